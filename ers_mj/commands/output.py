"""What commands show: a progress bar, and lines for a terminal."""

from __future__ import annotations

import contextlib
import io
import os
import shutil
import sys
import time
from collections.abc import Iterator

from ers_mj.commands.keeping import Kept


class Told:
    """Whether anything is told but errors and JSON."""

    quiet = False


@contextlib.contextmanager
def quietly(quiet: bool, as_json: bool) -> Iterator[None]:
    """Say nothing but errors, and JSON where it is asked for, until this ends."""
    Told.quiet = quiet
    try:
        with contextlib.redirect_stdout(io.StringIO()) if quiet and not as_json else contextlib.nullcontext():
            yield
    finally:
        Told.quiet = False


class Progress:
    """A bar on standard error where that is a terminal, silence elsewhere: `progress(text, fraction)`. It tells how
    long it has been, and how long it may take yet.
    """

    def __init__(self):
        self.shown = sys.stderr.isatty() and not Told.quiet
        self._began = time.monotonic()

    def __call__(self, text: str, fraction: float) -> None:
        if not self.shown:
            return
        share, bar = min(max(float(fraction), 0.0), 1.0), 24  # characters
        full = round(bar * share)
        width = max(shutil.get_terminal_size().columns - 1, 20)
        line = f"  {'━' * full}{'╌' * (bar - full)} {share:4.0%}  {self._times(share)}  {text}"
        sys.stderr.write(f"\r\x1b[2K{line[:width]}")
        sys.stderr.flush()

    def _times(self, share: float) -> str:
        """Elapsed, and what is left if it goes on as it went; nothing of that before it can be told."""
        elapsed = time.monotonic() - self._began
        left = f", {_clock(elapsed * (1.0 - share) / share)} left" if share > 0.03 and elapsed > 3.0 else ""
        return _clock(elapsed) + left

    def __enter__(self) -> Progress:
        return self

    def __exit__(self, *_: object) -> None:
        if self.shown:
            sys.stderr.write("\r\x1b[2K")
            sys.stderr.flush()


def _clock(seconds: float) -> str:
    """ "1:05", "2:03:10"."""
    minutes, rest = divmod(round(seconds), 60)
    hours, minutes = divmod(minutes, 60)
    return f"{hours}:{minutes:02}:{rest:02}" if hours else f"{minutes}:{rest:02}"


def written(kept: Kept) -> list[str]:
    """The lines that tell which files were written, none where there are none."""
    title = "written, in the place of what was there" if kept.replaced else "written"
    return ["", bold(title), *(f"  {path}" for path in kept.files)] if kept.files else []


def bold(text: str) -> str:
    """Text in bold on a terminal."""
    return f"\x1b[1m{text}\x1b[0m" if sys.stdout.isatty() and "NO_COLOR" not in os.environ else text


def tell(line: str) -> None:
    """A line for a person while the work goes on, out of the way of --json."""
    if not Told.quiet:
        print(line if not sys.stderr.isatty() else f"\r\x1b[2K{line}", file=sys.stderr, flush=True)
