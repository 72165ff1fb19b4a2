"""Torque by which the motor's magnets hold its iron teeth."""

import math

import numpy as np

from ers_mj.effects.base import RETURNS, Drive, Parameter, law

ORDERS = (1, 1.4, 2, *range(3, 41))  # periods within the whole travel from which a fit is begun; one apart


class Cogging(Drive):
    """theta'' += A (sin x + second sin(2 x + phase_2)) / J, x = 2 pi theta / period + phase, with or without current; n
    periods at the motor are n times as wide. The second harmonic is absent where it is infinite.
    """

    name = "cogging"
    sentence = "the motor cogs: a torque of amplitude {A} at the rudder that returns every {period} of its angle"
    mjcf = (
        "a passive dcmotor on the rudder's angle, or the motor's where that is a body of its own, its cogging of one"
        " pole behind a gear of 2 pi / period, and another for the second harmonic"
    )
    apart = (
        "returns with the angle with or without current, faster than a gear's ripple; a periodic_gust returns "
        "with the clock"
    )
    parameters = (
        Parameter("A", "torque", "amplitude, seen at the output", positive=False),
        Parameter("period", "position", "period, seen at the output"),
        Parameter("phase", "phase", "phase of the sine at angle zero", positive=False),
        Parameter(
            "second", "ratio", "second harmonic over the first", positive=False, lower=-2.0, upper=2.0, absent=np.inf
        ),
        Parameter("phase_2", "phase", "phase of the second harmonic against the first", positive=False, absent=np.inf),
    )
    needs, together = (("A",),), (("second", "phase_2"),)
    sized, tries, fewest_turns = 1, 3, RETURNS
    wave = ((0,), 2)

    def starts(self, scales):
        travel = scales.high - scales.low
        periods = [*(travel / order for order in ORDERS), *scales.finer_waves("torque", ORDERS[-1])]
        return [
            np.array([0.2 * scales.acceleration, period, 0.0, np.inf, np.inf])
            for period in periods
            if period <= scales.cog
        ]

    def grown(self, name, p, scales):
        """From a plain sine: with a second harmonic."""
        return (
            [np.array([*p[:3], 0.1, phase]) for phase in (0.0, 0.5 * np.pi)]
            if name == self.name and not np.isfinite(p[3])
            else []
        )

    def constants(self, p, c):
        return np.array([p[0], 2 * np.pi / p[1], p[2], *(p[3:] if np.isfinite(p[3]) else (0.0, 0.0))])

    @law
    def torque(p, theta, w, j, t):
        x = p[1] * theta + p[2]
        cog = math.sin(x)
        if p[3] != 0.0:
            cog += p[3] * math.sin(2.0 * x + p[4])
        return p[0] * cog

    def edit_spec(self, p, c, twin):
        import mujoco

        waves = [(p[0], p[1], p[2])] + ([(p[0] * p[3], 2.0 * p[1], 2.0 * p[2] + p[4])] if p[3] != 0.0 else [])
        parted = any(joint.name == "gap" for joint in twin.spec.joints)
        place = (mujoco.mjtTrn.mjTRN_JOINT, "rocker") if parted else (mujoco.mjtTrn.mjTRN_TENDON, "rudder_angle")
        for k, (amplitude, rate, phase) in enumerate(waves):
            magnets = twin.spec.add_actuator(name=("cogging", "cogging_2")[k], trntype=place[0], target=place[1])
            magnets.set_to_dcmotor(
                motorconst=[0.0, 0.0],
                resistance=1.0,
                cogging=[twin.inertia * amplitude / rate, 1.0, phase],
                ctrlspec=int(mujoco.mjtCtrlInput.mjINPUT_NONE),
            )
            magnets.gear[0] = rate
        return True
