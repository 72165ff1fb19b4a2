"""Conducts a proof: cases are made, the truth is sealed, the diagnosis asked, the truth opened, the answers scored.

The same seed gives the same cases and answers whatever the number of jobs; what is there already is kept.
"""

from __future__ import annotations

import multiprocessing
import signal
from collections.abc import Callable, Sequence
from concurrent.futures import FIRST_COMPLETED, ThreadPoolExecutor, wait
from dataclasses import dataclass
from pathlib import Path

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
from ers_mj.workers.held import held

Progress = Callable[[str, float], None]
MAKING = 0.4  # share of the bar


@dataclass(frozen=True)
class Task:
    """A case to be made: `make(*what)` gives its files and its truth. It travels to another process."""

    name: str
    make: Callable[..., tuple[dict[str, str], dict]]
    what: tuple


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
    jobs: int = 1,
    limit: float = LIMIT,
    tell: Callable[[str], None] = lambda text: None,
    progress: Progress = lambda text, share: None,
) -> Proof:
    """Carry out a proof in this folder, or carry on with it.

    Args:
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
        _make(folder, [task for task in tasks if not has_case(folder, task.name)], jobs, progress)
        digest = seal(folder, names)
        tell(f"the truth of {len(names)} cases is sealed, sha256 {digest}")
        code = hash_of_diagnosis()
        _ask(
            folder,
            [name for name in names if answer_of(folder, name, code) is None],
            Asker(code, limit),
            jobs,
            progress,
        )
        return Proof(opened(folder, digest), {name: answer_of(folder, name, code) or {} for name in names}, digest)


def _make(folder: Path, tasks: Sequence[Task], jobs: int, progress: Progress) -> None:
    """Make the cases, here or in processes of their own."""
    if min(jobs, len(tasks)) <= 1:
        for k, task in enumerate(tasks):
            progress(f"making case {k + 1} of {len(tasks)}", MAKING * k / len(tasks))
            _made((folder, task))
        return
    with multiprocessing.get_context("spawn").Pool(
        min(jobs, len(tasks)), initializer=_deaf
    ) as pool:  # left early, it ends its processes
        for k, _ in enumerate(pool.imap_unordered(_made, [(folder, task) for task in tasks])):
            progress(f"making case {k + 2} of {len(tasks)}", MAKING * (k + 1) / len(tasks))


def _deaf() -> None:
    """Leave Ctrl-C to the process that conducts."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)


def _made(job: tuple[Path, Task]) -> None:
    folder, task = job
    keep_case(folder, task.name, *task.make(*task.what))


def _ask(folder: Path, names: Sequence[str], asker: Asker, jobs: int, progress: Progress) -> None:
    """Ask about these cases, some at a time, and keep every answer as it comes."""
    with ThreadPoolExecutor(jobs) as pool:
        try:
            pending = {pool.submit(_asked, folder, name, asker) for name in names}
            while pending:
                done = len(names) - len(pending)
                progress(f"diagnosing case {done + 1} of {len(names)}", MAKING + (1 - MAKING) * done / len(names))
                finished, pending = wait(pending, return_when=FIRST_COMPLETED)
                for future in finished:
                    future.result()
        except BaseException:
            asker.stop()
            pool.shutdown(cancel_futures=True)
            raise


def _asked(folder: Path, name: str, asker: Asker) -> None:
    answer = asker.ask(folder / name)
    if answer is not None:
        keep_answer(folder, name, answer)
