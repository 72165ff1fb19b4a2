"""The answer: every letter with its interval or why it cannot be told, the combinations that can, the model, and a
sentence.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ers_mj.data.prepared import Blocks, Trace
from ers_mj.data.recording import Recording
from ers_mj.identification.finding import FOLLOWED, Settings
from ers_mj.identification.minimisers import Minimum
from ers_mj.identification.misfit import STEP, Misfit, Search, Simulator, central
from ers_mj.identification.precision import WEAK, Precision, Profile, precision_of, profile
from ers_mj.identification.rows import Row, Rows, factor_of
from ers_mj.identification.structure import Structure
from ers_mj.identification.unknowns import Unknowns
from ers_mj.servo.datasheet import LUMPED, Datasheet

WRONG = 1.5  # mean squared residual in sigmas from which the model is said to be wrong


@dataclass(frozen=True)
class Identified:
    """What an identification found.

    Attributes:
        settings: how it was asked.
        rows: the answer.
        fitness: Eq. (13) [output unit^2 s].
        misfit: mean squared residual in sigmas; in MuJoCo the median block's, as an observer (see FOLLOWED): its step
            decides when a lever is met, and a free run carries each such chance on.
        minimum: what the minimiser found, with its trace; ``evaluations`` counts the polish too.
        structure: what the data can tell.
        profiles: of the weak combinations.
        traces, predicted: recordings with their fitted starts, and the model's free runs (N,) beside them.
        model: the identified model.
        sentence: what came out.
        warnings: what to be careful about.
        wall_s: time it took.
    """

    settings: Settings
    rows: tuple[Row, ...]
    fitness: float
    misfit: float
    minimum: Minimum
    evaluations: int
    structure: Structure
    profiles: tuple[Profile, ...]
    traces: tuple[Trace, ...]
    predicted: tuple[np.ndarray, ...]
    model: Datasheet
    sentence: str
    warnings: tuple[str, ...]
    wall_s: float

    @property
    def explains(self) -> bool:
        """Whether the model explains the recordings within their noise."""
        return self.misfit <= WRONG


def answer(
    recordings: Sequence[Recording],
    datasheet: Datasheet | None,
    settings: Settings,
    search: Search,
    x: np.ndarray,
    simulate: Simulator | None,
    minimum: Minimum,
    used: int,
) -> Identified:
    """What was found at the coordinates x (r,) of a search after ``used`` evaluations, judged by what is simulated;
    ``wall_s`` is left at 0.
    """
    unknowns, letters = search.unknowns, search.letters(x)
    open_ended = replace(search, with_starts=True)
    x = np.concatenate([x, np.zeros(open_ended.bounds[0].size - x.size)])
    reduced = Misfit(open_ended, FOLLOWED[-1] if simulate else 0.0)
    e, weight = replace(reduced, simulate=simulate).residuals(x), reduced.weight
    free = replace(reduced, simulate=simulate, rate=0.0).residuals(x) if simulate else e
    slopes = np.nan_to_num(central(reduced.residuals, x, STEP) / weight[:, None])
    precision = precision_of(slopes, e / weight, search.traces, settings.seed)
    seen = np.concatenate([t.seen for t in search.traces])
    misfit = (
        float(np.median(Blocks.of(search.traces).misfit(e / weight)))
        if simulate
        else float(np.sum((e / weight) ** 2)) / int(seen.sum())
    )
    profiles = () if simulate or misfit > WRONG else _profiles(reduced, open_ended, slopes, x, precision)
    y, u = recordings[0].output_unit, {"pct": "%"}.get(recordings[0].input_unit, recordings[0].input_unit)
    sheet = {**datasheet.to_lumped(), **datasheet.parameters} if datasheet is not None else {}
    ends = {p.name: (_factor(p.name, p.ends[0]), _factor(p.name, p.ends[1])) for p in profiles}
    rows = Rows(search, letters, precision, ends, sheet, y, u).all()
    predicted = _predicted(search, letters, free / weight)
    return Identified(
        settings,
        tuple(rows),
        float(free @ free),
        misfit,
        minimum,
        used,
        search.structure,
        profiles,
        search.traces,
        predicted,
        _model(unknowns, letters),
        _sentence(search, misfit, settings),
        tuple(_warnings(search, x, misfit)),
        0.0,
    )


def _factor(name: str, z: float | None) -> float | None:
    """The factor that a coordinate stands for, where there is one."""
    return None if z is None else factor_of(name, z)


def _profiles(
    objective: Misfit, search: Search, slopes: np.ndarray, x: np.ndarray, precision: Precision
) -> tuple[Profile, ...]:
    """Of those coordinates whose interval is wide enough to be bent; in sigmas, so that a rise of one is one of
    chi^2.
    """
    out = []
    for k, name in enumerate(search.names):
        half = 1.96 * math.sqrt(precision.fisher[k, k])
        if name != "theta_0" and WEAK < half < 3.0:  # beyond, a profile says no more
            unit = np.eye(x.size)[k]
            out.append(
                profile(InSigmas(objective), slopes, x, k, name, half, precision.half_width(unit) / half, search.bounds)
            )
    return tuple(out)


class InSigmas:
    """A misfit whose squares sum to chi^2."""

    def __init__(self, misfit: Misfit):
        self._misfit, self._weight = misfit, misfit.weight

    def residuals(self, x: np.ndarray) -> np.ndarray:
        """Residuals (N,) in sigmas."""
        return self._misfit.residuals(x) / self._weight


def _predicted(search: Search, letters: np.ndarray, e: np.ndarray) -> tuple[np.ndarray, ...]:
    """What the plant shows (N,) in each recording: the measured output less its residual, by the reduced model where
    none was measured.
    """
    out, at = [], 0
    for k, trace in enumerate(search.traces):
        own = search.unknowns.model(letters).predict(trace, k)
        out.append(np.where(trace.valid, trace.y - trace.sigma * e[at : at + trace.t.size], own))
        at += trace.rows
    return tuple(out)


def _model(unknowns: Unknowns, letters: np.ndarray) -> Datasheet:
    """The identified model: what cannot be told stands as it was known, the rest beside it as the recordings have
    it.
    """
    values = unknowns.values(letters)
    lumped = {name: float(values[name]) for name in LUMPED}
    held = {"J": unknowns.inertia} if unknowns.effects and unknowns.inertia != 1.0 else {}
    return Datasheet(
        parameters=held if unknowns.is_lumped else unknowns.everything(letters),
        lumped=lumped,
        effects=tuple(unknowns.effects),
        baseline={name: float(values[name]) for name in ("tau_e", "emf_share")},
        name="model.toml",
    )


def _sentence(search: Search, misfit: float, settings: Settings) -> str:
    structure, count = search.structure, len(search.traces)
    what = (
        f"{structure.rank} of {len(structure.names)} parameters can be told"
        if structure.pivots
        else f"all {structure.rank} parameters can be told"
    )
    said = (
        f"From {'this recording' if count == 1 else f'these {count} recordings'}"
        f" {what}{' as combinations' if structure.pivots else ''}"
    )
    if misfit > WRONG and settings.method != "ls" and not settings.polish:
        return (
            f"{said}, but {settings.method} left {math.sqrt(misfit):.2g} times the noise: it stopped short of the best"
            " fit, or the model is wrong (--polish tells)."
        )
    if misfit > WRONG:
        return (
            f"{said}, but the model is wrong: what it leaves is {math.sqrt(misfit):.2g} times the noise. `ers diagnose`"
            " looks for what is missing."
        )
    return f"{said}; the model explains what was recorded within its noise."


def _warnings(search: Search, x: np.ndarray, misfit: float) -> list[str]:
    lower, upper = search.bounds
    out = [
        f"{name.replace('_', ' ')} acts as the datasheet has it, its numbers are held (`ers diagnose` fits them)"
        for name, _ in search.unknowns.effects
    ]
    out += [
        f"{name} was left out: these recordings ask for less of it than its bounds allow (--bounds {name}=LOW:HIGH"
        " forces it in)"
        for name in search.unknowns.absent
    ]
    for name, z, low, high in zip(search.names, x, lower, upper):
        if min(z - low, high - z) < 1e-3 * (high - low):
            end, wanted = ("lower", "less") if z - low < high - z else ("upper", "more")
            out.append(
                f"{name} rests at the {end} end of its bounds: these recordings ask for {wanted} of it; widen them"
                " (--bounds) or doubt the model"
            )
    return (
        out
        + (["the intervals hold for a model that is right, which this one is not"] if misfit > WRONG else [])
        + search.structure.trades()
    )
