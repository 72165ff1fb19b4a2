"""The folder of a proof: what is handed out, what is sealed, what was answered; every file whole or not at all.

settings.json                     seed, number and kind of cases, and the code that made them
case-NNN/                         recordings and datasheet: all that the diagnosis is handed
sealed/case-NNN.json, truth.json  the truth, each case bound to its files by their hashes; truth.sha256 its own
answers/case-NNN.json             what the diagnosis said, bound to the same hashes and to the code that said it
"""

from __future__ import annotations

import json
import shutil
from collections.abc import Callable, Mapping, Sequence
from hashlib import sha256
from pathlib import Path

from ers_mj.data.tables import reason
from ers_mj.data.whole import write_whole
from ers_mj.errors import InputError

SETTINGS, SEALED, ANSWERS = "settings.json", "sealed", "answers"
JUDGES = (
    "sealing.py",
    "asking.py",
    "conduct.py",
    "scoring.py",
    "parameters.py",
    "contest.py",
)  # of proving/: they make no case
WRITTEN = ("results.json", "report.html", "summary.txt")  # by the command, at the end


def hash_of(content: bytes) -> str:
    """SHA-256 in hexadecimal."""
    return sha256(content).hexdigest()


def hash_of_maker() -> str:
    """Hash of the sources that make cases."""
    return _hash_of_sources(lambda names: names[0] == "proving" and names[-1] not in JUDGES)


def hash_of_diagnosis() -> str:
    """Hash of the sources that diagnose: all but those of the proof."""
    return _hash_of_sources(lambda names: not any(name.startswith(("proving", "prove.py", "proof_")) for name in names))


def _hash_of_sources(wanted: Callable[[tuple[str, ...]], bool]) -> str:
    root = Path(__file__).resolve().parents[1]
    parts = {p: p.relative_to(root).parts for p in sorted(root.rglob("*.py"))}
    return hash_of(b"".join("/".join(names).encode() + p.read_bytes() for p, names in parts.items() if wanted(names)))


def begin(folder: Path, settings: Mapping, force: bool) -> bool:
    """Make the folder ready for these settings; whether a run of the same is resumed.

    Raises:
        InputError: it holds another run or other files, and `force` is not given.
    """
    known = _read(folder / SETTINGS)
    if known == dict(settings):
        (folder / ANSWERS).mkdir(exist_ok=True)  # somebody may have taken the answers away, to have them given again
        return True
    if known is not None and not force:
        told = " and ".join(
            f"{key} {known.get(key)}" for key in settings if known.get(key) != settings[key] and key != "made_by"
        )
        raise InputError(
            f"{folder}: holds a proof with {told or 'cases that other code made'}, name another folder or give --force"
            " to replace it"
        )
    if known is None and not force and folder.is_dir() and any(folder.iterdir()):
        raise InputError(f"{folder}: holds files already, give --force to write into it or name another folder")
    if known is not None:
        _clear(folder)
    try:
        for part in (SEALED, ANSWERS):
            (folder / part).mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(f"{folder}: cannot be written ({reason(error)})") from None
    write_whole(folder / SETTINGS, json.dumps(dict(settings), indent=1))
    return False


def refuse_foreign(folder: Path) -> None:
    """Raise InputError where a folder holds folders of a proof's names, and no proof."""
    held = [path for path in _kept(folder) if path.exists()]
    if held and _read(folder / SETTINGS) is None:
        raise InputError(f"{held[0]}: is of no proof, move it, or name another folder with --out")


def _kept(folder: Path) -> list[Path]:
    """The folders in which a proof keeps what it made."""
    return [folder / SEALED, folder / ANSWERS, *folder.glob("case-[0-9][0-9][0-9]*")]


def _clear(folder: Path) -> None:
    """Remove what an earlier proof wrote, and nothing else."""
    for path in _kept(folder):
        shutil.rmtree(path, ignore_errors=True)
    for name in (SETTINGS, *WRITTEN):
        (folder / name).unlink(missing_ok=True)


# -- cases -----------------------------------------------------------------------------------------------------


def keep_case(folder: Path, name: str, files: Mapping[str, str], truth: Mapping) -> None:
    """Write a case's files, then its truth with their hashes: a case without a truth is none."""
    place = folder / name
    shutil.rmtree(place, ignore_errors=True)
    place.mkdir(parents=True)
    for file, text in files.items():
        write_whole(place / file, text)
    write_whole(folder / SEALED / f"{name}.json", json.dumps({**truth, "files_sha256": hashes(place)}, indent=1))


def has_case(folder: Path, name: str) -> bool:
    """Whether the case is there as it was sealed."""
    truth = _read(folder / SEALED / f"{name}.json")
    return truth is not None and truth.get("files_sha256") == hashes(folder / name)


def hashes(place: Path) -> dict[str, str]:
    """File name -> hash of all files of a case."""
    return {p.name: hash_of(p.read_bytes()) for p in sorted(place.iterdir())} if place.is_dir() else {}


def seal(folder: Path, names: Sequence[str]) -> str:
    """Write all truths in one file; its hash."""
    text = json.dumps({name: _read(folder / SEALED / f"{name}.json") for name in names}, indent=1)
    write_whole(folder / SEALED / "truth.json", text)
    digest = hash_of(text.encode())
    write_whole(folder / SEALED / "truth.sha256", f"{digest}  truth.json\n")
    return digest


def opened(folder: Path, digest: str) -> dict[str, dict]:
    """The truths, once all has been answered.

    Raises:
        InputError: truth, recordings or datasheets are not what was sealed.
    """
    content = (folder / SEALED / "truth.json").read_bytes()
    if hash_of(content) != digest:
        raise InputError(f"{folder}: the sealed truth was changed after its hash was printed")
    truths = json.loads(content)
    for name, truth in truths.items():
        if truth["files_sha256"] != hashes(folder / name):
            raise InputError(f"{folder / name}: its files are not those that were sealed")
    return truths


# -- answers ---------------------------------------------------------------------------------------------------


def keep_answer(folder: Path, name: str, answer: Mapping) -> None:
    """Write what was answered."""
    write_whole(folder / ANSWERS / f"{name}.json", json.dumps(dict(answer), indent=1))


def answer_of(folder: Path, name: str, code: str) -> dict | None:
    """The kept answer to these very files by this very code, None where there is none."""
    answer = _read(folder / ANSWERS / f"{name}.json")
    if answer is None or answer.get("files_sha256") != hashes(folder / name) or answer.get("code") != code:
        return None
    return answer


def _read(path: Path) -> dict | None:
    try:
        content = json.loads(path.read_text("utf-8"))
    except (OSError, ValueError):
        return None
    return content if isinstance(content, dict) else None
