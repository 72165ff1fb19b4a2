"""What may be concealed in the sensor."""

from __future__ import annotations

from ers_mj.proving.concealed.base import Effect, angle, choose, index, put_in_samples, sign
from ers_mj.proving.plant import DEG

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


ENTRIES = (
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
)
