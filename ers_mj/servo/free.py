"""The numbers of a model that may be fitted: where each lives, how it is transformed, and how it is bounded."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ers_mj.effects import BY_NAME
from ers_mj.effects.base import Parameter
from ers_mj.effects.quantities import Scales

DRIFTS = "gain", "offset", "friction_level"  # what may differ from one day to the next
DAY = "gain", "friction_level"  # of these what a drive and its temperature change together
LOADS = "load", "weight"  # from one load to another: inertia and gravity as a factor, gravity by more than that
STATES = (*DRIFTS, *LOADS)
MOST_TAU = 2.0  # of a datasheet's electrical time constant, up to which the baseline's is an ordinary one


@dataclass(frozen=True)
class Bounds:
    """Ends of what is fitted, where the recordings at hand or a datasheet set them."""

    least_tau: float = 0.1  # of a datasheet's electrical time constant, from which the baseline's is an ordinary one
    near: float = 0.1  # half travels by which theta_0 or a stop may lie beyond the travel
    smallest: float = 0.5  # of the noise: a smaller width cannot be seen, and makes the simulation chatter
    fewest_cycles: int = 3  # of a frequency within the longest recording: a slower swing bends to any drift
    # of a sample, in which a damped or sprung motion settles by a factor of e: of a faster one no sample tells, and its
    # rates grow together without end
    fastest: float = 0.05
    # standard deviation of ln(gain), ln(friction level); a tenth of it, over half the travel, for an offset
    state_prior: float = 0.2
    load_prior: float = 1.0  # the same of a load
    table_prior: float = 0.5  # of an entry of what stays unknown, over the friction's level


BOUNDS = Bounds()
CLOCKED = {"phase": 1.0, "time": 0.1}  # scales [rad, s] of signed parameters whose own size says nothing


@dataclass(frozen=True)
class Free:
    """One fitted number: where it lives, how it is transformed and bounded."""

    owner: str
    name: str
    index: int
    positive: bool
    scale: float
    lower: float
    upper: float
    prior: tuple[float, float] | None = None
    local: bool = False

    @property
    def key(self) -> tuple[str, str, int]:
        """What tells this number from every other one, whatever else is fitted."""
        return self.owner, self.name, self.index // 16 if self.local else self.index if self.owner in STATES else 0

    def ends(self, z: float, half: float) -> tuple[float, float]:
        """The interval z -+ half of the transformed number, in the number's own unit."""
        if self.positive:
            return math.exp(min(z - half, 700)), math.exp(min(z + half, 700))
        return (z - half) * self.scale, (z + half) * self.scale


def of_base(names: Sequence[str], priors: Mapping[str, tuple[float, float]], scales: Scales) -> list[Free]:
    """The free numbers of the baseline."""
    if not names:
        return []
    rate = 1.0 / (BOUNDS.fastest * scales.sample_time)
    ends = {
        "theta_0": _near_travel(scales),
        "emf_share": (0.02, 0.999),
        "tau_e": _tau_bounds(scales),
        "a_1": (1e-9, rate**2),
        "a_2": (1e-9, rate),
    }
    return [
        Free("base", name, 0, name != "theta_0", scales.position, *ends.get(name, (1e-9, np.inf)), priors.get(name))
        for name in names
    ]


def of_effects(
    effects: Sequence[tuple[str, np.ndarray]], frozen: Sequence[str], local: Mapping[str, np.ndarray], scales: Scales
) -> list[Free]:
    """Those of the effects that are alike in every recording."""
    return [
        _of_effect(name, parameter, row * 16 + k, values[k], scales)
        for row, (name, values) in enumerate(effects)
        if name not in frozen
        for k, parameter in enumerate(BY_NAME[name].parameters)
        if np.isfinite(values[k]) and parameter.fitted and not (parameter.per_record and name in local)
    ]


def of_recordings(local: Mapping[str, np.ndarray], frozen: Sequence[str], scales: Scales) -> list[Free]:
    """Those of the effects that are others in every recording."""
    return [
        _of_effect(name, parameter, r * 16 + k, v, scales, True)
        for name, rows in local.items()
        if f"{name}, local" not in frozen
        for k, parameter in enumerate(p for p in BY_NAME[name].parameters if p.per_record)
        for r, v in enumerate(rows[:, k])
        if np.isfinite(v)
    ]


def of_states(states: Mapping[str, np.ndarray], scales: Scales) -> list[Free]:
    """Record states, in all recordings but the first."""
    return list(_of_states(states, scales))


def _of_states(states: Mapping[str, np.ndarray], scales: Scales) -> Iterator[Free]:
    for state, per_record in states.items():
        spread = BOUNDS.load_prior if state in LOADS else BOUNDS.state_prior
        for k in range(1, len(per_record)):
            if state == "offset":
                yield Free(state, state, k, False, scales.position, -np.inf, np.inf, (0.0, 0.1 * spread))
            else:
                yield Free(state, state, k, True, scales.position, 0.2, 5.0, (0.0, spread))


def _of_effect(name: str, parameter: Parameter, index: int, value: float, scales: Scales, local: bool = False) -> Free:
    if BY_NAME[name].tabled:
        ends = -np.inf, np.inf
        return Free(name, parameter.name, index, False, scales.acceleration, *ends, (0.0, BOUNDS.table_prior))
    scale = 1.0 if parameter.positive else CLOCKED.get(parameter.kind, max(abs(value), 1e-12))
    ends = _near_travel(scales) if parameter.on_travel else _ends(name, parameter, scales)
    return Free(name, parameter.name, index, parameter.positive, scale, *ends, local=local)


def _ends(name: str, parameter: Parameter, scales: Scales) -> tuple[float, float]:
    """The declared ends of an effect's number within what these recordings can show."""
    most = {
        "frequency": 1.0 / scales.sample_time,
        "period": 2.0 * scales.position / BY_NAME[name].fewest_turns,
    }
    largest = most.get(parameter.name if parameter.kind == "position" else parameter.kind, np.inf)
    least = {"position": BOUNDS.smallest * scales.noise, "frequency": BOUNDS.fewest_cycles / scales.duration}
    lower = least.get(parameter.kind, 1e-12) if parameter.positive and parameter.lower <= 0.0 else parameter.lower
    return lower, min(parameter.upper, largest)


def _near_travel(scales: Scales) -> tuple[float, float]:
    near = BOUNDS.near * scales.position
    return scales.low - near, scales.high + near


def _tau_bounds(scales: Scales) -> tuple[float, float]:
    known = scales.tau_e_datasheet
    return (BOUNDS.least_tau * known, MOST_TAU * known) if known else (1e-6, 1.0)
