"""The main job: recordings in, the missing physics out, as one result."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

from threadpoolctl import threadpool_limits

from ers_mj.door.known import Known, known
from ers_mj.door.model import Model
from ers_mj.door.reading import Given, recordings_of
from ers_mj.door.results import Progress, Result, Writers, parameter_rows, silent
from ers_mj.door.saving import report_writers, today, write_text
from ers_mj.door.together import refuse_mixed_inputs, refuse_other_units, refuse_twice
from ers_mj.errors import InputError
from ers_mj.selection.budget import QUICK, SEARCH
from ers_mj.servo.model_file import write_model

if TYPE_CHECKING:
    from ers_mj.diagnosis.document import Diagnosis as Found


class Diagnosis(Result):
    """What a diagnosis found; `diagnose` makes it.

    `to_dict()` is diagnosis.json, `to_frame()` every parameter of the servo and of the named effects with its 95 %
    interval, `save(folder)` writes diagnosis.json, report.html, model.toml and plant.xml.
    """

    made_by = ""  # the command, where one made it, for the page
    made_on = ""  # the day that the page tells, today where none is given

    def __init__(self, found: Found):
        super().__init__(found.document)
        self._found = found

    @property
    def verdict(self) -> str:
        """consistent, parameters_only, missing_physics or unexplained."""
        return str(self._document["verdict"])

    @property
    def sentence(self) -> str:
        """The answer in one sentence."""
        return str(self._document["sentence"])

    @property
    def effects(self) -> tuple[str, ...]:
        """Names of the missing physics, strongest first; none under another verdict."""
        return tuple(effect["effect"] for effect in self._document["missing"])

    @property
    def left_out(self) -> tuple[str, ...]:
        """What a quick look left out, a sentence each."""
        return tuple(part["sentence"] for part in self._document.get("left_out") or ())

    @cached_property
    def model(self) -> Model:
        """The improved model: the refitted servo with the named effects."""
        data = self._document["data"]
        return Model(self._found.model, output_unit=data["output_unit"], input_unit=data["input_unit"])

    def __repr__(self) -> str:
        named = f": {', '.join(self.effects)}" if self.effects else ""
        return f"<Diagnosis {self.verdict}{named}>\n{self.sentence}"

    def _rows(self) -> list[dict[str, Any]]:
        rows = parameter_rows("servo", self._document.get("parameters") or {})
        for effect in self._document["missing"]:
            rows += parameter_rows(effect["effect"], effect["parameters"])
        return rows

    def _page(self) -> str:
        from ers_mj.report.diagnosis_report import summary_page

        return summary_page(self._document, self._found.evidence)

    @property
    def _beside(self) -> Writers:
        """What is saved beside the document and the page."""
        from ers_mj.report.diagnosis_report import NEXT_INPUT

        found = self._found
        writers: dict[str, Callable[[Path], None]] = {
            "model.toml": lambda path: write_model(path, found.model),
            "plant.xml": lambda path: write_text(path, found.plant.xml()),
        }
        following = (self._document.get("next_recording") or {}).get("excitation")
        if following:
            writers[NEXT_INPUT] = lambda path: write_text(path, input_table(following))
        return writers

    def _report(self) -> str:
        from ers_mj.report.diagnosis_report import Made, report_page
        from ers_mj.view.frames import frames_of

        found, made = self._found, Made(self.made_by, self.made_on or today(), ("diagnosis.json", *self._beside))
        return report_page(self._document, found.evidence, frames_of(found.plant, found.evidence), made)

    def _writers(self) -> Writers:
        return report_writers("diagnosis.json", self._document, self._report()) | dict(self._beside)


def diagnose(
    recordings: Given | Iterable[Given],
    datasheet: Known = None,
    holdout: Given | Iterable[Given] = (),
    *,
    seed: int = 0,
    jobs: int | None = None,
    progress: Progress = silent,
    quick: bool = False,
) -> Diagnosis:
    """Locate, name and model what a simulation of these recordings leaves out.

    Args:
        recordings: of one servo, with one kind of input: paths or recordings, one or many.
        datasheet: what is known of the servo (SI): a path, "table1" for the paper's, a mapping laid out as the TOML,
            a datasheet or a model. None: everything is identified.
        holdout: recordings that are opened only after the selection has ended; without them each one is left out in
            turn.
        seed: kept in the document; nothing here draws random numbers.
        jobs: threads; all cores by default. The result does not depend on it.
        progress: told (text, share of the work done).
        quick: a first look, which leaves parts out and says which (`left_out`).

    Returns:
        The diagnosis, errors in output units.

    Raises:
        InputError: what was given cannot be used, in one sentence.

    Source: Energies 2020, Eq. (1) and (6), is the baseline; an effect is named where it pays on data that it was not
    fitted to.
    """
    from ers_mj.diagnosis import pipeline

    trained, held = recordings_of(recordings), recordings_of(holdout)
    if not trained:
        raise InputError("no recording was given, at least one was expected")
    refuse_twice(trained, held)
    refuse_mixed_inputs([*trained, *held])
    sheet, search = known(datasheet), QUICK if quick else SEARCH
    refuse_other_units(sheet, trained)
    with threadpool_limits(1):  # ours are for recordings and effects; small matrices are slower on many, and differ
        found = pipeline.diagnose(trained, sheet, held, seed=seed, jobs=jobs, progress=progress, search=search)
    return Diagnosis(found)


def input_table(excitation: dict[str, Any]) -> str:
    """The input to record next, as `ers simulate --input` takes it."""
    from ers_mj.data.columns import input_name
    from ers_mj.data.excitation import signal

    column = input_name(excitation["input_unit"])
    return "\n".join([f"t_s,{column}", *(f"{t:.9g},{u:.6g}" for t, u in zip(*signal(excitation), strict=True))]) + "\n"
