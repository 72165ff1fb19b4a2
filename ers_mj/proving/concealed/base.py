"""What every concealed effect is, and what several of them draw or share.

Forms differ on purpose from one case to the next, and from the textbook form, so that a library is not proven on its
own formulas. `context` describes the servo and its effect-free records: params, peak_V, peak_A, travel (rad about
theta_0), records, durations; of other plants than the rudder also stiffness and turns,
by how much their contacts are stiffer and their teeth finer.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

CONTACT = ("spring and damper", "Hunt-Crossley")


RIGID = "rigid limit"
"""Of MuJoCo; the quick simulator takes a spring and damper."""


@dataclass(frozen=True)
class Effect:
    """One effect: the meaning and plausible range of its strength, how its shape is drawn, how both are set."""

    name: str
    strength_name: str
    low: float
    high: float
    draw: Callable
    put: Callable
    listed: bool = True


# -- draws ----------------------------------------------------------------------------------------------------


def choose(rng, *options):
    """One of the options, each as likely."""
    return options[rng.integers(len(options))]


def sign(rng):
    """+1 or -1."""
    return float(rng.choice([-1.0, 1.0]))


def between(rng, low, high):
    """Log-uniform in [low, high]."""
    return float(np.exp(rng.uniform(np.log(low), np.log(high))))


def angle(rng):
    """A phase [rad]."""
    return float(rng.uniform(0.0, 2.0 * np.pi))


def spells(rng, samples, dt, rate, mean_s):
    """(samples,) true in spells that begin `rate` times a second and last mean_s [s] on average."""
    inside = np.zeros(samples, bool)
    starts = np.flatnonzero(rng.random(samples) < rate * dt)
    stretch = rng.exponential(1.0, starts.size)
    for start, long in zip(starts, stretch):
        inside[start : start + max(1, int(round(long * mean_s / dt)))] = True
    return inside


# -- what is written into the record of the laws --------------------------------------------------------------


def index(options, form):
    """Place of a form's name among the options, as the number the compiled code branches on."""
    return float(options.index(form))


def put_in_samples(p, s, shape, record):
    """Acts on the samples: see `samples_of`."""
