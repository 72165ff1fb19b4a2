"""A round of the selection: every promising effect is refitted with the whole baseline, and the likeliest leads.

A candidate's worth is the decrease of the block cost C (identification.py) after every baseline parameter has been refitted with it (ranking.py).
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

import numpy as np

from ers_mj.effects import BY_NAME, EQUIVALENT
from ers_mj.identification import Fit, converged, fit, near_noise, residuals_in, score
from ers_mj.isolability import PARAMETER_PRICE
from ers_mj.model import OBSERVER_RATE, STATES, Model
from ers_mj.plants.reduced import EFFORT
from ers_mj.ranking import (CLOCKED, FORKED, NEAR_TIE, QUIET, RIVAL, TIE, Candidate, bends_and_twists, is_clocked, is_dear, is_quiet, judged, likeliest_first, priced,
                            rivals_of, shows)
from ers_mj.screening import PEAK, Begin, attainable, screen
from ers_mj.traces import Blocks, Trace

LEAST_GAIN = 3.0  # decrease of C that an effect must buy: one servo in forty without missing physics offers as much (evaluation.NULL_GAIN)
BENT = 0.5  # C per block from which a model has been bent by what is missing, even if half the blocks are explained
RENEWALS = 2  # Jacobians of their own with which the refits go on each lap, and one where they are finite differences beside an effect
LAPS, LATER_LAPS = 8, 3  # the most laps, in the first round and beside an effect
PACE, PACE_SHARE = 0.1, 0.03  # of the gain that matters and of the best gain so far, which a refit must win in a lap to run another
FINISHED = 3  # of those, how many at most are fitted to the end: those with half the best one's gain
SEEN = 0.03  # share of the leader's gain that an overlooked law must show in its first steps to be refitted, and of its promise beside what takes long to simulate
AGAIN = 0.1  # share of the best first refit's gain from which an effect is refitted from its other starts as well; what cannot be scaled is in any case
FAILED = 0.05  # share of the best first refit's gain below which a promise was none
FOREMOST = 2  # effects of the largest promise: refitted from their other starts whatever the first refit's gain, on Jacobians of their own if bent (beside
# an effect that is not dear all that promise and are not: there a borrowed Jacobian has been bent by two)
TAUT = 10.0  # times the observer's rate, at which C has few dents: a refit that begins so finds valleys that others miss
LET_GO = 10  # of these refits, how many go on at the observer's own rate (on 72 rounds of tuning seeds each that mattered was among the first eight)
FEW_STARTS = 4  # of an effect's own, up to which it is refitted from them as they are
EXPLAINED = 0.25  # share of C that a leader which explains everything leaves at most
NEAR_LEAST = 0.5  # share of the gain that matters below which the best first refit is not carried on
HALF_STEP = 0.5  # of a coarse converter's, by which an effect moves the reading at least
STEP_GAIN = 30.0  # of C, from which it is told even if that is less: many thresholds together tell what is much smaller than a step
QUICK = 8  # steps of a first refit, on a borrowed Jacobian
ANEW, ANEW_FROM = 8, 0.2  # starts from which a wave is fitted again that leaves so much C per block


def candidates(base: Fit, traces: Sequence[Trace], tau: float, jobs: int, exclude: Sequence[str],
               anchors: Sequence[Mapping[str, float]] = (), least: float = 0.0, last: float = math.inf) -> list[Candidate]:
    """The promising effects, and what may differ between recordings, each refitted with the whole baseline, best first.

    They race: each is fitted on as long as it wins something, since the valley of a true effect may be long and narrow and a
    mimic's short; from each place on its own where the baseline is bent far from the noise. Where none comes near the ``least`` gain that
    matters they are left at that, and where no explanation could buy LEAST_GAIN none is looked for. Once the EFFORT reaches ``last`` all but the best are left
    at their first refits, or where the last stage brought them: beside a bristle that stays wrong a race may take minutes.
    """
    if attainable(base.misfit, Blocks.of(traces).counts, tau) < min(LEAST_GAIN, least) and score(base.misfit, tau).max() < math.log(PEAK):
        return []
    reference = float(score(base.misfit, tau).sum())

    def total(found):
        return float(score(found.misfit, tau).sum())

    def priced(found):
        return total(found) + PARAMETER_PRICE * found.size

    def quick(begin):
        return fit(begin.model, traces, tau=tau, steps=QUICK, ceiling=base.misfit, known=begin.known, renewals=0)

    def refitted(starts):
        """The best fit by label from pairs (label, Begin), those with the most parameters begun first since they take longest."""
        order = sorted(starts, key=lambda start: -len(start[1].model.layout()))
        ends = list(zip((label for label, _ in order), pool.map(quick, (begin for _, begin in order))))
        return {label: min((found for other, found in ends if other == label), key=total) for label, _ in starts}

    def leaders(ends):
        """The best fit by name of those by (name, place)."""
        return {name: min((found for (other, _), found in ends.items() if other == name), key=total) for name, _ in ends}

    def glanced(item):
        return item[0], fit(item[1].model, traces, tau=tau, steps=3, renewals=1)

    def onward(item):
        renewals = RENEWALS if item[1].model.has_tangents or not base.model.names else 1
        return item[0], fit(item[1].model, traces, tau=tau, steps=6, ceiling=base.misfit, renewals=renewals)

    def descended(item):
        return item[0], fit(item[1].model, traces, tau=tau, steps=20, ceiling=base.misfit, renewals=20)

    def finish(item):
        return item[0], fit(item[1].model, traces, tau=tau, steps=20, ceiling=base.misfit)

    def held_taut(item):
        """A fit under an observer that holds the motion to the reading, which hardly lets it stick where the rudder slipped: C has few dents then."""
        return item[0], fit(item[1].model, traces, rate=TAUT * OBSERVER_RATE, tau=tau, steps=QUICK, renewals=2)

    def let_go(item):
        return item[0], fit(item[1].model, traces, tau=tau, steps=6, ceiling=base.misfit, renewals=1)

    def spent():
        return EFFORT.spent >= last  # asked between stages only, so that the answer does not hang on the number of jobs

    def told(found):
        """Those that the recordings can show, the likeliest first."""
        return likeliest_first(sorted((c for c in found if shows(c) and not _is_within_a_step(c, traces)), key=lambda c: -c.worth))

    def leaves_much(found):
        """Whether a fit leaves a good part, and more than forks of stick and slip do, or wins what matters."""
        left = total(found)
        return left > EXPLAINED * reference and (left > FORKED or reference - left >= NEAR_LEAST * max(least, LEAST_GAIN))

    def contending(labels, ends):
        """Those labels that may still be the explanation: all while none explains everything, then those with RIVAL of the best one's gain."""
        least = reference - min(map(total, ends.values()), default=reference)
        return [label for label in labels if reference - least > QUIET * base.misfit.size or reference - total(ends[label]) >= RIVAL * least]

    def overlooked(best):
        """The cheap laws, with models to refit, that explain less than CLOCKED of what leads with a clock of its own, or are one with a law that leads and were not refitted: on a
        borrowed Jacobian, or seen by its secant, what has a threshold (a stop, a limit) does nothing until that is passed. Beside what takes long to simulate, those alone
        that were screened, and promise SEEN of what leads.
        """
        leader = min(best, key=lambda name: total(best[name]), default=None)
        if leader is None or reference - total(best[leader]) < max(least, LEAST_GAIN):
            return []
        laws = [effect for effect in BY_NAME.values() if not (is_clocked(effect.name) or effect.dear or effect.name in exclude)
                and (effect.name not in best or is_clocked(leader) and reference - total(best[effect.name]) < CLOCKED * (reference - total(best[leader])))
                and (is_clocked(leader) or any({leader, effect.name} <= group for group in EQUIVALENT))]
        own = {effect.name: [Begin(base.model.with_effect(effect.name, start), {}) for start in effect.starts(base.model.scales)]
               for effect in laws if not (effect.sized or base.model.plant().coupled)}
        if base.model.plant().coupled and is_clocked(leader):
            own = {effect.name: screened.begins[effect.name][0][:1] for effect in laws if effect.name in screened.begins
                   and screened.promises.get(effect.name, 0.0) >= SEEN * screened.promises.get(leader, math.inf)}
        twists = base.model.plant().has_motor_side  # a play or a shaft, which takes longest, is no knock
        return [(name, begin) for name in (effect.name for effect in laws) for begin in starts.get((name, 0), own.get(name, []))
                if begin.model.plant().has_motor_side == twists]

    states = [((s, 0), [Begin(base.model.with_state(s, len(traces)), {})]) for s in STATES if len(traces) > 1 and s not in (base.model.states or {})]
    places = [base.model, *(replace(base.model, values={**base.model.values, **values}) for values in anchors)]
    with ThreadPoolExecutor(jobs) as pool:
        quiet, bent = is_quiet(base, tau), not near_noise(base) or reference > BENT * base.misfit.size
        screened = screen(places, traces, tau, exclude, bent, quiet, least=min(LEAST_GAIN, least))
        if quiet and not screened.promising():
            return []
        starts = dict(states)
        first = refitted([(label, begins[0]) for label, begins in starts.items()])
        failed: set[str] = set()
        while new := [name for name in screened.promising(failed) if (name, 0) not in starts]:
            added = {(name, place): begins for name in new for place, begins in enumerate(screened.begins[name])}
            starts |= added
            first |= refitted([(label, begins[0]) for label, begins in added.items()])
            most = max((reference - total(f) for f in first.values()), default=0.0)
            failed = {name for name, found in leaders(first).items() if reference - total(found) <= FAILED * max(most, 0.0)}
        most = max((reference - total(f) for f in first.values()), default=0.0)
        foremost = [name for name in screened.promising(failed) if name not in failed][:FOREMOST]
        own = {*foremost, *(name for name in screened.promising() if base.model.names and not is_dear(base) and not BY_NAME[name].dear)}  # where bent
        best, ahead = dict(first), [label for label in starts if label[1] == 0 and label[0] in own] if bent and not spent() else []
        early = [(label, begin) for label in ahead for begin in starts[label]]
        ended = list(pool.map(descended, early))
        for label, found in ended:
            best[label] = min(best[label], found, key=total)
        worth = {name for name, found in leaders(best).items() if bent or reference - total(found) >= AGAIN * most}
        worth = {*contending(worth, leaders(best)), *foremost, *(name for name in screened.promising(failed) if not BY_NAME[name].sized)}
        more = starts.items() if not spent() else ()
        again = refitted([(label, begin) for label, begins in more if label[0] in worth and label not in ahead for begin in begins[1:]])
        best |= {label: min(best[label], found, key=total) for label, found in again.items()}
        if not bent:
            best = {(name, 0): found for name, found in leaders(best).items()}
        running = contending([label for label in best if label not in ahead], best)
        for _ in range(LATER_LAPS if base.model.names else LAPS):
            if spent():
                break
            leading = max(reference - min(map(total, best.values())), 0.0) if best else 0.0
            pace = max(PACE * least, PACE_SHARE * leading)
            ends = dict(pool.map(onward, ((label, best[label]) for label in running)))
            running = [label for label in running if total(best[label]) - total(ends[label]) > pace
                       and not (label[0] in BY_NAME and BY_NAME[label[0]].dear or bends_and_twists(ends[label]))]
            best |= {label: found for label, found in ends.items() if total(found) < total(best[label])}
            running = contending(running, best)
        best = leaders(best)
        leading = reference - min(map(total, best.values()), default=reference)
        glances = pool.map(glanced, overlooked(best) if not spent() else [])
        late = list(pool.map(onward, [(name, found) for name, found in glances if reference - total(found) >= SEEN * leading]))
        for name, found in pool.map(finish, [(name, found) for name, found in late if reference - total(found) >= AGAIN * leading]):
            best[name] = min(best.get(name, found), found, key=total)
        if best and leaves_much(min(best.values(), key=total)) and not (is_dear(base) or spent()):
            taut = pool.map(held_taut, _more_starts(base.model, [name for name in BY_NAME if name not in exclude], screened.promising(), starts))
            for name, found in pool.map(let_go, sorted(taut, key=lambda item: item[1].cost)[:LET_GO]):
                best[name] = min(best.get(name, found), found, key=total)
        rough = sorted(best.items(), key=lambda item: total(item[1]))
        gains = [reference - total(f) for _, f in rough]
        if not gains or gains[0] < NEAR_LEAST * least:
            return sorted((judged(*item, base, tau) for item in rough), key=lambda c: -c.worth)
        over = spent()
        close = sum(g >= 0.5 * gains[0] for g in gains[:FINISHED])
        finished = dict(pool.map(finish, [item for item in rough[:close] if not (over and bends_and_twists(item[1]))]))
        if over:
            return told(judged(*item, base, tau) for item in {**dict(rough), **finished}.items())
        explained = min(map(total, finished.values())) <= QUIET * base.misfit.size
        for name, found in pool.map(finish, [] if explained or bends_and_twists(base) else _anew(finished, traces, tau)):
            finished[name] = min(finished[name], found, key=total)
        others = _other_forms(finished, {name: begins for (name, place), begins in starts.items() if place == 0})
        others = [(name, begin) for name, begin in others if not any(begin is known for _, known in early)]
        known, wider = [(label[0], found) for label, found in ended if label[0] in finished], _wider(finished, exclude)
        for name, found in (*known, *pool.map(finish, others)):
            if priced(found) < priced(finished[name]):
                finished[name] = found
        for name, found in pool.map(finish, [*wider, *_other_waves(finished, exclude)]):
            kept = finished.get(name, best.get(name))
            if kept is None or priced(found) < priced(kept) - (max(TIE, NEAR_TIE * (reference - total(kept))) if BY_NAME[name].dear else 0.0):
                finished[name] = found
        ranked = sorted((judged(*item, base, tau) for item in {**dict(rough), **finished}.items()), key=lambda c: -c.worth)
        rivals = len(rivals_of(ranked))
        if rivals > 1:
            lead, second = ranked[0].fit, ranked[1].fit
            ranked[:rivals] = pool.map(lambda c: judged(c.name, converged(c.fit, second if c.fit is lead else lead, traces, tau), base, tau), ranked[:rivals])
    return told(ranked)


def _is_within_a_step(candidate: Candidate, traces: Sequence[Trace]) -> bool:
    """Whether a candidate moves the reading by less than a coarse converter's step, if it acts once, or by less than half a step: what is so small is
    no more than what a model's own error makes of the moments at which thresholds are passed, or of where within a step the rudder began, unless it gains STEP_GAIN.

    Of effects of the sensor itself confirmation judges (confirmation.py).
    """
    if candidate.gain >= STEP_GAIN or candidate.name not in BY_NAME or BY_NAME[candidate.name].subsystem == "sensor" or all(trace.converter is None for trace in traces):
        return False
    share = 1.0 if BY_NAME[candidate.name].once else HALF_STEP
    models = candidate.fit.model, candidate.fit.model.without_effect(candidate.name)
    moved = [(np.subtract(*(trace.plain(residuals_in(m, trace, k, OBSERVER_RATE)) for m in models)), trace) for k, trace in enumerate(traces)]
    return all(trace.converter is not None and float(np.max(np.abs(d[:trace.t.size]))) * trace.sigma < share * trace.converter.step
               for d, trace in moved if np.any(d))


def _anew(finished: Mapping[str, Fit], traces: Sequence[Trace], tau: float) -> list[tuple[str, Begin]]:
    """More starts of the finished waves along the travel that leave much, from where they have brought the baseline: which of many periods is the true one
    shows badly beside parameters that stand for all of it.
    """
    out = []
    for name, found in finished.items():
        if _waves_along(name) and found.cost > ANEW_FROM * found.misfit.size:
            others = [other for other in BY_NAME if other != name]
            places = screen([found.model.without_effect(name)], traces, tau, others, True, False, tries=ANEW).begins.get(name, [])
            out += [(name, begin) for begins in places for begin in begins]
    return out


def _more_starts(base: Model, names: Sequence[str], promising: Sequence[str], starts: Mapping[tuple[str, int], Sequence[Begin]]) -> list[tuple[str, Begin]]:
    """More starts of what is simulated fast and lasts: those of the screening of what is ``promising``, and of all that have few their own as large as they are, since a
    secant across forks of stick and slip may ask for a dent, or promise nothing of what acts.
    """
    out = []
    for effect in (BY_NAME[name] for name in names if not (BY_NAME[name].dear or BY_NAME[name].once)):
        own = effect.starts(base.scales)
        begins = [*(starts.get((effect.name, 0), ()) if effect.name in promising else ()), *(Begin(base.with_effect(effect.name, p), {}) for p in own if len(own) <= FEW_STARTS)]
        out += [(effect.name, begin) for begin in begins if begin.model.has_tangents]
    return out


def _other_forms(finished: Mapping[str, Fit], starts: Mapping[str, Sequence[Begin]]) -> list[tuple[str, Begin]]:
    """The best start of each other form (which of its numbers are absent) of the finished effects: after a few steps forms are no more alike than effects."""
    out = []
    for name in (n for n in finished if n in BY_NAME):
        known = [_form(finished[name].model, name)]
        for begin in starts.get(name, ()):
            if (form := _form(begin.model, name)) not in known:
                known.append(form)
                out.append((name, begin))
    return out


def _form(model: Model, name: str) -> tuple[bool, ...]:
    return tuple(np.isfinite(dict(model.effects)[name]).tolist())


def _wider(finished: Mapping[str, Fit], exclude: Sequence[str]) -> list[tuple[str, Begin]]:
    """Effects that have a finished one as their limit, with the models that begin there: what is wider is no worse, if its fit finds it.

    What is dear gives way to its own wider form only beyond a tie: that takes several times as long to simulate, and one dent may decide.
    """
    out = []
    for name, found in finished.items():
        if name in BY_NAME:
            without, p = found.model.without_effect(name), dict(found.model.effects)[name]
            out += [(effect.name, Begin(without.with_effect(effect.name, start), {})) for effect in BY_NAME.values()
                    if effect.name not in exclude for start in effect.grown(name, p, found.model.scales)]
    return out


def _other_waves(finished: Mapping[str, Fit], exclude: Sequence[str]) -> list[tuple[str, Begin]]:
    """The other laws that wave along the travel, with models that begin at the period of one that leads: what acts has a sharp one, which starts of a law's own miss.

    Those that are one with it (effects.EQUIVALENT) are left out: they are told apart by how long their periods are.
    """
    leader = min(finished, key=lambda name: priced(finished[name]))
    model = finished[leader].model
    if not _waves_along(leader) or model.plant().coupled:
        return []
    out, without = [], model.without_effect(leader)
    period = dict(model.effects)[leader][_column_of_period(leader)]
    kin = next((group for group in EQUIVALENT if leader in group), {leader})
    for effect in (e for e in BY_NAME.values() if _waves_along(e.name) and e.name not in (*exclude, *kin)):
        column = _column_of_period(effect.name)
        waves = [p for p in effect.starts(model.scales) if np.isfinite(p[column])]
        forms = {tuple(np.isfinite(p)): p for p in waves if period <= waves[0][column]}  # of which the first is the longest
        for p in forms.values():
            for phase in (0.0, 0.5 * math.pi):
                begun = p.copy()
                begun[column], begun[effect.wave[1]] = period, phase
                out.append((effect.name, Begin(without.with_effect(effect.name, begun), {})))
    return out


def _waves_along(name: str) -> bool:
    return name in BY_NAME and BY_NAME[name].wave is not None and not is_clocked(name)


def _column_of_period(name: str) -> int:
    return next(k for k, p in enumerate(BY_NAME[name].parameters) if p.name == "period")
