"""Friction that gives like a spring before it slips."""

import math

import numpy as np

from ers_mj.effects.base import Friction, Parameter, law

DAMPED, FADING = (
    0.5,
    0.1,
)  # damping ratio, and the share of the recordings' speed at which it fades, with which the search begins


SOFT = 1.0 / 947.0, 0.0106  # [s, s] v_c over the level and T_c of MuJoCo's frictionloss, at its defaults
FASTEST_CREEP = 5e3  # [1/s] rate of friction that creeps, beyond which it is as good as dry: 0.2 ms


class Presliding(Friction):
    """LuGre's bristle z without its Stribeck: friction k z + d(w) z', z' = w - |w| k z / F, tends to the level F after
    a few x_s of motion.

    Or one that holds nothing but creeps: within the level, friction is what slows the output to a speed of v_c times
    the share of the level that pulls, with the time constant T_c: f = (1 - v_c / (F T_c)) a + w / T_c of the pull a.
    MuJoCo's frictionloss is that, at its defaults with v_c = F / (947 J) and T_c = 10.6 ms (d = 0.9, b = 2 / (0.95 x
    0.02 s)); grease, where T_c is absent, is plain damping F w / v_c.

    Dahl's bristle (1968) bends with z' = w |1 - x|^delta sgn(1 - x), x = k z sgn(w) / F, which is the above where delta
    = 1.

    k = F_c / x_s (LuGre's sigma_0), d = 2 zeta sqrt(k J) exp(-(w / w_d)^2): damping that fades with speed (Olsson,
    Astrom, Canudas de Wit, Gafvert and Lischinsky 1998), without which the bristle resists the slip it should let go
    of. Small zeta is Dahl's friction. The level F is what the other laws make of F_c. Beside a play or a shaft it is
    the rudder's share of the friction that bends.
    """

    name = "presliding"
    sentence = "friction gives like a spring before it slips: its level over its stiffness is {x_s}"
    mjcf = (
        "LuGre friction of a dcmotor without torque on the absolute angle (lugre), in place of frictionloss; one that"
        " creeps is set step by step from the speed"
    )
    apart = (
        "the rudder gives and springs back within the stuck phase, where stribeck and Coulomb friction hold it still"
    )
    parameters = (
        Parameter("x_s", "position", "level of friction over its stiffness at rest", absent=math.inf),
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
        Parameter("v_c", "speed", "speed at which one that creeps reaches its level", absent=math.inf),
        Parameter("T_c", "time", "time constant of the creep", lower=1.0 / FASTEST_CREEP, upper=0.1, absent=math.inf),
    )
    needs = (("x_s", "v_c"),)
    tries, dear, step, tangible = 2, True, 0.01, False
    in_loop = ("creep",)
    loop_sentence = "friction creeps below its level, like a damper of {value}"

    def beside(self, given):
        out = self.absent()
        if "x_s" not in given:  # what creeps has no bristle to damp
            out[1] = math.inf
        return out

    def starts(self, scales):
        least, most = 2 * scales.noise, 0.05 * scales.position
        bristles = [
            np.array([x_s, DAMPED, w_d, *3 * [math.inf]])
            for x_s in np.geomspace(most, least, 4)
            for w_d in (FADING * scales.speed, math.inf)
        ]
        creeps = [(SOFT[0] * scales.acceleration, SOFT[1]), (FADING * scales.speed, math.inf)]
        return [*bristles, *(np.array([*4 * [math.inf], *creep]) for creep in creeps)]

    def grown(self, name, p, scales):
        """One of another exponent, without damping or with it, from one of exponent 1; and one whose damping fades,
        where that of p does not: begun with a bristle much too stiff, as which it shows first, it may have lost its
        damping on the way."""
        if name != self.name or np.isfinite(p[3]) or not np.isfinite(p[0]):
            return []
        fading = (
            [np.array([p[0], DAMPED, FADING * scales.speed, *3 * [math.inf]])]
            if p[2] > 10.0 * FADING * scales.speed
            else []
        )
        return fading + [np.array([p[0], zeta, math.inf, 1.4, math.inf, math.inf]) for zeta in (0.02, p[1])]

    def coefficients(self, p, c):
        level = 0.5 * (c.c_2_plus + c.c_2_minus)
        if not np.isfinite(p[0]):
            return c._replace(creep=self._creep(p, level))
        # against J such a bristle swings at 2 kHz: 4e-5 deg of displacement in Table 1 are as good as rigid
        if p[0] <= 0 or level <= 0 or level > (2 * np.pi * 2000.0) ** 2 * p[0]:
            return c
        k = level / p[0]
        c = c._replace(
            k_bristle=k, d_bristle=2 * p[1] * math.sqrt(k), fade=p[2], dahl=p[3] if np.isfinite(p[3]) else 1.0
        )
        return c if c.has_motor_side else c._replace(two_body=1.0, rho=0.0, beta=0.0, phi=1.0)

    @staticmethod
    def _creep(p, level):
        """Rate [1/s] at which friction that creeps slows the output; 0 where it is as good as dry."""
        if not (0.0 < p[4] < math.inf and level > 0.0):
            return 0.0
        rate = max(1.0 / p[5], 0.0) if 0.0 < p[5] < math.inf else level / p[4]
        return min(rate, level / p[4]) if level / p[4] <= FASTEST_CREEP else 0.0

    def is_lawful(self, p):
        return not np.isfinite(p[0]) and np.isfinite(p[4])

    def constants(self, p, c):
        if c.creep <= 0.0:
            return np.zeros(1)
        pull = c.bias + c.a_1 * c.theta_0, c.a_1, c.c_1, c.theta_0, c.g_s, c.g_c
        return np.array([c.creep, p[4] * c.creep, c.a_mech_plus, *pull])

    @law
    def friction(p, level, theta, w, j, direction):
        if p[0] <= 0.0 or level <= 0.0:
            return level
        pull = j - p[2] * w + p[3] - p[4] * theta - p[7] * math.sin(theta) - p[8] * math.cos(theta)
        if p[5] > 0.0:
            pull -= math.copysign(p[5], theta - p[6])
        slows = (1.0 - min(p[1] / level, 1.0)) * pull + p[0] * w
        return direction * min(max(slows, -level), level)

    def edit_spec(self, p, c, twin):
        return c.creep == 0.0

    def describe(self, values):
        if values["x_s"] == "none":
            return f"friction creeps before it holds: it grows with the speed, up to its level at {values['v_c']}"
        return super().describe(values)
