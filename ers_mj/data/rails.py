"""Readings at the rail of a sensor or its converter: what lies beyond is not seen. They repeat to the last digit amid
noise, which takes them off elsewhere and never goes beyond.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from ers_mj.data.sensor_faults import at_extreme, decimal_grain, dithered, frozen_spans, held_spans, noise_sigma


@dataclass(frozen=True)
class Rails:
    """When readings that are the largest of all, or the least, are a rail's though they never rest there for long."""

    fewest: int = 20  # of them
    visits: int = 5  # spells of them, beside which noise takes the reading off: a hard stop of a simulation has none
    crowded: float = 10.0  # times as many as the next reading has
    fine: float = 1.5  # converter's steps that the noise has: a coarser one repeats its readings anyway


RAILS = Rails()


def rail_spans(y: np.ndarray, step: float) -> list[slice]:
    """Spans of an output y (N,) as printed, of a converter's ``step`` there, that are at a rail."""
    known = y[np.isfinite(y)]
    rails = {float(y[s.start]) for s in frozen_spans(y, step or decimal_grain(known)) if at_extreme(y, s)}
    at = {level: [s for s in held_spans(y, 1) if y[s.start] == level] for level in (known.min(), known.max())}
    if noise_sigma(y, step) > RAILS.fine * step:
        levels, counts = np.unique(known, return_counts=True)
        ends = (levels[0], counts[0], counts[1]), (levels[-1], counts[-1], counts[-2])
        rails |= {
            float(level)
            for level, count, beside in ends
            if count >= max(RAILS.fewest, RAILS.crowded * beside)
            and np.count_nonzero([dithered(y, span) for span in at[level]]) >= RAILS.visits
        }
    return sorted((span for level in rails for span in at[level]), key=lambda span: span.start)


def off_rails(fields: Mapping[str, np.ndarray], spans: list[slice]) -> dict[str, np.ndarray]:
    """The fields of a recording with the output missing there."""
    if not spans:
        return dict(fields)
    y = fields["y"].copy()
    for span in spans:
        y[span] = np.nan
    return {**fields, "y": y, "valid": np.isfinite(y)}
