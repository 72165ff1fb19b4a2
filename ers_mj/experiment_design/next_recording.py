"""What to record next: the input, or the further channel, that would settle what the recordings at hand leave open.
 Where explanations are left, the input under which they differ most after a refit (discriminating_inputs.py); where
 none is, the one
that narrows the intervals of what was named. Everything is simulated within the limits that the recordings show.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace

import numpy as np

from ers_mj.data.excitation import GENTLE, SHARES, Limits, excitations
from ers_mj.data.prepared import Blocks, Trace
from ers_mj.effects import BY_NAME
from ers_mj.estimation.jacobian import step_of
from ers_mj.estimation.objective import Fit, tau_of
from ers_mj.experiment_design.discriminating_inputs import (
    CHANNELS,
    DESIGN_RATE,
    SETTLED,
    VAGUE,
    Bench,
    Check,
    Design,
    Explanation,
    Pair,
    chances,
    channels,
    checked,
    designed,
    solved,
)
from ers_mj.servo.model import STATES, Model

RIVALS = 2  # explanations beside the leader that an input is designed against, the most probable first
PATIENCE = 10  # recordings of one kind that nobody wants to make more than
# share of what is left one way, below which what is left the other way shows that one explanation contains the other
NESTED = 0.5
NOISY = 4.0  # median misfit from which what the answer leaves is no longer the noise
WIDER = 1.0  # of the travel seen, that is asked for at either end where the travel seen does not do
CALLED = {
    "i_A": "the current (i_A)",
    "theta_m_rad": "the motor's angle (theta_m_rad)",
    "vin_V": "the supply voltage (vin_V)",
}
WORTH = 0.95  # of today's interval: one that stays wider is not worth a recording of its own
SEEN = 0.5  # share of VAGUE below which a number counts as seen at all: what no recording shows may not be there
# step of the differences at most, which are as wide as a number is unknown: stick and slip that fork make no slope
WIDEST = 0.1
FORKED = 1.0  # of C that a model may leave of its own recording, on noise
LOOSE = ("emf_share", "tau_e")  # numbers of the baseline that a datasheet knows better than any recording of the output


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
    others = sorted((r for r in rivals if not _once(r[1].model)), key=lambda r: -r[2])[:RIVALS]
    if not others or _once(leader[1].model):
        return _to_know_better(first, bench, units)
    return _to_separate(first, [Explanation.of(name, found) for name, found, _ in others], bench, units)


def _once(model: Model) -> bool:
    """Whether the model tells of what happened once and will not again."""
    return any(BY_NAME[name].once for name in model.names)


# -- where explanations are left --------------------------------------------------------------------------------------


def _to_separate(leader: Explanation, others: Sequence[Explanation], bench: Bench, units: Mapping[str, str]) -> dict:
    pairs = [Pair.of(leader, other) for other in others]
    best = designed(pairs, bench)
    if best is None:
        names = [_plain(e.name) for e in (leader, *others)]
        return {
            "sentence": (
                f"No input was found that keeps the rig within its travel and could tell {_listed(names)} apart."
            ),
            "excitation": {},
            "separates": [],
            "expected_sigmas": 0.0,
            "channel": None,
            "checked": {"simulations": bench.simulations},
        }
    told = {o.name: _told(pair, check, best.excitation, bench) for o, pair, check in zip(others, pairs, best.checks)}
    separated = [name for name, c in told.items() if c["recordings_needed"]]
    hopeless = {o.name: pair for o, pair in zip(others, pairs) if o.name not in separated}
    channel = _best_channel(told)
    wide = (
        {
            name: found
            for name, pair in hopeless.items()
            if not told[name]["nested"] and (found := _with_wider_travel(pair, bench))
        }
        if channel is None
        else {}
    )
    chosen = {**best.excitation, **units}
    words = _said(
        leader.name,
        told,
        channel,
        chosen,
        best.tried,
        "the noise" if bench.level < NOISY else "what the answer itself leaves",
    )
    if channel is None:
        words += _widened(leader.name, [*hopeless], wide, bench.limits, units)
    return {
        "sentence": " ".join(words),
        "excitation": chosen if separated or channel else {},
        "separates": [leader.name, *separated] if separated else [],
        "expected_sigmas": math.sqrt(2 * max(best.cost, 0.0)),
        "channel": channel,
        "with_wider_travel": {name: {**found.excitation, **units} for name, found in wide.items()},
        "checked": {"against": told, "under": chosen, "tried": best.tried, "simulations": bench.simulations},
    }


def _told(pair: Pair, there: Check, excitation: dict, bench: Bench) -> dict:
    """What is told of one rival: both ways, and with further channels.

    Where the richer of the two passes for the plainer one (``nested``), what is left the other way is what its further
    numbers, as they were fitted, would show. Unless one recording settles that, they are taken for chance.
    """
    back = checked(Pair(pair.answer, pair.rig), excitation, bench)
    nested = back is not None and pair.rig.z.size > pair.answer.z.size and back.cost < NESTED * there.cost
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
        "recordings_needed": needed if needed <= (1 if nested else PATIENCE) else None,
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
    best = max(worst, key=worst.get)
    return best if 0.5 * worst[best] ** 2 > max(SETTLED, 2 * min(c["cost"] for c in weak)) else None


def _with_wider_travel(pair: Pair, bench: Bench) -> Design | None:
    """The input that would settle it if the rig bore more travel than the recordings show; None where none would."""
    limits, more = bench.limits, WIDER * (bench.limits.high - bench.limits.low)
    wide = Bench(replace(limits, low=limits.low - more, high=limits.high + more), bench.sigma, bench.level, bench.tau)
    best = designed([pair], wide)
    bench.simulations += wide.simulations
    return best if best is not None and best.cost >= SETTLED else None


# -- where nothing is left to tell apart ------------------------------------------------------------------------------


def _to_know_better(leader: Explanation, bench: Bench, units: Mapping[str, str]) -> dict:
    """The input that narrows the intervals of the named effects most, or the baseline's where there are none."""
    wanted = [i for i, f in enumerate(leader.layout) if not f.local and f.owner not in STATES and f.name not in LOOSE]
    wanted = [i for i in wanted if leader.layout[i].owner != "base"] or wanted
    vague = np.eye(leader.z.size) / VAGUE**2
    before = _spreads(leader.known + vague, wanted)
    wanted, before = [i for i, x in zip(wanted, before) if x < SEEN * VAGUE], before[before < SEEN * VAGUE]
    least = step_of(leader.model)
    by = np.full(leader.z.size, least)
    by[wanted] = np.clip(before, least, max(WIDEST, least))
    best, tried = None, 0
    for shares in (SHARES, GENTLE):
        for shape in excitations(bench.limits, shares):
            for excitation in shape:
                tried += 1
                trace = bench.filled(leader.model, bench.trace(excitation, excitation["duration_s"], DESIGN_RATE))
                if trace is None or bench.forked(leader.model, trace) > FORKED:
                    continue
                e, blocks = bench.misses(leader.model, trace), Blocks.of([trace])
                slopes = bench.slopes(leader, leader.z, e, trace, by)
                weight = (2.0 / (bench.floor * blocks.counts))[blocks.index]
                after = _spreads(leader.known + vague + (slopes * weight[:, None]).T @ slopes, wanted)
                if wanted and (best is None or np.sum(np.log(after)) < np.sum(np.log(best[1]))):
                    best = excitation, after
                break
        if best:
            break
    if best is None:
        return {
            "sentence": (
                "No other explanation is left, and no input was found that keeps the rig within its travel and would"
                " tell more."
            ),
            "excitation": {},
            "separates": [],
            "expected_sigmas": 0.0,
            "channel": None,
            "checked": {"tried": tried, "simulations": bench.simulations},
        }
    ratios = {leader.layout[i].name: float(a / b) for i, a, b in zip(wanted, best[1], before)}
    weakest = leader.layout[wanted[int(np.argmin(best[1] / before))]]
    chosen, checked = {**best[0], **units}, {"interval_ratio": ratios, "tried": tried, "simulations": bench.simulations}
    whose = f"{weakest.name} of the {_plain(weakest.owner)}" if weakest.owner != "base" else weakest.name
    sentence = (
        f"No other explanation is left to tell apart. {asked(chosen)} It would narrow the interval of {whose} to"
        f" {ratios[weakest.name]:.0%} of today's."
    )
    if ratios[weakest.name] > WORTH:
        sentence, chosen = (
            (
                f"No other explanation is left to tell apart, and none of {tried} inputs within the limits of these"
                " recordings would narrow an interval by much: another recording of the same kind would confirm this"
                " one."
            ),
            {},
        )
    return {
        "sentence": sentence,
        "excitation": chosen,
        "separates": [],
        "expected_sigmas": 0.0,
        "channel": None,
        "checked": checked,
    }


def _spreads(curvature: np.ndarray, wanted: Sequence[int]) -> np.ndarray:
    """Standard deviations of the wanted numbers where all of them are fitted."""
    return np.sqrt(
        np.maximum([solved(curvature, row)[i] for i, row in zip(wanted, np.eye(curvature.shape[0])[wanted])], 1e-300)
    )


# -- words ------------------------------------------------------------------------------------------------------------


def _said(
    leader: str, told: Mapping[str, Mapping], channel: str | None, excitation: Mapping, tried: int, unit: str
) -> list[str]:
    """What to record, what it would settle, and what it would not, in sentences."""
    hopeful = [n for n, c in told.items() if c["recordings_needed"]]
    never = [n for n in told if n not in hopeful]
    words = [asked(excitation)] if hopeful else []
    for n in hopeful:
        c = told[n]
        then = (
            f"one of them would keep less than 5 %, with a chance of {min(c['chance_of_settling'], 0.99):.0%}"
            if c["recordings_needed"] == 1
            else f"{c['recordings_needed']} such recordings would be needed to settle it"
        )
        words.append(
            f"After a refit {_plain(leader)} and {_plain(n)} still differ there by {c['rms_over_left']:.2g} times"
            f" {unit}, {c['sigmas']:.2g} sigmas: {then}."
        )
        if c["nested"]:
            rich, plain = (leader, n) if c["played_by"] == leader else (n, leader)
            words.append(f"Should it be {_plain(plain)}, though, {_plain(rich)} can still pass for it.")
    if never:
        left = max(told[n]["rms_over_left"] for n in never)
        words.append(
            f"No input within the limits of these recordings ({tried} simulated) tells"
            f" {_listed(map(_plain, (leader, *never)))} apart by the output alone: after a refit {left:.1g} times"
            f" {unit} is left."
        )
    if channel:
        sigmas = min(c["channels_sigmas"][channel] for c in told.values() if c["cost"] < SETTLED)
        words.append(
            f"Recording {CALLED[channel]} as well would, at {sigmas:.2g} sigmas."
            + ("" if hopeful else f" {asked(excitation)}")
        )
    elif most := [max(told[n]["channels_sigmas"].values()) for n in never if told[n]["channels_sigmas"]]:
        words.append(f"Nor would {_listed(CALLED.values(), 'or')}, {max(most):.1g} sigmas at most.")
    return words


def _widened(
    leader: str, hopeless: Sequence[str], wide: Mapping[str, Design], limits: Limits, units: Mapping[str, str]
) -> list[str]:
    """What more travel would do for whom, and what is left where nothing does."""
    more = WIDER * (limits.high - limits.low)
    low, high = (_in_degrees(x, units["output_unit"]) for x in (limits.low - more, limits.high + more))
    words = []
    for name, found in wide.items():
        wish = asked({**found.excitation, **units})
        words.append(
            f"If the rig bears a travel from {low} to {high}: {wish[0].lower()}{wish[1:-1]}, which would tell"
            f" {_plain(leader)} and {_plain(name)} apart at {math.sqrt(2 * found.cost):.2g} sigmas."
        )
    if stuck := [name for name in hopeless if name not in wide]:
        at_load = all(BY_NAME[name].subsystem == "load" for name in (leader, *stuck) if name in BY_NAME)
        words.append(
            f"Only a change of the rig can tell {_listed(map(_plain, (leader, *stuck)))} apart"
            + (", such as taking the load off or turning it over." if at_load else ".")
        )
    return words


def _in_degrees(x: float, unit: str) -> str:
    return f"{math.degrees(x):.3g} deg" if unit == "rad" else f"{x:.3g} {unit}"


def asked(excitation: Mapping) -> str:
    """The excitation as an order."""
    e, unit = excitation, excitation["input_unit"]
    about = f" about {e['offset']:.3g} {unit}" if e["offset"] else ""
    how = {
        "multisine": "a multisine from {from_hz:.3g} to {to_hz:.3g} Hz",
        "chirp": "a chirp from {from_hz:.3g} to {to_hz:.3g} Hz",
        "square": "a square of growing amplitude with a period of {period_s:.3g} s",
        "triangle": "slow triangles of growing amplitude with a period of {period_s:.3g} s",
        "steps": "steps held for {hold_s:.3g} s each",
        "push_and_release": "pushes of {push_s:.3g} s either way, growing, with {rest_s:.3g} s of rest between them",
    }[e["kind"]]
    return (
        f"Record {how.format(**e)}, up to {e['amplitude']:.3g} {unit}{about}, for {e['duration_s']:.3g} s at"
        f" {e['rate_hz']:.4g} Hz."
    )


def _plain(name: str) -> str:
    return name.replace("_", " ")


def _listed(names: Iterable[str], last: str = "and") -> str:
    names = list(names)
    return f" {last} ".join(filter(None, [", ".join(names[:-1]), names[-1]]))
