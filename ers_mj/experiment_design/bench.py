"""Where explanations of a rig are tried out on recordings that do not exist yet.

An explanation is a fitted model with the curvature of its C over the recordings at hand: its numbers may move to
swallow a difference as far as these recordings let them.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ers_mj.data.excitation import Limits, signal
from ers_mj.data.prepared import Blocks, Signals, Trace, make_trace
from ers_mj.effects import BY_NAME
from ers_mj.estimation.jacobian import step_of
from ers_mj.estimation.objective import Fit
from ers_mj.servo.model import OBSERVER_RATE, STATES, Free, Model

VAGUE = 3.0  # standard deviation (of a logarithm, or over the value) of a number of which nothing is known


@dataclass(frozen=True)
class Explanation:
    """A fitted model made ready for a recording that does not exist yet.

    That recording is number 1 of two: what differs from one to the next is free in it. ``known`` (k, k) is the
    curvature of C over the recordings at hand, in the numbers z (k,) of ``layout``.
    """

    name: str
    model: Model
    layout: Sequence[Free]
    z: np.ndarray
    known: np.ndarray

    @staticmethod
    def of(name: str, found: Fit) -> Explanation:
        model = found.model.of_records([0, 0])
        for state in found.model.states or {}:
            model = model.with_state(state, 2)
        layout = model.layout()
        return Explanation(name, model, layout, model.vector(layout), _known(found, layout))

    def at(self, z: np.ndarray) -> Model:
        """The model with other numbers."""
        return self.model.at(self.layout, z)


def is_lasting(f: Free) -> bool:
    """Whether a fitted number is the same in every recording."""
    return not f.local and f.owner not in STATES


def _known(found: Fit, layout: Sequence[Free]) -> np.ndarray:
    """The curvature of the fit in the numbers of another layout; what belongs to one recording only is refitted beside
    them.
    """
    old = found.model.layout()
    if len(old) != found.size:
        raise ValueError(f"the fit's curvature is of {found.size} numbers, its model has {len(old)}")
    shared = [i for i, f in enumerate(old) if is_lasting(f)]
    curvature = _refitted_beside(found.hessian, shared)
    place = {old[i].key: k for k, i in enumerate(shared)}
    out = np.zeros((len(layout), len(layout)))
    both = [(i, place[f.key]) for i, f in enumerate(layout) if is_lasting(f) and f.key in place]
    new, known = ([pair[k] for pair in both] for k in (0, 1))
    out[np.ix_(new, new)] = curvature[np.ix_(known, known)]
    for i, f in enumerate(layout):
        if f.prior and not is_lasting(f):
            out[i, i] += 1.0 / f.prior[1] ** 2
    return out


def _refitted_beside(hessian: np.ndarray, shared: Sequence[int]) -> np.ndarray:
    """The curvature in the shared numbers where all others follow them."""
    single = [i for i in range(len(hessian)) if i not in shared]
    curvature = hessian[np.ix_(shared, shared)]
    if single:
        cross = hessian[np.ix_(shared, single)]
        curvature = curvature - cross @ np.linalg.pinv(hessian[np.ix_(single, single)], rcond=1e-12) @ cross.T
    return curvature


@dataclass
class Bench:
    """Where explanations are tried out: the limits, the noise [output unit], and the ``level`` of misfit that the
    leader leaves (1: noise).
    """

    limits: Limits
    sigma: float
    level: float
    tau: float
    simulations: int = 0

    @property
    def floor(self) -> float:
        """What a block of misfit stands above in C."""
        return self.tau + self.level

    def trace(self, excitation: Mapping, duration: float, rate: float) -> Trace:
        """An empty recording of an excitation."""
        t, u = signal({**excitation, "duration_s": duration, "rate_hz": min(rate, excitation["rate_hz"])})
        return make_trace("next", Signals.empty(t, u), self.sigma, start=(excitation["start"], 0.0))

    def filled(self, model: Model, trace: Trace) -> Trace | None:
        """The recording as the model would make it, without noise; None where the motion leaves the limits."""
        self.simulations += 1
        y = model.predict(trace, 1)
        return replace(trace, y=y) if self.limits.holds(y) else None

    def misses(self, model: Model, trace: Trace) -> np.ndarray:
        """What the model misses of a filled recording (N,) [sigma], in observer form."""
        self.simulations += 1
        return (trace.y - model.predict(trace, 1, OBSERVER_RATE)) / trace.sigma

    def noise(self, trace: Trace) -> np.ndarray:
        """What the rig's sensor and its unexplained rest add to a recording (N,) [sigma], the same every time."""
        return math.sqrt(self.level) * np.random.default_rng(1).standard_normal(trace.t.size)

    def forked(self, model: Model, clean: Trace) -> float:
        """C that a model leaves of its own recording beyond the noise, which reaches it by way of the observer and of
        the initial state.

        Under some inputs stick and slip fork on so little; what looks like a difference between explanations there is
        chance.
        """
        noise, blocks, (theta, omega) = self.noise(clean), Blocks.of([clean]), clean.start
        e = self.misses(model, replace(clean, y=clean.y + clean.sigma * noise, start=(theta + clean.sigma, omega)))
        more = np.sum(np.log((self.tau + blocks.misfit(e)) / (self.tau + blocks.misfit(noise))))
        return max(float(more), 0.0) if np.isfinite(more) else math.inf

    def slopes(
        self, one: Explanation, z: np.ndarray, e: np.ndarray, trace: Trace, by: np.ndarray | None = None
    ) -> np.ndarray:
        """Finite differences (N, k) of ``misses``, over steps ``by`` (k,)."""
        by = np.full(z.size, step_of(one.model)) if by is None else by
        columns = [(self.misses(one.at(z + row), trace) - e) / step for row, step in zip(np.diag(by), by)]
        return np.nan_to_num(np.column_stack(columns), nan=0.0, posinf=0.0, neginf=0.0)

    def further(self, model: Model, trace: Trace) -> dict[str, np.ndarray]:
        """What further channels would read (N,): the motor's torque for the current, the motor's side, and the share of
        the supply that is left.
        """
        self.simulations += 1
        plant, run = model.staged(trace, 1, OBSERVER_RATE, None)
        motion = plant.outputs(trace.t, trace.u, **run)[1]
        theta, drive, theta_m, supply = motion[:, 0], motion[:, 2], motion[:, 3], np.ones(trace.t.size)
        for name, values in plant.effects:
            supply = supply * BY_NAME[name].supply_left(values, plant.coefficients, trace.t, motion, drive)
        return {
            "i_A": plant.current(trace.t, motion),
            "theta_m_rad": theta_m if plant.coupled else theta,
            "vin_V": supply,
        }

    def cost(self, misfit: np.ndarray) -> float:
        """C beyond the leader's of blocks that miss this much (B,) more than it does."""
        return float(np.sum(np.log1p(misfit / self.floor)))
