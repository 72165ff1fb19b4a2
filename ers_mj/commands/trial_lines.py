"""What `ers trial` tells a terminal: a table a case and plant, and how the scattered servos lie."""

from __future__ import annotations

import math

from ers_mj.commands.keeping import Kept
from ers_mj.commands.output import bold, written

COLUMNS = (
    ("settles [ms]", "settling_time_s", 1e3, ".1f"),
    ("overshoot [%]", "overshoot_pct", 1.0, ".2f"),
    ("steady [°]", "steady_state_error_rad", math.degrees(1), ".4f"),
    ("RMSE [°]", "rmse_rad", math.degrees(1), ".4f"),
    ("peak [V]", "peak_u_V", 1.0, ".1f"),
    ("RMS [V]", "rms_u_V", 1.0, ".2f"),
    ("chatter [V]", "chatter_V", 1.0, ".3f"),
    ("energy [J]", "energy_J", 1.0, ".2f"),
)


def trial_lines(document: dict, kept: Kept) -> list[str]:
    """What a terminal shows when all is done."""
    lines = ["", bold(document["sentence"])]
    electric = [c for c in COLUMNS[4:] if any(t[c[1]] is not None for t in document["trials"])]
    told = [*COLUMNS[:4], *electric]
    keys = list(dict.fromkeys((t["case"], t["plant"]) for t in document["trials"]))
    for case, plant in keys:
        lines += ["", bold(f"{f'{case}, {plant} plant':26}" + "".join(f"{head:>15}" for head, *_ in told))]
        for t in document["trials"]:
            if (t["case"], t["plant"]) == (case, plant):
                cells = (
                    "".join(f"{_cell(t, *column):>15}" for column in told)
                    if t["stable"]
                    else f"{'unstable: it was given up':>30}"
                )
                lines.append(f"  {t['controller']:24}{cells}")
    lines += _spread_lines(document)
    lines += ["", *document["notes"]] if document["notes"] else []
    return lines + written(kept)


def _spread_lines(document: dict) -> list[str]:
    """RMS error and settling of the scattered servos: 5 %, median, 95 %."""
    lines, degree = [], math.degrees(1.0)
    for case, plant in dict.fromkeys((s["case"], s["plant"]) for s in document["robustness"]):
        group = [s for s in document["robustness"] if (s["case"], s["plant"]) == (case, plant)]
        head = f"{case}, {plant}, {group[0]['plants']} servos"
        lines += [
            "",
            bold(
                f"{head:26}{'RMSE [°] 5 / 50 / 95 %':>30}{'settles [ms] 5 / 50 / 95 %':>30}{'never':>8}{'unstable':>10}"
            ),
        ]
        for s in group:
            shown = (("rmse_rad", degree, ".4f"), ("settling_time_s", 1e3, ".1f"))
            cells = "".join(f"{_three(s['measures'][key], factor, form):>30}" for key, factor, form in shown)
            lines.append(f"  {s['controller']:24}{cells}{s['never_settled']:>8}{s['unstable']:>10}")
    return lines


def _three(quantiles: dict | None, factor: float, form: str) -> str:
    return (
        "-"
        if quantiles is None
        else " / ".join(f"{factor * quantiles[key]:{form}}" for key in ("q05", "median", "q95"))
    )


def _cell(trial: dict, head: str, key: str, factor: float, form: str) -> str:
    """One measure as a reader sees it."""
    x = trial[key]
    return ("never" if key == "settling_time_s" else "-") if x is None else f"{factor * x:{form}}"
