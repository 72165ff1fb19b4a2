"""A servo that closes a position loop of its own, for the eye: its joint in MuJoCo, its firmware stepped."""

from __future__ import annotations

import numpy as np

from ers_mj.data.recording import Recording
from ers_mj.errors import InputError
from ers_mj.position_loop.runs import runs_of
from ers_mj.position_loop.saved import looped_plant
from ers_mj.servo.datasheet import Datasheet
from ers_mj.view.replay import Replay, posed, refuse_runaway

ASKED = {"rad": 0.5, "V": 0.5, "m": 0.02}  # [output unit] the furthest that a named input commands


def refuse_built_on(datasheet: Datasheet, linkage: str | None, gap: float | None) -> None:
    """Raise InputError for what is built on a servo that is told a voltage only."""
    for option, value in (("--linkage", linkage), ("--gap", gap)):
        if value is not None:
            raise InputError(
                f"{option} is for models without a [loop], {datasheet.name} is one joint, its effects stand in its file"
            )


def commanded(datasheet: Datasheet, t: np.ndarray, shape: np.ndarray, moments: np.ndarray, unit: str = "rad") -> Replay:
    """The joint from rest under a reference of this shape (N,), scaled to ASKED, at the samples `moments` (F,)."""
    r = shape * ASKED[unit] / max(float(np.max(np.abs(shape))), 1e-12)
    plant = looped_plant(datasheet, unit == "rad")
    theta = plant.simulate(t, r, (float(r[0]), 0.0), float(r[0]))
    refuse_runaway(t, theta)
    return posed(plant, t[moments], theta[moments], output_unit=unit)


def replayed(datasheet: Datasheet, recording: Recording, moments: np.ndarray) -> Replay:
    """The joint under a recording's reference, started as the recording starts, and what was measured."""
    if recording.input_kind != "position":
        raise InputError(
            f"{recording.name}: its input is a {recording.input_kind}, {datasheet.name} closes a position loop, for"
            " which theta_ref_rad, theta_ref_deg or x_ref_m was expected"
        )
    (run,), cut = runs_of([recording]), slice(0, int(moments[-1]) + 1)
    plant = looped_plant(datasheet, recording.output_unit == "rad")
    theta = plant.simulate(run.t[cut], run.r[cut], run.start, run.before)
    refuse_runaway(run.t, theta)
    return posed(plant, run.t[moments], theta[moments], run.y[moments], output_unit=recording.output_unit)
