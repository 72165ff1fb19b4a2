"""Named inputs: voltages that move Table 1's rudder through stick and slip, and keep it within +-60 deg of theta_0.

Each is a function of time alone, u(t) [V] of t (N,) [s] from 0, deterministic, and repeats after DURATION.
"""

from collections.abc import Callable, Mapping

import numpy as np

DURATION = 10.0  # [s]
RATE_HZ = 1000.0  # sample rate where none is asked for


def multisine(t: np.ndarray) -> np.ndarray:
    """Twenty sines between 0.5 and 40 Hz, log-spaced on the 0.1 Hz grid, phases from a fixed seed."""
    f_hz = np.round(np.geomspace(0.5, 40.0, 20) * DURATION) / DURATION
    phase = np.random.default_rng(2020).uniform(0, 2 * np.pi, f_hz.size)
    return np.sin(2 * np.pi * np.multiply.outer(t, f_hz) + phase).sum(axis=-1)


def chirp(t: np.ndarray) -> np.ndarray:
    """1 to 20 Hz, linear in time; the amplitude grows from 5 to 12 V, so that the rudder still slips at 20 Hz."""
    s = np.mod(t, DURATION)
    phase = 2 * np.pi * (s + 0.5 * 19.0 / DURATION * s**2)
    return (5.0 + 7.0 * s / DURATION) * np.sin(phase)


def ramp(t: np.ndarray) -> np.ndarray:
    """A slow triangle of +-3.8 V and 5 s: breakaway, creep and return, both ways."""
    return 3.8 * _triangle(t / 5.0)


def steps(t: np.ndarray) -> np.ndarray:
    """Steps of 0.25 s to changing levels, rests and reversals between them."""
    levels = np.array([0, 4, 0, -4, 0, 6, 0, -5, 2, 0, -4, 0, 5, 2, 0, -6, 3, 0, 4, -4])
    return levels[np.floor(np.mod(t, 5.0) / 0.25).astype(int)].astype(float)


def square(t: np.ndarray) -> np.ndarray:
    """+4.5 V and -4.5 V for 0.3 s each, 0.7 s of rest after either, in which the preload brings the rudder home to
    stick.
    """
    s = np.mod(t, 2.0)
    return 4.5 * ((s < 0.3).astype(float) - ((s >= 1.0) & (s < 1.3)))


def _triangle(turns: np.ndarray) -> np.ndarray:
    """A triangle wave of amplitude 1 and period 1 that begins at 0 and rises."""
    return 2 / np.pi * np.arcsin(np.sin(2 * np.pi * turns))


INPUTS: Mapping[str, Callable[[np.ndarray], np.ndarray]] = {
    "multisine": multisine,
    "chirp": chirp,
    "ramp": ramp,
    "steps": steps,
    "square": square,
}
