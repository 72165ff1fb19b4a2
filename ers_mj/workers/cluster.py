"""Workers of a Dask cluster that is there already. Nothing is started and nothing shared but what tasks carry.

A worker that dies takes nothing with it: the scheduler gives what it had, or had done, to another. Each call has a key
of its own, since Dask takes equal calls for one.
"""

from __future__ import annotations

import contextlib
import pickle
import threading
import time
import uuid
import warnings
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import CancelledError
from typing import TYPE_CHECKING, Any

from ers_mj.errors import ErsError, InputError, MissingPackage
from ers_mj.workers.base import Done, Task
from ers_mj.workers.versions import code, sources, versions

if TYPE_CHECKING:
    from distributed import Client

ANSWERS_WITHIN = 10.0  # [s] that a scheduler may take to answer
PATIENCE = 60.0  # [s] without any worker after which a run is given up
AHEAD = 2  # tasks handed out a thread of a worker
_one_at_a_time = threading.Lock()


class Cluster:
    """The workers of the scheduler at an address, as tcp://host:8786.

    Raises:
        InputError: nobody answers there, it has no workers, or one of them runs other code than this machine.
        MissingPackage: dask is not installed.
    """

    def __init__(self, address: str):
        try:
            from distributed import Client
        except ImportError:
            raise MissingPackage(
                "--cluster needs dask, which is not installed: pip install 'ers-mj[cluster]'"
            ) from None
        if not address.strip():  # Dask would start a cluster of its own
            raise InputError("--cluster is empty, the address of a Dask scheduler was expected")
        self.address = address
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # of versions, which are checked below
            try:
                try:
                    self._client: Client = Client(address, timeout=ANSWERS_WITHIN)
                except AssertionError:  # a busy machine did not start its thread in the ten seconds that it is given
                    self._client = Client(address, timeout=ANSWERS_WITHIN)
            except (OSError, TimeoutError, ValueError, RuntimeError, ImportError):
                raise InputError(
                    f"--cluster {address}: no Dask scheduler answers there within {ANSWERS_WITHIN:g} s; its address"
                    " was expected, as in tcp://127.0.0.1:8786"
                ) from None
        try:
            self._refuse_strangers()
        except BaseException:
            self.close()
            raise

    def close(self) -> None:
        """Leave the cluster as it was."""
        self._client.close()

    def run(self, tasks: Iterable[Task]) -> Iterator[Done]:
        """As :class:`ers_mj.workers.base.Crew` says; what ends several workers is given up.

        Raises:
            ErsError: the cluster went away, or all its workers did.
        """

        coming, mark = iter(tasks), uuid.uuid4().hex
        waiting: dict[Any, Task] = {}
        try:
            while True:
                while len(waiting) < AHEAD * self._threads() and (task := next(coming, None)) is not None:
                    waiting[self._handed_out(task, f"ers-{mark}-{task.name}")] = task
                if not waiting:
                    return
                for future in self._finished(list(waiting)):
                    yield self._done(waiting.pop(future).name, future)
        finally:
            with contextlib.suppress(Exception):
                self._client.cancel(list(waiting), force=True)

    def _done(self, name: str, future: Any) -> Done:
        from distributed import KilledWorker

        try:
            return Done(name, future.result())
        except KilledWorker:
            return Done(name, lost="several workers of the cluster died while they worked on it")
        except CancelledError:
            raise self._gone() from None

    def _handed_out(self, task: Task, key: str) -> Any:
        work = pickle.dumps((task.call, task.what))
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # of large arguments: a recording travels once, and with its task
            return self._client.submit(carried_out, sources(), work, key=key, pure=False)

    def _finished(self, futures: list) -> list:
        """Those that ended, as soon as one did."""
        from distributed import wait

        alone = None
        while True:
            try:
                done = wait(futures, timeout=2.0, return_when="FIRST_COMPLETED").done
            except TimeoutError:
                done = set()
            except CancelledError:
                raise self._gone() from None
            if done:
                return [future for future in futures if future in done]
            alone = None if self._threads_now() else alone or time.monotonic()
            if alone is not None and time.monotonic() - alone > PATIENCE:
                raise ErsError(
                    f"--cluster {self.address}: has had no worker for {PATIENCE:g} s, what was done is kept; the same"
                    " command goes on from there"
                )

    def _threads_now(self) -> int:
        """Threads of all workers.

        Raises:
            ErsError: the scheduler went away.
        """
        if self._client.status != "running":
            raise self._gone()
        try:
            return sum(self._client.nthreads().values())
        except (OSError, TimeoutError, CancelledError):
            raise self._gone() from None

    def _threads(self) -> int:
        return max(self._threads_now(), 1)

    def _gone(self) -> ErsError:
        return ErsError(
            f"--cluster {self.address}: the scheduler went away, what was done is kept; the same command goes on from"
            " there"
        )

    # -- who they are -------------------------------------------------------------------------------------------------

    def _refuse_strangers(self) -> None:
        """Raise InputError where there is no worker, or one that is not of our versions."""
        found = self._client.run(code, on_error="return")
        if not found:
            raise InputError(
                f"--cluster {self.address}: the scheduler has no workers, start some with dask worker {self.address}"
            )
        for worker, told in found.items():
            who = f"--cluster {self.address}: its worker {worker}"
            if isinstance(told, BaseException):
                raise InputError(f"{who} has no ers_mj of this version; the same was expected")
            for name, ours in versions().items():
                if told[0].get(name) != ours:
                    raise InputError(
                        f"{who} has {name} {told[0].get(name)}, here it is {ours}; the same was expected, so that"
                        " answers do not depend on who gives them"
                    )
            if told[1] != sources():
                raise InputError(STRANGER.format(who))


STRANGER = "{} has other sources of ers_mj than this machine, of the same version; the same were expected"


def carried_out(expected: str, work: bytes) -> Any:
    """On a worker: the task, one at a time in a process, as much of a diagnosis belongs to its process.

    Raises:
        InputError: this worker, which came later, has other sources.
    """
    if sources() != expected:
        raise InputError(STRANGER.format("a worker that joined later"))
    call: Callable[..., Any]
    call, what = pickle.loads(work)
    with _one_at_a_time:
        return call(*what)
