"""`ers watch`: the parameters of a servo while it runs, and a flag when the model stops explaining it."""

from __future__ import annotations

import argparse
import codecs
import json
import os
import select
import shutil
import sys
import time
from collections import deque
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

from ers_mj.commands.options import mapping, number, pair
from ers_mj.door.saving import plain
from ers_mj.errors import InputError
from ers_mj.processes import stopping

if TYPE_CHECKING:
    from ers_mj.online.moving_horizon import Estimate


def add_parser(commands: argparse._SubParsersAction) -> None:
    """Add this command to the command line."""
    parser = commands.add_parser(
        "watch",
        help="follow a running servo's parameters, and flag when the model stops explaining it",
        description=(
            "Follow Eq. (6)'s parameters along a stream of samples: CSV with a header, in a recording's columns t_s,"
            " u_V, theta_rad (or others that\ners diagnose takes). A file is followed as it grows until Ctrl-C. Changes"
            " of parameters are announced; a flag rises when no parameters\nexplain the stream. Without excitation"
            " nothing is told: the voltage should keep the output moving through stick and slip."
        ),
        epilog=(
            "examples:\n  ers watch rig.csv --datasheet servo.toml\n  my_logger | ers watch - --json\n  ers watch"
            " run1.csv --once"
        ),
    )
    parser.add_argument("stream", metavar="FILE|-", help="a CSV file that may grow, or - for standard input")
    parser.add_argument(
        "--datasheet",
        "--model",
        metavar="TOML",
        help=(
            "what is known of the servo, or a model.toml; table1 for the paper's (default: learn it from the first 5 s)"
        ),
    )
    parser.add_argument(
        "--map",
        action="append",
        default=[],
        type=pair,
        metavar="NAME=COLUMN",
        help="take a column of another name; repeatable",
    )
    parser.add_argument("--once", action="store_true", help="stop at the end of the file instead of waiting for more")
    parser.add_argument(
        "--every",
        type=number(above=0),
        default=1.0,
        metavar="S",
        help="a line every S seconds of the stream, in a pipe (default 1)",
    )
    parser.add_argument("--json", action="store_true", help="one JSON object a line for every estimate (0.1 s)")
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> int:
    """Follow until the stream ends, 0; or until Ctrl-C, 130 as everywhere, with all that was told before it shown."""
    chosen = mapping(arguments.map)
    if arguments.stream != "-" and not Path(arguments.stream).is_file():
        what = "is a folder" if Path(arguments.stream).is_dir() else "there is no such file"
        raise InputError(f"{arguments.stream}: {what}, a CSV file or - for standard input was expected")
    from ers_mj.data.streaming import Stream
    from ers_mj.servo.datasheet import read_plant

    datasheet = None if arguments.datasheet is None else read_plant(arguments.datasheet)
    stream = Stream("standard input" if arguments.stream == "-" else Path(arguments.stream).name, chosen)
    show = _Machine() if arguments.json else _Screen(stream.name) if sys.stdout.isatty() else _Lines(arguments.every)
    try:
        for estimate in _estimates(stream, _pieces(arguments.stream, arguments.once), datasheet, show):
            show(estimate)
    except KeyboardInterrupt:
        show.end()
        stopping.tell(f" following {stream.name}")
        return stopping.STOPPED
    show.end()
    return 0


def _pieces(source: str, once: bool, size: int = 1 << 16, pause: float = 0.05) -> Iterator[str]:
    """Text as it arrives, at most `size` bytes at once; an empty piece where nothing has come for `pause` [s]."""
    decoder = codecs.getincrementaldecoder("utf-8")(errors="strict")
    handle, follow = (sys.stdin.fileno(), False) if source == "-" else (os.open(source, os.O_RDONLY), not once)
    try:
        while True:
            if source == "-" and not select.select([handle], [], [], pause)[0]:
                yield ""
                continue
            piece = os.read(handle, size)
            if not piece and not follow:
                yield "\n"
                return
            if not piece:
                if os.fstat(handle).st_size < os.lseek(handle, 0, os.SEEK_CUR):
                    raise InputError(f"{source}: has become shorter while it was read, a file that grows was expected")
                time.sleep(pause)
            yield decoder.decode(piece)
    except UnicodeDecodeError:
        raise InputError(f"{source}: is not text in UTF-8, lines of CSV were expected") from None
    except OSError as error:
        raise InputError(f"{source}: cannot be read ({error.strerror})") from None
    finally:
        if source != "-":
            os.close(handle)


def _estimates(stream, pieces: Iterator[str], datasheet, show) -> Iterator[Estimate]:
    """Estimates of a stream; the first ones once it has moved for long enough."""
    import numpy as np

    from ers_mj.online.horizon import HORIZON
    from ers_mj.online.moving_horizon import Tracker, is_moving, opening

    begun: tuple[np.ndarray, ...] = (np.zeros(0),) * 3
    tracker: Tracker | None = None
    needed = HORIZON.unknown_opening if datasheet is None else HORIZON.opening
    for piece in pieces:
        samples = stream.feed(piece)
        if tracker is None:
            begun = tuple(np.append(a, b) for a, b in zip(begun, samples, strict=True))
            if not begun[0].size or begun[0][-1] - begun[0][0] < needed or not is_moving(*begun[1:]):
                show.wait(begun[0])
                begun = (
                    tuple(x[np.searchsorted(begun[0], begun[0][-1] - 2 * needed) :] for x in begun)
                    if begun[0].size
                    else begun
                )
                continue
            tracker, samples = (
                Tracker(opening(begun[0], begun[1], begun[2], datasheet, stream.units["y"] == "rad")),
                begun,
            )
            show.begin(stream.units, datasheet)
        yield from tracker.push(*samples)
    if tracker is None:
        seconds = begun[0][-1] - begun[0][0] if begun[0].size else 0.0
        raise InputError(
            f"{stream.name}: ended after {seconds:.3g} s, at least {needed:g} s of motion under a changing input were"
            " expected" + ("" if stream.units else " and a header before them")
        )


class _Lines:
    """For a pipe: what happens, and a line every so often."""

    def __init__(self, every: float):
        self._every, self._next = every, -float("inf")
        self._last: Estimate | None = None

    def wait(self, t) -> None:
        """Nothing to say yet."""

    def begin(self, units, datasheet) -> None:
        """The model is ready."""
        from ers_mj.report.watch_report import units as shown

        self._shown = shown(units["y"], units["u"])

    def __call__(self, now: Estimate) -> None:
        from ers_mj.report.watch_report import events, line

        for event in events(self._last, now, self._shown):
            print(f"{now.t:.1f} s  {event}", flush=True)
        if now.t >= self._next:
            print(line(now, self._shown), flush=True)
            self._next = now.t + self._every - 1e-6
        self._last = now

    def end(self) -> None:
        """Nothing to clear away."""


class _Machine(_Lines):
    """JSON lines."""

    def __init__(self):
        super().__init__(0.0)

    def __call__(self, now: Estimate) -> None:
        from ers_mj.report.watch_report import as_document, events

        print(
            json.dumps(
                plain(as_document(now, events(self._last, now, self._shown))), ensure_ascii=False, allow_nan=False
            ),
            flush=True,
        )
        self._last = now


class _Screen(_Lines):
    """For a terminal: one screen, drawn anew in its place, at most ten times a second."""

    def __init__(self, name: str):
        super().__init__(0.0)
        self._name, self._drawn, self._height = name, -float("inf"), 0
        self._history: deque[Estimate] = deque(maxlen=400)
        self._events: deque[str] = deque(maxlen=6)
        self._first: dict[str, float] = {}

    def wait(self, t) -> None:
        seconds = t[-1] - t[0] if t.size else 0.0
        self._draw(
            [f"ers watch  {self._name}", f"  waiting for motion under a changing input ({seconds:.1f} s seen)"],
            force=False,
        )

    def __call__(self, now: Estimate) -> None:
        from ers_mj.report.watch_report import events, screen

        told = events(self._last, now, self._shown)
        self._events.extend(f"{now.t:.1f} s  {event}" for event in told)
        self._history.append(now)
        self._first = self._first or dict(now.values)
        self._last = now
        width = max(shutil.get_terminal_size().columns - 1, 40)
        self._draw(screen(self._name, self._history, self._events, self._first, self._shown, width), force=bool(told))

    def _draw(self, lines: list[str], force: bool) -> None:
        self._lines = lines
        if force or time.monotonic() - self._drawn > 0.1:
            up = f"\x1b[{self._height}A" if self._height else ""
            sys.stdout.write(up + "".join(f"\x1b[2K{line}\n" for line in lines) + "\x1b[J")
            sys.stdout.flush()
            self._drawn, self._height = time.monotonic(), len(lines)

    def end(self) -> None:
        """The last screen stays."""
        if self._history:
            self._draw(self._lines[:-2], force=True)
