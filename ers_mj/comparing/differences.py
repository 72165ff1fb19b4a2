"""What differs between two diagnoses: parameters, what is named, what differs between recordings, errors.

A parameter differs where the intervals say so; all tests of one comparison stand under one chance (Holm). An effect
that one names and the other does not differs where its own evidence survives with them and the other excludes it.
An error has no interval: it is told and not judged.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Any

from ers_mj.comparing.chance import LEVEL, Estimate, between, beyond_chance, p_value
from ers_mj.comparing.documents import Told, refuse_unlike, reservations

ERRORS = {
    "heldout_rmse_before_rad": "held-out error without what is named",
    "heldout_rmse_after_rad": "held-out error with what is named",
    "noise_floor_rad": "noise floor",
}
Value = float | str | bool | None


@dataclass(frozen=True)
class Difference:
    """One line: what, its two values, 95 % interval of b - a, and the chance of it where nothing differs; None where
    chance cannot be judged. `against` says why a line is not called a difference whatever its chance.
    """

    kind: str  # parameter, effect, remainder, record_state or error
    what: str
    a: Value
    b: Value
    unit: str
    ci95: tuple[float, float] | None = None
    p: float | None = None
    against: str = ""
    significant: bool = False
    decided: bool = False  # by each diagnosis itself, where no chance is told
    ends: tuple[Any, Any] = (None, None)  # 95 % intervals of a and of b

    def to_dict(self) -> dict[str, Any]:
        """As an entry of `differences`."""
        return {
            "what": self.what,
            "kind": self.kind,
            "a": self.a,
            "b": self.b,
            "unit": self.unit,
            "ci95": list(self.ci95) if self.ci95 else None,
            "p_value": self.p,
            "significant": self.significant,
            "untold": self.against or None,
            "sentence": self._sentence(),
            "a_ci95": self.ends[0],
            "b_ci95": self.ends[1],
        }

    def _sentence(self) -> str:
        if self.kind in ("effect", "remainder"):
            yes, no = ("A", "B") if self.a else ("B", "A")
            judged = self.against or ("" if self.significant else "chance accounts for it")
            told = (
                f"{yes} names {self.what} and {no} does not"
                if self.kind == "effect"
                else f"{yes} leaves a mismatch that nothing named accounts for and {no} does not"
            )
            return told + (f": {judged}" if judged else "")
        unit = f" {self.unit}" if self.unit not in ("", "-") else ""
        apart = f"{self.what}: {_number(self.a)}{unit} in A, {_number(self.b)}{unit} in B"
        if self.p is None:
            return f"{apart}; {self.against}"
        if self.ci95 is None:
            return f"{apart}; {'beyond' if self.significant else 'within'} chance"
        low, high = map(_number, self.ci95)
        return f"{apart}; B - A lies in {low} to {high}{unit}, {'beyond' if self.significant else 'within'} chance"


def _number(x: Value) -> str:
    return f"{x:.4g}" if isinstance(x, float | int) and not isinstance(x, bool) else str(x)


def compare(a: Told, b: Told) -> dict[str, Any]:
    """The document of `ers compare`: every line, those beyond chance first among their kind.

    Raises:
        InputError: their units or kinds of input differ.
    """
    refuse_unlike(a, b)
    lines, untold = _parameters(a.document["parameters"], b.document["parameters"], "")
    for effect in _named(a).keys() & _named(b).keys():
        more, less = _parameters(_named(a)[effect]["parameters"], _named(b)[effect]["parameters"], f"{effect} ")
        lines, untold = [*lines, *more], [*untold, *less]
    lines += [*_effects(a, b), *_remainder(a, b), *_states(a, b)]
    judged = _judged(lines)
    beyond = [line for line in judged if line.significant]
    tests = sum(line.p is not None for line in judged)
    notes = reservations(a, b)
    if untold:
        notes.append(f"not compared, since one of them cannot tell: {', '.join(untold)}")
    return {
        "a": _head(a),
        "b": _head(b),
        "sentence": _summary(beyond),
        "differences": [line.to_dict() for line in [*judged, *_errors(a, b)]],
        "chance": {
            "method": "Holm",
            "level": LEVEL,
            "tests": tests,
            "sentence": f"Of {tests} tests together, the chance that even one is wrongly called a difference is"
            f" {LEVEL:.0%} (Holm); each interval by itself is a 95 % one.",
        },
        "notes": notes,
    }


def _head(told: Told) -> dict[str, Any]:
    document = told.document
    effects = [m["effect"] for m in document.get("missing") or []]
    return {"name": told.name, "verdict": document["verdict"], "effects": effects, "files": told.data.get("files")}


def _summary(beyond: list[Difference]) -> str:
    if not beyond:
        return "Nothing differs beyond chance."
    names, many = [line.what for line in beyond], len(beyond)
    more = f" and {many - 6} more" if many > 6 else ""
    verb = "differs" if many == 1 else "differ"
    return f"{many} of what was compared {verb} beyond chance: {', '.join(names[:6])}{more}."


def _judged(lines: list[Difference]) -> list[Difference]:
    """The lines with the tests among them judged together."""
    holds = iter(beyond_chance([line.p for line in lines if line.p is not None]))
    out = []
    for line in lines:
        beyond = next(holds) if line.p is not None else line.decided
        clear = line.ci95 is None or not line.ci95[0] <= 0.0 <= line.ci95[1]
        out.append(replace(line, significant=beyond and clear and not line.against))
    return out


# -- what is compared -------------------------------------------------------------------------------------------------


def _parameters(ours: Mapping, theirs: Mapping, owner: str) -> tuple[list[Difference], list[str]]:
    """(parameters that both can tell, those that only one can); a row that repeats another in both is left out."""
    lines, untold, seen = [], [], set()
    for name, entry in ours.items():
        other = theirs.get(name) or {}
        values = entry.get("value"), other.get("value")
        if None in values:
            untold += [owner + name] if values != (None, None) else []
            continue
        if values in seen:
            continue
        seen.add(values)
        lines.append(_estimated("parameter", owner + name, entry.get("unit") or "", entry, other))
    return lines, untold + [
        owner + name for name in theirs if name not in ours and theirs[name].get("value") is not None
    ]


def _estimated(kind: str, what: str, unit: str, ours: Mapping, theirs: Mapping) -> Difference:
    one, other = (Estimate.of(entry["value"], entry.get("ci95")) for entry in (ours, theirs))
    low, high = between(one, other)
    ends = ours.get("ci95"), theirs.get("ci95")
    known = all(abs(x) < float("inf") for x in (low, high))
    if not known:
        return Difference(kind, what, one.value, other.value, unit, against="no interval is known", ends=ends)
    return Difference(kind, what, one.value, other.value, unit, (low, high), p_value(one, other), ends=ends)


def _named(told: Told) -> dict[str, Mapping]:
    return {m["effect"]: m for m in told.document.get("missing") or []}


def _effects(a: Told, b: Told) -> Iterator[Difference]:
    """What one of them names and the other does not."""
    for one, other, in_a in ((a, b, True), (b, a, False)):
        for effect, entry in _named(one).items():
            if effect in _named(other):
                continue
            p = (entry.get("evidence") or {}).get("p_value")
            against = _not_excluded(effect, entry, other)
            yield Difference("effect", effect, in_a, not in_a, "", p=p, against=against, decided=True)


def _not_excluded(effect: str, entry: Mapping, other: Told) -> str:
    """Why the effect may be in the other servo as well; empty where it is excluded there."""
    rivals = {x["effect"] for x in entry.get("alternatives") or []}
    for name, theirs in _named(other).items():
        if effect in {x["effect"] for x in theirs.get("alternatives") or []} or name in rivals:
            return f"the other names {name}, which data like these cannot tell from it"
    if (other.document.get("remainder") or {}).get("significant"):
        return "the other leaves a mismatch unexplained, in which it may be hidden"
    return ""


def _remainder(a: Told, b: Told) -> Iterator[Difference]:
    """Whether one leaves a mismatch beyond noise and the other none, as each of them decided."""
    left = [bool((told.document.get("remainder") or {}).get("significant")) for told in (a, b)]
    if left[0] != left[1]:
        yield Difference("remainder", "mismatch left", left[0], left[1], "", decided=True)


def _states(a: Told, b: Told) -> Iterator[Difference]:
    """What drifts between the recordings of one of them: from its first recording to its last, beside the other's."""
    ours, theirs = ({x["name"]: x for x in told.document.get("record_state") or []} for told in (a, b))
    for name in dict.fromkeys([*ours, *theirs]):
        unit = (ours.get(name) or theirs[name]).get("unit") or ""
        drifts = [_drift(states.get(name)) for states in (ours, theirs)]
        yield _estimated("record_state", f"drift of {name.replace('_', ' ')}", unit, *drifts)


def _drift(state: Mapping | None) -> dict[str, Any]:
    """From the first recording to the last; no drift beyond chance is none."""
    if state is None or len(state["values"]) < 2:
        return {"value": 0.0, "ci95": [0.0, 0.0]}
    first, last = (_of_recording(state, k) for k in (0, -1))
    return {"value": last.value - first.value, "ci95": list(between(first, last))}


def _of_recording(state: Mapping, k: int) -> Estimate:
    """What a recording has of it; the first, to which factors refer, has no interval and is exact."""
    value, ends = state["values"][k], (state.get("ci95") or [None])[k]
    exact = k == 0 and (ends is None or None in ends)
    return Estimate(value, value, value) if exact else Estimate.of(value, ends)


def _errors(a: Told, b: Told) -> Iterable[Difference]:
    """Errors and noise floors, which have no interval."""
    fits = [told.document.get("fit") or {} for told in (a, b)]
    measured: Callable[[Mapping], tuple] = lambda fit: (fit.get("measure"), fit.get("window_s"))
    against = "no interval is known, chance is not judged"
    if measured(fits[0]) != measured(fits[1]):
        against = "by another measure in each, not to be compared"
    unit = a.data.get("output_unit") or ""
    for key, what in ERRORS.items():
        if fits[0].get(key) is not None and fits[1].get(key) is not None:
            yield Difference("error", what, fits[0][key], fits[1][key], unit, against=against)
