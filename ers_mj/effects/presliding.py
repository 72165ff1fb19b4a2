"""Friction that gives like a spring before it slips."""

import math

import numpy as np

from ers_mj.effects.base import Friction, Parameter

DAMPED, FADING = (
    0.5,
    0.1,
)  # damping ratio, and the share of the recordings' speed at which it fades, with which the search begins


class Presliding(Friction):
    """LuGre's bristle z without its Stribeck: friction k z + d(w) z', z' = w - |w| k z / F, tends to the level F after
    a few x_s of motion.

    Dahl's bristle (1968) bends with z' = w |1 - x|^delta sgn(1 - x), x = k z sgn(w) / F, which is the above where delta
    = 1.

    k = F_c / x_s (LuGre's sigma_0), d = 2 zeta sqrt(k J) exp(-(w / w_d)^2): damping that fades with speed (Olsson,
    Astrom, Canudas de Wit, Gafvert and Lischinsky 1998), without which the bristle resists the slip it should let go
    of. Small zeta is Dahl's friction. The level F is what the other laws make of F_c. Beside a play or a shaft it is
    the rudder's share of the friction that bends.
    """

    name = "presliding"
    sentence = "friction gives like a spring before it slips: its level over its stiffness is {x_s}"
    mjcf = "LuGre friction of a dcmotor without torque on the absolute angle (lugre), in place of frictionloss"
    parameters = (
        Parameter("x_s", "position", "level of friction over its stiffness at rest"),
        Parameter(
            "zeta", "ratio", "damping ratio of that spring against the inertia", lower=0.005, upper=2.0, absent=0.2
        ),
        Parameter(
            "w_d", "speed", "speed at which the damping has fallen to 1/e (infinite: it does not)", absent=math.inf
        ),
        Parameter(
            "delta",
            "ratio",
            "exponent with which it lets go (Dahl; infinite: 1)",
            lower=0.5,
            upper=3.0,
            absent=math.inf,
        ),
    )
    tries, dear, step, tangible = 2, True, 0.01, False
    in_loop = ("creep",)
    loop_sentence = "friction creeps below its level, like a damper of {value}"

    def starts(self, scales):
        least, most = 2 * scales.noise, 0.05 * scales.position
        return [
            np.array([x_s, DAMPED, w_d, math.inf])
            for x_s in np.geomspace(most, least, 4)
            for w_d in (FADING * scales.speed, math.inf)
        ]

    def grown(self, name, p, scales):
        """One of another exponent, without damping or with it, from one of exponent 1; and one whose damping fades,
        where that of p does not: begun with a bristle much too stiff, as which it shows first, it may have lost its
        damping on the way."""
        if name != self.name or np.isfinite(p[3]):
            return []
        fading = (
            [np.array([p[0], DAMPED, FADING * scales.speed, math.inf])] if p[2] > 10.0 * FADING * scales.speed else []
        )
        return fading + [np.array([p[0], zeta, math.inf, 1.4]) for zeta in (0.02, p[1])]

    def coefficients(self, p, c):
        level = 0.5 * (c.c_2_plus + c.c_2_minus)
        # against J such a bristle swings at 2 kHz: 4e-5 deg of displacement in Table 1 are as good as rigid
        if p[0] <= 0 or level <= 0 or level > (2 * np.pi * 2000.0) ** 2 * p[0]:
            return c
        k = level / p[0]
        c = c._replace(
            k_bristle=k, d_bristle=2 * p[1] * math.sqrt(k), fade=p[2], dahl=p[3] if np.isfinite(p[3]) else 1.0
        )
        return c if c.has_motor_side else c._replace(two_body=1.0, rho=0.0, beta=0.0, phi=1.0)
