"""`model_control.py`: a module that stands alone, for python-control."""

from __future__ import annotations

import re
from collections.abc import Mapping
from importlib.resources import files
from string import Template
from typing import TYPE_CHECKING, Any

import numpy as np

from ers_mj.errors import InputError
from ers_mj.export.base import Target, Written
from ers_mj.export.portable import STATE, WITHIN, Portable
from ers_mj.export.servo import Servo

if TYPE_CHECKING:
    import control

PADE = 4  # order of the approximations that stand for dead times in linear()
NOT_RECORDED = (
    "python-control's input_output_response interpolates a continuous system's input and steps over short pulses: what"
    " plant() returns is discrete, and its input is held from sample to sample"
)


class PythonControl(Target):
    """The whole servo as a discrete NonlinearIOSystem, and the slipping one as a StateSpace."""

    name, file, tool = "control", "model_control.py", "python-control"

    def write(self, servo: Servo) -> Written:
        return Written(
            module_of(servo, servo.portable).encode(), (*servo.portable.left_out, *_linear_losses(servo), NOT_RECORDED)
        )


def module_of(servo: Servo, p: Portable) -> str:
    """The module's text, of a servo with these numbers and laws."""
    from ers_mj import __version__

    into, out = servo.signals
    values = {
        "title": f"{servo.name}: a servo's model, for python-control.",
        "version": __version__,
        "input": into,
        "output": out,
        "unit": servo.output_unit,
        "rest": repr(servo.rest),
        "step": repr(p.step),
        "numbers": shown(p.numbers),
        "constants": shown({name: x.tolist() for name, x in p.constants.items()}),
        "remembering": repr(p.remembering),
        "tables": shown({name: x.tolist() for name, x in p.tables.items()}),
        "state": repr(STATE),
        "within": repr(WITHIN),
        "scheme": p.text.rstrip(),
        **{name: repr(matrix.tolist()) for name, matrix in zip("ABCD", linear_of(servo), strict=True)},
    }
    text = (files("ers_mj.export") / "model_control.txt").read_text(encoding="utf-8")
    return Template(text).substitute(values)


def built(servo: Servo) -> dict[str, Any]:
    """What that module defines: ``plant``, ``linear`` and ``run``."""
    module: dict[str, Any] = {}
    exec(compile(module_of(servo, servo.portable), "model_control.py", "exec"), module)
    return module


def closed(servo: Servo, theta: float | None, omega: float, rate_hz: float | None) -> control.StateSpace:
    """The slipping servo with its firmware's loop, from reference to reading; at ``rate_hz``, held between samples.

    Raises:
        InputError: another point than its rest is asked for.
    """
    import control

    if theta is not None or omega != 1.0:
        raise InputError("a servo with a [loop] is linear about its rest, theta and omega are not taken")
    system = built(servo)["linear"]()
    return system if rate_hz is None else control.sample_system(system, 1.0 / rate_hz)


def shown(table: Mapping[str, object]) -> str:
    """A dictionary as Python reads it, a line an entry, infinite numbers by their names."""
    lines = [f"    {key!r}: {_number(x)}," for key, x in table.items()]
    return "\n".join(["{", *lines, "}"])


def _number(x: object) -> str:
    return re.sub(r"\binf\b", "math.inf", repr(x))


def linear_of(servo: Servo) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """(A, B, C, D) of the slipping servo about its rest, closed by its firmware's loop where it has one."""
    from ers_mj.control.frequency.firmware import closed_loop
    from ers_mj.control.frequency.linear import continuous

    if servo.loop is None:
        system = continuous(servo.plant, servo.rest, 1.0, PADE)
        return system.A, system.B, system.C, system.D
    system = closed_loop(servo.plant, servo.loop, servo.rest, PADE)
    return system.A, system.B, system.C, system.D


def _linear_losses(servo: Servo) -> list[str]:
    from ers_mj.control.frequency.linear import left_out

    c, q = servo.lowered, servo.loop
    dry = c.c_2_plus + c.c_2_minus > 0 or c.c_1 > 0
    late = c.delay > 0 or q is not None and q.tau + q.dead_time > 0
    limits = q is not None and bool(np.isfinite([q.L, q.R, q.most]).any() or q.band > 0 or q.least > 0 or q.idle > 0)
    found = {
        "dry friction and preload, constant while it slips, are not in it": dry,
        f"a dead time is Pade's approximation of order {PADE}": late,
        "the firmware's limits and dead band are not in it": limits,
    }
    shaped = [f"{name.replace('_', ' ')} is not in it: it is not linear" for name in left_out(servo.plant)]
    return [f"linear() alone: {told}" for told in (*(text for text, is_so in found.items() if is_so), *shaped)]
