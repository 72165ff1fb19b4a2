"""Parameters from recordings, with intervals, as one result."""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping, Sequence
from functools import cached_property
from typing import Any, TypedDict, Unpack

from threadpoolctl import threadpool_limits

from ers_mj.data.recording import Recording
from ers_mj.diagnosis.loop.rows import improved, parameters
from ers_mj.door.known import Known, known, known_plant
from ers_mj.door.model import Model
from ers_mj.door.reading import Given, recordings_of
from ers_mj.door.results import Progress, Result, Writers, parameter_rows, silent
from ers_mj.door.saving import report_writers, versions
from ers_mj.door.together import refuse_mixed_inputs, refuse_other_units, refuse_twice
from ers_mj.errors import InputError, refuse_other
from ers_mj.identification import estimate
from ers_mj.identification.answer import Identified
from ers_mj.identification.finding import BUDGET, Settings
from ers_mj.position_loop.identify import Identified as LoopFound
from ers_mj.position_loop.identify import identify_loop
from ers_mj.position_loop.saved import model_of
from ers_mj.servo.datasheet import Datasheet
from ers_mj.servo.model_file import write_model


class SearchOptions(TypedDict, total=False):
    """Where and for how long it is searched: `bounds` name -> (low, high), the others `within` these factors of what is
    known, `evaluations` at most, whether ls goes on where another method ends (`polish`), MuJoCo's `timestep` [s], the
    `seed` of what is drawn by chance, `jobs` cores.
    """

    bounds: Mapping[str, tuple[float, float]]
    within: tuple[float, float]
    evaluations: int | None
    polish: bool
    timestep: float | None
    seed: int
    jobs: int | None


class Identification(Result):
    """What an identification found; `identify` makes it.

    `to_dict()` is identify.json, `to_frame()` a row a parameter with its 95 % interval, `save(folder)` writes
    identify.json, report.html and model.toml.
    """

    def __init__(self, found: Identified, recordings: Sequence[Recording]):
        super().__init__(_document(found, recordings))
        self._found = found

    @property
    def sentence(self) -> str:
        """What came out, in one sentence."""
        return str(self._document["sentence"])

    @property
    def parameters(self) -> dict[str, float | None]:
        """The values in SI (or per inertia), None of what the recordings cannot tell."""
        return {name: row["value"] for name, row in self._document["parameters"].items()}

    @cached_property
    def model(self) -> Model:
        """The identified model."""
        data = self._document["data"]
        return Model(self._found.model, output_unit=data["output_unit"], input_unit=data["input_unit"])

    def __repr__(self) -> str:
        told = ", ".join(f"{name} {x:.4g}" for name, x in self.parameters.items() if x is not None)
        return f"<Identification by {self._document['method']}: {told}>\n{self.sentence}"

    def _rows(self) -> list[dict[str, Any]]:
        return parameter_rows("servo", self._document["parameters"])

    def _page(self) -> str:
        from ers_mj.report.identify_report import identify_page

        return identify_page(self._document, self._found)

    def _writers(self) -> Writers:
        return report_writers("identify.json", self._document, self._page()) | {
            "model.toml": lambda path: write_model(path, self.model.datasheet)
        }


class LoopIdentification(Identification):
    """What an identification of a position loop found."""

    def __init__(self, found: LoopFound, recordings: Sequence[Recording], seed: int, fixed: Mapping[str, float]):
        Result.__init__(self, _loop_document(found, recordings, seed, fixed))
        self._loop, self._model = found, improved(found.fit.model)

    @cached_property
    def model(self) -> Model:
        """The identified model."""
        data = self._document["data"]
        return Model(self._model, output_unit=data["output_unit"], input_unit=data["input_unit"])

    def _page(self) -> str:
        from ers_mj.report.identify_report import loop_page

        return loop_page(self._document)

    def _writers(self) -> Writers:
        return report_writers("identify.json", self._document, self._page()) | {
            "model.toml": lambda path: write_model(path, self.model.datasheet)
        }


def identify(
    recordings: Given | Iterable[Given],
    datasheet: Known = None,
    *,
    method: str = "ls",
    plant: str = "reduced",
    fix: Mapping[str, float] | None = None,
    progress: Progress = silent,
    **search: Unpack[SearchOptions],
) -> Identification:
    """Identify a servo's parameters from recordings: values, intervals, and what cannot be told.

    Args:
        recordings: of one servo: paths or recordings, one or many.
        datasheet: where the search begins (SI); None: Eq. (6) from scratch.
        method: ls, iga, iga-rotated, ga, pso, cma or de.
        plant: what is simulated, reduced or mujoco.
        fix: name -> value that is held.
        progress: told (text, share of the work done).
        search: `bounds`, `within` (0.2, 3), `evaluations`, `polish`, `timestep`, `seed`, `jobs` (see SearchOptions).

    Raises:
        InputError: what was given cannot be used, in one sentence.

    Source: Eq. (13) of Energies 2020 is the misfit.
    """
    refuse_other("plant", plant, BUDGET)
    within = tuple(search.get("within", (0.2, 3.0)))
    if len(within) != 2 or not within[0] < 1 < within[1]:
        raise InputError(
            f"--within gives {', '.join(f'{x:g}' for x in within)}, a factor below one and one above it were expected"
        )
    timestep = search.get("timestep")
    settings = Settings(
        method,
        plant,
        dict(fix or {}),
        dict(search.get("bounds") or {}),
        within,
        search.get("evaluations"),
        search.get("polish", False),
        search.get("seed", 0),
        search.get("jobs") or os.cpu_count() or 1,
        **({"timestep": timestep} if timestep else {}),
    )
    given = recordings_of(recordings)
    if not given:
        raise InputError("no recording was given, at least one was expected")
    refuse_twice(given, [])
    refuse_mixed_inputs(given)
    if given[0].input_kind == "position":
        return _of_a_loop(given, known(datasheet), settings, progress)
    sheet = known_plant(datasheet)
    refuse_other_units(sheet, given)
    with threadpool_limits(1):
        found = estimate.identify(given, sheet, settings, progress)
    return Identification(found, given)


def _of_a_loop(
    given: list[Recording], loop: Datasheet | None, settings: Settings, progress: Progress
) -> LoopIdentification:
    """As ``identify``, of recordings of a position command."""
    refuse_beside_a_loop(settings, loop)
    refuse_other_units(loop, given)
    fixed = settings.fixed or {}
    with threadpool_limits(1):
        found = identify_loop(given, settings.jobs, progress, None if loop is None else model_of(loop), fixed)
    return LoopIdentification(found, given, settings.seed, fixed)


def _document(found: Identified, recordings: Sequence[Recording]) -> dict[str, Any]:
    return {
        "method": found.settings.method,
        "plant": found.settings.plant,
        "sentence": found.sentence,
        "parameters": {row.name: row.as_document() for row in found.rows},
        "fitness": found.fitness,
        "evaluations": found.evaluations,
        "wall_s": found.wall_s,
        "explains": found.explains,
        "misfit_sigma2": found.misfit,
        "warnings": list(found.warnings),
        "structure": {
            "letters": list(found.structure.names),
            "rank": found.structure.rank,
            "null_space": found.structure.null,
            "singular_values": found.structure.singular,
        },
        "data": _data(recordings),
        "seed": found.settings.seed,
        "versions": versions(),
    }


def _data(recordings: Sequence[Recording]) -> dict[str, Any]:
    return {
        "files": [r.name for r in recordings],
        "sha256": [r.sha256 for r in recordings],
        "output_unit": recordings[0].output_unit,
        "input_unit": recordings[0].input_unit,
        "input_kind": recordings[0].input_kind,
        "problems": [f"{r.name}: {p}" for r in recordings for p in r.problems],
        "faults": [fault.as_document(r.name) for r in recordings for fault in r.faults],
    }


def refuse_beside_a_loop(settings: Settings, loop: Datasheet | None) -> None:
    """Raise InputError for what the fit of a position loop does not take."""
    asked = {
        "--method": settings.method != "ls",
        "--plant": settings.plant != "reduced",
        "--bounds": bool(settings.bounds),
        "--fix": bool(settings.fixed) and loop is None,
        "--datasheet": loop is not None and not loop.loop,
    }
    why = {
        "--fix": "needs --datasheet with a model.toml whose [loop] has that number",
        "--datasheet": "takes a model.toml with a [loop] where a position is commanded, or is left out",
    }
    for option, is_given in asked.items():
        if is_given:
            told = why.get(option, "does not go with a position command, which least squares fit without it")
            raise InputError(f"{option} {told}")


def _loop_document(
    found: LoopFound, recordings: Sequence[Recording], seed: int, fixed: Mapping[str, float]
) -> dict[str, Any]:
    words = "explains the recordings" if found.explains else "leaves more than noise: ask ers diagnose what is missing"
    rows = parameters(found.intervals, recordings[0].output_unit, found.data)
    return {
        "method": "ls",
        "plant": "reduced",
        "sentence": f"A {found.fit.model.kind} position loop {words}.",
        "parameters": {name: row | _held(fixed.get(name)) for name, row in rows.items()},
        "fitness": found.fitness,
        "evaluations": found.evaluations,
        "wall_s": found.wall_s,
        "explains": found.explains,
        "misfit_sigma2": found.fit.misfit,
        "warnings": [],
        "data": _data(recordings),
        "seed": seed,
        "versions": versions(),
    }


def _held(value: float | None) -> dict[str, Any]:
    """What a row says of a number that is held there."""
    if value is None:
        return {"fixed": False}
    return {"value": value, "ci95": [value, value], "identifiable": True, "fixed": True}
