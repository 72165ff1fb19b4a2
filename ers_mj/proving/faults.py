"""Faults that real recordings have and that are no effect: put on the columns of a file that is otherwise whole."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

Table = dict[str, np.ndarray]  # columns (N,) by name, NaN where a cell is blank
SHARE = 0.35  # of the cases, that have some


def draw_faults(
    rng: np.random.Generator, columns: dict[str, str], jitter: float, travel: tuple[float, float], turns: bool
) -> list[dict]:
    """One or two faults of a case, each with its numbers, in a third of the cases.

    Args:
        columns: names of input and output.
        jitter: of the time stamps that the noise hides [s].
        travel: of the output; where it `turns`, its count may wrap inside.
    """
    if rng.random() >= SHARE:
        return []
    kinds = ["held", "blanks", "gap", "jitter"]
    kinds += ["wrap"] if turns else []
    kinds += ["supply", "unsigned"] if columns["input"] in ("u_V", "u_duty_pct") else []
    out = []
    for kind in rng.permutation(kinds)[: 1 + int(rng.random() < 0.3)]:
        fault = {"kind": str(kind), "seed": int(rng.integers(2**31))}
        if kind == "jitter":
            fault["s"] = jitter
        if kind == "wrap":
            fault["at"] = float(travel[0] + rng.uniform(0.2, 0.8) * (travel[1] - travel[0]))
        out.append(fault)
    return out


def with_faults(table: Table, faults: list[dict], number: int, columns: dict[str, str]) -> Table:
    """The columns of recording `number` (from 0) with these faults."""
    for fault in faults:
        rng = np.random.default_rng([fault["seed"], number])
        table = FAULTS[fault["kind"]](rng, dict(table), fault, columns)
    return table


def _held(rng, table, fault, columns):
    """The output is read anew for every second row only: each value stands twice."""
    y = table[columns["output"]]
    return table | {columns["output"]: y[np.arange(y.size) // 2 * 2]}


def _blanks(rng, table, fault, columns):
    """Cells without a value, alone or a few together."""
    y = table[columns["output"]].copy()
    for start in np.flatnonzero(rng.random(y.size) < 0.003):
        y[start + 5 : start + 5 + int(rng.integers(1, 4))] = np.nan
    return table | {columns["output"]: y}


def _gap(rng, table, fault, columns):
    """Rows that were lost, alone."""
    keep = rng.random(table["t_s"].size) > 0.002
    keep[:20] = True
    return {name: x[keep] for name, x in table.items()}


def _jitter(rng, table, fault, columns):
    """Stamps that are not quite the times at which the samples were taken."""
    t = table["t_s"]
    step = float(np.median(np.diff(t)))
    late = np.clip(fault["s"] * rng.standard_normal(t.size), -0.3 * step, 0.3 * step)
    return table | {"t_s": t + late - late[0]}


def _wrap(rng, table, fault, columns):
    """The angle is counted within one turn, whose end lies inside the travel."""
    y = table[columns["output"]]
    low = fault["at"] - 2.0 * np.pi
    return table | {columns["output"]: low + np.mod(y - low, 2.0 * np.pi)}


def _supply(rng, table, fault, columns):
    """The supply is logged, with readings off its median."""
    u = table[columns["input"]]
    nominal = 12.0 if columns["input"] == "u_duty_pct" else float(np.ceil(np.abs(u).max()))
    volts = nominal + 0.02 * rng.standard_normal(u.size)
    volts[rng.random(u.size) < 0.001] = 0.0
    return table | {"vin_V": np.round(volts, 2)}


def _unsigned(rng, table, fault, columns):
    """The input has lost its sign, which stands in a column of its own."""
    u = table[columns["input"]]
    return table | {columns["input"]: np.abs(u), "direction": np.where(u < 0.0, 0.0, 1.0)}


FAULTS: dict[str, Callable[..., Table]] = {
    "held": _held,
    "blanks": _blanks,
    "gap": _gap,
    "jitter": _jitter,
    "wrap": _wrap,
    "supply": _supply,
    "unsigned": _unsigned,
}
"""Kind -> how it is put on a table."""
