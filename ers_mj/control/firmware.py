"""A servo that closes a position loop of its own: the controller of its trials and of its study over frequency is its
firmware.
"""

from __future__ import annotations

import math

import numpy as np

from ers_mj.control.closed_loop import LOST, Run
from ers_mj.control.controllers import Servo
from ers_mj.control.references import Reference
from ers_mj.errors import InputError
from ers_mj.position_loop.saved import loop_of, motion_of
from ers_mj.servo.datasheet import Datasheet

NAME = "firmware"


def refuse_other_than_angle(datasheet: Datasheet) -> None:
    """Raise InputError for a model whose output is none: cases and amplitudes are angles."""
    unit = datasheet.output_unit
    if unit not in ("", "rad"):
        raise InputError(
            f"{datasheet.name}: its output is in {unit}, cases and amplitudes are angles here: a model in rad was"
            " expected"
        )


def told_numbers(datasheet: Datasheet) -> str:
    """The numbers of its loop, in words."""
    return ", ".join(f"{name} {x:.4g}" for name, x in datasheet.loop.items())


def as_known(datasheet: Datasheet) -> Servo:
    """The plant behind the loop, per unit of the drive's acceleration."""
    c, _, _ = loop_of(datasheet)
    return Servo(c.a_1, c.a_mech_plus + c.a_emf, 1.0, 0.0, c.c_2_plus, c.theta_0)


def largest_drive(datasheet: Datasheet) -> float:
    """The loop's limit [rad/s^2]; infinite where it has none."""
    return loop_of(datasheet)[2].L


def run_firmware(datasheet: Datasheet, plant: str, aim: Reference, start: float) -> Run:
    """The servo under a reference, from rest at ``start`` [rad], which the reference was before; its drive is known as
    an acceleration, its voltage is not.
    """
    t = aim.t - aim.t[0]
    motion = motion_of(datasheet, t, aim.theta, plant, (start, 0.0), start)
    gone = np.flatnonzero(~(np.abs(motion[:, 0] - start) < LOST))
    motion[gone[0] if gone.size else t.size :] = math.nan
    theta, omega, theta_m, drive = motion.T
    log = theta_m if loop_of(datasheet)[2].log_at_motor > 0.0 else theta
    return Run(aim, theta, omega, log, np.full(t.size, math.nan), drive, np.append(drive[1:], drive[-1:]))
