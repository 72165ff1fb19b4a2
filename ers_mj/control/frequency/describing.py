"""What is not linear, at one amplitude: the first harmonic out over the sine in.

Of an angle E sin(wt) about a centre, each nonlinearity's N [1/s^2] stands beside the inertia: theta'' + N theta = ...
; 4/pi terms as in Gelb and Vander Velde, Multiple-Input Describing Functions, 1968. A controller is described as it
runs: sample by sample, with its filter or observer.
"""

from __future__ import annotations

import math

import numpy as np

from ers_mj.control.controllers import Aim, Controller
from ers_mj.control.frequency.linear import LinearPlant


def highest_hz(h: float) -> float:
    """Up to where a controller of this sample time [s] is asked: almost half its sample rate."""
    return 0.47 / h


def coulomb(c_2: float, amplitude):
    """Friction c_2 Sgn(w): j 4 c_2 / (pi E). It leads the angle by a quarter period."""
    return 4j * c_2 / (math.pi * np.asarray(amplitude))


def preload(c_1: float, amplitude, offset: float = 0.0):
    """Preload c_1 Sgn(theta - theta_0), the centre at ``offset`` from theta_0: 4 c_1 / (pi E) sqrt(1 - (offset / E)^2),
    0 where E does not reach it.
    """
    inside = np.maximum(1.0 - (offset / np.asarray(amplitude)) ** 2, 0.0)
    return 4.0 * c_1 / (math.pi * np.asarray(amplitude)) * np.sqrt(inside)


def rubbing(c_2: float, speed: float, f_hz):
    """Friction under a motion of many sines, its speed normal with this standard deviation [rad/s]: j w sqrt(2/pi) c_2
    / speed.
    """
    return 2j * math.pi * np.asarray(f_hz) * math.sqrt(2.0 / math.pi) * c_2 / speed


def leaning(c_1: float, spread: float, offset: float):
    """Preload under the same motion, the angle normal about ``offset`` from theta_0: sqrt(2/pi) c_1 / spread
    exp(-offset^2 / (2 spread^2)).
    """
    return math.sqrt(2.0 / math.pi) * c_1 / spread * math.exp(-0.5 * (offset / spread) ** 2)


def contact(k: float, d: float, gap: float, amplitude: np.ndarray, omega: float) -> np.ndarray:
    """A play's contact under twists A sin(wt), A (X,): the force max(k (|twist| - gap) + d |twist|', 0) outside the
    play, over the twist.

    k [1/s^2] and d [1/s] per total inertia. The spring-damper pushes and never pulls; without d this is k times the
    dead zone's 1 - (2/pi) (asin(g/A) + (g/A) sqrt(1 - (g/A)^2)).
    """
    points = 256  # of a quarter period
    quarter = 0.5 * math.pi * (np.arange(points) + 0.5) / points
    phase = np.concatenate([quarter, quarter + 0.5 * math.pi])  # the other half period is its mirror image
    depth = np.multiply.outer(amplitude, np.sin(phase)) - gap
    force = np.where(
        depth > 0, np.maximum(k * depth + d * omega * np.multiply.outer(amplitude, np.cos(phase)), 0.0), 0.0
    )
    return (force @ np.sin(phase) + 1j * (force @ np.cos(phase))) / (points * np.asarray(amplitude))


def saturation(limit: float, amplitude: float) -> float:
    """A sine of this amplitude behind a limit: (2/pi) (asin(x) + x sqrt(1 - x^2)), x = limit / amplitude; 1 where the
    limit is not reached.
    """
    x = limit / amplitude if amplitude > limit else 1.0
    return 2.0 / math.pi * (math.asin(x) + x * math.sqrt(1.0 - x * x))


def plant_response(plant: LinearPlant, f_hz: np.ndarray, N) -> np.ndarray:
    """Angle over voltage (F,) [rad/V] with N (F,) [1/s^2] beside the inertia: P / (1 + N P_load)."""
    return plant.response(f_hz) / (1.0 + N * plant.load_response(f_hz))


def controller_response(controller: Controller, centre: float, amplitude: float, f_hz: np.ndarray) -> np.ndarray:
    """Voltage over angle with the sign of a feedback, -U/Y (F,) [V/rad], of a controller that holds ``centre`` and sees
    E cos(wt) about it.

    The drive's limit is left out: no amplitude is small enough for it at all frequencies.
    """
    return np.array([_answer(controller, centre, amplitude, float(f)) for f in f_hz])


def _answer(controller: Controller, centre: float, amplitude: float, f_hz: float) -> complex:
    """Two cycles or 0.05 s of a sine, whichever is longer, counted after as many again."""
    h = controller.h
    counted = max(round(2 / (f_hz * h)), round(0.05 / h))
    t = h * np.arange(2 * counted)
    phase = 2.0 * math.pi * f_hz * t
    controller.reset(centre + amplitude)
    aim, ask = Aim(centre), controller.unlimited
    u = np.array(
        [ask(aim, y, s) for y, s in zip((centre + amplitude * np.cos(phase)).tolist(), t.tolist(), strict=True)]
    )
    used = slice(counted, None)
    columns = np.column_stack([np.cos(phase), np.sin(phase), np.ones(t.size), t])[used]
    (c, s, _, _), *_ = np.linalg.lstsq(columns, u[used], rcond=None)
    return -complex(c, -s) / amplitude
