"""What a recording that is asked for is told in: sentences of an order, of what it would settle, and of what it would
not.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence

from ers_mj.data.excitation import Limits
from ers_mj.effects import BY_NAME
from ers_mj.experiment_design.discriminating_inputs import SETTLED, Design

CALLED = {
    "i_A": "the current (i_A)",
    "theta_m_rad": "the motor's angle (theta_m_rad)",
    "vin_V": "the supply voltage (vin_V)",
}


def said(
    leader: str, told: Mapping[str, Mapping], channel: str | None, excitation: Mapping, tried: int, unit: str
) -> list[str]:
    """What to record, what it would settle, and what it would not, in sentences."""
    hopeful = [n for n, c in told.items() if c["recordings_needed"]]
    never = [n for n in told if n not in hopeful]
    words = [asked(excitation)] if hopeful else []
    for n in hopeful:
        words += _said_of(leader, n, told[n], unit)
    if never:
        words.append(_not_told_apart(leader, never, told, tried, unit))
    if channel:
        sigmas = min(c["channels_sigmas"][channel] for c in told.values() if c["cost"] < SETTLED)
        words.append(
            f"Recording {CALLED[channel]} as well would, at {sigmas:.2g} sigmas."
            + ("" if hopeful else f" {asked(excitation)}")
        )
    elif most := [max(told[n]["channels_sigmas"].values()) for n in never if told[n]["channels_sigmas"]]:
        words.append(f"Nor would {listed(CALLED.values(), 'or')}, {max(most):.1g} sigmas at most.")
    return words


def _not_told_apart(leader: str, never: Sequence[str], told: Mapping[str, Mapping], tried: int, unit: str) -> str:
    left = max(told[n]["rms_over_left"] for n in never)
    return (
        f"No input within the limits of these recordings ({tried} simulated) tells"
        f" {listed(map(plain, (leader, *never)))} apart by the output alone: after a refit {left:.1g} times"
        f" {unit} is left."
    )


def _said_of(leader: str, n: str, c: Mapping, unit: str) -> list[str]:
    """What the input would settle between the leader and one rival."""
    then = (
        f"one of them would keep less than 5 %, with a chance of {min(c['chance_of_settling'], 0.99):.0%}"
        if c["recordings_needed"] == 1
        else f"{c['recordings_needed']} such recordings would be needed to settle it"
    )
    words = [
        f"After a refit {plain(leader)} and {plain(n)} still differ there by {c['rms_over_left']:.2g} times"
        f" {unit}, {c['sigmas']:.2g} sigmas: {then}."
    ]
    if c["nested"]:
        rich, poor = (leader, n) if c["played_by"] == leader else (n, leader)
        words.append(f"Should it be {plain(poor)}, though, {plain(rich)} can still pass for it.")
    return words


def widened(
    leader: str, hopeless: Sequence[str], wide: Mapping[str, Design], limits: Limits, units: Mapping[str, str]
) -> list[str]:
    """What the travel of wider ``limits`` would do for whom, and what is left where nothing does."""
    low, high = (_in_degrees(x, units["output_unit"]) for x in (limits.low, limits.high))
    words = []
    for name, found in wide.items():
        wish = asked({**found.excitation, **units})
        words.append(
            f"If the rig bears a travel from {low} to {high}: {wish[0].lower()}{wish[1:-1]}, which would tell"
            f" {plain(leader)} and {plain(name)} apart at {math.sqrt(2 * found.cost):.2g} sigmas."
        )
    if stuck := [name for name in hopeless if name not in wide]:
        at_load = all(BY_NAME[name].subsystem == "load" for name in (leader, *stuck) if name in BY_NAME)
        words.append(
            f"Only a change of the rig can tell {listed(map(plain, (leader, *stuck)))} apart"
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


def plain(name: str) -> str:
    """An effect's name as words."""
    return name.replace("_", " ")


def listed(names: Iterable[str], last: str = "and") -> str:
    """Names with commas, the last behind a word."""
    names = list(names)
    return f" {last} ".join(filter(None, [", ".join(names[:-1]), names[-1]]))
