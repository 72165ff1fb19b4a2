"""What a signal does to a command: it ends with exit code 130, within two seconds, at whatever moment it comes.

Python acts on a signal between two of its own steps only, so a long call of compiled code would keep it waiting, and
an import or a callback may swallow the exception. A thread that C's handler wakes ends the process where it has not
ended by itself.
"""

from __future__ import annotations

import os
import signal
import sys
import threading
import time
from collections.abc import Callable, Sequence
from contextlib import suppress
from typing import NoReturn

from ers_mj.processes import passing

GRACE = 1.2  # [s] that a command has to end by itself
STOPPED = 130  # exit code
SIGNALS = tuple(getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name))
_told = threading.Event()


def tell(sentence: str) -> None:
    """Say on standard error that the command was stopped."""
    _told.set()
    print(f"ers: stopped{sentence}", file=sys.stderr, flush=True)


def guarded(run: Callable[[], int]) -> int:
    """Run a command in the main thread of a process of its own; its exit code, 130 where a signal stopped it."""
    if os.name != "posix":
        return run()
    heard, told = os.pipe()
    os.set_blocking(told, False)
    signal.set_wakeup_fd(told, warn_on_full_buffer=False)
    came = threading.Event()

    def stop(number: int, frame: object) -> None:
        came.set()
        for each in SIGNALS:  # one is enough; the next would break into the end
            signal.signal(each, signal.SIG_IGN)
        # where the interrupt meets a callback or another thread's end, Python prints what it cannot raise
        sys.unraisablehook = lambda _: None
        threading.excepthook = lambda _: None
        raise KeyboardInterrupt

    heeded = [each for each in SIGNALS if signal.getsignal(each) != signal.SIG_IGN]  # which nohup sets
    for each in heeded:
        signal.signal(each, stop)
    os.register_at_fork(after_in_child=lambda: _forget(heeded))
    threading.Thread(target=_end, args=(heard,), daemon=True).start()
    code = STOPPED
    try:
        code = run()
    except BaseException:
        if not came.is_set():
            raise
        if not _told.is_set():  # an import makes other errors of an interrupt
            tell("")
    if came.is_set():
        _leave(code)
    return code


def _forget(heeded: Sequence[signal.Signals]) -> None:
    """In a forked child: what it is sent is not for its parent, and ends it."""
    signal.set_wakeup_fd(-1)
    for each in heeded:
        signal.signal(each, signal.SIG_DFL)


def _end(heard: int) -> None:
    """Wait for a signal, and for the command to end by itself; then end it."""
    while (number := os.read(heard, 1)) and number[0] not in SIGNALS:
        pass
    time.sleep(GRACE)
    if not _told.is_set():
        os.write(2, b"ers: stopped\n")
    passing.clear()
    os._exit(STOPPED)  # what the main thread has not yet printed it may be printing now


def _leave(code: int) -> NoReturn:
    """End the process now: its threads may be in long calls, and Python itself would end by the signal where the
    interrupt passed through code that it compiles from text.
    """
    passing.clear()
    for stream in (sys.stdout, sys.stderr):
        with suppress(OSError, ValueError, AttributeError):  # closed, or none
            stream.flush()
    os._exit(code)
