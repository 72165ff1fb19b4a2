"""One call of `ers frequency`: plants, loops, limit cycles and recordings under the same conditions.

datasheet -> plants -> linear plants -> loops (a controller each) -> margins;  describing functions -> cycles;
recordings -> responses -> gaps
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from ers_mj.control.controllers import Servo
from ers_mj.control.frequency.cycle import Cycle, predicted, simulated
from ers_mj.control.frequency.describing import coulomb, leaning, plant_response, preload, rubbing
from ers_mj.control.frequency.linear import LinearPlant, coefficients, linearised
from ers_mj.control.frequency.loop import LOWEST_HZ, Loop, ask, close_loop
from ers_mj.control.trial import Conditions, make_controller, plant_under, refuse_late, sampled
from ers_mj.data.frequency_response import Gap, Response, frequency_response, gap
from ers_mj.data.prepared import smooth_speed
from ers_mj.data.recording import Recording
from ers_mj.effects.quantities import Coefficients
from ers_mj.errors import InputError
from ers_mj.servo.datasheet import Datasheet

if TYPE_CHECKING:
    from ers_mj.control.trial import Plant

Progress = Callable[[str, float], None]


@dataclass(frozen=True)
class Scope:
    """How far a study goes.

    Attributes:
        slowest_hz, fastest_hz: sample rates of a loop that is analysed.
        most_late: samples of dead time, each of which is a state of the linear plant.
        compared_hz: up to which linear plants are compared in one number.
        drawn: frequencies of a plant's own picture.
        kick, watched: where from its centre a loop is let go [rad], and for how long it is watched [s].
    """

    slowest_hz: float = 20.0
    fastest_hz: float = 1e5
    most_late: int = 1000
    compared_hz: float = 100.0
    drawn: int = 300
    kick: float = math.radians(2.0)
    watched: float = 3.0


SCOPE = Scope()


@dataclass(frozen=True, eq=False)
class PlantView:
    """A plant beside the others, each (F,) [rad/V]: linear while it slips, and with friction and preload at the
    amplitude; ``off`` is the largest difference of its linear response from the first plant's where they are compared,
    ([dB], [deg])."""

    linear: LinearPlant
    f_hz: np.ndarray
    slipping: np.ndarray
    rubbing: np.ndarray
    off: tuple[float, float]


@dataclass(frozen=True, eq=False)
class Cycles:
    """The limit cycles of one controller: those predicted, and by plant the one that the simulation shows (None: it
    rests), its end (N,) [rad].
    """

    controller: str
    predicted: tuple[Cycle, ...]
    seen: dict[str, Cycle | None]
    tails: dict[str, np.ndarray]


@dataclass(frozen=True, eq=False)
class Compared:
    """A recording's response beside models (name -> (F,)), how far each is, and the unit of output over input, nothing
    where they are alike.
    """

    response: Response
    models: dict[str, np.ndarray]
    gaps: dict[str, Gap | None]
    unit: str = ""


@dataclass(frozen=True, eq=False)
class Study:
    """All of it."""

    plants: tuple[PlantView, ...]
    loops: tuple[Loop, ...]
    cycles: tuple[Cycles, ...]
    recordings: tuple[Compared, ...]


def study(
    datasheet: Datasheet,
    controllers: Sequence[str],
    plants: Sequence[str],
    conditions: Conditions,
    recordings: Sequence[Recording] = (),
    *,
    design: Datasheet | None = None,
    progress: Progress = lambda text, fraction: None,
) -> Study:
    """Analyse every combination.

    Args:
        datasheet: the plant.
        controllers, plants: names.
        conditions: of all; ``start`` is the point of the loops and ``amplitude`` that of their sines.
        recordings: to be compared with the plants.
        design: what the controllers know of the plant; the datasheet itself where None.
        progress: told (text, fraction).

    Raises:
        InputError: the datasheet, an effect, a recording or the sample rate cannot be used.
    """
    refuse_rate(conditions.rate_hz)
    known = Servo.of(design or datasheet)
    responses = [_response(r, datasheet) for r in recordings]  # what cannot be used is refused before anything runs
    built = {name: plant_under(conditions, datasheet, name) for name in plants}
    for plant in built.values():
        refuse_late(plant, conditions.rate_hz, SCOPE.most_late)
    reduced = built.get("reduced") or plant_under(replace(conditions, linkage="constant"), datasheet, "reduced")
    c = coefficients(reduced)
    linear = {name: linearised(plant, conditions.rate_hz, conditions.start) for name, plant in built.items()}
    loops, cycles = [], []
    for k, name in enumerate(controllers):
        law = make_controller(name, known, conditions.rate_hz, conditions)
        progress(f"closing {name} around the plants", k / len(controllers))
        answers = ask(law, conditions.start, conditions.amplitude)
        loops += [close_loop(answers, plant, c) for plant in linear.values()]
        progress(f"looking for limit cycles of {name}", (k + 0.4) / len(controllers))
        cycles.append(_cycles(law, built, c, conditions))
    return Study(
        _views(linear, c, conditions),
        tuple(loops),
        tuple(cycles),
        tuple(_compare(*pair, built, c) for pair in zip(recordings, responses, strict=True)),
    )


def refuse_rate(rate_hz: float) -> None:
    """Raise InputError for a sample rate [Hz] at which no loop is analysed."""
    if not SCOPE.slowest_hz <= rate_hz <= SCOPE.fastest_hz:
        raise InputError(
            f"the loop's sample rate is {rate_hz:g} Hz, {SCOPE.slowest_hz:g} Hz to {SCOPE.fastest_hz:g} Hz was expected"
        )


def _views(linear: dict[str, LinearPlant], c: Coefficients, conditions: Conditions) -> tuple[PlantView, ...]:
    f_hz = np.geomspace(LOWEST_HZ, 0.47 * conditions.rate_hz, SCOPE.drawn)
    N = coulomb(0.5 * (c.c_2_plus + c.c_2_minus), conditions.amplitude) + preload(
        c.c_1, conditions.amplitude, conditions.start - c.theta_0
    )
    slipping = {name: plant.response(f_hz) for name, plant in linear.items()}
    first, low = next(iter(slipping.values())), f_hz <= SCOPE.compared_hz
    views = []
    for name, plant in linear.items():
        ratio = (slipping[name] / first)[low]
        off = float(np.abs(20.0 * np.log10(np.abs(ratio))).max()), float(np.abs(np.degrees(np.angle(ratio))).max())
        views.append(PlantView(plant, f_hz, slipping[name], plant_response(plant, f_hz, N), off))
    return tuple(views)


def _cycles(law, built: dict[str, Plant], c: Coefficients, conditions: Conditions) -> Cycles:
    """About theta_0, where nothing leans a play to one side."""
    seen, tails = {}, {}
    for name, plant in built.items():
        stood = sampled(plant, conditions.rate_hz, (c.theta_0 + SCOPE.kick, 0.0))
        seen[name], theta = simulated(law, stood, plant.effects, plant.terminal, c.theta_0, SCOPE.kick, SCOPE.watched)
        tails[name] = theta[-round(0.1 * conditions.rate_hz) :]
    return Cycles(law.name, tuple(predicted(law, c, c.theta_0)), seen, tails)


# -- recordings --------------------------------------------------------------------------------------------------------


def _response(recording: Recording, datasheet: Datasheet) -> Response:
    if datasheet.parameters and (recording.input_unit, recording.output_unit) != ("V", "rad"):
        raise InputError(
            f"{recording.name}: is in {recording.output_unit} per {recording.input_unit},"
            f" {datasheet.name or 'the datasheet'} in rad per V: give a datasheet with [lumped] in the recording's"
            " units"
        )
    return frequency_response(recording)


def _compare(recording: Recording, response: Response, built: dict[str, Plant], c: Coefficients) -> Compared:
    """A recording beside each plant, slipping and with the friction and preload that its motion meets (taken as
    normal).
    """
    y, f_hz = recording.y[recording.valid], response.f_hz
    speed, spread, centre = float(smooth_speed(recording).std()), float(y.std()), float(y.mean())
    N = rubbing(0.5 * (c.c_2_plus + c.c_2_minus), speed, f_hz) + leaning(c.c_1, spread, centre - c.theta_0)
    models = {}
    for name, plant in built.items():
        linear = linearised(plant, recording.rate_hz, centre)
        models[f"{name}, slipping"] = linear.response(f_hz)
        if c.c_2_plus > 0 or c.c_1 > 0:
            models[f"{name}, friction described"] = plant_response(linear, f_hz, N)
    gaps, unit = {name: gap(response, model) for name, model in models.items()}, recording.input_unit
    return Compared(response, models, gaps, f" {recording.output_unit}/{'%' if unit == 'pct' else unit}")
