"""A model on the way that an export is measured by: an excitation of its own size, and its response as it leaves."""

from __future__ import annotations

import math

import numpy as np

from ers_mj.export.portable import Portable
from ers_mj.export.python_control import module_of
from ers_mj.export.servo import Servo

RATE_HZ, DURATION = 1000.0, 4.0  # [Hz], [s] of the excitation
SLOW, FAST = (0.5, 0.7), (2.3, 0.3)  # (frequency [Hz], share of the amplitude) of its sines
STEPS = np.array([0, 0, 1, 1, 0, -1, -1, 0])  # of half a second each, as a share of 0.4 of the amplitude


def excitation(servo: Servo) -> tuple[np.ndarray, np.ndarray]:
    """(t [s], input), each (N,): two sines and steps, through friction and springs to a few rad/s, or of some 0.4 rad
    where a position is commanded, about where it begins.
    """
    t = np.arange(round(RATE_HZ * DURATION)) / RATE_HZ
    size = _travel(servo) if servo.loop else _input(servo)
    wave = sum(share * np.sin(2.0 * np.pi * f * t) for f, share in (SLOW, FAST))
    return t, servo.held + size * (wave + 0.4 * STEPS[(t / 0.5).astype(int) % STEPS.size])


def response(servo: Servo, p: Portable, t: np.ndarray, u: np.ndarray) -> np.ndarray:
    """Readings (N,) as the exported module gives them."""
    namespace: dict = {}
    exec(compile(module_of(servo, p), "model_control.py", "exec"), namespace)
    return np.asarray(namespace["run"](t, u))


def apart(y: np.ndarray, other: np.ndarray) -> float:
    """RMS difference of two responses, over the RMS of the second about its mean."""
    return float(np.sqrt(np.mean((y - other) ** 2)) / np.std(other))


def _input(servo: Servo) -> float:
    c, weight = servo.lowered, math.hypot(servo.lowered.g_s, servo.lowered.g_c)
    holds = max(c.c_2_plus, c.c_2_minus) + c.c_1 + abs(c.bias) + weight + 0.5 * c.a_1
    return (holds + 3.0 * (c.a_emf + c.a_mech_plus)) / abs(c.b)


def _travel(servo: Servo) -> float:
    q, c = servo.loop, servo.lowered
    ends = [abs(x - servo.rest) for x in (c.lower, c.upper) if math.isfinite(x)]
    size = 0.4 if servo.is_angle or q is None or not math.isfinite(q.L) else 3.0 * q.L / q.K
    return min([size, *ends])
