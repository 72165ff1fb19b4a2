"""The search: what of the unknowns can be told, the way to the least misfit, and the polish in which the recordings'
starts are free too.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ers_mj.data.prepared import Trace
from ers_mj.errors import InputError
from ers_mj.estimation.initial_state import with_starts
from ers_mj.identification.minimisers import LS, MINIMISERS, Minimum
from ers_mj.identification.minimisers.ls import MULTISTART
from ers_mj.identification.misfit import Misfit, Search, Simulator, structure_at
from ers_mj.identification.structure import Structure
from ers_mj.identification.unknowns import FACTORS, Unknowns
from ers_mj.plants.mujoco.plant import TIMESTEP

BUDGET = {"reduced": 10_000, "mujoco": 400}  # evaluations at most where none is asked for


@dataclass(frozen=True)
class Gains:
    """Shares of the value below which a step ends a search by squares."""

    search: float = 1e-4
    polish: float = 1e-9
    mujoco: float = 1e-4
    # that of a polish where more than noisy_from of the noise's own misfit is left: of chi^2 it is next to
    # nothing
    noisy: float = 1e-7
    noisy_from: float = 0.5


GAINS = Gains()


@dataclass(frozen=True)
class Trials:
    """How often something is tried."""

    places: int = 8  # beside the reference, at which the rank is looked for
    after_opening: int = 2  # attempts where the reference is the end of a search from many guesses already
    budget: int = 200  # evaluations of a polish
    polishes: int = 4
    worth: float = 1e-4  # share of the value that another polish must have been worth


TRIALS = Trials()

FOLLOWED = (60.0, 30.0)  # [1/s] observer rates of the polish in MuJoCo; the answer is judged by the last


@dataclass(frozen=True)
class Settings:
    """How to identify: minimiser, plant, what is held and bounded (see unknowns.py), evaluations at most, whether ls
    goes on where another method ends, and MuJoCo's step [s]."""

    method: str = "ls"
    plant: str = "reduced"
    fixed: Mapping[str, float] | None = None
    bounds: Mapping[str, tuple[float, float]] | None = None
    factors: tuple[float, float] = FACTORS
    budget: int | None = None
    polish: bool = False
    seed: int = 0
    jobs: int = 1
    timestep: float = TIMESTEP


def best_structure(unknowns: Unknowns, traces: Sequence[Trace], scale: float, seed: int) -> Structure:
    """The highest rank met at the reference and at places drawn from the bounds, once it has been met twice: where a
    rudder sticks less can be told.
    """
    random, found = np.random.default_rng(seed), [structure_at(unknowns, traces, unknowns.reference, scale)]
    for _ in range(TRIALS.places):
        found.append(structure_at(unknowns, traces, unknowns.drawn(random), scale))
        best = max(found, key=lambda s: s.rank)
        if best.rank == len(unknowns.names) or sum(s.rank == best.rank for s in found) > 1 and best.rank:
            break
    if not best.rank:
        raise InputError(
            "no motion that the model can make within these bounds shows any parameter: check units of input and"
            " output, or widen --within"
        )
    return best


def found_by(search: Search, settings: Settings, simulate: Simulator | None) -> tuple[np.ndarray, Search, Minimum, int]:
    """(coordinates, search with the fitted starts, the minimiser's own result, evaluations in all).

    A winding of which the recordings ask for less than the bounds allow is left out: a vanishing time constant can
    neither be told nor be run well.
    """
    winding = search.unknowns.winding
    doubted = winding in search.names and winding not in (settings.bounds or {})
    found = _minimum(search, settings, simulate, 1 if doubted else None)
    used, letters = found.evaluations, search.letters(found.x)
    absent = doubted and search.at_lower_end(found.x, winding)
    if absent:
        unknowns = search.unknowns.without(winding, letters)
        search = replace(
            search, unknowns=unknowns, structure=structure_at(unknowns, search.traces, unknowns.reference, search.scale)
        )
    if absent or doubted and settings.method == "ls" and found.value > Misfit(search).target:
        found = _minimum(search, settings, simulate)
        used += found.evaluations
    x = found.x
    if settings.method == "ls" or settings.polish:
        search = replace(search, traces=tuple(with_starts(search.unknowns.model(search.letters(x)), search.traces)))
        x, search, more = polished(search, x, found.value, simulate)
        used += more
    return x, search, found, used


def _minimum(search: Search, settings: Settings, simulate: Simulator | None, attempts: int | None = None) -> Minimum:
    """What the method finds from the reference on, by that many ``attempts`` where it is ls."""
    by_squares = settings.method == "ls"
    objective = Misfit(search, jobs=settings.jobs, simulate=None if by_squares else simulate)
    lower, upper = search.bounds
    method = (
        LS(
            gain=GAINS.search,
            attempts=attempts or (TRIALS.after_opening if search.unknowns.guessed else MULTISTART.attempts),
        )
        if by_squares
        else MINIMISERS[settings.method]
    )
    found = method.minimise(
        objective,
        lower,
        upper,
        seed=settings.seed,
        budget=settings.budget or BUDGET["reduced" if by_squares else settings.plant],
        start=np.clip(search.coordinates(search.unknowns.reference), lower, upper),
    )
    if not np.isfinite(found.value):
        if settings.budget and found.evaluations >= settings.budget:
            raise InputError(
                f"{method.name} found no motion that resembles the recordings within {settings.budget} evaluations:"
                f" allow more (--evaluations)"
            )
        raise InputError(
            "no motion that the model can make within these bounds resembles the recordings: check units and signs of"
            " input and output"
        )
    return found


def polished(search: Search, x: np.ndarray, value: float, simulate: Simulator | None) -> tuple[np.ndarray, Search, int]:
    """ls carried on from x (r,) of a ``value`` with the recordings' starts among the unknowns: where it ends, and
    evaluations.
    """
    used = 0
    for _ in range(TRIALS.polishes):  # a kink, as where theta_0 meets a resting rudder, may end one
        x, search, ended = _polished(search, x, value, None, FOLLOWED[0] if simulate else 0.0)
        used += ended.evaluations
        value, gain = ended.value, value - ended.value
        if gain < TRIALS.worth * value:
            break
    for rate in FOLLOWED if simulate is not None else ():
        x, search, ended = _polished(search, x, value, simulate, rate)
        used += ended.evaluations
    return x, search, used


def _polished(
    search: Search, x: np.ndarray, value: float, simulate: Simulator | None, rate: float
) -> tuple[np.ndarray, Search, Minimum]:
    """ls from x (r,) of a ``value`` with the recordings' starts among the unknowns; by the reduced model, or with its
    slopes by ``simulate``, forgiving single blocks.
    """
    letters = search.letters(x)
    begun = replace(search, unknowns=search.unknowns.around(letters), with_starts=True).at_home(letters)
    lower, upper = begun.bounds
    own = np.concatenate([x, np.zeros(lower.size - x.size)])
    objective = Misfit(begun, rate, simulate=simulate, robust=simulate is not None)
    gain = GAINS.mujoco if simulate else GAINS.noisy if value > GAINS.noisy_from * objective.target else GAINS.polish
    found = LS(attempts=1, staged=False, gain=gain).minimise(objective, lower, upper, budget=TRIALS.budget, start=own)
    around = begun.unknowns.around(begun.letters(found.x))
    return found.x[: x.size], replace(begun, unknowns=around, traces=begun.started(found.x), with_starts=False), found
