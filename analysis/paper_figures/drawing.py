"""What the scripts of this folder share: the trials behind a figure, their curves and bars, and where pictures go.

The paper's figures 7 and 8 are simulations of Eq. (5) at 10 kHz; 11 to 15 were measured on its test bench, in whose
place stands the MuJoCo plant here, with a sensor noise of 0.01 deg and a loop of 1 kHz. Beside the paper's three laws
stands the fair rival, its PID with the feed-forward of FTRC.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import matplotlib
import numpy as np
from matplotlib.figure import Figure

from ers_mj.control.trial import Conditions, Trial, try_out
from ers_mj.report.style import STYLE
from ers_mj.report.trial_figures import COLOURS, error_limit
from ers_mj.servo.datasheet import read_datasheet

LAWS = ("hinf", "pid", "pid-ff", "ftrc")
SIMULATED = Conditions()
BENCH = Conditions(rate_hz=1000.0, noise=math.radians(0.01))
PICTURES = Path(__file__).resolve().parents[2] / "docs" / "paper"


def trials(
    cases: Sequence[str], on_bench: bool, laws: Sequence[str] = LAWS, amplitude_deg: float = 10.0
) -> list[Trial]:
    """The trials of a figure, on Eq. (5) or on the MuJoCo plant that stands for the test bench."""
    conditions = replace(BENCH if on_bench else SIMULATED, amplitude=math.radians(amplitude_deg))
    return try_out(read_datasheet("table1"), laws, ["mujoco" if on_bench else "reduced"], cases, conditions)


def curves(found: Sequence[Trial], name: str, until: float | None = None) -> Path:
    """Response (a) and error (b) of one case, as the paper draws them; the picture's path."""
    reference = found[0].run.reference
    shown = slice(None, None if until is None else int(np.searchsorted(reference.t, until)))
    with matplotlib.rc_context(STYLE.settings):
        figure = Figure(figsize=(9.8, 3.6), layout="constrained")
        response, error = figure.subplots(1, 2)
        response.plot(
            reference.t[shown],
            np.degrees(reference.theta[shown]),
            color=STYLE.measured,
            linewidth=3.0,
            label="reference",
        )
        for trial in found:
            shade = COLOURS[trial.controller]
            response.plot(reference.t[shown], np.degrees(trial.run.theta[shown]), color=shade, label=trial.controller)
            error.plot(reference.t[shown], np.degrees(trial.run.theta - reference.theta)[shown], color=shade)
        largest = [float(np.abs(t.run.theta - t.run.reference.theta).max()) for t in found]
        limit = np.degrees(error_limit(largest))
        error.set_ylim(-limit, limit)
        for ax, label in ((response, "(a) angle [°]"), (error, "(b) error [°]")):
            ax.set_ylabel(label, color=STYLE.ink)
            ax.set_xlabel("time [s]")
            ax.margins(x=0)
        figure.legend(loc="outside upper left", ncols=6)
        return saved(figure, name)


def bars(panels: Sequence[tuple[str, dict[str, float | None]]], name: str) -> Path:
    """One panel a measure: (its label, value by law); a law without one gets the word never."""
    with matplotlib.rc_context(STYLE.settings):
        figure = Figure(figsize=(9.8, 3.0), layout="constrained")
        for ax, (label, values) in zip(np.atleast_1d(figure.subplots(1, len(panels))), panels, strict=True):
            for k, (law, x) in enumerate(values.items()):
                ax.bar(k, x or 0.0, color=COLOURS[law], width=0.65)
                ax.annotate(
                    "never" if x is None else f"{x:.3g}",
                    (k, x or 0.0),
                    ha="center",
                    va="bottom",
                    fontsize=8.5,
                    color=STYLE.ink,
                )
            ax.set_xticks(range(len(values)), values, rotation=20)
            ax.set_title(label, color=STYLE.ink)
            ax.grid(axis="x", visible=False)
            ax.margins(y=0.15)
        return saved(figure, name)


def saved(figure: Figure, name: str) -> Path:
    """The figure as docs/paper/NAME.png, and its path told."""
    PICTURES.mkdir(parents=True, exist_ok=True)
    path = PICTURES / f"{name}.png"
    figure.savefig(path, dpi=110, metadata={"Software": None})
    print(f"written {path.relative_to(PICTURES.parents[1])}")
    return path


def table(found: Sequence[Trial]) -> None:
    """The measures of trials, a line each."""
    for t in found:
        m = t.measures
        settles = "never" if m.settling_time_s is None else f"{1e3 * m.settling_time_s:.1f} ms"
        print(
            f"  {t.case:7} {t.controller:8} settles {settles:>9}  overshoot {m.overshoot_pct:6.2f} %  steady"
            f" {math.degrees(m.steady_state_error_rad):7.4f} deg  RMSE {math.degrees(m.rmse_rad):7.4f} deg  energy"
            f" {m.energy_J:7.2f} J"
        )
