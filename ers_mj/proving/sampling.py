"""From the servo's motion to the samples of a recording: sensor, converter, controller, and what is asked of them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numba import njit

from ers_mj.proving.catalogue import samples_of
from ers_mj.proving.plant import CONTROLLER, CUR, LAG, TH, W


@dataclass(frozen=True, eq=False)
class Setup:
    """What stands around a servo while it is recorded.

    Attributes:
        number: of the recording within its case, from 0.
        noise: (samples,) [rad], added to the angle; or None.
        adc_step: of the ordinary converter [rad], 0 where there is none.
        controller: gains by the names CONTROLLER, following ``theta_ref`` (samples,) [rad]; None of an open loop.
        decimals: of the applied voltage; None: not rounded.
    """

    number: int = 0
    noise: np.ndarray | None = None
    adc_step: float = 0.0
    controller: Mapping[str, float] | None = None
    theta_ref: np.ndarray | None = None
    decimals: int | None = None

    @staticmethod
    def of(servo: Mapping, number: int) -> Setup:
        """That of one of a drawn servo's records: closed loops close around the noisy measured angle."""
        record = servo["records"][number]
        return Setup(
            number,
            record["noise"],
            servo["sensor"]["adc_step_rad"],
            servo["controller"] if record["closed_loop"] else None,
            record["ref"],
            4,
        )

    def given(self, effects: Sequence[Mapping], u: np.ndarray | None, samples: int, dt: float) -> Given:
        """What the compiled sampling reads, ``u`` [V] where the loop is open."""
        stuck, spike, gain = samples_of(effects, self.number, samples, dt)
        closed, controller = self.controller is not None, self.controller or {}
        return Given(
            u=np.zeros(samples) if closed else np.asarray(u, float),
            target=np.asarray(self.theta_ref, float) if closed else np.zeros(samples),
            gains=np.array([controller.get(name, 0.0) for name in CONTROLLER]) if closed else np.zeros(len(CONTROLLER)),
            closed=closed,
            noise=np.zeros(samples) if self.noise is None else np.asarray(self.noise, float),
            stuck=stuck,
            spike=spike,
            gain=gain,
            dt=dt,
            printed=0.0 if self.decimals is None else 10.0**self.decimals,
        )


ALONE = Setup()  # an open loop, its sensor without noise


class Given(NamedTuple):
    """What a recording is made from, (samples,) each but the controller's gains, dt [s] and 10^decimals of the
    voltage.
    """

    u: np.ndarray
    target: np.ndarray
    gains: np.ndarray
    closed: bool
    noise: np.ndarray
    stuck: np.ndarray
    spike: np.ndarray
    gain: np.ndarray
    dt: float
    printed: float


class Run(NamedTuple):
    """One simulated recording, (samples,) each; `theta` [rad] is measured, `clean` lacks noise and ordinary converter,
    `omega` [rad/s] is the true speed.
    """

    theta: np.ndarray
    clean: np.ndarray
    true: np.ndarray
    u: np.ndarray
    i_A: np.ndarray
    omega: np.ndarray


@njit(cache=True)
def bend(p, x):
    """[rad] error of the sensor at x = theta - theta_0: 1 square, 2 sine, 3 loaded potentiometer."""
    s = x / p.nl_P
    if p.nl_form == 1.0:
        return p.nl_a * s * s
    if p.nl_form == 2.0:
        return p.nl_a * (np.sin(2.0 * np.pi * s + p.nl_ph) - np.sin(p.nl_ph))
    if p.nl_form == 3.0:
        return p.nl_a * 2.6 * s * (1.0 - s * s) / (1.0 + 0.5 * s * s)
    return 0.0


@njit(cache=True)
def quantise(p, x):
    """[rad] 0 to the nearest step, 1 downwards, 2 to the middle of a step."""
    if p.q_step <= 0.0:
        return x
    if p.q_form == 1.0:
        return np.floor(x / p.q_step) * p.q_step
    if p.q_form == 2.0:
        return (np.floor(x / p.q_step) + 0.5) * p.q_step
    return np.round(x / p.q_step) * p.q_step


@njit(cache=True)
def sensed(p, y, ring, step, late):
    """[rad] angle behind lag and bend: lag_form 1 first order, 2 pure delay, 3 mean over a window."""
    angle = y[TH]
    if p.lag_form == 1.0:
        angle = y[LAG]
    elif p.lag_form == 2.0:
        angle = ring[(step - late) % ring.size]
    elif p.lag_form == 3.0:
        angle = ring.mean()
    return angle + bend(p, angle - p.theta_0)


@njit(cache=True)
def pid(c, memory, target, angle, dt):
    """[V] PID with filtered derivative, held integral at the limit, optional feed-forward; memory = (integral, slope,
    last).
    """
    error = target - angle
    lead = -angle if c[10] > 0.0 else error
    memory[1] = (c[3] * memory[1] + c[2] * (lead - memory[2])) / (c[3] + dt)
    memory[2] = lead
    x = target - c[9]
    u = c[0] * error + memory[0] + memory[1] + c[5] * c[6] * (c[8] * x + c[7] * np.tanh(x / 0.01))
    if abs(u) < c[4] or u * error < 0.0:
        memory[0] += c[1] * dt * error
    return min(max(u, -c[4]), c[4])


@njit(cache=True)
def take(p, y, k, out, ring, step, late, given, memory):
    """Write sample k into out (6, samples): measured, clean, true angle, the u [V] from now on, current, speed."""
    clean = sensed(p, y, ring, step, late)
    held = out[0, k - 1] if k > 0 else clean
    held_clean = out[1, k - 1] if k > 0 else clean
    stuck, spike = given.stuck[k], given.spike[k]
    out[1, k] = held_clean if stuck else quantise(p, clean + spike)
    raw = quantise(p, clean + spike + given.noise[k])
    raw = np.round(raw / p.adc_step) * p.adc_step if p.adc_step > 0.0 else raw
    out[0, k], out[2, k], out[4, k], out[5, k] = (held if stuck else raw), y[TH], y[CUR], y[W]
    if k == 0:
        memory[2] = (0.0 if given.gains[10] > 0.0 else given.target[0]) - out[0, 0]
    u = pid(given.gains, memory, given.target[k], out[0, k], given.dt) if given.closed else given.u[k]
    printed = given.printed
    out[3, k] = np.round(u * printed) / printed + 0.0 if printed > 0.0 else u
