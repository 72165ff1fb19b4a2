"""The play that a bare gap stands for, the same on both plants: two bodies, all friction and damping on the rudder's
side.
"""

import math

from ers_mj.effects.quantities import Coefficients

MOTOR_SHARE = 0.64  # of J on the motor's side, where no effect says otherwise: n^2 J_m = 0.00198 of 0.0031 kg m^2
CONTACT_HZ = 2000.0  # of the reduced model's contact, against the total inertia: 0.01 deg RMS from two rigid masses
CONTACT_DAMPING = (
    1.0  # its damping ratio, twice critical for the two bodies against each other: they meet all but without a bounce
)


def rigid_play(c: Coefficients, gap: float) -> Coefficients:
    """c with a play of +-``gap`` [output unit] whose contact has no stiffness of its own: MuJoCo makes it rigid."""
    return c._replace(two_body=1.0, gap=gap, rho=MOTOR_SHARE, beta=0.0, phi=0.0, k_twist=0.0, d_twist=0.0)


def stiff_play(c: Coefficients, gap: float) -> Coefficients:
    """The same for the event-exact model, whose contact is a spring-damper: as stiff as its segments allow."""
    contact = 2 * math.pi * CONTACT_HZ
    return rigid_play(c, gap)._replace(k_twist=contact**2, d_twist=2 * CONTACT_DAMPING * contact)
