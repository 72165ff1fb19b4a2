"""What to record next: the input, or the further channel, that would settle what the recordings at hand leave open.

Where explanations are left, the input under which they differ most after a refit (discriminating_inputs.py); where none
is, the one that narrows the intervals of what was named. Everything is simulated within the limits that the recordings
show.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ers_mj.data.excitation import GENTLE, SHARES, Limits, excitations
from ers_mj.data.prepared import Blocks, Trace
from ers_mj.effects import BY_NAME
from ers_mj.estimation.jacobian import step_of
from ers_mj.estimation.objective import Fit, tau_of
from ers_mj.experiment_design.bench import VAGUE, Bench, Explanation, is_lasting
from ers_mj.experiment_design.discriminating_inputs import (
    CHANNELS,
    SEARCH,
    SETTLED,
    Check,
    Design,
    Pair,
    chances,
    channels,
    checked,
    designed,
)
from ers_mj.experiment_design.refits import solved
from ers_mj.experiment_design.wording import asked, listed, plain, said, widened
from ers_mj.servo.model import Model

LOOSE = ("emf_share", "tau_e")  # numbers of the baseline that a datasheet knows better than any recording of the output


@dataclass(frozen=True)
class Advising:
    """When another recording is worth asking for."""

    rivals: int = 2  # explanations beside the leader that an input is designed against, the most probable first
    patience: int = 10  # recordings of one kind that nobody wants to make more than
    nested: float = 0.5  # share of what is left one way, below which the other way shows that one contains the other
    noisy: float = 4.0  # median misfit from which what the answer leaves is no longer the noise
    wider: float = 1.0  # of the travel seen, that is asked for at either end where the travel seen does not do
    worth: float = 0.95  # of today's interval: one that stays wider is not worth a recording of its own
    seen: float = 0.5  # share of VAGUE below which a number counts as seen: what no recording shows may not be there
    # step of the differences at most, which are as wide as a number is unknown: stick and slip that fork make no slope
    widest: float = 0.1
    forked: float = 1.0  # of C that a model may leave of its own recording, on noise


ADVISING = Advising()


def next_recording(
    leader: tuple[str, Fit],
    rivals: Sequence[tuple[str, Fit, float]],
    traces: Sequence[Trace],
    input_unit: str,
    output_unit: str,
) -> dict:
    """{"sentence", "excitation", "separates", "expected_sigmas", "channel", "checked"}: what would settle most.

    ``expected_sigmas`` belongs to the rival that differs least: sqrt(2 C) of what remains after its refit.

    Args:
        leader: name and fit of the answer (of the baseline, where nothing is named).
        rivals: name, fit and probability of what the recordings do not exclude, on the same recordings.
        traces: the recordings at hand.
        input_unit, output_unit: of u and of the output.
    """
    values, level = leader[1].model.values, max(float(np.median(leader[1].misfit)), 1.0)
    bench = Bench(
        Limits.of(traces, values["a_1"] > 0 or values["c_1"] > 0),
        float(np.median([t.sigma for t in traces])),
        level,
        tau_of(leader[1].misfit),
    )
    first, units = Explanation.of(*leader), {"input_unit": input_unit, "output_unit": output_unit}
    others = sorted((r for r in rivals if not _once(r[1].model)), key=lambda r: -r[2])[: ADVISING.rivals]
    if not others or _once(leader[1].model):
        return _to_know_better(first, bench, units)
    return _to_separate(first, [Explanation.of(name, found) for name, found, _ in others], bench, units)


def _once(model: Model) -> bool:
    """Whether the model tells of what happened once and will not again."""
    return any(BY_NAME[name].once for name in model.names)


# -- where explanations are left -------------------------------------------------------------------------------------


def _to_separate(leader: Explanation, others: Sequence[Explanation], bench: Bench, units: Mapping[str, str]) -> dict:
    pairs = [Pair.of(leader, other) for other in others]
    best = designed(pairs, bench)
    if best is None:
        names = [plain(e.name) for e in (leader, *others)]
        sentence = f"No input was found that keeps the rig within its travel and could tell {listed(names)} apart."
        return _nothing(sentence, {"simulations": bench.simulations})
    told = {o.name: _told(pair, check, best.excitation, bench) for o, pair, check in zip(others, pairs, best.checks)}
    separated = [name for name, c in told.items() if c["recordings_needed"]]
    hopeless = {o.name: pair for o, pair in zip(others, pairs) if o.name not in separated}
    channel = _best_channel(told)
    chosen = {**best.excitation, **units}
    left = "the noise" if bench.level < ADVISING.noisy else "what the answer itself leaves"
    words, wide = said(leader.name, told, channel, chosen, best.tried, left), {}
    if channel is None:
        wide = _all_with_wider_travel(hopeless, told, bench)
        words += widened(leader.name, [*hopeless], wide, _wider(bench.limits), units)
    return {
        "sentence": " ".join(words),
        "excitation": chosen if separated or channel else {},
        "separates": [leader.name, *separated] if separated else [],
        "expected_sigmas": math.sqrt(2 * max(best.cost, 0.0)),
        "channel": channel,
        "with_wider_travel": {name: {**found.excitation, **units} for name, found in wide.items()},
        "checked": {"against": told, "under": chosen, "tried": best.tried, "simulations": bench.simulations},
    }


def _nothing(sentence: str, tried: dict) -> dict:
    """An answer that asks for no input."""
    return {
        "sentence": sentence,
        "excitation": {},
        "separates": [],
        "expected_sigmas": 0.0,
        "channel": None,
        "checked": tried,
    }


def _told(pair: Pair, there: Check, excitation: dict, bench: Bench) -> dict:
    """What is told of one rival: both ways, and with further channels.

    Where the richer of the two passes for the plainer one (``nested``), what is left the other way is what its further
    numbers, as they were fitted, would show. Unless one recording settles that, they are taken for chance.
    """
    back = checked(Pair(pair.answer, pair.rig), excitation, bench)
    nested = back is not None and pair.rig.z.size > pair.answer.z.size and back.cost < ADVISING.nested * there.cost
    slopes = bench.slopes(pair.answer, there.z, there.e, there.clean)
    costs = chances(pair, there, slopes, bench)
    low, middle, high = (float(c) for c in np.quantile(costs, (0.1, 0.5, 0.9)))
    needed = math.ceil(SETTLED / max(min(there.cost, middle), 1e-9))
    return {
        "played_by": pair.rig.name,
        "cost": there.cost,
        "sigmas": there.sigmas,
        "rms_sigma": there.rms,
        "rms_over_left": there.rms / math.sqrt(bench.level),
        "probability_of_wrong": 1.0 / (1.0 + math.exp(min(max(there.cost, 0.0), 700.0))),
        "cost_range": [low, high],
        "cost_of_forks": there.forked,
        "chance_of_settling": float(np.mean(costs > SETTLED)),
        "cost_on_noise": there.noisy,
        "cost_the_other_way": back.cost if back else None,
        "nested": nested,
        "recordings_needed": needed if needed <= (1 if nested else ADVISING.patience) else None,
        "channels_sigmas": channels(pair, there, slopes, bench) if there.cost < SETTLED else {},
    }


def _best_channel(told: Mapping[str, Mapping]) -> str | None:
    """The channel that leaves most between the rivals that the angle alone does not tell apart; None where none does or
    none is needed.
    """
    weak = [c for c in told.values() if c["cost"] < SETTLED]
    if not weak:
        return None
    worst = {name: min(c["channels_sigmas"][name] for c in weak) for name in CHANNELS}
    best = max(worst, key=lambda name: worst[name])
    return best if 0.5 * worst[best] ** 2 > max(SETTLED, 2 * min(c["cost"] for c in weak)) else None


def _wider(limits: Limits) -> Limits:
    """The limits with more travel at either end."""
    more = ADVISING.wider * (limits.high - limits.low)
    return replace(limits, low=limits.low - more, high=limits.high + more)


def _all_with_wider_travel(pairs: Mapping[str, Pair], told: Mapping[str, Mapping], bench: Bench) -> dict[str, Design]:
    """The inputs that would settle what they can if the rig bore more travel than the recordings show."""
    found = {name: _with_wider_travel(pair, bench) for name, pair in pairs.items() if not told[name]["nested"]}
    return {name: design for name, design in found.items() if design is not None}


def _with_wider_travel(pair: Pair, bench: Bench) -> Design | None:
    wide = Bench(_wider(bench.limits), bench.sigma, bench.level, bench.tau)
    best = designed([pair], wide)
    bench.simulations += wide.simulations
    return best if best is not None and best.cost >= SETTLED else None


# -- where nothing is left to tell apart -----------------------------------------------------------------------------


@dataclass(frozen=True, eq=False)
class Wish:
    """Which numbers of an explanation are to be known better: their places, how surely they are known (standard
    deviations), and the steps (k,) over which slopes are taken.
    """

    places: Sequence[int]
    before: np.ndarray
    by: np.ndarray

    @staticmethod
    def of(leader: Explanation) -> Wish:
        """Those of the named effects, or the baseline's where there are none, as far as the recordings show them."""
        own = [i for i, f in enumerate(leader.layout) if is_lasting(f) and f.name not in LOOSE]
        own = [i for i in own if leader.layout[i].owner != "base"] or own
        before, most = _spreads(leader.known + _vague(leader), own), ADVISING.seen * VAGUE
        places, before = [i for i, x in zip(own, before) if x < most], before[before < most]
        least = step_of(leader.model)
        by = np.full(leader.z.size, least)
        by[places] = np.clip(before, least, max(ADVISING.widest, least))
        return Wish(places, before, by)


def _vague(leader: Explanation) -> np.ndarray:
    return np.eye(leader.z.size) / VAGUE**2


def _to_know_better(leader: Explanation, bench: Bench, units: Mapping[str, str]) -> dict:
    """The input that narrows the intervals of the named effects most, or the baseline's where there are none."""
    wish = Wish.of(leader)
    best, tried = _narrowest(leader, wish, bench)
    if best is None:
        return _nothing(
            "Nothing else that was tried explains these recordings, and no input was found that keeps the rig within"
            " its travel and would tell more.",
            {"tried": tried, "simulations": bench.simulations},
        )
    ratios = {leader.layout[i].name: float(a / b) for i, a, b in zip(wish.places, best[1], wish.before)}
    weakest = leader.layout[wish.places[int(np.argmin(best[1] / wish.before))]]
    told = {"interval_ratio": ratios, "tried": tried, "simulations": bench.simulations}
    if ratios[weakest.name] > ADVISING.worth:
        return _nothing(
            f"Nothing else that was tried explains these recordings, and none of {tried} inputs within their"
            " limits would narrow an interval by much: another recording of the same kind would confirm this one.",
            told,
        )
    chosen = {**best[0], **units}
    whose = f"{weakest.name} of the {plain(weakest.owner)}" if weakest.owner != "base" else weakest.name
    sentence = (
        f"Nothing else that was tried explains these recordings. {asked(chosen)} It would narrow the"
        f" interval of {whose} to {ratios[weakest.name]:.0%} of today's."
    )
    return {**_nothing(sentence, told), "excitation": chosen}


def _narrowest(leader: Explanation, wish: Wish, bench: Bench) -> tuple[tuple[dict, np.ndarray] | None, int]:
    """(the best input, standard deviations behind it), None where none stays in the travel; how many were tried."""
    best, tried = None, 0
    for shares in (SHARES, GENTLE):
        for shape in excitations(bench.limits, shares):
            for excitation in shape:
                tried += 1
                trace = bench.filled(leader.model, bench.trace(excitation, excitation["duration_s"], SEARCH.rank_hz))
                if trace is None or bench.forked(leader.model, trace) > ADVISING.forked:
                    continue
                after = _after(leader, wish, trace, bench)
                if wish.places and (best is None or np.sum(np.log(after)) < np.sum(np.log(best[1]))):
                    best = excitation, after
                break
        if best:
            break
    return best, tried


def _after(leader: Explanation, wish: Wish, trace: Trace, bench: Bench) -> np.ndarray:
    """How surely the wanted numbers are known behind a recording."""
    e, blocks = bench.misses(leader.model, trace), Blocks.of([trace])
    slopes = bench.slopes(leader, leader.z, e, trace, wish.by)
    weight = (2.0 / (bench.floor * blocks.counts))[blocks.index]
    return _spreads(leader.known + _vague(leader) + (slopes * weight[:, None]).T @ slopes, wish.places)


def _spreads(curvature: np.ndarray, wanted: Sequence[int]) -> np.ndarray:
    """Standard deviations of the wanted numbers where all of them are fitted."""
    return np.sqrt(
        np.maximum([solved(curvature, row)[i] for i, row in zip(wanted, np.eye(curvature.shape[0])[wanted])], 1e-300)
    )
