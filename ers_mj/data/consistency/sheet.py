"""The columns of one recording while they are looked over, and what may be found in them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np


@dataclass(frozen=True)
class Fault:
    """What of a recording was masked or mended, or is to be known.

    Attributes:
        kind: held, wrap, leap, blackout, torque_off, gap, time_jump, supply, unsigned_input, constant_input, unit,
            stuck, clipped, blank, jitter, converter; or a mere note: limit (of an input), ignored, read.
        column: of the file.
        count: samples (or places) concerned.
        region: from the first to the last of them [s], or None.
        sentence: what is so, and what was done.
    """

    kind: str
    column: str
    sentence: str
    count: int = 0
    region: tuple[float, float] | None = None

    @property
    def is_note(self) -> bool:
        """Whether it is worth a sentence and no row of the faults."""
        return self.kind in ("limit", "ignored", "read")

    def as_document(self, file: str) -> dict:
        """The row of diagnosis.json."""
        return {
            "kind": self.kind,
            "file": file,
            "column": self.column,
            "count": self.count,
            "region_s": list(self.region) if self.region else None,
            "sentence": self.sentence,
        }


@dataclass(frozen=True, eq=False)
class Sheet:
    """Checked fields of a recording, (N,) each.

    Attributes:
        name: of the recording, for messages.
        kind: of its input.
        fields: field -> values in SI; NaN where a measured one is missing.
        labels: field -> column of the file.
        units: field -> unit of the values.
        rows: which rows of the file these are.
        step: the converter's, of the output [output unit]; 0 where there is none.
        sure: fields whose unit a person has given: their scale is not doubted.
    """

    name: str
    kind: str
    fields: Mapping[str, np.ndarray]
    labels: Mapping[str, str]
    units: Mapping[str, str]
    rows: np.ndarray
    step: float = 0.0
    sure: frozenset[str] = frozenset()

    @property
    def t(self) -> np.ndarray:
        return self.fields["t"]

    @property
    def y(self) -> np.ndarray:
        return self.fields["y"]

    @property
    def u(self) -> np.ndarray:
        return self.fields["u"]

    def changed(self, **fields: np.ndarray) -> Sheet:
        """With other values."""
        return replace(self, fields={**self.fields, **fields})

    def without(self, field: str) -> Sheet:
        """With a field left out."""
        return replace(self, fields={f: x for f, x in self.fields.items() if f != field})

    def only(self, rows: np.ndarray) -> Sheet:
        """Some of the rows: a mask or their numbers."""
        return replace(self, fields={f: x[rows] for f, x in self.fields.items()}, rows=self.rows[rows])

    def masked(self, field: str, where: np.ndarray) -> Sheet:
        """With a measured field missing at a mask (N,)."""
        return self.changed(**{field: np.where(where, np.nan, self.fields[field])})

    def row(self, k: int) -> int:
        """The data row of the file, counted from one, of sample k."""
        return int(self.rows[k]) + 1

    def fault(self, kind: str, field: str, where: np.ndarray, sentence: str) -> Fault:
        """A fault at a mask (N,) or at numbers of samples."""
        at = np.flatnonzero(where) if where.dtype == bool else where
        region = (float(self.t[at[0]]), float(self.t[at[-1]])) if at.size else None
        return Fault(kind, self.labels[field], sentence, int(at.size), region)


Found = tuple[Sheet, list[Fault]]
