"""What the reduced model leaves out: Eq. (5), or Eq. (1) where the inductance is on, against the MuJoCo plant.

    datasheet -> (gap, linkage, inductance) x input -> two motions -> their difference -> maps over sines and over play

The reduced model has neither play nor rod here; beside it stands the same model with the play put in.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import product

import numpy as np

from ers_mj.plants.inputs import DURATION, INPUTS, RATE_HZ
from ers_mj.plants.mujoco.plant import simulate_many
from ers_mj.servo.datasheet import Datasheet
from ers_mj.servo.simulation import build_plant, finite, has_play

GAPS, LINKAGES, INDUCTANCES = (0.0, float(np.radians(0.5))), ("constant", "rod"), (False, True)  # [rad] of play
Progress = Callable[[str, float], None]


@dataclass(frozen=True)
class Grid:
    """What the maps are made of.

    Attributes:
        amplitudes, frequencies_hz: of the sines; amplitudes in breakaways.
        sine_s: how long a sine runs [s].
        most_travel: about theta_0 [rad], beyond which a sine's cell is left empty.
        gaps_deg, L_factors: play, and the inductance in units of the datasheet's.
        play_s: how long the multisine over them runs [s].
        share: of a validation's work that the maps take, for its progress.
    """

    amplitudes: tuple[float, ...] = (1.1, 1.25, 1.6, 2.0, 2.5, 3.2, 4.0)
    frequencies_hz: tuple[float, ...] = (0.5, 1.0, 2.0, 4.0, 8.0, 16.0)
    sine_s: float = 2.0
    most_travel: float = float(np.radians(60))
    gaps_deg: tuple[float, ...] = (0.0, 0.1, 0.25, 0.5, 1.0)
    L_factors: tuple[float, ...] = (0.0, 0.5, 1.0, 2.0, 4.0)
    play_s: float = 3.0
    share: float = 0.35


GRID = Grid()


@dataclass(frozen=True)
class Condition:
    """What the MuJoCo plant has beyond Eq. (5): play of +-gap [rad], linkage, inductance."""

    gap: float
    linkage: str
    inductance: bool

    @property
    def departures(self) -> int:
        """In how many ways it leaves Eq. (5)."""
        return (self.gap > 0) + (self.linkage != "constant") + self.inductance


@dataclass(frozen=True, eq=False)
class Case:
    """One input under one condition: angles (N,) [rad] at t (N,) [s] of MuJoCo, of the reduced model, of Eq. (5) with L
    = 0, and (where there is play and the linkage constant) of the reduced model with the play put in; the ratio n of
    MuJoCo's linkage at the lowest angle, at zero, at the highest."""

    input: str
    condition: Condition
    t: np.ndarray
    u: np.ndarray
    mujoco: np.ndarray
    reduced: np.ndarray
    eq_5: np.ndarray
    with_play: np.ndarray | None
    ratio: tuple[float, float, float]

    @property
    def error(self) -> np.ndarray:
        """MuJoCo less the reduced model (N,) [rad]."""
        return self.mujoco - self.reduced

    @property
    def error_eq_5(self) -> np.ndarray:
        """MuJoCo less Eq. (5), which has no inductance, (N,) [rad]."""
        return self.mujoco - self.eq_5

    @property
    def rms(self) -> float:
        """[rad]"""
        return rms(self.error)

    @property
    def motion(self) -> float:
        """Standard deviation of MuJoCo's angle [rad]."""
        return float(self.mujoco.std())

    def as_document(self) -> dict:
        """The case under the keys of `ers validate --json`."""
        c = self.condition
        return {
            "input": self.input,
            "gap_rad": c.gap,
            "linkage": c.linkage,
            "inductance": c.inductance,
            "rms_rad": self.rms,
            "max_rad": float(np.abs(self.error).max()),
            "motion_rms_rad": self.motion,
            "rms_eq5_rad": rms(self.error_eq_5),
            "rms_with_play_rad": None if self.with_play is None else rms(self.mujoco - self.with_play),
        }


@dataclass(frozen=True, eq=False)
class ValidityMap:
    """Deviation of Eq. (5) from MuJoCo: rms and motion (X, Y) [rad], NaN where not run.

    x (X,) and y (Y,) are amplitude [V] and frequency [Hz] of a sine under a condition, or play [rad] and L [H] under no
    other.
    """

    condition: Condition | None
    x: tuple[float, ...]
    y: tuple[float, ...]
    rms: np.ndarray
    motion: np.ndarray

    @property
    def relative(self) -> np.ndarray:
        """rms over motion (X, Y), NaN where it moves by less than 1e-4 rad."""
        return self.rms / np.where(self.motion > 1e-4, self.motion, np.nan)


@dataclass(frozen=True, eq=False)
class Validation:
    """All cases, the maps over sines (see :func:`mapped`), the map over play and L, and Eq. (6)'s letters."""

    cases: tuple[Case, ...]
    lumped: Mapping[str, float]
    sines: tuple[ValidityMap, ...] = ()
    play: ValidityMap | None = None


def rms(x: np.ndarray) -> float:
    """Root mean square of x."""
    return float(np.sqrt(np.mean(np.square(x))))


def possible(datasheet: Datasheet) -> tuple[tuple[float, ...], tuple[str, ...], tuple[bool, ...], list[str]]:
    """Gaps [rad], linkages and inductances of the default run that this datasheet can make, and what it cannot in
    words.
    """
    p, left_out = datasheet.parameters, []
    gaps: tuple[float, ...] = GAPS
    linkages: tuple[str, ...] = LINKAGES
    inductances: tuple[bool, ...] = INDUCTANCES
    if has_play(datasheet.effects):
        gaps = (0.0,)
        left_out.append("a gap, as the model has a play of its own")
    if not all(p.get(name, 0.0) > 0.0 for name in ("J", "n", "K_t")):
        linkages = ("constant",)
        left_out.append("the rod linkage, which needs J, n and K_t")
    if "tau_e" not in {**datasheet.to_lumped(), **datasheet.baseline}:
        inductances = (False,)
        left_out.append("the inductance, which needs L and R")
    return gaps, linkages, inductances, left_out


def validate(
    datasheet: Datasheet,
    gaps: Sequence[float] = GAPS,
    linkages: Sequence[str] = LINKAGES,
    inductances: Sequence[bool] = INDUCTANCES,
    *,
    maps: Grid | None = GRID,
    jobs: int = 0,
    duration: float = DURATION,
    progress: Progress = lambda text, fraction: None,
) -> Validation:
    """Every combination of gap [rad], linkage and inductance under every named input, both plants.

    Args:
        datasheet: the servo; effects that it holds act in both plants.
        maps: what the maps are made of; None for no maps.
        jobs: cores to use, 0 for all.
        duration: of each input [s].
        progress: told (text, fraction).

    Raises:
        InputError: the datasheet cannot make one of the plants, or a motion leaves all bounds.
    """
    t = np.arange(round(duration * RATE_HZ)) / RATE_HZ
    inputs = {name: law(t) for name, law in INPUTS.items()}
    conditions = [Condition(*values) for values in product(gaps, linkages, inductances)]
    for condition in conditions:  # what cannot be built is refused before anything runs
        _mujoco(datasheet, condition)
    share, cases = 1.0 - (maps.share if maps else 0.0), []
    for k, condition in enumerate(conditions):
        progress(f"simulating {spoken(condition)}", share * k / len(conditions))
        cases += _cases(datasheet, condition, t, inputs, jobs)
    if maps is None:
        return Validation(tuple(cases), datasheet.to_lumped())
    return Validation(
        tuple(cases),
        datasheet.to_lumped(),
        *_maps(datasheet, conditions, maps, jobs, lambda text, x: progress(text, share + maps.share * x)),
    )


def spoken(condition: Condition) -> str:
    """The condition in words."""
    play = f"play ±{np.degrees(condition.gap):.3g}°" if condition.gap else "no play"
    return f"{play}, {condition.linkage} linkage, L {'on' if condition.inductance else 'off'}"


def _mujoco(datasheet: Datasheet, c: Condition):
    return build_plant(datasheet, plant="mujoco", gap=c.gap, linkage=c.linkage, inductance=c.inductance)


def _cases(
    datasheet: Datasheet, c: Condition, t: np.ndarray, inputs: Mapping[str, np.ndarray], jobs: int
) -> list[Case]:
    eq_5, reduced = build_plant(datasheet), build_plant(datasheet, inductance=c.inductance)
    repaired = build_plant(datasheet, gap=c.gap, inductance=c.inductance) if c.gap and c.linkage == "constant" else None
    plant = _mujoco(datasheet, c)
    motions = simulate_many([plant], t, np.array(list(inputs.values())), jobs)
    return [
        Case(
            name,
            c,
            t,
            u,
            finite(t, motion.theta),
            finite(t, reduced.simulate(t, u).theta),
            eq_5.simulate(t, u).theta,
            repaired.simulate(t, u).theta if repaired else None,
            tuple(plant.ratio(x) for x in (motion.theta.min(), 0.0, motion.theta.max())),
        )
        for (name, u), motion in zip(inputs.items(), motions, strict=True)
    ]


# -- maps --------------------------------------------------------------------------------------------------------


def mapped(conditions: Sequence[Condition]) -> list[Condition]:
    """Which of the conditions get a map over sines: the widest play, the rod, the inductance, each alone; where none
    stands alone, the first that departs from Eq. (5)."""
    single = [c for c in conditions if c.departures == 1]
    widest = max((c.gap for c in single), default=0.0)
    return [c for c in single if c.gap == widest or not c.gap] or [c for c in conditions if c.departures][:1]


def _maps(datasheet: Datasheet, conditions: Sequence[Condition], grid: Grid, jobs: int, progress: Progress):
    """(maps over sines, map over play and L or None)."""
    chosen = mapped(conditions)
    over_play = (
        any(c.gap or c.inductance for c in conditions)
        and datasheet.parameters.get("L", 0.0) > 0.0
        and not has_play(datasheet.effects)
    )
    sines = []
    for k, condition in enumerate(chosen):
        progress(f"mapping {spoken(condition)}", k / (len(chosen) + over_play))
        sines.append(_sine_map(datasheet, condition, grid, jobs))
    if not over_play:
        return tuple(sines), None
    progress("mapping play and inductance", len(chosen) / (len(chosen) + 1))
    return tuple(sines), _play_map(datasheet, grid, jobs)


def breakaway(lumped: Mapping[str, float]) -> float:
    """The voltage that moves the rudder from rest at theta_0 [V], 1 where nothing holds it."""
    return (lumped.get("c_1", 0.0) + lumped.get("c_2", 0.0)) / abs(lumped["b"]) or 1.0


def _sine_map(datasheet: Datasheet, condition: Condition, grid: Grid, jobs: int) -> ValidityMap:
    """Over amplitude [V] and frequency [Hz] of a sine; empty where Eq. (5) travels too far."""
    t = np.arange(round(grid.sine_s * RATE_HZ)) / RATE_HZ
    amplitudes = tuple(float(f"{breakaway(datasheet.to_lumped()) * factor:.2g}") for factor in grid.amplitudes)
    cells = list(product(range(len(amplitudes)), range(len(grid.frequencies_hz))))
    u = np.array([amplitudes[i] * np.sin(2 * np.pi * grid.frequencies_hz[j] * t) for i, j in cells])
    eq_5 = np.array([build_plant(datasheet).simulate(t, row).theta for row in u])
    within = np.flatnonzero(np.abs(eq_5 - eq_5[:, :1]).max(axis=1) <= grid.most_travel)
    error, motion = np.full((2, len(amplitudes), len(grid.frequencies_hz)), np.nan)
    if within.size:
        for k, run in zip(within, simulate_many([_mujoco(datasheet, condition)], t, u[within], jobs), strict=True):
            error[cells[k]], motion[cells[k]] = rms(run.theta - eq_5[k]), run.theta.std()
    return ValidityMap(condition, amplitudes, grid.frequencies_hz, error, motion)


def _play_map(datasheet: Datasheet, grid: Grid, jobs: int) -> ValidityMap:
    """Over play [rad] and inductance [H], under the multisine."""
    t = np.arange(round(grid.play_s * RATE_HZ)) / RATE_HZ
    u, L = INPUTS["multisine"](t), datasheet.parameters["L"]
    inductances = tuple(factor * L for factor in grid.L_factors)
    eq_5 = build_plant(datasheet).simulate(t, u).theta
    gaps = tuple(np.radians(grid.gaps_deg).tolist())
    plants = [
        _mujoco(replace(datasheet, parameters={**datasheet.parameters, "L": x}), Condition(gap, "constant", x > 0))
        for gap, x in product(gaps, inductances)
    ]
    runs = simulate_many(plants, t, u, jobs)
    shape = len(gaps), len(inductances)
    return ValidityMap(
        None,
        gaps,
        inductances,
        np.reshape([rms(run.theta - eq_5) for run in runs], shape),
        np.reshape([run.theta.std() for run in runs], shape),
    )
