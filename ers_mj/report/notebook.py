"""Small pages for a notebook: of a model its numbers, of a simulation its course."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from matplotlib.figure import Figure

from ers_mj.report import page
from ers_mj.report.display import figure as digits
from ers_mj.report.drawing import both_widths, margins, restart_ids
from ers_mj.report.style import STYLE
from ers_mj.report.thinning import decimate


def model_page(title: str, numbers: Iterable[tuple[str, str, float]]) -> str:
    """A model's numbers: (owner, parameter, value), in the units of its datasheet."""
    rows = [((page.named(owner), f"<code>{page.text(name)}</code>", digits(x, 5)), "") for owner, name, x in numbers]
    return page.frame("model", "", f"<h2>{page.text(title)}</h2>{page.table(['of', 'parameter', '>value'], rows)}")


def simulation_page(
    title: str, t: np.ndarray, u: np.ndarray, y: np.ndarray, units: tuple[str, str] = ("V", "rad")
) -> str:
    """A simulation's output over its input, both (N,), in ``units`` of the input and the output; an angle in deg."""
    restart_ids()
    drawn = both_widths(lambda width: _course(t, u, y, units, width), "simulated output and input over time")
    return page.frame("simulation", "", f"<p>{page.text(title)}</p>{page.figure(drawn)}")


def _course(t: np.ndarray, u: np.ndarray, y: np.ndarray, units: tuple[str, str], width: float) -> Figure:
    is_angle = units[1] == "rad"
    figure = Figure(figsize=(width, 3.6))
    above, below = figure.subplots(2, 1, sharex=True, height_ratios=(2, 1))
    margins(figure)
    points = 1500 if width == STYLE.wide else 700
    above.plot(*decimate(t, np.degrees(y) if is_angle else y, points), color=STYLE.after, linewidth=1.2)
    below.plot(*decimate(t, u, points), color=STYLE.ink, linewidth=0.8)
    above.set_ylabel("angle [°]" if is_angle else f"output [{units[1]}]")
    below.set_ylabel(f"input [{units[0]}]")
    below.set_xlabel("time [s]")
    above.margins(x=0)
    return figure
