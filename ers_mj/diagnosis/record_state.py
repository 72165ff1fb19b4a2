"""What differs between recordings of one rig: its record state."""

from __future__ import annotations

from collections.abc import Sequence

from ers_mj.data.prepared import Trace
from ers_mj.decisions.explained import cost
from ers_mj.diagnosis.case import Case
from ers_mj.diagnosis.sentences import shown
from ers_mj.estimation.fit import fit
from ers_mj.selection.cross_validation import recalibrated
from ers_mj.servo.model import DRIFTS, LOADS, STATES, Model

ONE_LOAD = 1.05  # factor within which recordings are of one load
STEPS = 12  # of the answer's refit with what may differ between its recordings
Ends = tuple[float | None, float | None]  # of a 95 % interval


def record_state(case: Case, held: Sequence[Trace]) -> list[dict]:
    """What differs between recordings beyond chance: training ones as fitted, held-out ones as recalibrated."""
    later = [recalibrated(model, h).states for model, h in zip(case.confirmed.models, held)]
    fitted = with_drifts(case)
    errors = case.state_errors(fitted)
    found = ((name, *_values(case, fitted, name, errors, later)) for name in STATES)
    return [_told(case, name, values, ci95) for name, values, ci95 in found if _differs(case, name, values, ci95)]


def with_drifts(case: Case) -> Model:
    """The answer with what may drift from one training recording to the next beside what it has of it, refitted; the
    answer itself where that explains no more than chance would.

    What is told so changes no other number: the answer stays the one of all recordings.
    """
    model, traces, tau = case.model, case.start.traces, case.selection.tau
    known = model.states or {}
    feels_position = model.values["a_1"] > 0 or model.values["c_1"] > 0
    lacking = [name for name in DRIFTS if name not in known and (feels_position or name != "offset")]
    if len(traces) < 2 or not lacking or set(known) & set(LOADS):
        return model
    fixed = fit(model, traces, tau=tau, steps=STEPS)
    drifting = fixed.model
    for name in lacking:
        drifting = drifting.with_state(name, len(traces))
    found = fit(drifting, traces, tau=tau, steps=STEPS)
    bought, price = cost(fixed.misfit, tau) - cost(found.misfit, tau), 0.5 * (found.size - fixed.size)
    return found.model if bought - price >= case.policy.least_gain else model


def _rest(name: str) -> float:
    """The value of a state that differs from nothing."""
    return 0.0 if name == "offset" else 1.0


def _values(case: Case, model: Model, name: str, errors: dict, later: Sequence[dict]) -> tuple[list[float], list[Ends]]:
    """The values of a state in each recording, training ones first, and their intervals."""
    count, rest, unknown = len(case.start.traces), _rest(name), (None, None)
    fitted = (model.states or {}).get(name, [rest] * count)
    values = [*fitted, *(s.get(name, (rest,))[0] for s in later)]
    ci95 = [errors.get((name, k), unknown) for k in range(count)]
    ci95 += [tuple(s[name][1:]) if name in s else unknown for s in later]
    return values, ci95


def _differs(case: Case, name: str, values: Sequence[float], ci95: Sequence[Ends]) -> bool:
    """Whether a recording's state is off beyond its interval, and by enough to be worth a line."""
    rest, policy = _rest(name), case.policy
    travel = case.start.fit.model.scales.position
    least = policy.state_offset * travel if name == "offset" else policy.state_factor
    known = ((v, low, high) for v, (low, high) in zip(values, ci95) if low is not None and high is not None)
    return any(abs(v - rest) > least and not low <= rest <= high for v, low, high in known)


def _told(case: Case, name: str, values: Sequence[float], ci95: Sequence[Ends]) -> dict:
    unit = case.output_unit if name == "offset" else "-"
    return {
        "name": name,
        "unit": unit,
        "values": [float(v) for v in values],
        "ci95": [list(ends) for ends in ci95],
        "sentence": _by_groups(case, name, values) if name in LOADS else _from_to(name, values, unit),
    }


def _from_to(name: str, values: Sequence[float], unit: str) -> str:
    lowest, highest = shown(min(values), unit), shown(max(values), unit)
    return f"{name.replace('_', ' ')} differs between the recordings: from {lowest} to {highest}"


def _by_groups(case: Case, name: str, values: Sequence[float]) -> str:
    """Which recordings are of one load, and how they differ."""
    names = [recording.name for recording in (*case.recordings, *case.holdout)]
    groups: list[list[int]] = []
    for k in sorted(range(len(values)), key=lambda k: values[k]):
        if groups and values[k] <= values[groups[-1][0]] * ONE_LOAD:
            groups[-1].append(k)
        else:
            groups.append([k])
    told = "; ".join(
        f"{', '.join(names[k] for k in sorted(group))}: {shown(sum(values[k] for k in group) / len(group), '-')}"
        for group in groups
    )
    what = "inertia and gravity" if name == "load" else "gravity beyond the inertia's part"
    return f"the recordings are of different loads, {what} over the first one's: {told}"
