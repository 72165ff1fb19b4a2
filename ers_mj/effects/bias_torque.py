"""A constant torque on the rudder."""

import numpy as np

from ers_mj.effects.base import Load, Parameter


class BiasTorque(Load):
    """theta'' += tau_0 / J. In stick and slip it equals a Coulomb friction that differs between directions."""

    name = "bias_torque"
    sentence = "a constant torque of {tau_0} pushes the rudder to one side"
    mjcf = "an actuator of constant force on the rudder"
    apart = (
        "one constant torque; gravity changes along the travel, asymmetric_friction turns with the direction "
        "(over Coulomb friction alone the two cannot be told apart)"
    )
    parameters = (Parameter("tau_0", "torque", "constant torque, positive towards growing angle", positive=False),)
    sized = 1

    def starts(self, scales):
        return [np.array([0.1 * scales.acceleration])]

    def coefficients(self, p, c):
        return c._replace(bias=c.bias + p[0])
