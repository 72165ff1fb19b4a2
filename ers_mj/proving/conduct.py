"""Conducts a proof: cases are made, the truth is sealed, the diagnosis asked, the truth opened, the answers scored.

The same seed gives the same cases and answers whatever the number of jobs; what is there already is kept.
"""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor, as_completed
from dataclasses import dataclass
from pathlib import Path

from ers_mj.errors import ErsError
from ers_mj.proving.asking import LIMIT, Asker
from ers_mj.proving.sealing import (
    answer_of,
    begin,
    has_case,
    hash_of_diagnosis,
    hash_of_maker,
    keep_answer,
    keep_case,
    opened,
    seal,
)
from ers_mj.workers.base import Crew, Task
from ers_mj.workers.held import held
from ers_mj.workers.here import Here

Progress = Callable[[str, float], None]
MAKING = 0.4  # share of the bar
ALONE = Here(1)
REAL = "real"  # the kind of a proof that conceals in real records


@dataclass(frozen=True)
class Proof:
    """What came of it: truths and answers by case, and the hash under which the truth was sealed."""

    truths: dict[str, dict]
    answers: dict[str, dict]
    sha256: str


def conduct(
    folder: Path,
    tasks: Sequence[Task],
    settings: dict,
    *,
    force: bool = False,
    crew: Crew = ALONE,
    limit: float = LIMIT,
    tell: Callable[[str], None] = lambda text: None,
    progress: Progress = lambda text, share: None,
) -> Proof:
    """Carry out a proof in this folder, or carry on with it.

    Args:
        tasks: cases to be made, each ``call(*what)`` giving its files and its truth.
        crew: who makes them and who is asked; real records are handed out by this machine, which has them.
        tell: called with lines for a person as they come, the hash before the first question among them.

    Raises:
        InputError: the folder holds something else, another run is at work in it, or the sealed truth was touched.
        KeyboardInterrupt: stopped; what was made and answered is kept.
    """
    settings = {**settings, "limit_s": limit, "made_by": hash_of_maker()}
    with held(folder, "ers prove"):
        if begin(folder, settings, force):
            tell(f"{folder}: goes on where it was left")
        names = [task.name for task in tasks]
        maker = crew if settings.get("kind") != REAL else ALONE
        _make(folder, [task for task in tasks if not has_case(folder, task.name)], maker, progress)
        digest = seal(folder, names)
        tell(f"the truth of {len(names)} cases is sealed, sha256 {digest}")
        code = hash_of_diagnosis()
        _ask(
            folder,
            [name for name in names if answer_of(folder, name, code) is None],
            Asker(code, limit),
            crew,
            progress,
        )
        return Proof(opened(folder, digest), {name: answer_of(folder, name, code) or {} for name in names}, digest)


def _make(folder: Path, tasks: Sequence[Task], crew: Crew, progress: Progress) -> None:
    """Make the cases and keep each as it comes."""
    for k, done in enumerate(crew.run(tasks), start=1):
        if done.lost:
            raise ErsError(f"{done.name}: {done.lost}")
        keep_case(folder, done.name, *done.value)
        progress(f"making case {min(k + 1, len(tasks))} of {len(tasks)}", MAKING * k / len(tasks))


def _ask(folder: Path, names: Sequence[str], asker: Asker, crew: Crew, progress: Progress) -> None:
    """Ask about these cases, some at a time, and keep every answer as it comes."""
    answers = _here(folder, names, asker, crew.jobs) if isinstance(crew, Here) else _there(folder, names, asker, crew)
    for k, (name, answer) in enumerate(answers, start=1):
        keep_answer(folder, name, answer)
        share = MAKING + (1 - MAKING) * k / len(names)
        progress(f"diagnosing case {min(k + 1, len(names))} of {len(names)}", share)


def _here(folder: Path, names: Sequence[str], asker: Asker, jobs: int) -> Iterator[tuple[str, dict]]:
    """Each diagnosis is a process of its own already; threads wait for them."""
    with ThreadPoolExecutor(jobs) as pool:
        pending = {pool.submit(asker.ask, folder / name): name for name in names}
        try:
            for future in as_completed(pending):
                answer = future.result()
                if answer is not None:
                    yield pending[future], answer
        except BaseException:
            asker.stop()
            pool.shutdown(cancel_futures=True)
            raise


def _there(folder: Path, names: Sequence[str], asker: Asker, crew: Crew) -> Iterator[tuple[str, dict]]:
    """On the workers of a cluster, which get a case's files and nothing else."""
    files = lambda name: {path.name: path.read_bytes() for path in (folder / name).iterdir()}
    for done in crew.run(Task(name, asked_there, (name, files(name), asker.code, asker.limit)) for name in names):
        if done.lost:
            raise ErsError(f"{done.name}: {done.lost}")
        yield done.name, done.value


def asked_there(name: str, files: dict[str, bytes], code: str, limit: float) -> dict:
    """The answer to one case, asked where this runs."""
    with tempfile.TemporaryDirectory(prefix="ers-case-") as passing:
        case = Path(passing) / name
        case.mkdir()
        for file, content in files.items():
            (case / file).write_bytes(content)
        return Asker(code, limit).ask(case) or {}
