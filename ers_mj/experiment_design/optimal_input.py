"""The input that pins wanted parameters best: optimal design by the Fisher information of the event-exact model.

model, limits of a rig -> inputs (excitation.py) -> information of each (question.py) -> the best, refined
-> mixtures of several -> the most promising, refitted
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ers_mj.data.excitation import ASKING, GENTLE, SHARES, Limits, excitations, signal
from ers_mj.errors import InputError
from ers_mj.experiment_design.question import Plan, Question, inverse
from ers_mj.plants.inputs import DURATION, INPUTS

UNSEEN = 1.0  # standard deviation of a logarithm from which a number does not show


@dataclass(frozen=True)
class Effort:
    """How far the search goes."""

    refined: int = 5  # inputs that are refined
    rounds: int = 6
    least_gain: float = 0.01  # share of a spread that a round must gain
    parts: int = 3  # inputs in a mixture at most
    shortest_part: float = 1.0  # [s] of each at least
    checked: int = 5  # plans that are refitted
    refits: int = 10  # how often each


EFFORT = Effort()
REFINED = ("amplitude", "sines", "period_s", "hold_s", "push_s", "rest_s")  # numbers beside frequencies
FACTORS: Mapping[str, tuple[float, ...]] = {
    "amplitude": (0.85, 1.15),
    "sines": (0.6, 1.6),
}  # of a number, in one step of the refinement
FACTOR = (1 / 1.35, 1.35)  # of a frequency or a time


def reference(question: Question, name: str = "multisine") -> Plan:
    """What the named input promises and refits find, cut off at the rig's voltage; it may leave the travel."""
    limits = question.rig.limits
    part = _named_at(name, min(_peak(name), limits.high_u), limits)
    u = np.clip(INPUTS[name](question.rig.t), limits.low_u, limits.high_u)
    plan = question.plan(u, [part], within=False)
    assert plan is not None  # as it need not stay within the travel
    return question.checked(plan, EFFORT.refits)


def planned(
    question: Question, before: Plan, progress: Callable[[str, float], None] = lambda text, share: None
) -> Plan:
    """The best input that is found within the rig's limits, against a plan that refits have checked.

    Information is a promise to first order: the best few are refitted, and the worse of promise and refits decides.

    Raises:
        InputError: every input that was tried leaves the travel.
    """
    question = question.compared(before)
    order = _distinct(_tried(question, progress))
    _refuse_unseen(order[0].spread)
    refined = []
    for k, start in enumerate(order[: EFFORT.refined]):
        progress("refining the best", 0.4 + 0.3 * k / len(order[: EFFORT.refined]))
        refined.append(_refined(question, start))
    found = _distinct([*refined, *order])
    kinds = {p.parts[0]["kind"]: p for p in reversed(found)}
    promising = [
        *sorted(_mixtures(question, found), key=lambda p: p.cost)[:1],
        *sorted(kinds.values(), key=lambda p: p.cost),
    ][: EFFORT.checked]
    checked = []
    for k, plan in enumerate(promising):
        progress("refitting under the best", 0.7 + 0.3 * k / EFFORT.checked)
        checked.append(question.checked(plan, EFFORT.refits))
    is_allowed = question.plan(before.u) is not None
    return min([*checked, *([before] if is_allowed else [])], key=lambda p: _worse(p, before))


def _tried(question: Question, progress: Callable[[str, float], None]) -> list[Plan]:
    """What each input promises that stays in the travel, at gentle shares of the voltage where none does."""
    limits, tried = question.rig.limits, []
    for shares in (SHARES, GENTLE):
        rows = [*excitations(limits, shares), *_named(limits, shares)]
        for k, row in enumerate(rows):
            progress("trying inputs", 0.4 * k / len(rows))
            tried += [found for e in row if (found := question.plan(built(e), [e])) is not None]
        if tried:
            return tried
    raise InputError(
        f"every input that was tried leaves the travel of {math.degrees(limits.low):.4g} .."
        f" {math.degrees(limits.high):.4g} deg: more travel or less voltage was expected"
    )


def _refuse_unseen(spread: Mapping[str, float]) -> None:
    """Raise InputError where even the best input shows nothing of what is wanted."""
    if all(x > UNSEEN for name, x in spread.items() if name != "theta_0" or len(spread) == 1):
        raise InputError(
            "no input within these limits moves the servo so that anything of what is wanted shows: more voltage or"
            " travel was expected"
        )


def _worse(plan: Plan, before: Plan) -> float:
    """Mean logarithm of the wanted numbers' spreads over those of another plan, the worse of what was promised and
    found.
    """
    return float(
        np.mean(
            [
                max(math.log(plan.spread[n] / before.spread[n]), math.log(plan.found[n] / before.found[n]))
                for n in plan.spread
            ]
        )
    )


def built(excitation: Mapping) -> np.ndarray:
    """The input (N,) of an excitation (see excitation.py), or of a named input under an amplitude of its own."""
    if excitation["kind"] != "named":
        return signal(excitation)[1]
    t = np.arange(round(excitation["duration_s"] * excitation["rate_hz"])) / excitation["rate_hz"]
    return np.clip(
        INPUTS[excitation["name"]](t) * excitation["amplitude"] / _peak(excitation["name"]),
        -excitation["amplitude"],
        excitation["amplitude"],
    )


def _peak(name: str) -> float:
    return float(np.max(np.abs(INPUTS[name](np.arange(0.0, DURATION, 1e-3)))))


def _named(limits: Limits, shares: Sequence[float]) -> list[list[dict]]:
    """The package's named inputs at their own amplitude and at every share of the rig's."""
    half = 0.5 * (limits.high_u - limits.low_u)
    return [
        [_named_at(name, x, limits) for x in sorted({min(_peak(name), half), *(share * half for share in shares)})]
        for name in INPUTS
    ]


def _named_at(name: str, amplitude: float, limits: Limits) -> dict:
    """A named input as an excitation."""
    return {
        "kind": "named",
        "name": name,
        "amplitude": amplitude,
        "offset": 0.0,
        "peak_u": amplitude,
        "duration_s": limits.duration,
        "lead_s": 0.0,
        "rate_hz": limits.rate_hz,
        "start": limits.start,
    }


def _refined(question: Question, plan: Plan) -> Plan:
    """The plan with its numbers changed one at a time, as long as that pays."""
    for _ in range(EFFORT.rounds):
        found = [
            p
            for e in _neighbours(plan.parts[0], question.rig.limits)
            if (p := question.plan(built(e), [e])) is not None
        ]
        better = min(found, key=lambda p: p.cost, default=plan)
        if better.cost > plan.cost - EFFORT.least_gain:
            break
        plan = better
    return plan


def _neighbours(excitation: Mapping, limits: Limits) -> Iterator[dict]:
    """The excitation with one of its numbers a step up or down."""
    for key in [k for k in excitation if k in REFINED or (k.endswith("_hz") and k != "rate_hz")]:
        for factor in FACTORS.get(key, FACTOR):
            new = _within(key, float(f"{excitation[key] * factor:.3g}"), limits)
            changed = {**excitation, key: new}
            if new != excitation[key] and changed.get("from_hz", 0.0) < changed.get("to_hz", math.inf):
                yield {**changed, "peak_u": abs(changed["offset"]) + changed["amplitude"]}


def _within(key: str, new: float, limits: Limits) -> float:
    """A number of an excitation within what the rig bears."""
    if key == "amplitude":
        return min(new, 0.5 * (limits.high_u - limits.low_u))
    if key == "sines":
        return max(round(new), 2)
    if key.endswith("_hz"):
        return min(max(new, 1.0 / limits.duration), ASKING.top * limits.rate_hz)
    return min(max(new, 4.0 / limits.rate_hz), limits.duration)


def _mixtures(question: Question, plans: Sequence[Plan]) -> list[Plan]:
    """Several inputs one after the other, in the shares of time that the multiplicative algorithm of optimal design
    gives them.
    """
    chosen = _distinct(plans)[: 4 * EFFORT.parts]
    information = [blocks.sum(axis=0) for p in chosen if (blocks := question.information(p.u)) is not None]
    weight, g = np.full(len(chosen), 1.0 / len(chosen)), question.gradients
    for _ in range(300):
        lead = g @ inverse(np.tensordot(weight, information, 1))
        inner = np.linalg.inv(lead @ g.T) if question.criterion == "D" else np.eye(len(g))
        slope = np.array([np.trace(inner @ lead @ f @ lead.T) for f in information])
        weight = weight * np.sqrt(slope / (weight @ slope))
        weight = weight / weight.sum()
    out, duration = [], question.rig.limits.duration
    for count in range(2, EFFORT.parts + 1):
        best = np.argsort(-weight)[:count]
        seconds = np.round(duration * weight[best] / weight[best].sum(), 1)
        seconds[0] += duration - seconds.sum()
        if len(chosen) < count or seconds.min() < EFFORT.shortest_part:
            continue
        parts = [{**chosen[k].parts[0], "duration_s": float(s)} for k, s in zip(best, seconds)]
        u = np.concatenate([built(e) for e in parts])
        if u.size == question.rig.t.size and (plan := question.plan(u, parts)) is not None:
            out.append(plan)
    return out


def _distinct(plans: Sequence[Plan]) -> list[Plan]:
    """By their cost, of those that differ in amplitude only the best."""
    kinds: dict[tuple, Plan] = {}
    for p in sorted(plans, key=lambda p: p.cost):
        kinds.setdefault(tuple(v for k, v in p.parts[0].items() if k not in ("amplitude", "peak_u")), p)
    return list(kinds.values())
