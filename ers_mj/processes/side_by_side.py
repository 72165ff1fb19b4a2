"""Independent work side by side, with the same results as one after the other.

Most of a fit's time is spent in Python itself, of which threads of one process run one at a time. So the work is shared
with forks of this process, which see all that it holds and send back what they made. Where it cannot fork, or other
threads may hold a lock in that moment, threads share it.
"""

from __future__ import annotations

import io
import os
import pickle
import sys
import threading
import time
import warnings
import weakref
from collections.abc import Callable, Iterable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from signal import SIGKILL
from typing import Any, ClassVar, TypeVar

from ers_mj.processes.passing import end_with_parent
from ers_mj.processes.stopping import WATCHING

A = TypeVar("A")
B = TypeVar("B")
LEAST = 0.1  # [s] of work from which a fork is worth its start
NUMBER = 4  # bytes of an item's place in the queue
_is_sharing = False  # work already, in a helper or beside some, so that what is within is done as it comes
_paces: dict[object, float] = {}  # [s] that an item took last, by the code that was called


class Shared:
    """What is one object on both sides of a fork: a helper sends back which one it means, and what it counted on it is
    counted here as well.
    """

    _alive: ClassVar[weakref.WeakValueDictionary[int, Shared]] = weakref.WeakValueDictionary()

    def __init__(self) -> None:
        Shared._alive[id(self)] = self

    @property
    def tally(self) -> tuple[int, bool]:
        """What was counted, and whether something was marked."""
        raise NotImplementedError

    def add_tally(self, count: int, mark: bool) -> None:
        """Count what a helper counted beyond what was there when it began."""
        raise NotImplementedError


def each(function: Callable[[A], B], items: Iterable[A], jobs: int, known: Iterable[object] = ()) -> list[B]:
    """The function of each item, by up to so many processes at once.

    What a helper sends back is a copy, but for the items and what they are made of, the ``known`` objects and what is
    ``Shared``. An item that a helper failed on is done here, where its error is raised.
    """
    items = list(items)
    if jobs < 2 or len(items) < 2 or _is_sharing:
        return list(map(function, items))
    if not _may_fork():
        with ThreadPoolExecutor(jobs) as pool:
            return list(pool.map(function, items))
    code = getattr(getattr(function, "func", function), "__code__", None)
    done: list[B] = []
    while len(done) < len(items):
        left = len(items) - len(done)
        worth = 1 + int(_paces.get(code, 0.0) * left / LEAST)
        if left > 1 and worth > 1:
            return done + _with_helpers(function, items[len(done) :], min(jobs, left, worth), known)
        begun = time.perf_counter()
        done.append(function(items[len(done)]))
        _paces[code] = time.perf_counter() - begun
    return done


def _may_fork() -> bool:
    """Whether this process is one that may fork: no other thread may hold a lock that its copy would wait for."""
    own = threading.main_thread()
    if sys.platform != "linux" or threading.current_thread() is not own:
        return False
    return all(thread is own or thread.name == WATCHING for thread in threading.enumerate())


def _with_helpers(function: Callable[[A], B], items: Sequence[A], jobs: int, known: Iterable[object]) -> list[B]:
    """The function of each item, by this process and forks of it, each of which takes the next item that is left."""
    global _is_sharing
    shared = dict(Shared._alive)
    same = {id(o): o for o in (*known, *shared.values(), *_parts(items))}
    queue, filled = os.pipe()
    os.write(filled, b"".join(k.to_bytes(NUMBER, "little") for k in range(len(items))))
    os.close(filled)
    helpers: dict[int, int] = {}  # where each sends, by process
    done: dict[int, B] = {}
    _is_sharing = True
    try:
        for _ in range(jobs - 1):
            process, sent = _forked(function, items, queue, shared, same)
            helpers[process] = sent
        for k in iter(lambda: os.read(queue, NUMBER), b""):
            done[int.from_bytes(k, "little")] = function(items[int.from_bytes(k, "little")])
        for process in list(helpers):
            _receive(helpers.pop(process), process, done, shared, same)
    finally:
        _is_sharing = False
        os.close(queue)
        for process, sent in helpers.items():
            os.close(sent)
            with suppress(OSError):
                os.kill(process, SIGKILL)
                os.waitpid(process, 0)
    return [done[k] if k in done else function(item) for k, item in enumerate(items)]


def _parts(items: Sequence[object]) -> Iterable[object]:
    for item in items:
        yield item
        if isinstance(item, tuple):
            yield from item


def _forked(function, items, queue: int, shared: Mapping[int, Shared], same: Mapping[int, object]) -> tuple[int, int]:
    """(process, where it sends) of a helper that takes items from the queue until that is empty."""
    sent, sends = os.pipe()
    with warnings.catch_warnings():  # of threads, which `_may_fork` has looked at
        warnings.simplefilter("ignore", DeprecationWarning)
        process = os.fork()
    if process:
        os.close(sends)
        return process, sent
    try:
        _help(function, items, queue, sends, shared, same)
    finally:
        os._exit(0)


def _help(function, items, queue: int, sends: int, shared: Mapping[int, Shared], same: Mapping[int, object]) -> None:
    """In a helper: do what is left, and send it; of an item that fails nothing is sent."""
    end_with_parent()
    before, done = {key: one.tally for key, one in shared.items()}, {}
    with suppress(Exception):
        for k in iter(lambda: os.read(queue, NUMBER), b""):
            done[int.from_bytes(k, "little")] = function(items[int.from_bytes(k, "little")])
    counted = {key: one.tally for key, one in shared.items() if one.tally != before[key]}
    counts = {key: (count - before[key][0], mark) for key, (count, mark) in counted.items()}
    packed = io.BytesIO()
    _Packing(packed, same).dump((done, counts))
    with open(sends, "wb") as stream:
        stream.write(packed.getbuffer())


def _receive(sent: int, process: int, done: dict[int, Any], shared: Mapping[int, Shared], same) -> None:
    """Take what a helper has done, and count what it counted; nothing where it ended before it could send."""
    with open(sent, "rb") as stream:
        packed = stream.read()
    os.waitpid(process, 0)
    with suppress(EOFError, pickle.UnpicklingError):
        more, counts = _Unpacking(io.BytesIO(packed), same).load()
        done.update(more)
        for key, (count, mark) in counts.items():
            shared[key].add_tally(count, mark)


class _Packing(pickle.Pickler):
    """Packs what is the same on both sides by where it lies."""

    def __init__(self, stream: io.BytesIO, same: Mapping[int, object]):
        super().__init__(stream, pickle.HIGHEST_PROTOCOL)
        self.same = same

    def persistent_id(self, given: object) -> int | None:
        return id(given) if self.same.get(id(given)) is given and given is not None else None


class _Unpacking(pickle.Unpickler):
    def __init__(self, stream: io.BytesIO, same: Mapping[int, object]):
        super().__init__(stream)
        self.same = same

    def persistent_load(self, key: int) -> object:
        return self.same[key]
