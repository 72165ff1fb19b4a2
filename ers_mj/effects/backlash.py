"""Play between the motor's side and the rudder."""

import numpy as np

from ers_mj.effects.base import Parameter, Transmission
from ers_mj.effects.quantities import coupled


class Backlash(Transmission):
    """Two bodies that touch at +-gap: inside, each moves on its own; at the ends, a stiff spring-damper.

    The motor's side carries the shares rho of the inertia and phi of the friction; the contact's natural frequency
    (against the total inertia) and damping ratio are nuisances of the collision.
    """

    name = "backlash"
    sentence = "the rudder has a play of ±{gap} against its drive"
    mjcf = (
        "the joint gap, its limit a spring-damper (negative solref) that does not pull; the "
        "shares of inertia, damping and friction on the rocker"
    )
    apart = (
        "free travel at each reversal of torque, of a width that does not grow with the load; shaft_compliance "
        "twists in proportion to it"
    )
    parameters = (
        Parameter("gap", "position", "half-width of the play"),
        Parameter("rho", "ratio", "motor side's share of the inertia", lower=0.2, upper=0.9, absent=0.5),
        Parameter(
            "phi", "ratio", "motor side's share of the friction", positive=False, lower=0.0, upper=0.9, absent=0.1
        ),
        Parameter("f_contact", "frequency", "contact's natural frequency", lower=40.0, upper=1000.0, absent=120.0),
        Parameter("zeta", "ratio", "contact's damping ratio", lower=0.001, upper=2.0, absent=0.2),
    )
    tries, tangible, is_play = 3, False, True
    parts_damping = True

    def starts(self, scales):
        contact = min(120.0, 0.5 / scales.sample_time)
        return [np.array([part * scales.position, 0.6, 0.2, contact, 0.2]) for part in (0.003, 0.01, 0.03, 0.1)]

    def grown(self, name, p, scales):
        """A twisting shaft is a contact without play: one as wide as the noise, or a third of that."""
        if name != "shaft_compliance" or p[1] > 0.5:  # damped more, a shaft is no spring
            return []
        f, zeta, rho, phi, _ = p
        return [np.array([part * scales.noise, rho, phi, min(f, 1000.0), max(zeta, 0.05)]) for part in (1.0, 0.3)]

    def seen(self, p, friction):
        """A play that is wider than its contact gives way under the friction, or nearly: concealed shafts look like
        up to 0.36 of it, plays like 0.40 and more.
        """
        return p[0] >= 0.38 * friction / (2.0 * np.pi * p[3]) ** 2

    def really(self, p, friction):
        """A play less wide than its contact gives way under the friction is not seen as one: a shaft, stiffer the more
        it twists.
        """
        return self.name if self.seen(p, friction) else "shaft_compliance"

    def coefficients(self, p, c):
        return coupled(c, f=p[3], zeta=p[4], rho=p[1], phi=p[2], gap=p[0])
