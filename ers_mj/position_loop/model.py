"""A servo with its firmware's loop: the numbers that are fitted of it, and its free run under a reference."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from ers_mj.effects import BY_NAME
from ers_mj.effects.quantities import Coefficients, Parameter, Scales
from ers_mj.plants.firmware import simulate
from ers_mj.plants.kernel.laws import laid_out
from ers_mj.plants.loop_numbers import LoopNumbers
from ers_mj.plants.reduced import lowered
from ers_mj.position_loop.runs import Run
from ers_mj.servo.simulation import PER_INERTIA


@dataclass(frozen=True)
class Letter:
    """A number of the loop or of the plant behind it: its unit ({y}: the output's), what it is where it is absent,
    whether it is fitted in its logarithm, its bounds, and the size in which a signed one is fitted; by how much [s] a
    drive may be ``late``, which acts as the damping -K late.
    """

    unit: str
    absent: float = 0.0
    positive: bool = True
    lower: float = 0.0
    upper: float = math.inf
    size: float = 1.0
    late: float = 0.0


LETTERS: Mapping[str, Letter] = {
    "K": Letter("1/s^2", lower=1e-3),
    "D": Letter("1/s", positive=False, size=10.0, late=0.003),
    "lag_s": Letter("s", lower=1e-4, upper=0.05),  # of the speed that D multiplies
    "I": Letter("1/s^3", lower=1e-6),
    "L": Letter("{y}/s^2", math.inf, lower=1e-6),
    "tau_s": Letter("s", positive=False, upper=0.3, size=0.01),
    "dead_time_s": Letter("s", positive=False, upper=0.2, size=0.01),
    "R": Letter("{y}/s", math.inf, lower=1e-6),
    "band": Letter("{y}", lower=1e-9),
    "idle": Letter("{y}/s^2", lower=1e-9),
    "least": Letter("{y}/s^2", lower=1e-9),
    "most": Letter("{y}/s^2", math.inf, lower=1e-6),
    "creep": Letter("1/s", math.inf, lower=5.0, upper=1e5),
    "heavy": Letter("-", 1.0, lower=1.0, upper=10.0),
    "buried": Letter("-", 1.0, lower=1.0, upper=30.0),
    "share": Letter("-", math.nan, positive=False, upper=0.97, size=0.3),  # absent: as the inertia is shared
    "grease": Letter("1/s", lower=1e-4),
    "rubbed": Letter("-", positive=False, upper=1.0, size=0.3),  # share of the damping that is no back-EMF
    "rotor": Letter("-", lower=1e-6, upper=1e6),
    "a_1": Letter("1/s^2", positive=False, lower=-math.inf, size=20.0),
    "a_2": Letter("1/s", lower=1e-4),
    "c_2": Letter("{y}/s^2", lower=1e-9),
    "hold": Letter("{y}/s^2", positive=False, lower=-math.inf, size=5.0),
    "offset": Letter("{y}", positive=False, lower=-math.inf, size=0.01),  # of the log's sensor alone
}
SCALED = ("K", "I", "D", "L", "idle", "least", "most", "grease", "a_1", "a_2", "c_2", "hold")  # by one over the inertia
WIDER = {
    "rho": (0.05, 0.95),
    "phi": (0.0, 1.0),
    "zeta": (0.02, 10.0),
}  # a loop's motor may be light and bear all friction
CONTACT = ("f_contact", "zeta")  # of a play: what no loop shows
FASTEST, SEEN = 120.0, 1.0  # [Hz] of a contact that is told from a stiff one, and that as a share of the log's rate
SIDES = ("load", "link", "motor")  # where loop and log sit: both on the load; loop on the motor; both on the motor


@dataclass(frozen=True)
class Free:
    """One fitted number: a letter (``owner`` is empty) or the ``index``-th parameter of an effect."""

    owner: str
    name: str
    index: int
    positive: bool
    size: float
    lower: float
    upper: float

    @property
    def span(self) -> float:
        """How far apart the transformed bounds are; infinite where there is none."""
        if not self.positive:
            return (self.upper - self.lower) / self.size
        return math.log(self.upper / self.lower) if 0.0 < self.lower < self.upper < math.inf else math.inf

    def inside(self, z: float) -> float:
        """The number of a transformed one, within its bounds."""
        return min(max(math.exp(min(z, 80.0)) if self.positive else z * self.size, self.lower), self.upper)

    def ends(self, z: float, half: float) -> tuple[float, float]:
        """The interval z -+ half of the transformed number, in the number's own unit."""
        return self.inside(z - half), self.inside(z + half)


@dataclass(frozen=True)
class LoopModel:
    """Values of LETTERS (those that are not there are absent), those that are ``free``, effects (name, parameters) with
    laws of their own, and the side on which loop and log sit (see SIDES). The firmware's gain register multiplies the
    error alone, or of a ``whole`` loop its integral and the damping as well. The integral holds the servo where a
    recording begins, or is empty there (``fresh``).
    """

    values: Mapping[str, float]
    free: tuple[str, ...]
    effects: tuple[tuple[str, np.ndarray], ...] = ()
    side: str = "load"
    whole: bool = False
    fresh: bool = False
    scales: Scales = field(default=None, repr=False)  # type: ignore[assignment]  # one that is only simulated has none

    def __getitem__(self, letter: str) -> float:
        """A letter's value."""
        return self.values.get(letter, LETTERS[letter].absent)

    @property
    def names(self) -> tuple[str, ...]:
        """The effects with laws of their own."""
        return tuple(name for name, _ in self.effects)

    @property
    def has_two_bodies(self) -> bool:
        """Whether a play or a shaft parts the motor from the load."""
        return any(BY_NAME[name].subsystem == "transmission" for name in self.names)

    @property
    def kind(self) -> str:
        """P, PD, PI or PID."""
        return "P" + ("I" if self["I"] > 0 else "") + ("D" if self["D"] > 0 else "")

    def layout(self) -> list[Free]:
        """Every fitted number."""
        every = [(name, LETTERS[name]) for name in self.free]
        letters = [Free("", name, 0, x.positive, x.size, self._lower(name), x.upper) for name, x in every]
        effects = [
            self._of_effect(name, p, k, values[k])
            for name, values in self.effects
            for k, p in enumerate(BY_NAME[name].parameters)
            if np.isfinite(values[k]) and p.fitted and not (BY_NAME[name].is_play and p.name in CONTACT)
        ]
        return letters + effects

    def _lower(self, name: str) -> float:
        """A letter's lower bound; a speed that is late is one that damps."""
        letter = LETTERS[name]
        return letter.lower if "lag_s" in self.free else letter.lower - letter.late * self["K"]

    def _of_effect(self, name: str, p: Parameter, k: int, value: float) -> Free:
        size = max(abs(value), 1e-3)
        if p.on_travel and self.scales is not None:
            size = self.scales.position
        elif p.kind in PER_INERTIA and self.scales is not None:
            size = max(self.scales.acceleration, 1e-6)
        lower, upper = p.lower if not p.positive else max(p.lower, 1e-9), p.upper
        if p.name in WIDER and (p.name != "zeta" or p.kind == "ratio" and self["buried"] > 1.0):
            lower, upper = WIDER[p.name]
        if p.kind == "frequency" and self.scales is not None:  # what the samples can show of a contact or a shaft
            upper = max(min(upper, FASTEST, SEEN / self.scales.sample_time), 1.1 * lower)
        if p.name == "period" and self.scales is not None:
            upper = min(upper, (self.scales.high - self.scales.low) / BY_NAME[name].fewest_turns)
        return Free(name, p.name, k, p.positive, size, lower, upper)

    def vector(self, layout: Sequence[Free]) -> np.ndarray:
        """The fitted numbers, transformed (logarithm of positive ones, others over their size)."""
        effects = dict(self.effects)
        z = np.empty(len(layout))
        for i, f in enumerate(layout):
            v = effects[f.owner][f.index] if f.owner else self[f.name]
            z[i] = math.log(max(v, f.lower, 1e-300)) if f.positive else v / f.size
        return z

    def at(self, layout: Sequence[Free], z: np.ndarray) -> LoopModel:
        """The model with the fitted numbers of z, held within their bounds."""
        values, effects = dict(self.values), {n: v.copy() for n, v in self.effects}
        for f, q in zip(layout, z, strict=True):
            if f.owner:
                effects[f.owner][f.index] = f.inside(float(q))
            else:
                values[f.name] = f.inside(float(q))
        return replace(self, values=values, effects=tuple(effects.items()))

    def having(self, **letters: float) -> LoopModel:
        """The model with these letters free, begun at the values given."""
        free = (*self.free, *(n for n in letters if n not in self.free))
        return replace(self, values={**self.values, **letters}, free=free)

    def fixed(self, **letters: float) -> LoopModel:
        """The model with these letters held at the values given."""
        free = tuple(n for n in self.free if n not in letters)
        return replace(self, values={**self.values, **letters}, free=free)

    def lacking(self, *letters: str) -> LoopModel:
        """The model without these letters."""
        return self.fixed(**{n: LETTERS[n].absent for n in letters})

    def with_effect(self, name: str, start: np.ndarray) -> LoopModel:
        """The model with one more effect, or with another start of one."""
        return replace(self.without_effect(name), effects=(*self.without_effect(name).effects, (name, start)))

    def without_effect(self, name: str) -> LoopModel:
        """The model with one effect less."""
        return replace(self, effects=tuple(e for e in self.effects if e[0] != name))

    # -- running -------------------------------------------------------------------------------------------------------

    def lightness(self, run: Run) -> float:
        """The first run's inertia over that of this one."""
        rotor = self["rotor"]
        return (rotor + 1.0) / (rotor + run.inertia)

    def motor_share(self, run: Run) -> float:
        """On which side of the gear that rubs the inertia lies: the motor's share in this run, half where that is not
        known, or the same share in all runs.
        """
        rotor = self["rotor"]
        if math.isfinite(self["share"]):
            return self["share"]
        return rotor / (rotor + run.inertia) if rotor > 0 else 0.5

    def of(self, run: Run) -> tuple[LoopNumbers, np.ndarray]:
        """The firmware's numbers and the plant (laid out, see laws.laid_out) of one run."""
        light = self.lightness(run)
        v = {n: self[n] * (light if n in SCALED else 1.0) for n in LETTERS}
        beside = run.gain if self.whole else 1.0
        loop = LoopNumbers(
            K=v["K"] * run.gain,
            D=v["D"] * beside,
            lag=v["lag_s"],
            I=v["I"] * beside,
            L=v["L"],
            tau=v["tau_s"],
            dead_time=v["dead_time_s"],
            R=v["R"],
            band=v["band"],
            lost=v["band"],
            idle=v["idle"],
            least=v["least"],
            most=v["most"],
            creep=v["creep"],
            heavy=v["heavy"],
            buried=v["buried"],
            share=self.motor_share(run),
            grease=v["grease"],
            at_motor=float(self.side != "load"),
            log_at_motor=float(self.side == "motor"),
            fresh=float(self.fresh),
        )
        return loop, laid_out(*lowered(*self.plant_of(run)))

    def plant_of(self, run: Run) -> tuple[Coefficients, list[tuple[str, np.ndarray]]]:
        """The plant behind the loop in one run: coefficients of an input of 1 acceleration, and the effects in it."""
        light = self.lightness(run)
        damping = self["a_2"] * light
        mechanical = damping * self["rubbed"]
        c = Coefficients(
            a_1=self["a_1"] * light,
            a_mech_plus=mechanical,
            a_mech_minus=mechanical,
            a_emf=damping - mechanical,
            c_2_plus=self["c_2"] * light,
            c_2_minus=self["c_2"] * light,
            bias=self["hold"] * light,
        )
        return c, [(name, self._scaled(name, values, light, run.pull)) for name, values in self.effects]

    @staticmethod
    def _scaled(name: str, values: np.ndarray, light: float, pull: float) -> np.ndarray:
        """An effect's numbers under another load: torques over the inertia, those of a weight with its moment; natural
        frequencies and damping ratios against it, and the motor's share of it.
        """
        if light == 1.0 and pull == 1.0:
            return values
        effect, scaled = BY_NAME[name], []
        for p, v in zip(effect.parameters, values, strict=True):
            if p.kind in PER_INERTIA:
                scaled.append(v * light * (pull if effect.is_weight else 1.0))
            else:
                other = v * light ** effect.by_lightness.get(p.name, 0.0)
                scaled.append(min(other, WIDER["rho"][1]) if p.name == "rho" else other)
        return np.array(scaled)

    def motion(self, run: Run, refine: int = 1, following: float = 0.0) -> np.ndarray:
        """Free run (N, 4) from the first sample, or one that follows the log at a rate [1/s]: load's angle and speed,
        motor side's angle, drive.
        """
        loop, plant = self.of(run)
        out = np.empty((run.t.size, 4))
        theta, w = run.start
        start, seen = (theta - self["offset"], w), run.seen - self["offset"]
        numbers = np.array(loop, float)
        simulate(run.t, run.r, run.enable, plant, numbers, *start, run.before, refine, seen, following, out)
        return out

    def predicted(self, run: Run, refine: int = 1) -> np.ndarray:
        """What the log shows (N,)."""
        return self.logged(self.motion(run, refine))

    def logged(self, motion: np.ndarray) -> np.ndarray:
        """The column (N,) of a motion that is logged."""
        return motion[:, 2 if self.side == "motor" else 0] + self["offset"]


def only_letters(model: LoopModel, letters: tuple[str, ...]) -> LoopModel:
    """The model of which these letters alone are fitted, and no effect's numbers."""
    return _OnlyLetters(model.values, letters, model.effects, model.side, model.whole, model.fresh, model.scales)


class _OnlyLetters(LoopModel):
    def layout(self):
        return [f for f in super().layout() if not f.owner]
