"""Limit cycles: those that the describing functions predict, and the one that the simulated loop shows.

    motor's side   Z_m theta_m + tau = drive,   Z_m = rho s^2 + beta a_mech s + a_emf s / (1 + tau_e s)
    rudder         Z_l theta = tau,
                   Z_l = (1 - rho) s^2 + (1 - beta) a_mech s + a_1 + N_friction(E) + N_preload(E)
    play           tau = N_contact(A, w) (theta_m - theta)
    drive          -H C(E) N_limit(|C| E) theta,  H = b (1 - e^(-s h)) / (s h) e^(-s delay) / (1 + tau_e s)

with E the rudder's amplitude and A the twist's. A cycle of frequency w and amplitude E balances both lines; without
play theta_m = theta. It lasts where a larger E damps it: Im(R_E / R_w) < 0 of the residual R(w, E), the quasi-static
criterion of Gelb and Vander Velde.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from scipy.interpolate import RectBivariateSpline
from scipy.optimize import root

from ers_mj.control.closed_loop import Sampled, Sensor, close
from ers_mj.control.controllers import Controller
from ers_mj.control.frequency.describing import contact, controller_response, coulomb, highest_hz, preload, saturation
from ers_mj.control.references import Reference
from ers_mj.effects.quantities import Coefficients


@dataclass(frozen=True)
class Grid:
    """Where cycles are looked for.

    Attributes:
        from_hz, to_hz: frequencies, below half the sample rate.
        least, most: amplitudes of the rudder [rad].
        asked: numbers of frequencies and amplitudes at which the controller is asked.
        looked: those at which the balance is looked at.
        twists: how many, up to the widest.
        widest: twist, in times of the play.
    """

    from_hz: float = 2.0
    to_hz: float = 500.0
    least: float = math.radians(0.02)
    most: float = math.radians(20.0)
    asked: tuple[int, int] = (24, 7)
    looked: tuple[int, int] = (120, 48)
    twists: int = 300
    widest: float = 1e4


GRID = Grid()


@dataclass(frozen=True)
class Cycle:
    """A limit cycle: frequency [Hz] and amplitude of the rudder [rad]; ``lasting`` whether disturbances of it die
    out.
    """

    f_hz: float
    amplitude: float
    lasting: bool = True

    def as_document(self) -> dict:
        """As an entry of `predicted`, or as `simulated`."""
        return {"frequency_hz": self.f_hz, "amplitude_rad": self.amplitude, "lasting": self.lasting}


def predicted(controller: Controller, c: Coefficients, centre: float) -> list[Cycle]:
    """The cycles about ``centre`` [rad] that balance by their first harmonic, those that last first.

    Args:
        controller: asked as it runs; its limit on the voltage is described on its own.
        c: the plant. What holds it at its centre is taken as constant.
        centre: where the reference stands.
    """
    top = min(GRID.to_hz, highest_hz(controller.h))
    f_hz, E = np.geomspace(GRID.from_hz, top, GRID.asked[0]), np.geomspace(GRID.least, GRID.most, GRID.asked[1])
    C = _surface(f_hz, E, np.array([controller_response(controller, centre, e, f_hz) for e in E]).T)

    def left(f: float, e: float) -> complex:
        asks = C(f, e)
        return residual(c, controller.h, centre, asks * saturation(controller.u_max, abs(asks) * e), f, e)

    return balanced(left, top)


def _surface(f_hz: np.ndarray, E: np.ndarray, values: np.ndarray) -> Callable[[float, float], complex]:
    """Complex values (F, E) as a function of frequency and amplitude, straight over both logarithms."""
    parts = [
        RectBivariateSpline(np.log(f_hz), np.log(E), part, kx=1, ky=1)
        for part in (np.log(np.abs(values)), np.unwrap(np.unwrap(np.angle(values), axis=0), axis=1))
    ]
    return lambda f, e: complex(
        np.exp(parts[0].ev(math.log(f), math.log(e)) + 1j * parts[1].ev(math.log(f), math.log(e)))
    )


def residual(
    c: Coefficients, h: float, centre: float, C: complex, f_hz: float, E: float, at_motor: bool = False
) -> complex:
    """What the balance leaves [1/s^2], over E: 0 for a cycle; NaN where no twist passes the torque that the rudder
    takes. The controller sees the rudder, or the motor's side.
    """
    w = 2.0 * math.pi * f_hz
    s = 1j * w
    lag = 1.0 + s * c.tau_e
    held = c.b * (1.0 - np.exp(-s * h)) / (s * h) * np.exp(-s * c.delay) / lag
    N = coulomb(0.5 * (c.c_2_plus + c.c_2_minus), E) + preload(c.c_1, E, centre - c.theta_0)
    if not c.has_motor_side:
        return complex(s * s + c.a_mech_plus * s + c.a_emf * s / lag + c.a_1 + N + held * C)
    Z_l = (1.0 - c.rho) * s * s + (1.0 - c.beta) * c.a_mech_plus * s + c.a_1 + N
    Z_m = c.rho * s * s + c.beta * c.a_mech_plus * s + c.a_emf * s / lag
    through = passed(c, w, abs(Z_l) * E)
    if through is None:
        return complex(math.nan, math.nan)
    turned = 1.0 + Z_l / through  # the motor's side over the rudder
    return complex(Z_m * turned + Z_l + held * C * (turned if at_motor else 1.0))


def passed(c: Coefficients, w: float, torque: float) -> complex | None:
    """N of the contact [1/s^2] at the twist by which it passes this much [rad/s^2]; None where no twist does."""
    if c.gap <= 0 and c.harden <= 0:
        return c.k_twist + 1j * w * c.d_twist
    torques, N = _contacts(c.k_twist, c.d_twist, c.gap, c.harden, w)
    if torque > torques[-1] or torque < torques[0] and c.gap > 0:
        return None
    at = math.log(torque)
    return complex(np.interp(at, np.log(torques), N.real), np.interp(at, np.log(torques), N.imag))


@lru_cache(maxsize=4 * GRID.looked[0])
def _contacts(k: float, d: float, gap: float, harden: float, w: float) -> tuple[np.ndarray, np.ndarray]:
    """What the contact passes (X,) [rad/s^2] of twists just beyond the play up to the widest, and its N (X,); of a
    shaft that hardens, of twists as small against that at which it takes twice the torque."""
    spread = np.geomspace(1e-4, GRID.widest, GRID.twists)
    if harden > 0:
        twist = spread / np.sqrt(harden)
        N = k * (1.0 + 0.75 * harden * twist**2) + 1j * w * d  # of a cube: Gelb and Vander Velde 1968
    else:
        twist = gap * (1.0 + spread)
        N = contact(k, d, gap, twist, w)
    return np.abs(N) * twist, N


def balanced(residual: Callable[[float, float], complex], to_hz: float = GRID.to_hz) -> list[Cycle]:
    """Where a residual of (frequency [Hz], amplitude [rad]) vanishes up to to_hz, those that last first."""
    f_hz, E = np.geomspace(GRID.from_hz, to_hz, GRID.looked[0]), np.geomspace(GRID.least, GRID.most, GRID.looked[1])
    R = np.array([[residual(f, e) for e in E] for f in f_hz])
    ends = np.log([[f_hz[0], E[0]], [f_hz[-1], E[-1]]])
    at = lambda z: residual(*np.exp(np.clip(z, *ends)).tolist())
    found: list[Cycle] = []
    for i, j in np.argwhere(_turns(R.real) & _turns(R.imag)):
        start = np.log([math.sqrt(f_hz[i] * f_hz[i + 1]), math.sqrt(E[j] * E[j + 1])])
        size = abs(R[i, j])
        solved = root(lambda z, size=size: [at(z).real / size, at(z).imag / size], start, tol=1e-10)
        f, e = np.exp(np.clip(solved.x, *ends)).tolist()
        inside = bool((ends[0] < solved.x).all() and (solved.x < ends[1]).all())
        if (
            not solved.success
            or not inside
            or any(abs(math.log(f / x.f_hz)) < 1e-3 and abs(math.log(e / x.amplitude)) < 1e-3 for x in found)
        ):
            continue
        d = 1e-4
        R_w = (at(solved.x + [d, 0]) - at(solved.x - [d, 0])) / (2.0 * d * 2.0 * math.pi * f)
        R_E = (at(solved.x + [0, d]) - at(solved.x - [0, d])) / (2.0 * d * e)
        found.append(Cycle(f, e, bool((R_E / R_w).imag < 0)))
    return sorted(found, key=lambda x: (not x.lasting, x.f_hz))


def _turns(x: np.ndarray) -> np.ndarray:
    """Cells (F - 1, E - 1) whose corners have both signs."""
    corners = np.stack([x[:-1, :-1], x[1:, :-1], x[:-1, 1:], x[1:, 1:]])
    return (corners.min(axis=0) < 0) & (corners.max(axis=0) > 0)


def simulated(
    controller: Controller, plant: Sampled, effects, terminal, centre: float, kick: float, duration: float
) -> tuple[Cycle | None, np.ndarray]:
    """The cycle that a loop keeps after being let go at centre + kick [rad]; None where it comes to rest, and the angle
    (N,) about the centre.

    The plant stands at centre + kick; its drive's effects are in ``terminal``, its sensor's in ``effects``.
    """
    t = controller.h * np.arange(round(duration / controller.h))
    still = np.zeros(t.size)
    controller.reset(centre + kick)
    run = close(controller, plant, Sensor(effects, t), Reference("hold", t, still + centre, still, still), terminal)
    return lasting(run.theta - centre, controller.h), run.theta - centre


def lasting(theta: np.ndarray, h: float) -> Cycle | None:
    """The oscillation (N,) [rad], sampled at h [s], that is still there at the end; None where it dies out, grows out
    of bounds or never is: where it keeps less than 0.9 of its size from one quarter of the time to the next, or its
    amplitude is below 0.01 degrees.
    """
    quarter = theta.size // 4
    before, last = theta[-2 * quarter : -quarter], theta[-quarter:]
    if not np.isfinite(theta).all():
        return None
    last, before = last - last.mean(), before - before.mean()
    up = np.flatnonzero((last[:-1] < 0) & (last[1:] >= 0))
    amplitude = 0.5 * float(np.ptp(last))
    if up.size < 4 or amplitude < math.radians(0.01) or last.std() < 0.9 * before.std():
        return None
    crossing = up - last[up] / (last[up + 1] - last[up])
    return Cycle(float((up.size - 1) / (h * (crossing[-1] - crossing[0]))), amplitude)
