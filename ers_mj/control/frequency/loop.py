"""One controller around one plant over frequency: open loop, sensitivity, margins, disk margins, bandwidth.

plant about its point, friction and preload at the amplitude; controller at the same amplitude -> L = C P -> S = 1/(1 +
L), T = L S -> margins
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import control
import numpy as np

from ers_mj.control.controllers import Controller
from ers_mj.control.frequency.describing import controller_response, coulomb, highest_hz, plant_response, preload
from ers_mj.control.frequency.linear import LinearPlant
from ers_mj.effects.quantities import Coefficients

LOWEST_HZ = 0.5  # of all that is asked and drawn


@dataclass(frozen=True, eq=False)
class Loop:
    """A loop, each (F,): frequency [Hz], plant [rad/V], controller [V/rad], and what follows; None where there is none
    (an infinite margin too).

    Attributes:
        gain_margin_db: least change of the gain, up or down, that ends stability; ``gain_range`` both as factors.
        phase_margin_deg, gain_crossover_hz: at the crossover with the least margin.
        disk_margin: alpha of the balanced disk, with the gain [dB] and the phase [deg] that it allows at once.
        sensitivity_peak: largest |S|, at ``sensitivity_peak_hz``.
        bandwidth_hz: where |T| first falls 3 dB below its value at the lowest frequency.
        stable: whether the linear loop is.
    """

    controller: str
    plant: str
    f_hz: np.ndarray
    P: np.ndarray
    C: np.ndarray
    gain_margin_db: float | None
    gain_range: tuple[float | None, float | None]
    phase_margin_deg: float | None
    gain_crossover_hz: float | None
    disk_margin: float
    disk_gain_margin_db: float | None
    disk_phase_margin_deg: float | None
    sensitivity_peak: float
    sensitivity_peak_hz: float
    bandwidth_hz: float | None
    stable: bool

    @property
    def L(self) -> np.ndarray:
        """Open loop (F,)."""
        return self.C * self.P

    @property
    def S(self) -> np.ndarray:
        """Sensitivity (F,)."""
        return 1.0 / (1.0 + self.L)

    @property
    def T(self) -> np.ndarray:
        """Complementary sensitivity (F,), of the feedback alone."""
        return self.L * self.S

    def as_document(self) -> dict:
        """As an entry of `loops`."""
        names = (
            "controller",
            "plant",
            "gain_margin_db",
            "gain_range",
            "phase_margin_deg",
            "gain_crossover_hz",
            "disk_margin",
            "disk_gain_margin_db",
            "disk_phase_margin_deg",
            "sensitivity_peak",
            "sensitivity_peak_hz",
            "bandwidth_hz",
            "stable",
        )
        return {name: getattr(self, name) for name in names}


@dataclass(frozen=True, eq=False)
class Answers:
    """A controller's describing function C (F,) [V/rad] about ``centre`` at ``amplitude`` [rad]."""

    controller: str
    centre: float
    amplitude: float
    f_hz: np.ndarray
    C: np.ndarray


def ask(controller: Controller, centre: float, amplitude: float) -> Answers:
    """What a controller answers to sines of the rudder, from LOWEST_HZ almost up to half its sample rate: asked at 40
    frequencies, interpolated to 600.
    """
    asked = np.geomspace(LOWEST_HZ, highest_hz(controller.h), 40)
    f_hz = np.geomspace(asked[0], asked[-1], 600)
    return Answers(
        controller.name,
        centre,
        amplitude,
        f_hz,
        _between(asked, controller_response(controller, centre, amplitude, asked), f_hz),
    )


def close_loop(answers: Answers, plant: LinearPlant, c: Coefficients) -> Loop:
    """A controller around a plant, the friction and the preload of ``c`` at the same amplitude in it."""
    E = answers.amplitude
    N = coulomb(0.5 * (c.c_2_plus + c.c_2_minus), E) + preload(c.c_1, E, answers.centre - c.theta_0)
    return judged(answers.controller, plant.name, answers.f_hz, plant_response(plant, answers.f_hz, N), answers.C)


def _between(f: np.ndarray, values: np.ndarray, wanted: np.ndarray) -> np.ndarray:
    """Complex values (F,) at other frequencies: size and phase straight over log frequency."""
    size, phase = np.log(np.abs(values)), np.unwrap(np.angle(values))
    return np.exp(np.interp(np.log(wanted), np.log(f), size) + 1j * np.interp(np.log(wanted), np.log(f), phase))


def judged(controller: str, plant: str, f_hz: np.ndarray, P: np.ndarray, C: np.ndarray) -> Loop:
    """The margins of a loop that is given by its responses (F,)."""
    omega, L = 2.0 * math.pi * f_hz, C * P
    data = control.frd(L, omega, smooth=True)
    gains, phases, _, _, crossings, _ = control.stability_margins(data, returnall=True)
    up, down = _least(gains[gains > 1.0]), _most(gains[(gains > 0.0) & (gains < 1.0)])
    margins = [abs(20.0 * math.log10(x)) for x in (up, down) if x is not None]
    worst = int(np.argmin(np.abs(phases))) if phases.size else None
    S = 1.0 / (1.0 + L)
    T = np.abs(L * S)
    fallen = np.flatnonzero(T < T[0] / math.sqrt(2.0))
    alpha = float(np.min(1.0 / np.abs(S - 0.5)))
    return Loop(
        controller,
        plant,
        f_hz,
        P,
        C,
        min(margins) if margins else None,
        (down, up),
        None if worst is None else float(phases[worst]),
        None if worst is None else float(crossings[worst]) / (2.0 * math.pi),
        alpha,
        *_of_disk(alpha),
        float(np.abs(S).max()),
        float(f_hz[np.argmax(np.abs(S))]),
        _crossing(f_hz, T, int(fallen[0])) if fallen.size else None,
        is_stable(L),
    )


def _least(x: np.ndarray) -> float | None:
    return float(x.min()) if x.size else None


def _most(x: np.ndarray) -> float | None:
    return float(x.max()) if x.size else None


def _of_disk(alpha: float) -> tuple[float | None, float | None]:
    """Gain [dB], up or down, and phase [deg] within the balanced disk of size alpha (as `control.disk_margins`); None
    where it allows any.
    """
    gain = None if alpha >= 2.0 else 20.0 * math.log10((1.0 + 0.5 * alpha) / (1.0 - 0.5 * alpha))
    return gain, None if alpha >= 2.0 else math.degrees(2.0 * math.atan(0.5 * alpha))


def _crossing(f_hz: np.ndarray, T: np.ndarray, k: int) -> float:
    """Where T (F,) passes its limit between k - 1 and k, straight over log frequency."""
    limit = T[0] / math.sqrt(2.0)
    share = (T[k - 1] - limit) / (T[k - 1] - T[k])
    return float(np.exp(np.log(f_hz[k - 1]) + share * np.log(f_hz[k] / f_hz[k - 1])))


def is_stable(L: np.ndarray) -> bool:
    """Whether L (F,), of a plant and a controller that are stable but for one integrator, goes round -1 no time.

    From the lowest frequency to the highest, 1 + L then turns back to the real axis by the way that it came.
    """
    turn = np.unwrap(np.angle(1.0 + L))
    return bool(abs(turn[-1]) < math.pi / 2)
