"""What commands show: a progress bar, and lines for a terminal."""

from __future__ import annotations

import os
import shutil
import sys

from ers_mj.commands.keeping import Kept


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


def written(kept: Kept) -> list[str]:
    """The lines that tell which files were written, none where there are none."""
    title = "written, in the place of what was there" if kept.replaced else "written"
    return ["", bold(title), *(f"  {path}" for path in kept.files)] if kept.files else []


def bold(text: str) -> str:
    """Text in bold on a terminal."""
    return f"\x1b[1m{text}\x1b[0m" if sys.stdout.isatty() and "NO_COLOR" not in os.environ else text


def tell(line: str) -> None:
    """A line for a person while the work goes on, out of the way of --json."""
    print(line if not sys.stderr.isatty() else f"\r\x1b[2K{line}", file=sys.stderr, flush=True)
