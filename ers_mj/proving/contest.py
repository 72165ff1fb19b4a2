"""Cases that anyone may answer: handed out without their truth, which is sealed elsewhere; answers are scored as ours.

DIR/case-NNN/   recordings and datasheet
DIR/cases.json  hashes of all files, and of the sealed truth: neither can be changed later without being found out
DIR/servos.csv  the cases as `ers batch` takes them
SEALED          the truth of every case with the hashes of its files, the seed, and its own hash
"""

from __future__ import annotations

import csv
import io
import json
import shutil
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ers_mj.data.tables import reason
from ers_mj.data.whole import write_whole
from ers_mj.errors import ErsError, InputError
from ers_mj.proving.scoring import row_of
from ers_mj.proving.sealing import hash_of, hashes
from ers_mj.workers.base import Crew, Task

CASES, SERVOS, DIAGNOSIS = "cases.json", "servos.csv", "diagnosis.json"
Progress = Callable[[str, float], None]


def refuse_places(folder: Path, sealed: Path, force: bool) -> None:
    """Raise InputError where cases or truth cannot go there, or the truth would lie among the cases."""
    if sealed.resolve().is_relative_to(folder.resolve()):
        raise InputError(f"{sealed}: lies in {folder}, which is handed out; the truth was expected elsewhere")
    if folder.exists() and not folder.is_dir():
        raise InputError(f"{folder}: is a file, --export needs a folder")
    for path, there in ((folder, folder.is_dir() and any(folder.iterdir())), (sealed, sealed.exists())):
        if there and not force:
            raise InputError(f"{path}: is there already, give --force to write over it or name another")


def export(
    folder: Path, sealed: Path, tasks: Sequence[Task], settings: Mapping[str, Any], crew: Crew, progress: Progress
) -> str:
    """Make the cases, write them and the truth; the truth's hash.

    Raises:
        InputError: something cannot be written.
        ErsError: a case could not be made.
    """
    truths: dict[str, dict] = {}
    try:
        for old in folder.glob("case-[0-9][0-9][0-9]*"):
            shutil.rmtree(old)
        for count, done in enumerate(crew.run(tasks), start=1):
            if done.lost:
                raise ErsError(f"{done.name}: {done.lost}")
            files, truth = done.value
            (folder / done.name).mkdir(parents=True, exist_ok=True)
            for file, text in files.items():
                write_whole(folder / done.name / file, text)
            truths[done.name] = {**truth, "files_sha256": hashes(folder / done.name)}
            progress(f"making case {min(count + 1, len(tasks))} of {len(tasks)}", count / len(tasks))
        truths = {task.name: truths[task.name] for task in tasks}
        digest = _digest(truths)
        listed = {name: truth["files_sha256"] for name, truth in truths.items()}
        write_whole(folder / SERVOS, _servos(listed))
        write_whole(folder / CASES, json.dumps({"version": 1, "truth_sha256": digest, "cases": listed}, indent=1))
        sealed.parent.mkdir(parents=True, exist_ok=True)
        write_whole(sealed, json.dumps({"version": 1, "truth_sha256": digest, **settings, "truths": truths}, indent=1))
    except OSError as error:
        raise InputError(f"{error.filename or folder}: cannot be written ({reason(error)})") from None
    return digest


def _digest(truths: Mapping[str, Any]) -> str:
    return hash_of(json.dumps(truths, indent=1).encode())


def _servos(listed: Mapping[str, Mapping[str, str]]) -> str:
    """The manifest of the cases."""
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow(["name", "recordings", "datasheet"])
    for name, files in listed.items():
        sheet = [f"{name}/{file}" for file in files if file.endswith(".toml")]
        writer.writerow([name, ";".join(f"{name}/{file}" for file in files if file.endswith(".csv")), *(sheet or [""])])
    return out.getvalue()


# -- answers ----------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Answered:
    """Truth and answers side by side, as rows to be scored, and what is to be said of the answers, a sentence each;
    `altered` counts those that rest on other files than were handed out.
    """

    rows: list[dict]
    told: list[str]
    altered: int
    sealed: Mapping[str, Any]


def answered(answers: Path, sealed: Path) -> Answered:
    """Everybody's diagnosis.json: ANSWERS/case-NNN/diagnosis.json or ANSWERS/case-NNN.json. What is missing, unreadable
    or about other files counts as no answer.

    Raises:
        InputError: there are no answers at all, or the truth is none or was changed.
    """
    content = _truths(sealed)
    if not answers.is_dir():
        raise InputError(f"{answers}: is no folder, one with NAME/{DIAGNOSIS} or NAME.json for each case was expected")
    rows, told, altered = [], [], 0
    for name, truth in content["truths"].items():
        document, why = _document(answers, name)
        if document is not None:
            if why := _other_files(answers / name, document, truth):
                altered, document = altered + 1, None
            elif not (document.get("data") or {}).get("sha256"):
                told.append(f"{name}: does not say which recordings it rests on, data.sha256 would")
        try:
            rows.append(row_of(truth, {"document": document, "error": why or None}))
        except (KeyError, TypeError, ValueError, AttributeError, IndexError):
            why = f"its {DIAGNOSIS} is not laid out as the contract says"
            rows.append(row_of(truth, {"document": None, "error": why}))
        told += [f"{name}: {why}"] if why else []
    if all(row["error"] == MISSING for row in rows):
        raise InputError(
            f"{answers}: holds no answer to any of the {len(rows)} cases, as in {rows[0]['case']}/{DIAGNOSIS}"
        )
    return Answered(rows, told + _unknown(answers, content["truths"]), altered, content)


MISSING = "no answer was given"


def _truths(sealed: Path) -> dict[str, Any]:
    try:
        content = json.loads(sealed.read_text("utf-8"))
        truths, digest = content["truths"], content["truth_sha256"]
    except OSError as error:
        raise InputError(f"{sealed}: cannot be read ({reason(error)})") from None
    except (ValueError, KeyError, TypeError):
        raise InputError(f"{sealed}: is no sealed truth, the file that prove --export wrote was expected") from None
    if _digest(truths) != digest:
        raise InputError(f"{sealed}: the sealed truth was changed, its hash is no longer {digest}")
    return content


def _document(answers: Path, name: str) -> tuple[dict | None, str]:
    """(the answer to a case, why there is none)."""
    for path in (answers / name / DIAGNOSIS, answers / f"{name}.json"):
        if path.is_file():
            try:
                document = json.loads(path.read_text("utf-8"))
            except (OSError, ValueError):
                return None, f"{path.name} is no JSON"
            return (document, "") if isinstance(document, dict) else (None, f"{path.name} is no JSON object")
    return None, MISSING


def _other_files(place: Path, document: Mapping[str, Any], truth: Mapping[str, Any]) -> str:
    """Why the answer is not about the files that were handed out; empty where it is."""
    handed = truth["files_sha256"]
    beside = {name: digest for name, digest in hashes(place).items() if name in handed}
    if changed := sorted(name for name, digest in beside.items() if digest != handed[name]):
        return f"altered: {', '.join(changed)} beside the answer is not what was handed out"
    said = (document.get("data") or {}).get("sha256") or []
    if said and not set(said) <= set(handed.values()):
        return "altered: it rests on recordings that were not handed out"
    return ""


def _unknown(answers: Path, truths: Mapping[str, Any]) -> list[str]:
    names = {p.name.removesuffix(".json") for p in answers.iterdir() if p.name.startswith("case-")}
    return [f"{name}: is none of the cases and was passed over" for name in sorted(names - set(truths))]
