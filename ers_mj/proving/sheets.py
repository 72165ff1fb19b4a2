"""The datasheet that is handed out beside the recordings of a family: whole, half of it, or none."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

SHEETS = {"full": 0.4, "half": 0.3, "none": 0.3}
OFF = 0.08  # standard deviation of the logarithm by which its numbers are off
EXACT = ("n", "theta_0")


def draw_sheet(rng: np.random.Generator, kinds: Mapping[str, float] = SHEETS) -> str:
    """Which of them."""
    return str(rng.choice(list(kinds), p=np.array(list(kinds.values())) / sum(kinds.values())))


def sheet_text(
    rng: np.random.Generator, kind: str, table: str, numbers: Mapping[str, float], rate_hz: float
) -> str | None:
    """The file, or None.

    Args:
        table: parameters, or lumped.
        numbers: the true ones; what is zero and no count of anything is not told.
    """
    off = {name: float(np.exp(OFF * np.clip(rng.standard_normal(), -1.9, 1.9))) for name in numbers}
    told = {name: x * (1.0 if name in EXACT else off[name]) for name, x in numbers.items() if x != 0.0}
    if kind == "half":
        kept = set(rng.permutation(sorted(told))[: (len(told) + 1) // 2])
        told = {name: x for name, x in told.items() if name in kept}
    if kind == "none":
        return None
    lines = [f"[{table}]", *(f"{name} = {x:.6g}" for name, x in told.items())]
    return "\n".join([*lines, "", "[recording]", f"sample_rate_hz = {rate_hz:g}", ""])
