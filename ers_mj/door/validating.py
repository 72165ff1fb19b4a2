"""The reduced model against the MuJoCo plant, as one result."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, TypeVar

from ers_mj.door.known import Known, known_plant
from ers_mj.door.results import Progress, Result, Writers, silent
from ers_mj.door.saving import report_writers, versions
from ers_mj.errors import InputError, refuse_other
from ers_mj.plants.inputs import DURATION
from ers_mj.servo.datasheet import Datasheet
from ers_mj.validation import cases

if TYPE_CHECKING:
    from ers_mj.validation.cases import Validation as Found

A = TypeVar("A")


class Validation(Result):
    """Where the reduced model holds; `validate` makes it.

    `to_dict()` is validation.json, `to_frame()` a row a case (input, gap_rad, linkage, inductance, rms_rad, ...),
    `save(folder)` writes validation.json and report.html.
    """

    def __init__(self, validation: Found, left_out: Sequence[str], datasheet: str):
        from ers_mj.report.validity import as_document

        about = {"left_out": list(left_out), "datasheet": datasheet, "versions": versions()}
        super().__init__({**as_document(validation), **about})
        self.validation = validation

    @property
    def sentence(self) -> str:
        """What came out, in one sentence."""
        return str(self._document["sentence"])

    def __repr__(self) -> str:
        return f"<Validation of {self._document['datasheet']}: {len(self.validation.cases)} cases>\n{self.sentence}"

    def _rows(self) -> list[dict[str, Any]]:
        return list(self._document["cases"])

    def _page(self) -> str:
        from ers_mj.report.validation_report import validation_page

        return validation_page(
            self.validation, {"datasheet": self._document["datasheet"], **self._document["versions"]}
        )

    def _writers(self) -> Writers:
        return report_writers("validation.json", self._document, self._page())


def validate(
    datasheet: Known = "table1",
    *,
    gap: float | Sequence[float] | None = None,
    linkage: str | Sequence[str] | None = None,
    inductance: bool | Sequence[bool] | None = None,
    maps: bool = True,
    jobs: int | None = None,
    duration: float = DURATION,
    progress: Progress = silent,
) -> Validation:
    """Where and why the reduced model stops being valid: it against the MuJoCo plant under the same inputs.

    Args:
        datasheet: the servo: a path, "table1", a mapping, a datasheet or a model.
        gap: half-widths of a play [rad]. With none of these three every combination of 0 and 0.5 deg, both linkages,
            inductance off and on that the datasheet can make; else 0.
        linkage: constant, rod or both; else constant.
        inductance: whether L acts, in both plants; else off.
        maps: whether the maps over amplitude, frequency, play and inductance are made, a third of the time.
        jobs: cores; all by default.
        duration: of each input [s].
        progress: told (text, share of the work done).

    Raises:
        InputError: what was given cannot be simulated, in one sentence.

    Source: Energies 2020, Eq. (5) and (6), against the linkage of its Fig. 2 in MuJoCo.
    """
    sheet = known_plant(datasheet)
    if sheet is None:
        raise InputError("no datasheet was given, a path, a mapping, a datasheet or a model was expected")
    if gap is None and linkage is None and inductance is None:
        gaps, linkages, inductances, left_out = cases.possible(sheet)
    else:
        gaps, linkages, inductances = _each(gap, 0.0), _each(linkage, "constant"), _each(inductance, False)
        left_out = []
    for name in linkages:
        refuse_other("linkage", name, cases.LINKAGES)
    found = cases.validate(
        sheet,
        gaps,
        linkages,
        inductances,
        maps=cases.GRID if maps else None,
        jobs=jobs or 0,
        duration=duration,
        progress=progress,
    )
    return Validation(found, left_out, sheet.name or _named(datasheet))


def _each(given: A | Sequence[A] | None, usual: A) -> tuple[A, ...]:
    """One value or many as many, the usual one for None."""
    if given is None:
        return (usual,)
    return tuple(given) if isinstance(given, list | tuple) else (given,)  # type: ignore[return-value]


def _named(given: Known) -> str:
    return "" if isinstance(given, Datasheet) or given is None else str(given)
