"""Conducts a batch: what is there already is kept, the rest handed out, every servo's files whole before its row.

OUT/NAME/            as diagnose writes
OUT/.batch/NAME.json the row, bound to what the answer depends on: that it is there says that NAME is done
OUT/.batch/began     the day that pages tell, so that a batch that goes on tomorrow has the same pages
OUT/batch.csv        all rows in the manifest's order
"""

from __future__ import annotations

import csv
import io
import json
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from ers_mj.door.results import Progress, silent
from ers_mj.door.saving import refuse_folder, refuse_unwritable, today, write_file, write_results
from ers_mj.errors import ErsError
from ers_mj.fleet.diagnosing import COLUMNS, Row, Settings, diagnosed, failed, fingerprint, read_servo
from ers_mj.fleet.manifest import Servo
from ers_mj.workers.base import Crew, Task
from ers_mj.workers.finished import Finished
from ers_mj.workers.held import held
from ers_mj.workers.versions import sources

KEPT, BEGAN = ".batch", "began"


@dataclass
class Batch:
    """A batch in its folder: the servos, what is asked of each, and the rows that are there."""

    folder: Path
    servos: Sequence[Servo]
    settings: Settings
    rows: dict[str, Row] = field(default_factory=dict)
    asked: dict[str, str] = field(default_factory=dict)  # fingerprints

    @property
    def finished(self) -> Finished:
        """The rows in its folder."""
        return Finished(self.folder / KEPT)

    def table(self) -> str:
        """batch.csv: all digits of every number, nothing where there is none."""
        out = io.StringIO()
        writer = csv.DictWriter(out, COLUMNS, lineterminator="\n")
        writer.writeheader()
        writer.writerows({key: _cell(x) for key, x in self.rows[servo.name].items()} for servo in self.servos)
        return out.getvalue()

    def documents(self) -> dict[str, dict[str, Any]]:
        """diagnosis.json of every servo that has one."""
        done = (servo.name for servo in self.servos if not self.rows[servo.name]["error"])
        return {name: json.loads((self.folder / name / "diagnosis.json").read_text("utf-8")) for name in done}


def _cell(x: object) -> str:
    return "" if x is None else repr(x) if isinstance(x, float) else str(x)


def refuse_out(folder: Path, force: bool) -> None:
    """Raise InputError where the results cannot go there; a batch that was begun there goes on."""
    if (folder / KEPT).is_dir():
        refuse_unwritable(folder)
    else:
        refuse_folder(folder, force)


def conduct(
    folder: Path,
    servos: Sequence[Servo],
    settings: Settings,
    crew: Crew,
    *,
    tell: Callable[[str], None] = lambda text: None,
    progress: Progress = silent,
) -> Batch:
    """Diagnose all servos that have no answer in the folder yet.

    Args:
        tell: called with lines for a person as they come.

    Raises:
        InputError: another run is at work in the folder.
        ErsError: the workers are gone; what was done is kept.
        KeyboardInterrupt: stopped; what was done is kept.
    """
    with held(folder, "ers batch"):
        batch = Batch(folder, servos, replace(settings, made_on=_began(folder)))
        for servo in servos:
            batch.asked[servo.name] = fingerprint(servo, settings, sources())
            if (row := _kept(batch, servo)) is not None:
                batch.rows[servo.name] = row
        if batch.rows:
            tell(f"{folder}: goes on, {len(batch.rows)} of {len(servos)} servos are there")
        for done in crew.run(_tasks(batch)):
            row, files = (failed(done.name, done.lost), {}) if done.lost else done.value
            _keep(batch, row, files)
            progress(f"{len(batch.rows)} of {len(servos)} servos, last {done.name}", len(batch.rows) / len(servos))
        write_file(folder / "batch.csv", batch.table().encode())
        return batch


def _began(folder: Path) -> str:
    """The day on which the batch began."""
    path = folder / KEPT / BEGAN
    if not path.exists():
        write_file(path, today().encode())
    return path.read_text("utf-8")


def _tasks(batch: Batch) -> Iterator[Task]:
    """What is left to do, read as it is wanted; what cannot be read has its row at once."""
    for servo in batch.servos:
        if servo.name in batch.rows:
            continue
        try:
            batch.asked[servo.name] = fingerprint(servo, batch.settings, sources())  # files may have changed meanwhile
            read = read_servo(servo)
        except ErsError as error:
            _keep(batch, failed(servo.name, str(error).replace(f"{servo.folder}/", "")), {})
            continue
        yield Task(servo.name, diagnosed, (servo.name, read, batch.settings))


def _keep(batch: Batch, row: Row, files: dict[str, bytes]) -> None:
    """Write a servo's files, then its row. A failure is not kept: the next run tries it again."""
    name = row["name"]
    batch.rows[name] = row
    if files:
        write_results(batch.folder / name, {file: _writer(content) for file, content in files.items()})
        batch.finished.keep(name, batch.asked[name], row)


def _writer(content: bytes) -> Callable[[Path], None]:
    return lambda path: _write(path, content)


def _write(path: Path, content: bytes) -> None:
    path.write_bytes(content)


def _kept(batch: Batch, servo: Servo) -> Row | None:
    """The row that is there, None where there is none or something that it depends on has changed."""
    there = (batch.folder / servo.name / "diagnosis.json").is_file()
    return batch.finished.value(servo.name, batch.asked[servo.name]) if there else None
