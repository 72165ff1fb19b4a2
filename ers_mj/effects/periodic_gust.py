"""A load that swings by itself."""

import math

import numpy as np

from ers_mj.effects.base import Load, Parameter, law

CYCLES = range(3, 41)  # within the longest recording, from which a fit is begun: a sine fits within one cycle only


class PeriodicGust(Load):
    """theta'' += A sin(x) / J, x = 2 pi f t + phase, t from the zero of the recording's own clock: gusts, waves,
    another machine. Or A (sin(x) + third sin(3 x)), flat at its top or pointed; or one that swells, A (1 + swell sin(2
    pi f_s t + phase_s)) sin(x).
    """

    name = "periodic_gust"
    sentence = "a load of amplitude {A} swings at {f}, whatever the drive does"
    mjcf = "none: the ctrl of the load actuator is set step by step from the clock"
    apart = "returns with the clock whatever the rudder does; cogging and ripple return with the angle"
    parameters = (
        Parameter("A", "torque", "amplitude", positive=False),
        Parameter("f", "frequency", "frequency"),
        Parameter(
            "phase",
            "phase",
            "phase of the sine at time zero, another in every recording",
            positive=False,
            per_record=True,
        ),
        Parameter(
            "third", "ratio", "third harmonic over the first", positive=False, lower=-0.5, upper=0.5, absent=np.inf
        ),
        Parameter(
            "swell", "ratio", "by how much its amplitude swells", positive=False, lower=-1.0, upper=1.0, absent=np.inf
        ),
        Parameter("f_s", "frequency", "frequency of the swell", lower=0.02, absent=np.inf),
        Parameter("phase_s", "phase", "phase of the swell at time zero", positive=False, absent=np.inf),
    )
    needs, together = (("A",),), (("swell", "f_s", "phase_s"),)
    sized, tries = 1, 3
    wave = ((0,), 2)

    def starts(self, scales):
        return [
            np.array([0.2 * scales.acceleration, cycles / scales.duration, 0.0, *[np.inf] * 4]) for cycles in CYCLES
        ]

    def grown(self, name, p, scales):
        """From a plain sine: with a third harmonic, or with a swell."""
        if name != self.name or np.isfinite(p[3:]).any():
            return []
        swells = [
            np.array([*p[:3], np.inf, 0.2, cycles / scales.duration, phase])
            for cycles in (1.0, 2.0, 3.0)
            for phase in (0.0, 0.5 * np.pi)
        ]
        # a tenth of it in the third harmonic
        return [np.array([*p[:3], 0.1, np.inf, np.inf, np.inf]), *swells]

    def constants(self, p, c):
        swell, f_s, phase_s = p[4:] if np.isfinite(p[4]) else (0.0, 0.0, 0.0)
        return np.array(
            [p[0], 2 * np.pi * p[1], p[2], p[3] if np.isfinite(p[3]) else 0.0, swell, 2 * np.pi * f_s, phase_s]
        )

    @law
    def torque(p, theta, w, j, t):
        x = p[1] * t + p[2]
        wave = math.sin(x)
        if p[3] != 0.0:
            wave += p[3] * math.sin(3.0 * x)
        if p[4] != 0.0:
            wave *= 1.0 + p[4] * math.sin(p[5] * t + p[6])
        return p[0] * wave

    def describe(self, values):
        third = "" if values["third"] == "none" else f" with a third harmonic of {values['third']}"
        return (
            super().describe(values)
            + third
            + ("" if values["swell"] == "none" else f", and swells by {values['swell']} at {values['f_s']}")
        )
