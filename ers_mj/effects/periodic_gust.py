"""A load that swings by itself."""

import math

import numpy as np

from ers_mj.effects.base import Load, Parameter, law

CYCLES = range(3, 41)  # within the longest recording, from which a fit is begun: a sine fits within one cycle only


class PeriodicGust(Load):
    """theta'' += A sin(2 pi f t + phase) / J, t from the zero of the recording's own clock: gusts, waves, another machine."""

    name = "periodic_gust"
    sentence = "a load of amplitude {A} swings at {f}, whatever the drive does"
    mjcf = "none: the ctrl of the load actuator is set step by step from the clock"
    parameters = (
        Parameter("A", "torque", "amplitude", positive=False),
        Parameter("f", "frequency", "frequency"),
        Parameter("phase", "phase", "phase of the sine at time zero, another in every recording", positive=False, per_record=True),
    )
    needs = (("A",),)
    sized, tries = 1, 3
    wave = ((0,), 2)

    def starts(self, scales):
        return [np.array([0.2 * scales.acceleration, cycles / scales.duration, 0.0]) for cycles in CYCLES]

    def constants(self, p, c):
        return np.array([p[0], 2 * np.pi * p[1], p[2]])

    @law
    def torque(p, theta, w, j, t):
        return p[0] * math.sin(p[1] * t + p[2])
