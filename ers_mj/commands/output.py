"""What commands show: a progress bar, and lines for a terminal."""

from __future__ import annotations

import os
import shutil
import signal
import sys
import threading
from collections.abc import Sequence
from pathlib import Path


class Progress:
    """A bar on standard error where that is a terminal, silence elsewhere: `progress(text, fraction)`."""

    def __init__(self):
        self.shown = sys.stderr.isatty()

    def __call__(self, text: str, fraction: float) -> None:
        if not self.shown:
            return
        share, bar = min(max(float(fraction), 0.0), 1.0), 24  # characters
        full = round(bar * share)
        width = max(shutil.get_terminal_size().columns - 1, 20)
        line = f"  {'━' * full}{'╌' * (bar - full)} {share:4.0%}  {text}"
        sys.stderr.write(f"\r\x1b[2K{line[:width]}")
        sys.stderr.flush()

    def __enter__(self) -> Progress:
        return self

    def __exit__(self, *_: object) -> None:
        if self.shown:
            sys.stderr.write("\r\x1b[2K")
            sys.stderr.flush()


def written(files: Sequence[Path]) -> list[str]:
    """The lines that tell which files were written, none where there are none."""
    return ["", bold("written"), *(f"  {path}" for path in files)] if files else []


def bold(text: str) -> str:
    """Text in bold on a terminal."""
    return f"\x1b[1m{text}\x1b[0m" if sys.stdout.isatty() and "NO_COLOR" not in os.environ else text


def tell(line: str) -> None:
    """A line for a person while the work goes on, out of the way of --json."""
    print(line if not sys.stderr.isatty() else f"\r\x1b[2K{line}", file=sys.stderr, flush=True)


def heed_terminate() -> None:
    """Let a plain kill stop as Ctrl-C does: nothing under way is left behind."""
    if threading.current_thread() is threading.main_thread():
        signal.signal(signal.SIGTERM, signal.default_int_handler)
