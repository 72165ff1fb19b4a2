"""A rig's own best answer: what the diagnosis finds in its records as they are, to measure by it what is put into them.

records as they are -> diagnosis -> names and model; records touched -> the same names alone -> what they leave
"""

from __future__ import annotations

import math
import tempfile
from collections.abc import Mapping
from dataclasses import replace
from functools import cached_property
from pathlib import Path

import numpy as np
from threadpoolctl import threadpool_limits

from ers_mj.data.recording import Recording
from ers_mj.diagnosis import pipeline
from ers_mj.diagnosis.document import Diagnosis as Found
from ers_mj.door.model import Model
from ers_mj.door.reading import read
from ers_mj.selection.budget import SEARCH


class OwnAnswer:
    """The best answer to a rig as it is.

    Args:
        records: {file name: CSV text} of its records, untouched.
        jobs: threads of a diagnosis.

    Raises:
        InputError: the records cannot be diagnosed.
    """

    def __init__(self, records: Mapping[str, str], jobs: int = 1):
        self.records, self.jobs = recordings_of(records), jobs

    @cached_property
    def _found(self) -> Found:
        return self._diagnosed(self.records, None)

    def _diagnosed(self, recordings: list[Recording], among: tuple[str, ...] | None) -> Found:
        with threadpool_limits(1):
            search = replace(SEARCH, among=among, in_mujoco=False, tabled=False, advised=False)
            return pipeline.diagnose(recordings, None, jobs=self.jobs, search=search)

    @property
    def names(self) -> tuple[str, ...]:
        """What is named in it, strongest first."""
        return tuple(entry["effect"] for entry in self._found.document["missing"])

    @cached_property
    def model(self) -> Model:
        """Its improved model."""
        data = self._found.document["data"]
        return Model(self._found.model, output_unit=data["output_unit"], input_unit=data["input_unit"])

    @property
    def error(self) -> float:
        """The held-out error that it leaves [output unit], see ``_left``."""
        return self._left(self._found)

    def visibility(self, touched: Mapping[str, str]) -> float:
        """What records that were ``touched`` leave beyond the rig's own, once its names alone are fitted to them, over
        what it leaves as it is: sqrt(e^2 - e_0^2) / e_0 of the held-out errors e, 0 where they leave no more.
        """
        left = self._left(self._diagnosed(recordings_of(touched), self.names))
        return math.sqrt(max(left**2 - self.error**2, 0.0)) / self.error

    def _left(self, found: Found) -> float:
        """The held-out error [output unit] of an answer by the measure that decides; recalibrated, as it is and
        touched, where the records as they are differ by more than chance, which says nothing of what was put into them.
        """
        differ = self._found.document["record_state"]
        return float(found.document["fit"]["recalibrated_rmse_after_rad" if differ else "heldout_rmse_after_rad"])

    def moved(self, effect: str, values: Mapping[str, float]) -> list[np.ndarray]:
        """By how much an effect moves the output of the model (N,) [output unit] under the input of each record."""
        sheet = self.model.datasheet
        sheet = replace(sheet, effects=(*sheet.effects, (effect, dict(values))))
        with_it = Model(sheet, inductance=self.model.inductance)
        return [self.model.residual(record) - with_it.residual(record) for record in self.records]


def recordings_of(records: Mapping[str, str]) -> list[Recording]:
    """The recordings of these files, read as every diagnosis reads them."""
    with tempfile.TemporaryDirectory(prefix="ers-own-") as folder:
        for name, text in records.items():
            (Path(folder) / name).write_text(text, encoding="utf-8")
        return [read(Path(folder) / name) for name in records]
