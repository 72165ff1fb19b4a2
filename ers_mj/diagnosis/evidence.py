"""What a diagnosis hands to its report beside the document: curves, candidates and the map of residuals."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from ers_mj.diagnosis.mismatch_spectrum import Mismatch


@dataclass(frozen=True, eq=False)
class RecordView:
    """One recording beside its free runs, each (N,): t [s], u, and outputs in output units, NaN where missing.

    ``shaded`` are the spans of time [s] in which the located mismatch lives. ``without`` are the free runs of the model
    after with one named effect taken out of it and nothing refitted, by the effect's name.
    """

    name: str
    held_out: bool
    t: np.ndarray
    u: np.ndarray
    measured: np.ndarray
    before: np.ndarray
    after: np.ndarray
    shaded: tuple[tuple[float, float], ...] = ()
    without: Mapping[str, np.ndarray] = field(default_factory=dict)

    @property
    def error_before(self) -> float:
        """Root mean square of what the model before leaves [output unit], 0 where nothing was measured."""
        error = self.measured - self.before
        known = error[np.isfinite(error)]
        return float(np.sqrt(np.mean(known**2))) if known.size else 0.0


@dataclass(frozen=True)
class Rung:
    """One candidate: what it gains in block cost over what its round began with, how surely (``z``), what it scores on
    held-out data, and ``total``, what it takes off the baseline's block cost; NaN where that is not told.
    """

    effects: tuple[str, ...]
    gain: float
    z: float
    heldout_rmse: float | None
    chosen: bool
    note: str
    parameters: int
    total: float = math.nan


@dataclass(frozen=True, eq=False)
class ResidualMap:
    """Rms residual (A, S) over angle and speed bins of edges (A+1,) and (S+1,), in output units; NaN where no data
    is.
    """

    angle_edges: np.ndarray
    speed_edges: np.ndarray
    rms_before: np.ndarray
    rms_after: np.ndarray


@dataclass(frozen=True, eq=False)
class LatentForce:
    """The acceleration that a recording asks for beside the answer over times t (M,) [s], (M,) [output unit / s^2], and
    what of it the tables of what is unknown give, or None; ``noise`` is what the sensor's noise alone makes.
    """

    name: str
    t: np.ndarray
    asked: np.ndarray
    tabled: np.ndarray | None
    noise: float


@dataclass(frozen=True)
class Evidence:
    """Everything a report draws. ``noise`` is the noise floor in output units, ``spectrum`` what the model before
    leaves over frequency, ``latent`` what the answer lacks over time, where more than noise is left.
    """

    records: tuple[RecordView, ...]
    ladder: tuple[Rung, ...]
    residual_map: ResidualMap | None
    noise: float
    output_unit: str
    input_unit: str
    spectrum: Mismatch | None = None
    latent: LatentForce | None = None

    @property
    def told(self) -> list[RecordView]:
        """The recordings as a reader meets them: held-out ones first, among them where the model before does worst."""
        return sorted(self.records, key=lambda view: (not view.held_out, -view.error_before))
