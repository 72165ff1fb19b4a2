"""Torque by which the motor's magnets hold its iron teeth."""

import math

import numpy as np

from ers_mj.effects.base import Drive, Parameter, law

ORDERS = (2, *range(3, 41, 2))  # periods within the whole travel from which a fit is begun; in the half where most time is spent, one apart


class Cogging(Drive):
    """theta'' += A sin(2 pi theta / period + phase) / J, with or without current; n periods at the motor are n times as wide."""

    name = "cogging"
    sentence = "the motor cogs: a torque of amplitude {A} at the rudder that returns every {period} of its angle"
    mjcf = "a passive dcmotor on the rudder's angle, its cogging of one pole behind a gear of 2 pi / period"
    parameters = (
        Parameter("A", "torque", "amplitude, seen at the output", positive=False),
        Parameter("period", "position", "period, seen at the output"),
        Parameter("phase", "phase", "phase of the sine at angle zero", positive=False),
    )
    sized, tries = 1, 3
    wave = (0, 2)

    def starts(self, scales):
        travel = scales.high - scales.low
        return [np.array([0.2 * scales.acceleration, travel / order, 0.0]) for order in ORDERS]

    def constants(self, p, c):
        return np.array([p[0], 2 * np.pi / p[1], p[2]])

    @law
    def torque(p, theta, w, j, t):
        return p[0] * math.sin(p[1] * theta + p[2])

    def edit_spec(self, p, c, twin):
        import mujoco

        magnets = twin.spec.add_actuator(name="cogging", trntype=mujoco.mjtTrn.mjTRN_TENDON, target="rudder_angle")
        magnets.set_to_dcmotor(motorconst=[0.0, 0.0], resistance=1.0, cogging=[twin.inertia * p[0] / p[1], 1.0, p[2]],
                               ctrlspec=int(mujoco.mjtCtrlInput.mjINPUT_NONE))
        magnets.gear[0] = p[1]
        return True
