"""The laws of the independent servo: Eq. (1) of the paper with everything that may be concealed in it, compiled.

All on the rudder side of the gear, angles rad, torques N m, voltages V, currents A, times s. Two simulators read these
laws, the quick one (quick.py) and MuJoCo's (mechanism.py, recorder.py); neither shares a line with the package that is
put to the test. `p` is a record of plant.PLANT, `y` (STATES,) the state.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from ers_mj.proving.plant import AGE, APP, APV, BRI, BUS, CUR, FAST, HYS, LAG, MXW, RUN, TEMP, TH, THM, WM, W

# -- drive -----------------------------------------------------------------------------------------------------------


@njit(cache=True)
def dead_zone(p, u):
    """[V] 0 none, 1 u - d sgn u, 2 blanking, 3 the first with a rounded knee."""
    size, d = abs(u), p.dead_V
    if p.dead_form == 1.0:
        size = max(size - d, 0.0)
    elif p.dead_form == 2.0:
        size = 0.0 if size < d else size
    elif p.dead_form == 3.0:
        knee = 0.3 * d
        size = 0.5 * (size - d + np.sqrt((size - d) ** 2 + knee**2)) - 0.5 * (np.sqrt(d**2 + knee**2) - d)
    return np.copysign(size, u)


@njit(cache=True)
def saturate(p, v):
    """[V] hard clip, or v / (1 + |v/V|^p)^(1/p) where sat_p > 0."""
    if p.sat_V <= 0.0:
        return v
    if p.sat_p <= 0.0:
        return min(max(v, -p.sat_V), p.sat_V)
    return v / (1.0 + abs(v / p.sat_V) ** p.sat_p) ** (1.0 / p.sat_p)


@njit(cache=True)
def bus_target(p, v, i):
    """[V] supply behind its source resistance; drawn: 0 the motor's power (the bus takes none back), 1 the motor's
    current.
    """
    if p.sag_form == 1.0:
        return p.sag_V - p.sag_R * abs(i)
    return p.sag_V - p.sag_R * max(v * i / p.sag_V, 0.0)


@njit(cache=True)
def driven_voltage(p, y, u, gain):
    """[V] what the drive puts on the motor when told u, whatever the current."""
    v = saturate(p, dead_zone(p, u)) * gain
    if p.sag_R > 0.0:
        bus = y[BUS] if p.sag_tau > 0.0 else bus_target(p, v, y[CUR])
        v *= bus / p.sag_V
    return v


@njit(cache=True)
def terminal_voltage(p, y, u, gain):
    """[V] what the drive puts on the motor when told u, what it takes back beyond its current's limit included."""
    v = driven_voltage(p, y, u, gain)
    if p.lim_A > 0.0 and p.lim_form == 1.0:
        v -= np.copysign(12.0 * p.R * max(abs(y[CUR]) - p.lim_A, 0.0), y[CUR])
    return v


@njit(cache=True)
def warmth(p, y):
    """[K] winding temperature above the start, slow node plus fast node."""
    return y[TEMP] + y[FAST]


@njit(cache=True)
def ratio(p, x):
    """n(theta)/n at x = theta - theta_0: 0 constant, 1 crank and rod, 2 polynomial."""
    if p.ratio_form == 1.0:
        psi = x + p.ratio_a
        lever = np.cos(psi) / np.sqrt(1.0 - (p.ratio_b * np.sin(psi)) ** 2)
        start = np.cos(p.ratio_a) / np.sqrt(1.0 - (p.ratio_b * np.sin(p.ratio_a)) ** 2)
        return 1.0 + p.ratio_s * (start / lever - 1.0)
    if p.ratio_form == 2.0:
        s = x / 0.35
        return 1.0 + p.ratio_s * (p.ratio_a * s + p.ratio_b * s * s) / (1.0 + 0.2 * s * s)
    return 1.0


@njit(cache=True)
def torque_constant(p, y):
    """[N m/A] K_t at the winding's temperature and current."""
    k = p.K_t * (1.0 - p.th_beta * warmth(p, y))
    return k / (1.0 + (p.kt_sat * y[CUR]) ** 2)


@njit(cache=True)
def opposed(p, y, v):
    """[V] (v with what tachometer and brushes add to it, the motor's back-EMF)."""
    i = y[CUR]
    has_motor = p.two > 0.0 or p.rod > 0.0
    speed = y[WM] if has_motor else y[W]
    angle = y[THM] if has_motor else y[TH]
    emf = p.K_e * (1.0 - p.th_beta * warmth(p, y)) * p.n * ratio(p, y[TH] - p.theta_0) * speed
    if p.tacho_a > 0.0:
        v += p.tacho_a * emf * np.sin(p.n * angle + p.tacho_ph)
    if p.brush_V > 0.0:
        v -= np.copysign(p.brush_V * np.log1p(abs(i) / p.brush_i), i)
    return v, emf


@njit(cache=True)
def settled_current(p, y, u, gain):
    """[A] where the winding has no inductance: L i' = 0; a drive that is told a torque holds its current at u."""
    i = driven_voltage(p, y, u, gain)
    if p.torque == 0.0:
        v, emf = opposed(p, y, i)
        i = (v - emf) / (p.R * (1.0 + p.th_alpha * warmth(p, y)))
    if p.lim_A > 0.0 and abs(i) > p.lim_A:
        i = np.copysign(p.lim_A if p.lim_form == 0.0 else (abs(i) + 12.0 * p.lim_A) / 13.0, i)
    return i


@njit(cache=True)
def current_rate(p, y, u, gain):
    """[A/s] L i' = v - R i - K_e n w - brush drop."""
    i = y[CUR]
    v, emf = opposed(p, y, terminal_voltage(p, y, u, gain))
    resistance = p.R * (1.0 + p.th_alpha * warmth(p, y))
    rate = (v - resistance * i - emf) / (p.L * (1.0 - 0.4 * np.tanh(p.L_sat * i) ** 2))
    if p.lim_A > 0.0 and p.lim_form == 0.0 and abs(i) >= p.lim_A and rate * i > 0.0:
        return 0.0
    return rate


# -- friction --------------------------------------------------------------------------------------------------------


@njit(cache=True)
def stribeck(p, w):
    """Share of the static excess left at speed w: 0 rational, 1 Gaussian, 2 exponential, 3 hyperbolic."""
    x = abs(w) / p.stri_v
    if p.stri_form == 3.0:
        return 1.0 / np.cosh(x)
    if p.stri_form == 1.0:
        return np.exp(-x * x)
    if p.stri_form == 2.0:
        return np.exp(-x)
    return 1.0 / (1.0 + x * x)


@njit(cache=True)
def along_travel(p, x):
    """Relative modulation of friction at x = theta - theta_0: 0 sine, 1 one tight spot, 2 tightening outwards."""
    if p.pos_form == 1.0:
        return np.exp(-(((x - p.pos_ph) * p.pos_k) ** 2))
    if p.pos_form == 2.0:
        return np.tanh(p.pos_k * x * x)
    return np.sin(p.pos_k * x + p.pos_ph)


@njit(cache=True)
def friction_level(p, y, w, direction):
    """[N m] size of the dry friction of the whole train when it moves, or would move, in `direction`."""
    scale = 1.0 + direction * p.asym_c * (1.0 - 0.5 * np.exp(-abs(w) / p.asym_dir) if p.asym_dir > 0.0 else 1.0)
    if p.stri_f != 0.0:
        scale += p.stri_f * stribeck(p, w)
    if p.pos_a != 0.0:
        scale += p.pos_a * along_travel(p, y[TH] - p.theta_0)
    if p.age_a > 0.0:
        scale += p.age_a * np.log1p(y[AGE] / p.age_t0)
    if p.run_a != 0.0:
        scale += p.run_a * (1.0 - np.exp(-y[RUN] / p.run_D))
    level = p.F_c * max(scale, 0.02)
    if p.load_mu > 0.0:
        push = p.n * torque_constant(p, y) * y[CUR]
        if p.load_form == 1.0:
            push = np.sqrt(push * push + 0.05**2) - 0.05
        level += p.load_mu * abs(push)
    return level


@njit(cache=True)
def bristle_rate(p, y, level):
    """[rad/s] z' = w |1 - x|^delta sgn(1 - x), x = sigma_0 z sgn(w)/level: LuGre and Dahl at delta = 1."""
    w = y[W]
    x = p.pre_s0 * y[BRI] * np.sign(w) / level
    return w * np.copysign(abs(1.0 - x) ** p.pre_delta, 1.0 - x)


@njit(cache=True)
def viscous(p, y, w):
    """[N m] drag that grows with speed, per whole train."""
    b = p.B * (1.0 + np.sign(w) * p.asym_v)
    if p.angdamp_a > 0.0:
        b += p.angdamp_a * ((y[TH] - p.theta_0) / p.angdamp_P) ** 2
    return b * w


# -- load ------------------------------------------------------------------------------------------------------------


@njit(cache=True)
def hinge(p, x):
    """[N m] k3 x^3 and what looks like it: 0 cube, 1 6 k3 (x - sin x), 2 k3 x^3/(1 + 2 x^2)."""
    if p.k3_form == 1.0:
        return 6.0 * p.k3 * (x - np.sin(x))
    if p.k3_form == 2.0:
        return p.k3 * x**3 / (1.0 + 2.0 * x * x)
    return p.k3 * x**3


@njit(cache=True)
def stop_torque(p, x, w):
    """[N m] end stops at x = stop_hi and stop_lo, never pulling: 0 (and 2, rigid in MuJoCo) spring and damper, 1
    Hunt-Crossley.
    """
    side, depth = 1.0, x - p.stop_hi
    if depth <= 0.0:
        side, depth = -1.0, p.stop_lo - x
    if depth <= 0.0:
        return 0.0
    damping = p.stop_c * side * w
    if p.stop_form == 1.0:
        damping *= depth / 0.003
    return -side * max(p.stop_k * depth + damping, 0.0)


@njit(cache=True)
def pulse(p, t):
    """[N m] 0 rectangle, 1 half sine, 2 sudden and fading."""
    s = (t - p.dist_t0) / p.dist_d
    if s < 0.0 or (s > 1.0 and p.dist_form != 2.0):
        return 0.0
    if p.dist_form == 1.0:
        return p.dist_T * np.sin(np.pi * s)
    if p.dist_form == 2.0:
        return p.dist_T * np.exp(-3.0 * s)
    return p.dist_T


@njit(cache=True)
def gust(p, t):
    """[N m] 0 sine, 1 with a flat top, 2 with a slow swell."""
    s = np.sin(p.gust_w * t + p.gust_ph)
    if p.gust_form == 1.0:
        return p.gust_T * np.tanh(1.5 * s) / 0.9052
    if p.gust_form == 2.0:
        return p.gust_T * s * (1.0 + 0.3 * np.sin(0.13 * p.gust_w * t))
    return p.gust_T * s


@njit(cache=True)
def load_torque(p, y, t):
    """[N m] all that acts on the rudder but preload, friction and the motor."""
    x, w = y[TH] - p.theta_0, y[W]
    tau = -p.k_s * x + p.bias
    if p.grav != 0.0:
        tau -= p.grav * np.sin(p.grav_k * y[TH] + p.grav_ph)
    if p.k3 != 0.0:
        tau -= hinge(p, x)
    if p.stop_k > 0.0:
        tau += stop_torque(p, x, w)
    if p.dist_T != 0.0:
        tau += pulse(p, t)
    if p.gust_T != 0.0:
        tau += gust(p, t)
    if p.rip_a != 0.0:
        a = p.rip_k * y[TH] + p.rip_ph
        tau += p.rip_a * (np.sin(a) + p.rip_h2 * np.sin(2.0 * a + 1.0))
    if p.quad_c > 0.0:
        tau -= np.copysign(p.quad_c * abs(w) ** p.quad_p, w)
    if p.app_J > 0.0:
        tau += p.app_k * (y[APP] - y[TH]) + p.app_c * (y[APV] - w)
    if p.bw_T > 0.0:
        tau -= p.bw_T * y[HYS]
    if p.mxw_k > 0.0:
        tau -= p.mxw_k * (x - y[MXW])
    return tau


@njit(cache=True)
def motor_torque(p, y):
    """[N m at the rudder] K_t i through the gear, and cogging."""
    tau = p.n * ratio(p, y[TH] - p.theta_0) * torque_constant(p, y) * y[CUR]
    if p.cog_a != 0.0:
        a = p.cog_k * (y[THM] if p.two > 0.0 or p.rod > 0.0 else y[TH]) + p.cog_ph
        tau += p.cog_a * (np.sin(a) + p.cog_h2 * np.sin(2.0 * a + 0.7))
    return tau


@njit(cache=True)
def contact_torque(p, y):
    """[N m] joint between motor and rudder: 0 (and 3, rigid in MuJoCo) spring and damper in a gap, never pulling;
    1 Hunt-Crossley; 2 a shaft of rubber, 4 one whose stiffness rises in stages, as a strain wave gear's."""
    d, speed = y[THM] - y[TH], y[WM] - y[W]
    if p.con_form == 2.0:
        return p.con_k * 0.02 * np.sinh(d / 0.02) + p.con_c * speed
    if p.con_form == 4.0:
        staged = (
            d + 0.6 * (max(d - 0.008, 0.0) + min(d + 0.008, 0.0)) + 0.9 * (max(d - 0.024, 0.0) + min(d + 0.024, 0.0))
        )
        return p.con_k * staged + p.con_c * speed
    if p.gap <= 0.0:
        return p.con_k * d + p.con_c * speed
    side = 1.0 if d > 0.0 else -1.0
    depth = abs(d) - p.gap
    if depth <= 0.0:
        return 0.0
    damping = p.con_c * side * speed
    if p.con_form == 1.0:
        damping *= min(depth / 0.0003, 3.0)
    return side * max(p.con_k * depth + damping, 0.0)


@njit(cache=True)
def free_torques(p, y, t):
    """[N m] on (rudder, motor), dry friction and preload left out; one mass: all on the rudder."""
    tau = load_torque(p, y, t)
    if p.pre_s0 > 0.0:
        level = friction_level(p, y, y[W], np.sign(y[W])) * (1.0 - p.two * p.share_F)
        fade = np.exp(-((y[W] / p.pre_vd) ** 2)) if p.pre_vd > 0.0 else 1.0
        tau -= p.pre_s0 * y[BRI] + p.pre_s1 * fade * bristle_rate(p, y, level)
    if p.two > 0.0:
        joint = contact_torque(p, y)
        on_motor = motor_torque(p, y) - joint - p.share_B * viscous(p, y, y[WM])
        return tau + joint - (1.0 - p.share_B) * viscous(p, y, y[W]), on_motor
    drag = viscous(p, y, y[W])
    if p.ratio_form > 0.0:
        drag *= 1.0 + p.share_B * (ratio(p, y[TH] - p.theta_0) ** 2 - 1.0)
    return tau + motor_torque(p, y) - drag, 0.0


@njit(cache=True)
def inertia(p, x):
    """([kg m2], d/dtheta of it) of the rudder's mass: the motor's share grows with the ratio squared."""
    j = p.J * (1.0 - p.two * p.share_J) - p.app_J
    if p.ratio_form == 0.0:
        return j, 0.0
    r, slope = ratio(p, x), (ratio(p, x + 1e-5) - ratio(p, x - 1e-5)) / 2e-5
    return j + p.J * p.share_J * (r * r - 1.0), 2.0 * p.J * p.share_J * r * slope


# -- the differential inclusion --------------------------------------------------------------------------------------


@njit(cache=True)
def dry(p, y, w, direction, motor):
    """[N m] dry friction of one of the masses; bristles carry the rudder's where there are any."""
    if motor:
        return p.share_F * friction_level(p, y, w, direction)
    if p.pre_s0 > 0.0:
        return 0.0
    return (1.0 - p.two * p.share_F) * friction_level(p, y, w, direction)


@njit(cache=True)
def slow_rates(p, y, u, gain, dy):
    """Rates of the states beside angle, speed and current."""
    w, i = y[W], y[CUR]
    dy[HYS] = w / p.bw_x * (1.0 - 0.5 * (1.0 + np.sign(w * y[HYS])) * abs(y[HYS]) ** p.bw_n) if p.bw_T > 0.0 else 0.0
    if p.app_J > 0.0:
        dy[APP] = y[APV]
        dy[APV] = (p.app_k * (y[TH] - y[APP]) + p.app_c * (w - y[APV])) / p.app_J
    if p.th_R > 0.0:
        heat = p.th_R * p.R * (1.0 + p.th_alpha * warmth(p, y)) * i * i
        dy[TEMP] = ((1.0 - p.th_fast) * heat - y[TEMP]) / p.th_tau
        dy[FAST] = 8.0 * (p.th_fast * heat - y[FAST]) / p.th_tau
    if p.sag_tau > 0.0:
        dy[BUS] = (bus_target(p, saturate(p, dead_zone(p, u)) * gain, i) - y[BUS]) / p.sag_tau
    dy[LAG] = (y[TH] - y[LAG]) / p.lag_s if p.lag_s > 0.0 else 0.0
    dy[MXW] = (y[TH] - p.theta_0 - y[MXW]) / p.mxw_tau if p.mxw_k > 0.0 else 0.0
    dy[AGE] = 1.0 - abs(w) * y[AGE] / p.age_D if p.age_a > 0.0 else 0.0
    dy[RUN] = abs(w)
