"""One servo of many: what is read here, what a worker makes of it, the row that it comes to."""

from __future__ import annotations

import tempfile
from collections.abc import Mapping
from dataclasses import dataclass
from hashlib import sha256
from typing import Any

from ers_mj.data.recording import Recording, read_recording
from ers_mj.door.diagnosing import diagnose
from ers_mj.door.known import known
from ers_mj.errors import ErsError
from ers_mj.fleet.manifest import Servo
from ers_mj.servo.datasheet import Datasheet

COLUMNS = ("name", "verdict", "effects", "heldout_before", "heldout_after", "noise_floor", "error")
Row = dict[str, Any]


@dataclass(frozen=True)
class Settings:
    """What all servos of a batch have in common: the seed, whether a first look is enough, threads of each, and what
    their pages say of how and when they were made.
    """

    seed: int = 0
    quick: bool = False
    threads: int = 1
    made_by: str = ""
    made_on: str = ""


@dataclass(frozen=True)
class Read:
    """A servo's recordings and datasheet, as a worker gets them."""

    recordings: tuple[Recording, ...]
    holdout: tuple[Recording, ...]
    datasheet: Datasheet | None


def read_servo(servo: Servo) -> Read:
    """What a row names.

    Raises:
        ErsError: something in it cannot be used.
    """
    take = lambda path: read_recording(str(servo.path(path)), dict(servo.mapping))
    sheet = servo.datasheet and (servo.datasheet if _named(servo) else str(servo.path(servo.datasheet)))
    return Read(tuple(map(take, servo.recordings)), tuple(map(take, servo.holdout)), known(sheet or None))


def _named(servo: Servo) -> bool:
    """Whether the datasheet is one that ships, which no file of that name hides."""
    return servo.datasheet == "table1" and not servo.path(servo.datasheet).exists()


def fingerprint(servo: Servo, settings: Settings, sources: str) -> str:
    """Hash of all that an answer depends on; empty where a file cannot be read."""
    asked = (servo.recordings, servo.holdout, servo.datasheet, servo.mapping, settings.seed, settings.quick, sources)
    digest = sha256(repr(asked).encode())
    files = [path.partition("#")[0] for path in (*servo.recordings, *servo.holdout)]
    files += [servo.datasheet] if servo.datasheet and not _named(servo) else []
    try:
        for path in files:
            digest.update(sha256(servo.path(path).read_bytes()).digest())
    except OSError:
        return ""
    return digest.hexdigest()


def diagnosed(name: str, read: Read, settings: Settings) -> tuple[Row, dict[str, bytes]]:
    """On a worker: the row, and the files that diagnose writes, by name; none where it fails, whyever."""
    try:
        found = diagnose(
            read.recordings,
            read.datasheet,
            read.holdout,
            seed=settings.seed,
            jobs=settings.threads,
            quick=settings.quick,
        )
        found.made_by, found.made_on = settings.made_by, settings.made_on
        with tempfile.TemporaryDirectory(prefix="ers-batch-") as passing:
            files = {path.name: path.read_bytes() for path in found.save(passing)}
        return row_of(name, found.to_dict()), files
    except ErsError as error:
        return failed(name, str(error)), {}
    except Exception as error:  # one servo's surprise is not the others'
        return failed(name, f"the diagnosis failed ({type(error).__name__}: {' '.join(str(error).split())[:200]})"), {}


def row_of(name: str, document: Mapping[str, Any]) -> Row:
    """The row of a diagnosis."""
    fit = document.get("fit") or {}
    return {
        "name": name,
        "verdict": document["verdict"],
        "effects": ";".join(effect["effect"] for effect in document["missing"]),
        "heldout_before": fit.get("heldout_rmse_before_rad"),
        "heldout_after": fit.get("heldout_rmse_after_rad"),
        "noise_floor": fit.get("noise_floor_rad"),
        "error": "",
    }


def failed(name: str, why: str) -> Row:
    """The row of a servo without a diagnosis."""
    return dict.fromkeys(COLUMNS, None) | {"name": name, "verdict": "", "effects": "", "error": why}
