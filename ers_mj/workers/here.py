"""Workers of this machine: processes of their own, none for one job."""

from __future__ import annotations

import multiprocessing
import os
import signal
import threading
from collections.abc import Iterable, Iterator
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager

from ers_mj.workers.base import Done, Task

AHEAD = 2  # tasks handed out a worker: one under way, one waiting
LOST = "the process that worked on it was ended twice from outside, as by a system that ran out of memory"


class Here:
    """At most ``jobs`` processes; with one job all is done in this one."""

    def __init__(self, jobs: int):
        self.jobs = jobs

    def run(self, tasks: Iterable[Task]) -> Iterator[Done]:
        """As :class:`ers_mj.workers.base.Crew` says. A process that is killed takes nothing with it: what it had is
        worked off again, by itself; what ends a process twice is given up.
        """
        coming = iter(tasks)
        if self.jobs == 1:
            for task in coming:
                yield Done(task.name, task.call(*task.what))
            return
        broken = True
        while broken:
            waiting: dict[Future, Task] = {}
            with _pool(self.jobs) as pool:
                yield from self._until_broken(pool, coming, waiting)
            broken = bool(waiting)
            for task in waiting.values():
                yield _by_itself(task)

    def close(self) -> None:
        """Nothing is held between runs."""

    def _until_broken(self, pool: ProcessPoolExecutor, coming: Iterator[Task], waiting: dict) -> Iterator[Done]:
        """Until all is done or a process was killed; `waiting` holds what is handed out."""
        while True:
            while len(waiting) < AHEAD * self.jobs and (task := next(coming, None)) is not None:
                try:
                    waiting[pool.submit(task.call, *task.what)] = task
                except BrokenProcessPool:
                    waiting[Future()] = task
                    return
            if not waiting:
                return
            for future in wait(waiting, return_when=FIRST_COMPLETED).done:
                if isinstance(future.exception(), BrokenProcessPool):
                    return
                yield Done(waiting.pop(future).name, future.result())


def _by_itself(task: Task) -> Done:
    """One task in a process that does nothing else."""
    with _pool(1) as pool:
        try:
            return Done(task.name, pool.submit(task.call, *task.what).result())
        except BrokenProcessPool:
            return Done(task.name, lost=LOST)


@contextmanager
def _pool(jobs: int) -> Iterator[ProcessPoolExecutor]:
    """Fresh processes, which are ended with whatever they do when they are no longer wanted."""
    earlier = set(multiprocessing.active_children())
    pool = ProcessPoolExecutor(jobs, multiprocessing.get_context("spawn"), initializer=_begin)
    whole = False
    try:
        yield pool
        whole = True
    finally:
        if not whole:
            for child in set(multiprocessing.active_children()) - earlier:
                child.terminate()
        pool.shutdown(cancel_futures=True)


def _begin() -> None:
    """Leave Ctrl-C to the process that hands out, and end with it."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_end_with, args=(multiprocessing.parent_process(),), daemon=True).start()


def _end_with(parent: multiprocessing.process.BaseProcess) -> None:
    parent.join()
    os._exit(1)
