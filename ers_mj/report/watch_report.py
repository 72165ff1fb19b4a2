"""What `ers watch` says: a line an event, a line a second, and a screen."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from textwrap import wrap

from ers_mj.online.horizon import HORIZON
from ers_mj.online.moving_horizon import Estimate
from ers_mj.report.display import figure

MEANING = {"a_1": "spring", "a_2": "damping", "b": "drive", "c_1": "preload", "c_2": "friction", "theta_0": "home"}
BARS = "▁▂▃▄▅▆▇█"
BOLD, RED, GREEN, YELLOW, PLAIN = "\x1b[1m", "\x1b[1;31m", "\x1b[32m", "\x1b[33m", "\x1b[0m"


def units(output: str, input_: str) -> dict[str, tuple[str, float]]:
    """How each parameter is shown: unit and factor."""
    y, u = output, {"pct": "%"}.get(input_, input_)
    home = ("°", math.degrees(1.0)) if output == "rad" else (y, 1.0)
    return {
        "a_1": ("1/s²", 1.0),
        "a_2": ("1/s", 1.0),
        "b": (f"{y}/s²/{u}", 1.0),
        "c_1": (f"{y}/s²", 1.0),
        "c_2": (f"{y}/s²", 1.0),
        "theta_0": home,
    }


def events(last: Estimate | None, now: Estimate, shown: Mapping[str, tuple[str, float]]) -> list[str]:
    """What has happened between two estimates, a sentence each."""
    out = []
    for name, (before, after) in now.changed.items():
        unit, factor = shown[name]
        share = f" ({100 * (after / before - 1):+.0f} %)" if name != "theta_0" else ""
        out.append(
            f"{MEANING[name]} {name} has changed from {figure(before * factor, 4)} to {figure(after * factor, 4)}"
            f" {unit}{share}"
        )
    if now.flag and not (last and last.flag):
        out.append(
            f"FLAG: for {now.unexplained:.1f} s no parameters of this model have explained the stream,"
            f" {math.sqrt(max(now.misfit, 0)):.1f} times the noise is left; something is in the servo that the model"
            " has not (record it, and ask ers diagnose)"
        )
    if last and last.flag and not now.flag:
        out.append("the model explains the stream again")
    return out


def line(now: Estimate, shown: Mapping[str, tuple[str, float]]) -> str:
    """One estimate on one line."""
    values = ", ".join(f"{name} {figure(now.values[name] * shown[name][1], 4)}" for name in now.spread)
    state = f" (unexplained for {now.unexplained:.1f} s)" if now.unexplained else ""
    return (
        f"{now.t:.1f} s  {values}{state}; {math.sqrt(max(now.misfit, 0)):.2f} times the noise is left of"
        f" {now.window:.1f} s"
    )


def as_document(now: Estimate, told: Sequence[str]) -> dict:
    """One estimate for machines."""
    return {
        "t_s": now.t,
        "parameters": {n: {"value": now.values[n], "ci95": _interval(now, n)} for n in now.spread},
        "window_s": now.window,
        "misfit": now.misfit,
        "noise": now.sigma,
        "unexplained_s": now.unexplained,
        "flag": now.flag,
        "changed": {n: {"before": a, "after": b} for n, (a, b) in now.changed.items()},
        "events": list(told),
    }


def _interval(now: Estimate, name: str) -> list[float]:
    half, x = 1.96 * now.spread[name], now.values[name]
    if name == "theta_0":
        return [x - half, x + half]
    return sorted((x * math.exp(-min(half, 50.0)), x * math.exp(min(half, 50.0))))


def screen(
    name: str,
    history: Sequence[Estimate],
    told: Sequence[str],
    first: Mapping[str, float],
    shown: Mapping[str, tuple[str, float]],
    width: int,
) -> list[str]:
    """The live view: state, parameters with what they were lately, events; lines of at most ``width`` characters
    without their colours.
    """
    now = history[-1]
    if now.flag:
        state = RED, f"the model does not explain the stream any more ({now.unexplained:.1f} s)"
    elif now.unexplained:
        state = YELLOW, f"something changes ({now.unexplained:.1f} s)"
    else:
        state = GREEN, "the model explains the stream"
    factor, unit = (math.degrees(1.0), "°") if shown["theta_0"][0] == "°" else (1.0, " " + shown["theta_0"][0])
    head = (
        f"{now.t:.1f} s, noise {figure(now.sigma * factor)}{unit}, {math.sqrt(max(now.misfit, 0)):.2f} times it is left"
        f" over the last {now.window:.1f} s"
    )
    lines = [
        f"{BOLD}ers watch  {name}"[: width + 4] + PLAIN,
        f"{state[0]}● {state[1]}"[: width + len(state[0])] + PLAIN,
        f"  {head}"[:width],
        "",
    ]
    for n in now.spread:
        unit, factor = shown[n]
        half = now.spread[n] * 1.96 * (factor if n == "theta_0" else abs(now.values[n]) * factor)
        since = f"{100 * (now.values[n] / first[n] - 1):+7.1f} %" if n != "theta_0" and first.get(n) else " " * 9
        text = f"  {MEANING[n]:9}{n:8}{figure(now.values[n] * factor, 4):>9} ± {figure(half, 2):<8} {unit:10}{since}  "
        lines.append(
            (text + _bars([e.values[n] for e in history if e.misfit <= HORIZON.explained], width - len(text)))[:width]
        )
    said = [row for event in told for row in wrap(event, width, initial_indent="  ", subsequent_indent="      ")]
    return [*lines, "", *said, "", "  Ctrl-C ends"[:width]]


def _bars(values: Sequence[float], width: int) -> str:
    """A line of bars, the lowest value to the highest or 2 % of a value, whichever is more."""
    values = list(values)[-max(width, 0) :]
    if not values or width <= 0:
        return ""
    middle = 0.5 * (max(values) + min(values))
    span = max(max(values) - min(values), 0.02 * abs(max(values, key=abs)), 1e-300)
    return "".join(BARS[min(int((0.5 + (x - middle) / span) * len(BARS)), len(BARS) - 1)] for x in values)
