"""Where and why the reduced model stops being valid: sentences with numbers, from the cases and maps of a validation.

cases of one condition -> size, reason, angle, rest;  its map over sines -> amplitude, frequency
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass

import numpy as np

from ers_mj.plants.inputs import RATE_HZ
from ers_mj.report.display import figure
from ers_mj.validation.cases import Case, Condition, Validation, ValidityMap, breakaway, rms

VALID = 0.05  # of the motion: the deviation up to which Eq. (6) is called valid here
REST = np.radians(1.0)  # [rad/s] below which the rudder rests
ANGLES_DEG = (5, 10, 15, 20, 25, 30, 40)  # from theta_0


@dataclass(frozen=True)
class Finding:
    """One sentence on one axis, and the shares of squared error and of time that it speaks of."""

    axis: str
    sentence: str
    share_of_error: float | None = None
    share_of_time: float | None = None

    def as_document(self) -> dict:
        """As an entry of `where`."""
        return asdict(self)


@dataclass(frozen=True, eq=False)
class Departure:
    """One condition that leaves Eq. (5): its cases, its map over sines where there is one, and what they say."""

    condition: Condition
    cases: tuple[Case, ...]
    sines: ValidityMap | None
    findings: tuple[Finding, ...]

    @property
    def worst(self) -> Case:
        """The case that Eq. (5) is furthest from."""
        return max(self.cases, key=lambda case: rms(case.error_eq_5))


def departures(validation: Validation) -> list[Departure]:
    """The conditions that leave Eq. (5) in one way; where none was run, those that leave it in several."""
    conditions = list(dict.fromkeys(case.condition for case in validation.cases))
    chosen = [c for c in conditions if c.departures == 1] or [c for c in conditions if c.departures]
    chosen.sort(key=lambda c: (c.departures, not c.gap, c.linkage == "constant"))
    maps = {sines.condition: sines for sines in validation.sines}
    found = []
    for condition in chosen:
        cases = tuple(case for case in validation.cases if case.condition == condition)
        findings = [
            _size(condition, cases),
            _reason(condition, cases, validation),
            *_where(cases, validation.lumped.get("theta_0", 0.0)),
            *(_over_sines(maps[condition], validation) if condition in maps else ()),
        ]
        found.append(Departure(condition, cases, maps.get(condition), tuple(findings)))
    return found


def headline(validation: Validation) -> str:
    """The validation in one sentence."""
    plain = [case for case in validation.cases if not case.condition.departures]
    off = [
        f"with {called(d.condition)} by up to {degrees(rms(d.worst.error_eq_5))} ({d.worst.input})"
        for d in departures(validation)
    ]
    if not plain:
        return f"Eq. (6) is off {', '.join(off)}."
    holds = (
        "With no play, a constant linkage and no inductance Eq. (6) follows MuJoCo to"
        f" {degrees(max(case.rms for case in plain))} RMS."
    )
    return f"{holds} It is off {', '.join(off)}." if off else holds


def as_document(validation: Validation) -> dict:
    """What `ers validate --json` prints."""
    where = [_keys(d.condition) | finding.as_document() for d in departures(validation) for finding in d.findings]
    sines = [
        _keys(m.condition) | {"amplitude_V": m.x, "frequency_hz": m.y, "rms_rad": m.rms, "motion_rms_rad": m.motion}
        for m in validation.sines
    ]
    play = validation.play and {
        "input": "multisine",
        "gap_rad": validation.play.x,
        "L_H": validation.play.y,
        "rms_rad": validation.play.rms,
        "motion_rms_rad": validation.play.motion,
    }
    return {
        "sentence": headline(validation),
        "cases": [case.as_document() for case in validation.cases],
        "where": where,
        "maps": {"sines": sines, "play": play},
    }


def _keys(c: Condition) -> dict:
    return {"gap_rad": c.gap, "linkage": c.linkage, "inductance": c.inductance}


def called(c: Condition) -> str:
    """What departs, in words."""
    parts = (
        [f"play of ±{np.degrees(c.gap):.3g}°"] * bool(c.gap)
        + ["the rod linkage"] * (c.linkage == "rod")
        + ["the inductance"] * c.inductance
    )
    return " and ".join(parts) or "no departure"


def degrees(x: float) -> str:
    """An angle [rad] as a reader sees it."""
    x_deg = float(np.degrees(x))
    return f"{x_deg:.1g}°" if 1e-4 <= x_deg < 1e-3 else f"{figure(x_deg, 2)}°"


def per_cent(x: float) -> str:
    """A share as a reader sees it."""
    return f"{figure(100 * x, 2) if x < 0.1 else f'{100 * x:.0f}'} %"


# -- from the cases -----------------------------------------------------------------------------------------------


def _size(condition: Condition, cases: Sequence[Case]) -> Finding:
    ordered = sorted(cases, key=lambda case: -rms(case.error_eq_5))
    listed = ", ".join(f"{degrees(rms(case.error_eq_5))} on the {case.input}" for case in ordered)
    text = f"With {called(condition)} Eq. (6) is off by {listed} (RMS)."
    repaired = [rms(case.mujoco - case.with_play) for case in cases if case.with_play is not None]
    if repaired:
        text += f" With the same play put into the reduced model {degrees(max(repaired))} is left at most."
    elif condition.inductance:
        text += f" Eq. (1), which has the inductance, is off by {degrees(max(case.rms for case in cases))} at most."
    return Finding("size", text)


def _reason(condition: Condition, cases: Sequence[Case], validation: Validation) -> Finding:
    told = []
    if condition.gap:
        case = max(cases, key=lambda case: rms(case.error_eq_5))
        moving = np.abs(case.error_eq_5)[np.abs(_speed(case)) > REST]
        wide = degrees(2 * condition.gap)
        told.append(
            f"Each time the torque changes sign the motor crosses the play, {wide} wide, alone and meets the rudder"
            f" with a running start; on the {case.input} the deviation is {degrees(float(np.median(moving)))} in the"
            " median while it moves."
            if moving.size
            else f"The motor never gets across the play, {wide} wide, and the rudder stands still."
        )
    if condition.linkage == "rod":
        low, high = (min(cases, key=lambda case: case.mujoco.min()), max(cases, key=lambda case: case.mujoco.max()))
        told.append(
            f"The rod's ratio is {low.ratio[1]:.1f} at zero, {low.ratio[0]:.1f} at {np.degrees(low.mujoco.min()):.0f}°"
            f" and {high.ratio[2]:.1f} at {np.degrees(high.mujoco.max()):.0f}°: the further out, the less torque a volt"
            " gives.".replace("-", "−")
        )
    if condition.inductance and "tau_e" in validation.lumped:
        lag, case = validation.lumped["tau_e"], max(cases, key=lambda case: rms(case.error_eq_5))
        speed = rms(_speed(case))
        told.append(
            f"The current lags by L/R = {1e3 * lag:.2f} ms; on the {case.input}, at {np.degrees(speed):.0f} °/s RMS, a"
            f" lag of that much alone would be {degrees(lag * speed)}."
        )
    return Finding("reason", " ".join(told))


def _where(cases: Sequence[Case], theta_0: float) -> list[Finding]:
    """By angle from theta_0 and at rest, all inputs pooled."""
    error = np.concatenate([case.error_eq_5 for case in cases]) ** 2
    away = np.degrees(np.abs(np.concatenate([case.mujoco for case in cases]) - theta_0))
    rest = np.abs(np.concatenate([_speed(case) for case in cases])) < REST
    total = error.sum() or 1.0
    beyond = [(float(error[away > x].sum() / total), float((away > x).mean()), x) for x in ANGLES_DEG]
    in_error, in_time, angle = max(beyond, key=lambda entry: entry[0] - entry[1])
    words = "{} of the squared error lies beyond {}° from θ₀, in {} of the time."
    if in_error - in_time < 0.1:  # too near for an angle to be named
        in_error, in_time, angle = min(beyond, key=lambda entry: abs(entry[1] - 0.5))
        words = "Spread over the travel as the time is: {} of the squared error beyond {}° from θ₀, in {} of the time."
    at_rest = float(error[rest].sum() / total), float(rest.mean())
    persists = "It persists at rest" if at_rest[0] > at_rest[1] else "It is made in motion more than at rest"
    return [
        Finding("angle", words.format(per_cent(in_error), angle, per_cent(in_time)), in_error, in_time),
        Finding(
            "rest",
            f"{persists}: {per_cent(at_rest[0])} of the squared error falls where the rudder stands still,"
            f" {per_cent(at_rest[1])} of the time.",
            *at_rest,
        ),
    ]


def _speed(case: Case) -> np.ndarray:
    """Of MuJoCo's rudder (N,) [rad/s]."""
    return np.gradient(case.mujoco) * RATE_HZ


# -- from the maps ------------------------------------------------------------------------------------------------


def _over_sines(sines: ValidityMap, validation: Validation) -> list[Finding]:
    """By amplitude and by frequency, each over those values of the other at which all sines were run."""
    share, found = sines.relative, []
    whole_y, whole_x = np.flatnonzero(np.isfinite(share).all(axis=0)), np.flatnonzero(np.isfinite(share).all(axis=1))
    if whole_y.size and len(sines.x) > 1:
        ends = np.median(share[:, whole_y], axis=1)[[0, -1]]
        found.append(
            Finding(
                "amplitude",
                f"On a sine of {sines.x[0]:.3g} V (breakaway takes {breakaway(validation.lumped):.3g} V) the deviation"
                f" is {per_cent(ends[0])} of the motion, of {sines.x[-1]:.3g} V {per_cent(ends[1])} (medians over"
                f" {_span(sines.y, whole_y)} Hz).",
            )
        )
    if whole_x.size and len(sines.y) > 1:
        ends = np.median(share[whole_x], axis=0)[[0, -1]]
        found.append(
            Finding(
                "frequency",
                f"At {sines.y[0]:.3g} Hz it is {per_cent(ends[0])} of the motion, at {sines.y[-1]:.3g} Hz"
                f" {per_cent(ends[1])} (medians over {_span(sines.x, whole_x)} V). {_valid_cells(sines)}",
            )
        )
    return found


def _span(values: Sequence[float], chosen: np.ndarray) -> str:
    return f"{values[chosen[0]]:.3g} to {values[chosen[-1]]:.3g}" if chosen.size > 1 else f"{values[chosen[0]]:.3g}"


def _valid_cells(sines: ValidityMap) -> str:
    """How many sines Eq. (6) is good for, and the worst."""
    share = sines.relative
    run = int(np.isfinite(share).sum())
    i, j = np.unravel_index(np.nanargmax(share), share.shape)
    return (
        f"Within {100 * VALID:.0f} % of the motion on {int((share <= VALID).sum())} of {run} sines; worst at"
        f" {sines.x[i]:.3g} V and {sines.y[j]:.3g} Hz: {degrees(sines.rms[i, j])}, {per_cent(share[i, j])} of the"
        " motion."
    )
