"""A document and its evidence as a diagnosis might give them, with text that would be markup if it were not escaped."""

import numpy as np

from ers_mj.data.prepared import Signals, make_trace
from ers_mj.diagnosis.evidence import Evidence, RecordView, ResidualMap, Rung
from ers_mj.diagnosis.mismatch_spectrum import Mismatch, mismatch

NASTY = '<script>alert("1 & 2")</script>'


def view(name="run1.csv", held_out=False, n=900, **changes) -> RecordView:
    t = np.arange(n) * 1e-2
    y = 0.3 * np.sin(t)
    fields = {
        "t": t,
        "u": 5 * np.cos(t),
        "measured": y,
        "before": y + 0.05 * np.sin(3 * t),
        "after": y + 1e-3,
        "shaded": ((1.0, 1.5), (1.52, 2.0)),
        "without": {"stribeck": y + 0.02, "end_stop": y + 0.03 * np.cos(t), NASTY: y - 0.02},
    }
    return RecordView(name, held_out, **{**fields, **changes})


def spectral(is_off: bool = True) -> Mismatch | None:
    """What a simulation leaves over frequency that is off by a tenth, or by noise alone."""
    random = np.random.default_rng(1)
    t, u = np.arange(6000) * 1e-3, random.standard_normal(6000)
    x = np.cumsum(u) * 1e-3
    traces = [make_trace("made", Signals(t, u, x * gain, np.ones(6000, bool)), 1e-5) for gain in (1.0, 1.1)]
    error = 0.1 * x * is_off + 1e-5 * random.standard_normal(6000)
    return mismatch(traces, [error, error], 1e-9)


def evidence(unit="rad") -> Evidence:
    rng = np.random.default_rng(3)
    rms = rng.uniform(size=(6, 4))
    rms[0] = np.nan
    rungs = (
        Rung((), 0.0, 0.0, 0.05, False, "", 6, 0.0),
        Rung(("stribeck",), 30.0, 5.0, 0.01, True, NASTY, 3, 30.0),
        Rung(("backlash", "end_stop"), 2.0, 0.3, None, False, "did not converge", 6, 12.0),
    )
    maps = ResidualMap(np.linspace(-1, 1, 7), np.linspace(-2, 2, 5), rms, 0.1 * rms)
    return Evidence((view(), view("held.csv", True)), rungs, maps, 1e-3, unit, "V")


def document(verdict="missing_physics", **changes) -> dict:
    fit = {
        f"{kind}_rmse_{when}_rad": x
        for kind in ("train", "heldout", "recalibrated")
        for when, x in (("before", 0.05), ("after", 0.01))
    }
    number = {"value": 0.1, "unit": "N m", "ci95": [0.08, 0.12]}
    full = {
        "version": 1,
        "verdict": verdict,
        "sentence": f"A sentence with {NASTY}.",
        "where": [
            {
                "axis": "angle",
                "region": [0.1, 0.2],
                "unit": "rad",
                "label": None,
                "share_of_error": 0.78,
                "share_of_time": 0.09,
                "sentence": NASTY,
            },
            {
                "axis": "subsystem",
                "region": None,
                "unit": None,
                "label": "load",
                "share_of_error": None,
                "share_of_time": None,
                "sentence": None,
            },
        ],
        "missing": [
            {
                "effect": "stribeck",
                "sentence": NASTY,
                "subsystem": "load",
                "parameters": {"F_s": number, NASTY: number},
                "evidence": {
                    "heldout_rmse_without_rad": 0.05,
                    "heldout_rmse_with_rad": 0.01,
                    "delta_bic": -40.0,
                    "p_value": 1e-6,
                },
                "alternatives": [{"effect": "presliding", "probability": 0.2, "why_not_excluded": NASTY}],
            }
        ],
        "remainder": {"explained_share": 0.93, "significant": True, "sentence": NASTY},
        "record_state": [
            {"name": "gain", "unit": "-", "values": [1.0, 1.16], "ci95": [[1.0, 1.0], [1.1, 1.2]], "sentence": NASTY}
        ],
        "fit": {
            **fit,
            "noise_floor_rad": 1e-3,
            "mujoco_heldout_rmse_before_rad": None,
            "mujoco_heldout_rmse_after_rad": None,
        },
        "parameters": {
            "J": {
                "value": 0.0031,
                "unit": "kg m^2",
                "ci95": [0.003, 0.0032],
                "datasheet": 0.0031,
                "identifiable": True,
            },
            "k_s": {"value": None, "unit": "N m/rad", "ci95": None, "datasheet": 0.09, "identifiable": False},
        },
        "next_recording": {
            "sentence": NASTY,
            "excitation": {"kind": "ramp", "amplitude_V": 3.8, "levels": [1, 2.5, None]},
        },
        "data": {
            "files": [NASTY, "held.csv"],
            "sha256": ["ab" * 32, "cd" * 32],
            "output_unit": "rad",
            "input_unit": "V",
            "problems": [NASTY],
        },
        "seed": 7,
        "versions": {"ers_mj": "0.1.0"},
    }
    return full | changes
