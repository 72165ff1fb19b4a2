"""Pictures over frequency as inline SVG: Bode, Nyquist and Nichols of loops, sensitivities, plants, limit cycles,
recordings.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import MultipleLocator

from ers_mj.control.frequency.loop import Loop
from ers_mj.control.frequency.study import Compared, Cycles, PlantView
from ers_mj.data.frequency_response import SURE
from ers_mj.report.drawing import both_widths
from ers_mj.report.style import STYLE
from ers_mj.report.trial_figures import colour

DASHES = ("-", (0, (4, 2)), (0, (1, 1.5)))  # of the plants, in their order
MODELS = (STYLE.before, STYLE.after, "#8a6bb8", "#1d4f91")
CLOSED_DB = (6.0, 3.0, 1.0)  # contours of |T| in Nichols' plane


def open_loops(loops: Sequence[Loop]) -> str:
    """Bode of the open loops: size and phase."""
    lines = [(x.f_hz, x.L, _shade(x), _dash(x, loops), _label(x, loops)) for x in loops]
    return both_widths(lambda width: _bode(width, lines, "open loop", 0.0), "Bode plot of the open loops")


def plants(views: Sequence[PlantView]) -> str:
    """Bode of the plants: slipping, and at the amplitude."""
    lines = []
    for k, v in enumerate(views):
        lines += [(v.f_hz, v.slipping, MODELS[k], "-", f"{v.linear.name}, slipping")]
        if not np.allclose(v.slipping, v.rubbing):
            lines += [(v.f_hz, v.rubbing, MODELS[k], DASHES[1 + k], f"{v.linear.name}, friction described")]
    return both_widths(lambda width: _bode(width, lines, "angle over voltage", None), "Bode plot of the plants")


def _shade(loop: Loop) -> str:
    return colour(loop.controller)


def _dash(loop: Loop, loops: Sequence[Loop]):
    return DASHES[list(dict.fromkeys(x.plant for x in loops)).index(loop.plant)]


def _label(loop: Loop, loops: Sequence[Loop]) -> str:
    return loop.controller if len({x.plant for x in loops}) == 1 else f"{loop.controller}, {loop.plant}"


def _bode(width: float, lines, what: str, level: float | None) -> Figure:
    wide = width == STYLE.wide
    figure = Figure(figsize=(width, 5.2), layout="constrained")
    size, phase = figure.subplots(2, 1, sharex=True, height_ratios=(1.3, 1))
    for f_hz, values, shade, dash, label in lines:
        size.semilogx(f_hz, decibels(values), color=shade, linestyle=dash, label=label)
        phase.semilogx(f_hz, np.degrees(np.unwrap(np.angle(values))), color=shade, linestyle=dash)
    if level is not None:
        size.axhline(level, color=STYLE.faint, linewidth=0.8)
        phase.axhline(-180, color=STYLE.faint, linewidth=0.8)
    size.set_ylabel(f"{what} [dB{' rad/V' if level is None else ''}]")
    phase.set_ylabel("phase [°]")
    phase.set_xlabel("frequency [Hz]")
    phase.yaxis.set_major_locator(_turns())
    _legend(figure, size, wide)
    size.margins(x=0)
    return figure


def _turns() -> MultipleLocator:
    """Ticks of a phase: quarter turns."""
    return MultipleLocator(90)


def _legend(figure: Figure, axes, wide: bool) -> None:
    handles, labels = axes.get_legend_handles_labels()
    columns = min(len(labels), (6 if max(map(len, labels)) < 22 else 4) if wide else 2)
    figure.legend(handles, labels, loc="outside upper left", ncols=columns, handlelength=1.8, columnspacing=1.2)


def decibels(x: np.ndarray) -> np.ndarray:
    """20 log10 |x|."""
    return 20.0 * np.log10(np.maximum(np.abs(x), 1e-12))


def planes(loops: Sequence[Loop]) -> str:
    """Nyquist's and Nichols' planes of the open loops."""
    return both_widths(lambda width: _planes(loops, width), "Nyquist and Nichols plots of the open loops")


def _planes(loops: Sequence[Loop], width: float) -> Figure:
    wide = width == STYLE.wide
    figure = Figure(figsize=(width, 4.6 if wide else 8.6), layout="constrained")
    nyquist, nichols = figure.subplots(1, 2) if wide else figure.subplots(2, 1)
    turn = np.linspace(0, 2 * np.pi, 181)
    nyquist.plot(np.cos(turn), np.sin(turn), color=STYLE.grid, linewidth=1.0)
    weakest = min(loops, key=lambda x: x.disk_margin).disk_margin
    middle, radius = _disk(weakest)
    if radius is not None:
        nyquist.fill(
            middle + radius * np.cos(turn),
            radius * np.sin(turn),
            color=STYLE.shade,
            alpha=0.35,
            linewidth=0,
            label="least disk margin",
        )
    for ax in (nyquist, nichols):
        ax.plot([-1 if ax is nyquist else -180], [0], "+", color=STYLE.ink, markersize=9)
    for x in loops:
        nyquist.plot(x.L.real, x.L.imag, color=_shade(x), linestyle=_dash(x, loops), label=_label(x, loops))
        nichols.plot(_phase(x.L), decibels(x.L), color=_shade(x), linestyle=_dash(x, loops))
    for level in CLOSED_DB:
        _contour(nichols, level)
    reach = 2.2  # of Nyquist's plane, to the left
    nyquist.set_xlim(-reach, 0.6 * reach)
    nyquist.set_ylim(-0.8 * reach, 0.8 * reach)
    nyquist.set_aspect("equal")
    nyquist.set_xlabel("real part")
    nyquist.set_ylabel("imaginary part")
    nichols.set_xlim(-300.0, 0.0)
    nichols.set_ylim(-30.0, 40.0)
    nichols.xaxis.set_major_locator(_turns())
    nichols.set_xlabel("phase [°]")
    nichols.set_ylabel("open loop [dB]")
    _legend(figure, nyquist, wide)
    return figure


def _disk(alpha: float) -> tuple[float, float | None]:
    """Centre and radius of the balanced disk about -1 that a loop of disk margin alpha does not enter; no radius where
    it is no disk.
    """
    if alpha >= 2.0:
        return -1.0, None
    low, high = (1.0 - 0.5 * alpha) / (1.0 + 0.5 * alpha), (1.0 + 0.5 * alpha) / (1.0 - 0.5 * alpha)
    return -0.5 * (low + high), 0.5 * (high - low)


def _phase(L: np.ndarray) -> np.ndarray:
    """Phase [°] without jumps that begins within -360 .. 0."""
    phase = np.degrees(np.unwrap(np.angle(L)))
    return phase - 360.0 * math.ceil(phase[0] / 360.0)


def _contour(ax, level: float) -> None:
    """Where |T| is `level` [dB]: L = T / (1 - T)."""
    T = 10.0 ** (level / 20.0) * np.exp(1j * np.linspace(1e-3, 2 * np.pi - 1e-3, 361))
    L = T / (1.0 - T)
    phase = np.degrees(np.angle(L)) % 360.0 - 360.0
    ax.plot(phase, decibels(L), color=STYLE.faint, linewidth=0.7, linestyle=(0, (2, 2)))
    top = int(np.argmax(decibels(L)))
    ax.annotate(
        f"{level:g} dB", (phase[top], decibels(L)[top]), fontsize=7.5, color=STYLE.faint, ha="center", va="bottom"
    )


def sensitivities(loops: Sequence[Loop]) -> str:
    """|S| and |T| over frequency."""
    return both_widths(lambda width: _sensitivities(loops, width), "sensitivity and complementary sensitivity")


def _sensitivities(loops: Sequence[Loop], width: float) -> Figure:
    wide = width == STYLE.wide
    figure = Figure(figsize=(width, 3.6 if wide else 6.0), layout="constrained")
    axes = figure.subplots(1, 2, sharey=True) if wide else figure.subplots(2, 1)
    for ax, name in zip(axes, "ST", strict=True):
        for x in loops:
            ax.semilogx(
                x.f_hz, decibels(getattr(x, name)), color=_shade(x), linestyle=_dash(x, loops), label=_label(x, loops)
            )
        ax.axhline(0, color=STYLE.faint, linewidth=0.8)
        ax.set_ylim(-50, 12)
        ax.margins(x=0)
        ax.set_ylabel(f"|{name}| [dB]")
        ax.set_xlabel("frequency [Hz]")
    _legend(figure, axes[0], wide)
    return figure


def cycles(found: Cycles, h: float) -> str | None:
    """The end of a loop that was let go, plant by plant, beside the sine that is predicted; None where all rest and
    nothing lasting is predicted.
    """
    lasting = next((c for c in found.predicted if c.lasting), None)
    if lasting is None and not any(found.seen.values()):
        return None
    return both_widths(lambda width: _cycles(found, lasting, h, width), f"limit cycle of {found.controller}")


def _cycles(found: Cycles, lasting, h: float, width: float) -> Figure:
    figure = Figure(figsize=(width, 2.8), layout="constrained")
    ax = figure.subplots()
    tempo = lasting or next(c for c in found.seen.values() if c)
    n = min(max(round(4.0 / (tempo.f_hz * h)), 20), next(iter(found.tails.values())).size)
    t = h * np.arange(n)
    for k, (plant, tail) in enumerate(found.tails.items()):
        part = np.degrees(tail[: 2 * n] - tail.mean()) if found.seen[plant] else np.degrees(tail[: 2 * n])
        up = np.flatnonzero((part[:-1] < 0) & (part[1:] >= 0))
        begin = int(up[0]) if up.size and up[0] + n <= part.size else 0
        ax.plot(
            1e3 * t[: part.size - begin],
            part[begin : begin + n],
            color=MODELS[k],
            label=f"{plant}, seen" if found.seen[plant] else f"{plant}, at rest",
        )
    if lasting is not None:
        fine = np.linspace(t[0], t[-1], 300)
        ax.plot(
            1e3 * fine,
            np.degrees(lasting.amplitude) * np.sin(2 * np.pi * lasting.f_hz * fine),
            color=STYLE.measured,
            linewidth=2.6,
            zorder=1,
            label="predicted",
        )
    ax.set_xlabel("time [ms]")
    ax.set_ylabel("angle [°]")
    ax.margins(x=0)
    _legend(figure, ax, width == STYLE.wide)
    return figure


def recording(compared: Compared) -> str:
    """A recording's response over the models', its coherence, and its noise and distortion."""
    return both_widths(lambda width: _recording(compared, width), "frequency response of a recording over the models'")


def _recording(compared: Compared, width: float) -> Figure:
    r, wide = compared.response, width == STYLE.wide
    figure = Figure(figsize=(width, 7.4), layout="constrained")
    size, phase, trust, levels = figure.subplots(4, 1, sharex=True, height_ratios=(1.6, 1.2, 0.7, 1.1))
    for k, (name, model) in enumerate(compared.models.items()):
        size.semilogx(r.f_hz, decibels(model), color=MODELS[k % len(MODELS)], label=name)
        phase.semilogx(r.f_hz, np.degrees(np.unwrap(np.angle(model))), color=MODELS[k % len(MODELS)])
    marks = {"linestyle": "none", "marker": "o", "markersize": 4.5}
    first = next(iter(compared.models.values()))
    turned = np.degrees(np.angle(r.g / first) + np.unwrap(np.angle(first)))  # on the models' branch
    for part, shade, label in ((r.sure, STYLE.ink, "recorded, sure"), (~r.sure, "#b9c2cc", "recorded, unsure")):
        if part.any():
            size.semilogx(r.f_hz[part], decibels(r.g[part]), color=shade, label=label, **marks)
            phase.semilogx(r.f_hz[part], turned[part], color=shade, **marks)
    trust.semilogx(r.f_hz, r.coherence, color=STYLE.ink, marker=".", linewidth=0.8)
    trust.axhline(SURE, color=STYLE.faint, linewidth=0.8, linestyle=(0, (3, 3)))
    trust.set_ylim(0, 1.05)
    unit = math.degrees(1.0)
    levels.loglog(r.f_hz, unit * r.output, color=STYLE.ink, marker=".", label="output")
    levels.loglog(
        r.f_hz,
        unit * r.noise,
        color=STYLE.measured,
        marker=".",
        label="noise and distortion" if r.periods == 1 else "noise",
    )
    if np.isfinite(r.distortion).any():
        levels.loglog(
            r.f_hz,
            unit * np.where(r.distortion > 0, r.distortion, np.nan),
            color=STYLE.distortion,
            marker=".",
            label="distortion",
        )
    for ax, label in (
        (size, f"size [dB{compared.unit}]"),
        (phase, "phase [°]"),
        (trust, "coherence"),
        (levels, "amplitude [°]"),
    ):
        ax.set_ylabel(label)
    levels.set_xlabel("frequency [Hz]")
    levels.legend(loc="best", fontsize=8)
    phase.yaxis.set_major_locator(_turns())
    _legend(figure, size, wide)
    return figure
