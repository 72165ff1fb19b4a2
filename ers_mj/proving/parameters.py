"""Compares the parameters of an answer with the truth, where a parameter means one thing whatever the form of the law,
or where the law has the package's own form.

Torques are compared per inertia: position and voltage cannot tell J, so an answer's torque stands on the datasheet's.
"""

from __future__ import annotations

import math
from collections.abc import Mapping

from ers_mj.proving.plant import DEG, TABLE_1


def covered(truth: Mapping, document: Mapping) -> list[dict]:
    """One entry a parameter that can be compared: owner, name, truth, value, whether ci95 holds the truth, relative
    error.
    """
    out = []
    if truth.get("linkage") == "constant" and "lumped" in truth:
        rows = document.get("parameters") or {}
        out += [
            entry
            for name, value in truth["lumped"].items()
            if name in rows
            for entry in _compared("baseline", name, value, rows[name])
        ]
    for effect in truth.get("effects", []):
        answer = next((m for m in document.get("missing") or [] if m["effect"] == effect["label"]), None)
        if answer is None:
            continue
        for name, value in meant(effect, truth).items():
            entry = (answer.get("parameters") or {}).get(name)
            out += _compared("effect", f"{effect['label']} {name}", value, entry) if entry else []
    return out


def _compared(owner: str, name: str, true: float, entry: Mapping) -> list[dict]:
    value, (low, high) = entry.get("value"), entry.get("ci95") or (None, None)
    if value is None:
        return []
    inside = None if low is None or high is None else bool(low <= true <= high)
    return [
        {
            "owner": owner,
            "name": name,
            "true": true,
            "value": value,
            "ci95": [low, high],
            "inside": inside,
            "identifiable": entry.get("identifiable") is not False,
            "relative_error": abs(value - true) / abs(true) if true else None,
        }
    ]


def meant(effect: Mapping, truth: Mapping) -> dict[str, float]:
    """The answer's names of this effect's parameters -> what they should be; empty where the form leaves no single
    meaning, and of a real rig, whose own numbers nobody knows.
    """
    s, shape, p = effect["strength"], effect["shape"], truth.get("true_parameters") or {}
    if s is None or truth.get("rig"):
        return {}
    if "units" in truth:
        return _in_units(effect, truth) if shape["own_form"] else {}
    torque = TABLE_1["J"] / p["J"] if p else 1.0
    rules = {
        "backlash": lambda: {"gap": 0.5 * s * DEG},
        "input_delay": lambda: {"T_d": s},
        "sensor_lag": lambda: {"T": s},
        "bias_torque": lambda: {"tau_0": -s * shape["sign"] * torque},
        "gravity_imbalance": lambda: {
            "g_s": s * math.cos(shape["phase"]) * torque,
            "g_c": s * math.sin(shape["phase"]) * torque,
        },
        "voltage_saturation": lambda: {"u_max": (1.0 - s) * shape["command_peak_V"]},
        "sensor_quantisation": lambda: {"step": s * DEG},
        "periodic_gust": lambda: {"f": shape["freq_hz"]},
        "sensor_dropout": lambda: {"rate": shape["rate_per_s"]} if shape["form"] == "stuck" else {},
        "cogging": lambda: {"period": 2.0 * math.pi / (shape["cycles_per_motor_rev"] * p["n"])},
        "transmission_ripple": lambda: {"period": 2.0 * math.pi / shape["cycles_per_output_rev"]},
        "load_dependent_friction": lambda: {"mu": s},
        "end_stop": lambda: _stops(s, shape, p["theta_0"]),
    }
    return rules.get(effect["label"], dict)()


def _in_units(effect: Mapping, truth: Mapping) -> dict[str, float]:
    """The same of a plant that was simulated in units of its own; what is a torque is left out, an answer tells it over
    an inertia of its own.
    """
    s, shape, unit = effect["strength"], effect["shape"], truth["units"]
    angle, time, shift = unit["angle"], unit["time"], truth["shift"]
    n, rest = truth["true_parameters"]["n"] * angle, truth["true_parameters"]["theta_0"]
    rules = {
        "backlash": lambda: {"gap": 0.5 * s * DEG * angle},
        "input_delay": lambda: {"T_d": s * time},
        "sensor_lag": lambda: {"T": s * time},
        "sensor_quantisation": lambda: {"step": s * DEG * angle},
        "periodic_gust": lambda: {"f": shape["freq_hz"] / time},
        "sensor_dropout": lambda: {"rate": shape["rate_per_s"] / time} if shape["form"] == "stuck" else {},
        "cogging": lambda: {"period": 2.0 * math.pi / (shape["cycles_per_motor_rev"] * n) * angle},
        "transmission_ripple": lambda: {"period": 2.0 * math.pi / shape["cycles_per_output_rev"] * angle},
        "load_dependent_friction": lambda: {"mu": s},
        "end_stop": lambda: {end: x * angle + shift for end, x in _stops(s, shape, rest / angle).items()},
        "rate_limit": lambda: {"R": (1.0 - s) * shape["top_rad_s"] * angle},
    }
    return rules.get(effect["label"], dict)()


def _stops(s: float, shape: Mapping, rest: float) -> dict[str, float]:
    low, high = (x * DEG for x in shape["free_travel_deg"])
    ends = {"lower": rest + low * (1.0 - s), "upper": rest + high * (1.0 - s)}
    return {end: x for end, x in ends.items() if shape["side"] in (end, "both")}
