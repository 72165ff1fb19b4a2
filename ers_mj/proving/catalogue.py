"""The effects that the independent simulator can hide in a servo: what their strength means, how they are drawn and
set.
 A catalogue entry draws a shape (its functional form and the numbers beside the strength) and writes strength and shape
into the simulator's record. Forms differ on purpose from one case to the next, and from the textbook form, so that a
library is not proven on its own formulas. `context` describes the servo and its effect-free records: params, peak_V,
peak_A, travel (rad about theta_0), records, durations, dt.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ers_mj.proving.laws import DEG


@dataclass(frozen=True)
class Effect:
    """One effect: the meaning and plausible range of its strength, how its shape is drawn, how both are set."""

    name: str
    strength_name: str
    low: float
    high: float
    draw: Callable
    put: Callable
    listed: bool = True


def choose(rng, *options):
    """One of the options, each as likely."""
    return options[rng.integers(len(options))]


def sign(rng):
    """+1 or -1."""
    return float(rng.choice([-1.0, 1.0]))


def between(rng, low, high):
    """Log-uniform in [low, high]."""
    return float(np.exp(rng.uniform(np.log(low), np.log(high))))


def angle(rng):
    """A phase [rad]."""
    return float(rng.uniform(0.0, 2.0 * np.pi))


def index(options, form):
    """Place of a form's name among the options, as the number the compiled code branches on."""
    return float(options.index(form))


# ---- friction
# ---------------------------------------------------------------------------------------------------------

STRIBECK = ("1/(1+(w/v)^2)", "exp(-(w/v)^2)", "exp(-|w|/v)")
HYPERBOLIC = "1/cosh(w/v)"


def draw_stribeck(rng, context):
    """Stribeck speed [rad/s] and the shape of the fall."""
    return {"form": choose(rng, *STRIBECK), "v_stribeck_rad_s": between(rng, 0.08, 0.5)}


def put_stribeck(p, s, shape, record):
    """Strength (Fs - Fc)/Fc."""
    p["stri_f"], p["stri_v"], p["stri_form"] = (
        s,
        shape["v_stribeck_rad_s"],
        index((*STRIBECK, HYPERBOLIC), shape.get("form", STRIBECK[1])),
    )


def draw_presliding(rng, context):
    """LuGre (bristle damping fading with speed or not) or Dahl."""
    form = choose(rng, "LuGre", "LuGre, constant bristle damping", "Dahl")
    shape = {"form": form, "bristle_damping_ratio": 0.0 if form == "Dahl" else float(rng.uniform(0.2, 0.8))}
    return shape | {
        "v_d_rad_s": between(rng, 0.05, 0.3) if form == "LuGre" else 0.0,
        "delta": float(choose(rng, 1.0, 1.5)) if form == "Dahl" else 1.0,
    }


def put_presliding(p, s, shape, record):
    """Strength F_c/sigma_0 [deg]."""
    stiffness = p["F_c"][0] / (s * DEG)
    p["pre_s0"], p["pre_vd"], p["pre_delta"] = stiffness, shape.get("v_d_rad_s", 0.0), shape.get("delta", 1.0)
    p["pre_s1"] = 2.0 * shape["bristle_damping_ratio"] * np.sqrt(stiffness * p["J"][0])


def draw_asymmetric(rng, context):
    """Which way is heavier; viscous friction shares it in half of the cases."""
    return {"sign": sign(rng), "viscous_per_coulomb": float(choose(rng, 0.0, rng.uniform(0.3, 2.0)))}


def put_asymmetric(p, s, shape, record):
    """Strength a in Fc (1 +- a); the viscous asymmetry stands as it is or in proportion to a."""
    viscous = shape["viscous_per_coulomb"] * s if "viscous_per_coulomb" in shape else shape["viscous_asymmetry"]
    p["asym_c"], p["asym_v"] = shape["sign"] * s, shape["sign"] * viscous
    p["asym_dir"] = shape.get("growing_to_rad_s", 0.0)


LOAD = ("motor torque", "motor torque, rounded at zero")


def draw_load(rng, context):
    """Which torque presses."""
    return {"form": choose(rng, *LOAD)}


def put_load(p, s, shape, record):
    """Strength mu in Fc + mu |n Kt i|."""
    p["load_mu"], p["load_form"] = s, index(LOAD, shape.get("form", LOAD[0]))


def draw_quadratic(rng, context):
    """Exponent of the speed."""
    return {"exponent": float(rng.uniform(1.8, 2.2))}


def put_quadratic(p, s, shape, record):
    """Strength c [N m (s/rad)^p] in c |w|^p."""
    p["quad_c"], p["quad_p"] = s, shape.get("exponent", 2.0)


POSITION = ("sin(k x+ph)", "one spot exp(-(k (x-ph))^2)", "outwards tanh(k x^2)")


def draw_position(rng, context):
    """A wave along the travel, one tight or loose spot, or tightening outwards."""
    low, high = context["travel"]
    form = choose(rng, *POSITION)
    k, ph = between(rng, 8.0, 40.0), angle(rng)
    if form == POSITION[1]:
        k, ph = 1.0 / between(rng, 2.0 * DEG, 5.0 * DEG), float(rng.uniform(0.6 * low, 0.6 * high))
    elif form == POSITION[2]:
        k, ph = 1.0 / (0.5 * max(-low, high)) ** 2, 0.0
    return {"form": form, "k": float(k), "ph": ph, "sign": 1.0 if form == POSITION[0] else sign(rng)}


def put_position(p, s, shape, record):
    """Strength: relative modulation of Fc."""
    p["pos_a"], p["pos_k"], p["pos_ph"] = s * shape["sign"], shape["k"], shape["ph"]
    p["pos_form"] = index(POSITION, shape["form"])


# ---- transmission
# -----------------------------------------------------------------------------------------------------

CONTACT = ("spring and damper", "Hunt-Crossley")
SHAFT = ("linear", "sinh", "in stages")
RIGID = "rigid limit"
"""Of MuJoCo; the quick simulator takes a spring and damper."""


def draw_backlash(rng, context):
    """Stiffness and damping of the flanks, share of the dry friction on the motor's side."""
    return {
        "form": choose(rng, *CONTACT),
        "contact_k": between(rng, 1200.0, 3000.0),
        "contact_zeta": float(rng.uniform(0.1, 0.25)),
        "motor_friction_share": float(rng.uniform(0.15, 0.4)),
    }


def split(p, k, zeta, share):
    """Two masses joined by k [N m/rad] and damping ratio zeta."""
    motor = p["share_J"][0] * p["J"][0]
    reduced = motor * (1.0 - p["share_J"][0])
    p["two"], p["con_k"], p["con_c"], p["share_F"] = 1.0, k, 2.0 * zeta * np.sqrt(k * reduced), share


def put_backlash(p, s, shape, record):
    """Strength: total gap at the output [deg]."""
    split(p, shape["contact_k"], shape["contact_zeta"], shape["motor_friction_share"])
    p["gap"], form = 0.5 * s * DEG, shape.get("form", CONTACT[0])
    p["con_form"] = 3.0 if form == RIGID else index(CONTACT, form)


def draw_compliance(rng, context):
    """A linear shaft, or one that gets stiffer."""
    return {
        "form": choose(rng, *SHAFT),
        "zeta": float(rng.uniform(0.03, 0.2)),
        "motor_friction_share": float(rng.uniform(0.15, 0.4)),
    }


def put_compliance(p, s, shape, record):
    """Strength [deg per N m]."""
    split(p, 1.0 / (s * DEG), shape["zeta"], shape["motor_friction_share"])
    p["con_form"] = 2.0 * index(SHAFT, shape.get("form", SHAFT[0]))


def draw_ratio(rng, context):
    """Crank and rod (start angle, crank over rod) or a polynomial along the travel."""
    if rng.random() < 0.5:
        return {
            "form": "crank and rod",
            "psi0_rad": float(rng.uniform(0.2, 0.5)) * sign(rng),
            "lam": float(rng.uniform(-0.4, 0.4)),
        }
    return {
        "form": "polynomial",
        "slope": float(rng.uniform(0.3, 1.0)) * sign(rng),
        "curvature": float(rng.uniform(-0.8, 0.8)),
    }


def put_ratio(p, s, shape, record):
    """Strength: scale of n(theta)/n0 - 1."""
    crank = shape.get("form", "crank and rod") == "crank and rod"
    p["ratio_s"], p["ratio_form"] = s, 1.0 if crank else 2.0
    p["ratio_a"], p["ratio_b"] = (shape["psi0_rad"], shape["lam"]) if crank else (shape["slope"], shape["curvature"])


def draw_ripple(rng, context):
    """Teeth a turn of the output, and a share of the second harmonic in half of the cases."""
    turns = float(choose(rng, 18.0, 22.26, 36.0, rng.uniform(14.0, 60.0)))
    return {
        "cycles_per_output_rev": turns,
        "phase": angle(rng),
        "second_harmonic": float(choose(rng, 0.0, rng.uniform(0.1, 0.3))),
    }


def put_ripple(p, s, shape, record):
    """Strength: amplitude at the output [N m]."""
    p["rip_a"], p["rip_k"], p["rip_ph"] = -s, shape["cycles_per_output_rev"], shape["phase"]
    p["rip_h2"] = shape.get("second_harmonic", 0.0)


# ---- drive
# ------------------------------------------------------------------------------------------------------------


def draw_cogging(rng, context):
    """Poles times slots a turn of the motor."""
    return {
        "cycles_per_motor_rev": int(choose(rng, 4, 6, 8, 12)),
        "phase": angle(rng),
        "second_harmonic": float(choose(rng, 0.0, rng.uniform(0.1, 0.3))),
    }


def put_cogging(p, s, shape, record):
    """Strength: amplitude reflected to the output [N m]."""
    p["cog_a"], p["cog_k"], p["cog_ph"] = -s, shape["cycles_per_motor_rev"] * p["n"][0], shape["phase"]
    p["cog_h2"] = shape.get("second_harmonic", 0.0)


def draw_saturation(rng, context):
    """Hard clip, or soft with exponent p."""
    p = float(choose(rng, 0.0, rng.uniform(6.0, 16.0)))
    return {"form": "soft" if p > 0.0 else "hard", "exponent": p, "command_peak_V": context["peak_V"]}


def put_saturation(p, s, shape, record):
    """Strength: share of the command's peak clipped."""
    p["sat_V"], p["sat_p"] = (1.0 - s) * shape["command_peak_V"], shape.get("exponent", 0.0)


LIMIT = ("clamp", "foldback")


def draw_limit(rng, context):
    """A clamp, or a drive that takes voltage back beyond the limit."""
    return {"form": choose(rng, *LIMIT), "current_peak_A": context["peak_A"]}


def put_limit(p, s, shape, record):
    """Strength: share of the current's peak cut."""
    p["lim_A"], p["lim_form"] = (1.0 - s) * shape["current_peak_A"], index(LIMIT, shape.get("form", LIMIT[0]))


DEAD = ("", "u - d sgn(u)", "blanking: 0 inside, u outside", "u - d sgn(u), rounded knee")


def draw_dead(rng, context):
    """Which dead zone."""
    return {"form": choose(rng, *DEAD[1:])}


def put_dead(p, s, shape, record):
    """Strength: half width [V]."""
    p["dead_V"], p["dead_form"] = s, index(DEAD, shape["form"])


def draw_nothing(rng, context):
    """No shape."""
    return {}


def put_inductance(p, s, shape, record):
    """Strength: L [H] in place of the ordinary one; it may fall as the iron saturates."""
    p["L"], p["L_sat"] = s, shape.get("saturation_per_A", 0.0)


def put_delay(p, s, shape, record):
    """Strength: dead time [s]."""
    p["delay_s"] = s


def draw_thermal(rng, context):
    """One node, or a third of the heat in a winding eight times as fast."""
    return {
        "tau_s": float(rng.uniform(3.0, 14.0)),
        "alpha_R_per_K": 0.0039,
        "beta_K_per_K": float(rng.uniform(0.0008, 0.0012)),
        "fast_share": float(choose(rng, 0.0, 0.33)),
    }


def put_thermal(p, s, shape, record):
    """Strength: thermal resistance [K/W]."""
    p["th_R"], p["th_tau"], p["th_alpha"], p["th_beta"] = (
        s,
        shape["tau_s"],
        shape["alpha_R_per_K"],
        shape["beta_K_per_K"],
    )
    p["th_fast"] = shape.get("fast_share", 0.0)


SAG = ("motor's power", "motor's current")


def draw_sag(rng, context):
    """Bus capacitor's time constant (0: none), nominal supply, what the drive draws."""
    return {
        "form": choose(rng, *SAG),
        "tau_s": float(choose(rng, 0.0, between(rng, 0.03, 0.4))),
        "V_nominal": context["umax_V"],
    }


def put_sag(p, s, shape, record):
    """Strength: source resistance [ohm]."""
    p["sag_R"], p["sag_tau"], p["sag_V"] = s, shape["tau_s"], shape["V_nominal"]
    p["sag_form"] = index(SAG, shape.get("form", SAG[1]))


# ---- load
# -------------------------------------------------------------------------------------------------------------


def draw_sign(rng, context):
    """Which way."""
    return {"sign": sign(rng)}


def put_bias(p, s, shape, record):
    """Strength: |torque| [N m]; a positive sign loads as Eq. (1)'s T_L does, against positive motion."""
    p["bias"] = -s * shape["sign"]


def draw_gravity(rng, context):
    """Where the imbalance hangs."""
    return {"phase": angle(rng)}


def put_gravity(p, s, shape, record):
    """Strength: m g l [N m] in m g l sin(theta + phase)."""
    p["grav"], p["grav_ph"] = s, shape["phase"]


HINGE = ("k3 x^3", "6 k3 (x - sin x)", "k3 x^3/(1 + 2 x^2)")


def draw_hinge(rng, context):
    """Which odd function."""
    return {"form": choose(rng, *HINGE)}


def put_hinge(p, s, shape, record):
    """Strength: k3 [N m/rad^3], x = theta - theta_0."""
    p["k3"], p["k3_form"] = s, index(HINGE, shape.get("form", HINGE[0]))


def draw_stop(rng, context):
    """One side or both, springy or Hunt-Crossley."""
    return {
        "form": choose(rng, *CONTACT),
        "k": between(rng, 800.0, 3000.0),
        "zeta": float(rng.uniform(0.1, 0.4)),
        "side": choose(rng, "upper", "lower", "both"),
        "free_travel_deg": [float(x / DEG) for x in context["travel"]],
    }


def put_stop(p, s, shape, record):
    """Strength: share of the free travel to that side of theta_0 that is cut off."""
    low, high = (x * DEG for x in shape["free_travel_deg"])
    if shape["side"] in ("upper", "both"):
        p["stop_hi"] = high * (1.0 - s)
    if shape["side"] in ("lower", "both"):
        p["stop_lo"] = low * (1.0 - s)
    p["stop_k"], p["stop_c"] = shape["k"], 2.0 * shape["zeta"] * np.sqrt(shape["k"] * p["J"][0])
    p["stop_form"] = index((*CONTACT, RIGID), shape.get("form", CONTACT[0]))


PULSE = ("rect", "half sine", "sudden and fading")


def draw_disturbance(rng, context):
    """One pulse in one record."""
    record = int(rng.integers(context["records"]))
    duration = between(rng, 0.08, 0.6)
    start = float(rng.uniform(0.5, context["durations"][record] - duration - 0.8))
    return {"record": record + 1, "t0_s": start, "duration_s": duration, "form": choose(rng, *PULSE), "sign": sign(rng)}


def put_disturbance(p, s, shape, record):
    """Strength: torque [N m] with T_L's sign; `record` counts from one in the shape."""
    if record == shape["record"] - 1:
        p["dist_T"], p["dist_t0"], p["dist_d"] = -s * shape["sign"], shape["t0_s"], shape["duration_s"]
        p["dist_form"] = index(PULSE, shape["form"])


GUST = ("sine", "flat-topped", "swelling")


def draw_gust(rng, context):
    """One frequency, a phase for each record."""
    return {
        "form": choose(rng, *GUST),
        "freq_hz": float(rng.uniform(0.7, 5.0)),
        "phase_per_record": [angle(rng) for _ in range(context["records"])],
    }


def put_gust(p, s, shape, record):
    """Strength: torque amplitude [N m]."""
    p["gust_T"], p["gust_w"], p["gust_ph"] = -s, 2.0 * np.pi * shape["freq_hz"], shape["phase_per_record"][record]
    p["gust_form"] = index(GUST, shape.get("form", GUST[0]))


# ---- sensor
# -----------------------------------------------------------------------------------------------------------

LAG = ("", "first order", "pure delay", "mean over 2 tau")


def draw_lag(rng, context):
    """How the sensor is late."""
    return {"form": choose(rng, *LAG[1:])}


def put_lag(p, s, shape, record):
    """Strength: time constant or delay [s]."""
    p["lag_s"], p["lag_form"] = s, index(LAG, shape["form"])


BEND = ("", "a (x/P)^2", "a sin(2 pi x/P + ph)", "loaded potentiometer")


def draw_bend(rng, context):
    """How the sensor bends."""
    form = choose(rng, *BEND[1:])
    scale = {BEND[1]: 20.0, BEND[2]: float(rng.uniform(12.0, 40.0)), BEND[3]: 45.0}[form] * DEG
    return {"form": form, "P_rad": scale, "phase": angle(rng), "sign": sign(rng)}


def put_bend(p, s, shape, record):
    """Strength: amplitude of the deviation [deg]."""
    p["nl_a"], p["nl_P"], p["nl_ph"] = s * DEG * shape["sign"], shape["P_rad"], shape["phase"]
    p["nl_form"] = index(BEND, shape["form"])


ROUND = ("nearest", "downwards", "middle of the step")


def draw_quantum(rng, context):
    """How the converter rounds."""
    return {"form": choose(rng, *ROUND)}


def put_quantum(p, s, shape, record):
    """Strength: step [deg]."""
    p["q_step"], p["q_form"] = s * DEG, index(ROUND, shape.get("form", ROUND[0]))


def draw_dropout(rng, context):
    """Single spikes, or stretches in which the reading stands still."""
    return {
        "form": choose(rng, "spikes", "stuck"),
        "rate_per_s": float(rng.uniform(1.0, 5.0)),
        "seed": int(rng.integers(2**31)),
    }


def put_in_samples(p, s, shape, record):
    """Acts on the samples: see `samples_of`."""


# ---- outside the list
# -------------------------------------------------------------------------------------------------


def draw_appendage(rng, context):
    """A mass on a spring on the rudder."""
    return {"freq_hz": between(rng, 4.0, 25.0), "zeta": float(rng.uniform(0.01, 0.06))}


def put_appendage(p, s, shape, record):
    """Strength: its inertia over J (J is the total)."""
    j, w = s * p["J"][0], 2.0 * np.pi * shape["freq_hz"]
    p["app_J"], p["app_k"], p["app_c"] = j, j * w * w, 2.0 * shape["zeta"] * j * w


def draw_hysteresis(rng, context):
    """Bouc-Wen: angle of the turn and sharpness."""
    return {"x_deg": between(rng, 1.5, 6.0), "sharpness": float(rng.uniform(1.0, 2.5))}


def put_hysteresis(p, s, shape, record):
    """Strength: hysteretic torque [N m]."""
    p["bw_T"], p["bw_x"], p["bw_n"] = s, shape["x_deg"] * DEG, shape["sharpness"]


def draw_ageing(rng, context):
    """Rate and state: friction grows with the logarithm of the dwell and is worn off over a distance."""
    return {"t0_s": between(rng, 0.003, 0.03), "slip_deg": between(rng, 0.3, 3.0)}


def put_ageing(p, s, shape, record):
    """Strength: growth of Fc per e-fold of dwell."""
    p["age_a"], p["age_t0"], p["age_D"] = s, shape["t0_s"], shape["slip_deg"] * DEG


def draw_brush(rng, context):
    """Current scale of the brush contact's logarithm."""
    return {"i0_A": between(rng, 0.02, 0.3)}


def put_brush(p, s, shape, record):
    """Strength: V in V sgn(i) log(1 + |i|/i0)."""
    p["brush_V"], p["brush_i"] = s, shape["i0_A"]


def draw_angle_damping(rng, context):
    """Angle over which the damping grows."""
    return {"P_deg": float(max(-context["travel"][0], context["travel"][1]) / DEG)}


def put_angle_damping(p, s, shape, record):
    """Strength: damping added at the end of the travel [N m s/rad]."""
    p["angdamp_a"], p["angdamp_P"] = s, shape["P_deg"] * DEG


def draw_tacho(rng, context):
    """Phase of the eccentric encoder of the drive's speed loop."""
    return {"phase": angle(rng)}


def put_tacho(p, s, shape, record):
    """Strength: share of the back-EMF fed back with one wave a turn of the motor."""
    p["tacho_a"], p["tacho_ph"] = s, shape["phase"]


def draw_gaps(rng, context):
    """When the drive's gain breaks down: on average so often, so long."""
    return {
        "rate_per_s": float(rng.uniform(0.4, 1.5)),
        "mean_s": between(rng, 0.04, 0.3),
        "seed": int(rng.integers(2**31)),
    }


def put_magnetic(p, s, shape, record):
    """Strength: share of K_t lost at the current's peak."""
    p["kt_sat"] = np.sqrt(s / (1.0 - s)) / shape["current_peak_A"]


def draw_peak(rng, context):
    """The effect-free current peak [A]."""
    return {"current_peak_A": context["peak_A"]}


def draw_maxwell(rng, context):
    """Relaxation time of the spring's rubber."""
    return {"tau_s": between(rng, 0.1, 1.5)}


def put_maxwell(p, s, shape, record):
    """Strength: stiffness of the relaxing element [N m/rad]."""
    p["mxw_k"], p["mxw_tau"] = s, shape["tau_s"]


def draw_running_in(rng, context):
    """Sum of travel over which the friction settles, up or down, in each record anew."""
    return {"distance_deg": between(rng, 10.0, 80.0), "sign": sign(rng)}


def put_running_in(p, s, shape, record):
    """Strength: relative change of Fc."""
    p["run_a"], p["run_D"] = s * shape["sign"], shape["distance_deg"] * DEG


CATALOGUE = {
    e.name: e
    for e in (
        Effect("stribeck", "(Fs-Fc)/Fc", 0.002, 1.2, draw_stribeck, put_stribeck),
        Effect("presliding", "presliding displacement Fc/sigma0 (deg)", 0.04, 3.0, draw_presliding, put_presliding),
        Effect(
            "asymmetric_friction",
            "Coulomb asymmetry a: Fc(1+a) fwd, Fc(1-a) back",
            0.0005,
            0.5,
            draw_asymmetric,
            put_asymmetric,
        ),
        Effect("load_dependent_friction", "mu in Fc + mu*|n Kt i|", 0.0005, 0.25, draw_load, put_load),
        Effect("quadratic_drag", "c (N m (s/rad)^p) in c |w|^p", 0.0001, 0.12, draw_quadratic, put_quadratic),
        Effect("position_dependent_friction", "relative modulation of Fc", 0.004, 0.8, draw_position, put_position),
        Effect("backlash", "total gap at output (deg)", 0.02, 3.0, draw_backlash, put_backlash),
        Effect("shaft_compliance", "compliance (deg per N m)", 0.1, 6.0, draw_compliance, put_compliance),
        Effect("variable_ratio", "scale of n(theta)/n0-1", 0.003, 0.9, draw_ratio, put_ratio),
        Effect("transmission_ripple", "amplitude (N m at output)", 0.0008, 0.3, draw_ripple, put_ripple),
        Effect(
            "cogging", "amplitude (N m reflected to output; /n at the motor)", 0.002, 0.3, draw_cogging, put_cogging
        ),
        Effect(
            "voltage_saturation", "fraction of the command peak clipped", 0.005, 0.55, draw_saturation, put_saturation
        ),
        Effect("current_limit", "fraction of the current peak cut", 0.01, 0.6, draw_limit, put_limit),
        Effect("drive_dead_zone", "half width (V)", 0.002, 2.0, draw_dead, put_dead),
        Effect("inductance", "L (H)", 0.004, 0.03, draw_nothing, put_inductance),
        Effect("input_delay", "delay (s)", 0.0004, 0.03, draw_nothing, put_delay),
        Effect("thermal_drift", "thermal resistance (K/W)", 0.03, 20.0, draw_thermal, put_thermal),
        Effect("supply_sag", "source resistance (ohm)", 0.002, 1.2, draw_sag, put_sag),
        Effect("bias_torque", "|torque| (N m)", 0.0001, 0.11, draw_sign, put_bias),
        Effect("gravity_imbalance", "m g l (N m) in mgl sin(theta+ph)", 0.0003, 0.2, draw_gravity, put_gravity),
        Effect("hinge_moment_cubic", "k3 (N m/rad3)", 0.004, 8.0, draw_hinge, put_hinge),
        Effect("end_stop", "fraction of the free travel cut off", 0.01, 0.5, draw_stop, put_stop),
        Effect("load_disturbance", "pulse torque (N m)", 0.01, 1.0, draw_disturbance, put_disturbance),
        Effect("periodic_gust", "torque amplitude (N m)", 0.003, 0.25, draw_gust, put_gust),
        Effect("sensor_lag", "time constant / delay (s)", 0.0003, 0.03, draw_lag, put_lag),
        Effect("sensor_nonlinearity", "deviation amplitude (deg)", 0.02, 3.0, draw_bend, put_bend),
        Effect("sensor_quantisation", "step (deg)", 0.04, 1.0, draw_quantum, put_quantum),
        Effect(
            "sensor_dropout",
            "spike scale (deg), or mean time stuck (units of 10 ms)",
            0.3,
            20.0,
            draw_dropout,
            put_in_samples,
        ),
        Effect("second_resonance", "inertia of the appendage over J", 0.01, 0.5, draw_appendage, put_appendage, False),
        Effect("hysteretic_spring", "Bouc-Wen torque (N m)", 0.0005, 0.2, draw_hysteresis, put_hysteresis, False),
        Effect("friction_ageing", "growth of Fc per e-fold of dwell", 0.001, 0.3, draw_ageing, put_ageing, False),
        Effect("brush_drop", "V (V) in V sgn(i) log(1+|i|/i0)", 0.0005, 0.5, draw_brush, put_brush, False),
        Effect(
            "angle_dependent_damping",
            "damping added at the end of travel (N m s/rad)",
            0.0005,
            0.5,
            draw_angle_damping,
            put_angle_damping,
            False,
        ),
        Effect("tacho_eccentricity", "share of back-EMF rippling", 0.003, 0.4, draw_tacho, put_tacho, False),
        Effect("intermittent_gain", "share of the drive's gain lost", 0.01, 0.9, draw_gaps, put_in_samples, False),
        Effect(
            "magnetic_saturation", "share of K_t lost at the current's peak", 0.005, 0.5, draw_peak, put_magnetic, False
        ),
        Effect(
            "viscoelastic_spring",
            "stiffness of the relaxing element (N m/rad)",
            0.005,
            0.6,
            draw_maxwell,
            put_maxwell,
            False,
        ),
        Effect("running_in", "relative change of Fc", 0.002, 0.6, draw_running_in, put_running_in, False),
    )
}
"""Every effect by name; `listed` tells those of the contract from those that no library can name."""

LISTED = tuple(name for name, effect in CATALOGUE.items() if effect.listed)
OUTSIDE = tuple(name for name, effect in CATALOGUE.items() if not effect.listed)
FIRST = (
    "asymmetric_friction",
    "bias_torque",
    "stribeck",
    "load_dependent_friction",
    "quadratic_drag",
    "backlash",
    "voltage_saturation",
    "drive_dead_zone",
    "input_delay",
    "inductance",
    "gravity_imbalance",
    "hinge_moment_cubic",
    "end_stop",
    "sensor_quantisation",
)


def put_effects(plant, effects, record):
    """Write effects (mappings with label, strength, shape) into the simulator's record for recording number `record`
    (from 0).
    """
    for effect in effects:
        if effect["label"] not in CATALOGUE:
            raise ValueError(f"effect {effect['label']!r} is not known; there are {', '.join(CATALOGUE)}")
        CATALOGUE[effect["label"]].put(plant, effect["strength"], effect["shape"], record)


def spells(rng, samples, dt, rate, mean_s):
    """(samples,) true in spells that begin `rate` times a second and last mean_s [s] on average."""
    inside = np.zeros(samples, bool)
    starts = np.flatnonzero(rng.random(samples) < rate * dt)
    stretch = rng.exponential(1.0, starts.size)
    for start, long in zip(starts, stretch):
        inside[start : start + max(1, int(round(long * mean_s / dt)))] = True
    return inside


def samples_of(effects, record, samples, dt):
    """((samples,) reading stuck, spike added [rad], gain of the drive) from the effects that act sample by sample."""
    stuck, spike, gain = np.zeros(samples, bool), np.zeros(samples), np.ones(samples)
    for effect in effects:
        shape, s = effect["shape"], effect["strength"]
        if "seed" not in shape:
            continue
        rng = np.random.default_rng([shape["seed"], record])
        if effect["label"] == "intermittent_gain":
            gain[spells(rng, samples, dt, shape["rate_per_s"], shape["mean_s"])] = 1.0 - s
        elif shape["form"] == "stuck":
            stuck |= spells(rng, samples, dt, shape["rate_per_s"], 0.01 * s)
        else:
            hit = rng.random(samples) < shape["rate_per_s"] * dt
            spike[hit] += s * DEG * (rng.standard_normal(samples) + 1.5 * rng.choice([-1.0, 1.0], samples))[hit]
    return stuck, spike, gain
