"""What is wanted of a model on a rig, and how well an input tells it: the Fisher information of the event-exact model.

With Jacobian J (N, k) of the residuals [sigma] the covariance of the fitted numbers z is C = (J^T J)^-1, that of
wanted numbers with gradients G is G C G^T. D-optimal: least determinant; A-optimal: least trace. Slopes are differences
of the exact simulation, since a weak number is what is left of a column after all others are taken off it, and tangents
are good to a few per cent only. Where stick and slip nearly fork, an input promises a precision that holds within a
hair's breadth of the model's numbers; so the slopes are secants along the axes of C, as long as the standard deviations
that they promise, and a share of the blocks of time, those that tell most, counts no more than the others.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from ers_mj.data.excitation import ASKING, Limits
from ers_mj.data.prepared import Channel, Signals, Trace, make_trace
from ers_mj.errors import InputError
from ers_mj.estimation.fit import SQUARES, descend, fit
from ers_mj.estimation.jacobian import jacobian_of
from ers_mj.estimation.known_model import model_of
from ers_mj.estimation.objective import residuals, run_of
from ers_mj.experiment_design.bench import VAGUE
from ers_mj.servo.datasheet import Datasheet
from ers_mj.servo.model import OBSERVER_RATE, Model


@dataclass(frozen=True)
class Counting:
    """How the information of a recording is counted."""

    block: float = 0.25  # [s]
    fewest_blocks: int = 8
    secants: int = 2  # times that the slopes are taken anew, over steps of a standard deviation
    trimmed: float = 0.1  # share of the blocks, those that tell most, that are not counted on


@dataclass(frozen=True)
class Refitting:
    """How what was promised is checked on simulated recordings."""

    off: float = 0.01  # standard deviation of z, from how far a fit begins
    steps: int = 60  # of the least squares that end it
    tolerance: float = 1e-9  # in C at SQUARES


COUNTING, REFITTING = Counting(), Refitting()
TOLD: Mapping[str, tuple[str, Callable[[Mapping[str, float]], float]]] = {  # meaning, and value of what may be wanted
    "a_1": ("k_s/J", lambda v: v["a_1"]),
    "a_2": ("damping of Eq. (6)", lambda v: v["a_2"]),
    "b": ("n K_t/(J R)", lambda v: v["b"]),
    "c_1": ("T_LH/J", lambda v: v["c_1"]),
    "c_2": ("F_c/J", lambda v: v["c_2"]),
    "theta_0": ("home", lambda v: v["theta_0"]),
    "tau_e": ("L/R", lambda v: v["tau_e"]),
    "B": ("B/J", lambda v: v["a_2"] * (1 - v["emf_share"])),
    "K_e": ("n K_e", lambda v: v["a_2"] * v["emf_share"] / v["b"]),
    "K_t": ("n K_t/J", lambda v: v["ampere"]),
    "R": ("R", lambda v: v["ampere"] / v["b"]),
}
NEEDS = {
    "tau_e": "tau_e",
    "B": "emf_share",
    "K_e": "emf_share",
    "K_t": "ampere",
    "R": "ampere",
}  # the number that must be free


@dataclass(frozen=True)
class Rig:
    """What can be asked of a rig: its limits, the noise of the angle [rad], and that of the current [A] where it is
    measured.
    """

    limits: Limits
    sigma: float
    current_sigma: float | None = None

    @staticmethod
    def of(
        home: float,
        u_max: float,
        travel: float,
        duration: float,
        rate_hz: float,
        sigma: float,
        current_sigma: float | None = None,
    ) -> Rig:
        """A rig that bears +-u_max [V] and +-travel [rad] about its home."""
        inside = travel / (1 + 2 * ASKING.margin)
        return Rig(Limits(-u_max, u_max, home - inside, home + inside, rate_hz, duration, home), sigma, current_sigma)

    @property
    def t(self) -> np.ndarray:
        """Sample times (N,) [s]."""
        return np.arange(round(self.limits.duration * self.limits.rate_hz)) / self.limits.rate_hz


@dataclass(frozen=True)
class Plan:
    """An input u (N,) [V], the parts that it is made of, and the standard deviations that it leaves of the wanted
    numbers (of logarithms; of theta_0 in rad).

    ``spread`` is promised by the information, ``found`` the RMS error of refits to simulated recordings, once
    they were made.
    """

    u: np.ndarray
    parts: tuple[dict, ...]
    spread: Mapping[str, float]
    cost: float
    found: Mapping[str, float] = field(default_factory=dict)


@dataclass(frozen=True)
class Question:
    """What is wanted of a model on a rig: names of TOLD, by the criterion "D" or "A", in which each is weighed by its
    ``known`` spread (q,).
    """

    model: Model
    rig: Rig
    wanted: tuple[str, ...]
    criterion: str = "A"
    known: tuple[float, ...] = ()

    @staticmethod
    def of(
        datasheet: Datasheet, rig: Rig, wanted: Sequence[str] = (), criterion: str = "A", inductance: bool = True
    ) -> Question:
        """All that can be told, where nothing is named.

        Raises:
            InputError: a name that does not exist, or that these sensors cannot tell.
        """
        probe = _empty(rig, np.zeros(rig.t.size))
        probe = replace(
            probe,
            y=np.linspace(rig.limits.low, rig.limits.high, probe.t.size),
            u=np.full(probe.t.size, rig.limits.high_u),
        )
        model = model_of(datasheet, [probe], True, inductance=inductance, current=rig.current_sigma is not None)
        can = tuple(n for n in TOLD if NEEDS.get(n, n) in model.free)
        for name in wanted:
            if name not in TOLD:
                raise InputError(f"--for: there is no {name[:40]!r}; there are {', '.join(TOLD)}")
            if name not in can:
                remedy = (
                    "" if rig.current_sigma is not None else "; measuring the current would help (--current-noise-A)"
                )
                raise InputError(
                    f"--for {name}: this model and these sensors cannot tell it, they can tell {', '.join(can)}{remedy}"
                )
        free = tuple(n for n in can if n not in ("R", "a_2" if "B" in can else ""))
        question = Question(model, rig, tuple(wanted) or free, criterion)
        if criterion == "D" and np.linalg.matrix_rank(question.gradients) < len(question.wanted):
            raise InputError(
                f"--for {','.join(wanted)}: these depend on each other, leave one out (or ask for --criterion A)"
            )
        return question

    @cached_property
    def gradients(self) -> np.ndarray:
        """Gradients (q, k) of the wanted numbers' logarithms (of theta_0 itself) by z, over what is ``known`` of
        them.
        """
        layout = self.model.layout()
        z, rows, step = self.model.vector(layout), [], 1e-5
        for name, known in zip(self.wanted, self.known or np.ones(len(self.wanted))):
            value = lambda z, name=name: TOLD[name][1](self.model.at(layout, z).values)
            size = known * (1.0 if name == "theta_0" else value(z))
            rows.append([(value(z + step * row) - value(z - step * row)) / (2 * step * size) for row in np.eye(z.size)])
        return np.array(rows)

    def information(self, u: np.ndarray, within: bool = True) -> np.ndarray | None:
        """J^T J of each block (B, k, k) of a recording under u (N,) [V]; None where the motion leaves the travel and
        has to stay ``within``.
        """
        trace = self._recording(u)
        if not np.all(np.isfinite(trace.y)) or (within and not self.rig.limits.holds(trace.y)):
            return None
        layout = self.model.layout()
        z = self.model.vector(layout)
        jacobian = jacobian_of(run_of(self.model, [trace], OBSERVER_RATE), [trace], OBSERVER_RATE, by_tangents=False)
        for _ in range(COUNTING.secants):
            curvature, axes = np.linalg.eigh(self._trimmed(self._blocks(jacobian)))
            reach = axes / np.sqrt(np.maximum(curvature, 0.0) + VAGUE**-2)
            ends = [
                [
                    np.nan_to_num(
                        residuals(self.model.at(layout, z + way * row), [trace], OBSERVER_RATE), posinf=0.0, neginf=0.0
                    )
                    for way in (-1, 1)
                ]
                for row in reach.T
            ]
            jacobian = np.column_stack([0.5 * (after - before) for before, after in ends]) @ np.linalg.inv(reach)
        return self._blocks(jacobian)

    def _recording(self, u: np.ndarray) -> Trace:
        """What the rig's sensors would show under u (N,), without noise."""
        trace = _empty(self.rig, u)
        channels: tuple[Channel, ...] = ()
        plant, run = self.model.staged(trace, 0, 0.0, None)
        theta, motion = plant.outputs(trace.t, trace.u, **run)
        if self.rig.current_sigma is not None:
            channels = (
                Channel(
                    "current", plant.current(trace.t, motion) / self.model.values["ampere"], self.rig.current_sigma
                ),
            )
        return replace(trace, y=theta, channels=channels)

    def _blocks(self, jacobian: np.ndarray) -> np.ndarray:
        """J^T J (B, k, k) of the blocks of all channels."""
        count = max(round(self.rig.limits.duration / COUNTING.block), COUNTING.fewest_blocks)
        columns = np.split(jacobian, len(jacobian) // self.rig.t.size)
        return np.asarray(sum(np.array([part.T @ part for part in np.array_split(c, count)]) for c in columns))

    def _trimmed(self, blocks: np.ndarray) -> np.ndarray:
        """The blocks' information (k, k) in all, where those that tell most of what is wanted count as the others."""
        g, total = self.gradients, blocks.sum(axis=0)
        for _ in range(2):
            lead = g @ inverse(total)
            weight = np.linalg.inv(lead @ g.T) if self.criterion == "D" else np.eye(len(g))
            shares = np.array([np.trace(weight @ lead @ b @ lead.T) for b in blocks])
            kept = np.argsort(shares)[: math.ceil((1 - COUNTING.trimmed) * len(blocks))]
            total = blocks[kept].sum(axis=0) * len(blocks) / kept.size
        return total

    def judged(self, blocks: np.ndarray) -> tuple[np.ndarray, float]:
        """Covariance (q, q) of the wanted numbers by the blocks' information (B, k, k), trimmed, and the criterion's
        cost, in logarithms of a spread.
        """
        covariance = self.gradients @ inverse(self._trimmed(blocks)) @ self.gradients.T
        return covariance, self.cost(covariance)

    def cost(self, covariance: np.ndarray) -> float:
        """Mean logarithm of the spreads' ellipsoid (D), or logarithm of the root mean square spread (A)."""
        if self.criterion == "D":
            return 0.5 * float(np.linalg.slogdet(covariance)[1]) / len(covariance)
        return 0.5 * math.log(float(np.trace(covariance)) / len(covariance))

    def plan(self, u: np.ndarray, parts: Sequence[Mapping] = (), within: bool = True) -> Plan | None:
        """What an input promises; None where it leaves the travel."""
        blocks = self.information(u, within)
        if blocks is None:
            return None
        covariance, cost = self.judged(blocks)
        spread = np.sqrt(np.diag(covariance)) * (self.known or 1.0)
        return Plan(u, tuple(dict(p) for p in parts), dict(zip(self.wanted, spread.tolist())), cost)

    def errors(self, u: np.ndarray, seed: int) -> np.ndarray:
        """Errors (q,) of the wanted numbers after a fit to one simulated recording, noise included, from numbers that
        are off.

        The package's fit, then least squares.
        """
        random, trace, layout = np.random.default_rng(seed), self._recording(u), self.model.layout()
        channels = tuple(replace(c, values=c.values + c.sigma * random.standard_normal(u.size)) for c in trace.channels)
        trace = replace(trace, y=trace.y + trace.sigma * random.standard_normal(u.size), channels=channels)
        start = self.model.at(layout, self.model.vector(layout) + REFITTING.off * random.standard_normal(len(layout)))
        found = descend(
            fit(start, [trace]).model, [trace], OBSERVER_RATE, SQUARES, REFITTING.steps, REFITTING.tolerance
        ).model
        pairs = [(name, TOLD[name][1](found.values), TOLD[name][1](self.model.values)) for name in self.wanted]
        return np.array([a - b if name == "theta_0" else math.log(a / b) for name, a, b in pairs])

    def checked(self, plan: Plan, refits: int) -> Plan:
        """The plan with what so many refits find."""
        rms = np.sqrt(np.mean([self.errors(plan.u, seed) ** 2 for seed in range(refits)], axis=0))
        return replace(plan, found=dict(zip(self.wanted, rms.tolist())))

    def compared(self, known: Plan) -> Question:
        """The same, each spread over what another plan leaves of it."""
        return replace(self, known=tuple(known.spread[name] for name in self.wanted))


def inverse(information: np.ndarray) -> np.ndarray:
    """Covariance of z where VAGUE is all that is known beforehand."""
    return np.linalg.inv(information + np.eye(len(information)) / VAGUE**2)


def _empty(rig: Rig, u: np.ndarray) -> Trace:
    t = rig.t
    trace = make_trace("plan", Signals.empty(t, u), rig.sigma)
    return replace(trace, start=(rig.limits.start, 0.0))
