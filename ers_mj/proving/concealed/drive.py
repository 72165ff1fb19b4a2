"""What may be concealed in the drive."""

from __future__ import annotations

from ers_mj.proving.concealed.base import Effect, angle, between, choose, index


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


ENTRIES = (
    Effect("cogging", "amplitude (N m reflected to output; /n at the motor)", 0.002, 0.3, draw_cogging, put_cogging),
    Effect("voltage_saturation", "fraction of the command peak clipped", 0.005, 0.55, draw_saturation, put_saturation),
    Effect("current_limit", "fraction of the current peak cut", 0.01, 0.6, draw_limit, put_limit),
    Effect("drive_dead_zone", "half width (V)", 0.002, 2.0, draw_dead, put_dead),
    Effect("inductance", "L (H)", 0.004, 0.03, draw_nothing, put_inductance),
    Effect("input_delay", "delay (s)", 0.0004, 0.03, draw_nothing, put_delay),
    Effect("thermal_drift", "thermal resistance (K/W)", 0.03, 20.0, draw_thermal, put_thermal),
    Effect("supply_sag", "source resistance (ohm)", 0.002, 1.2, draw_sag, put_sag),
)
