"""The command line `ers`: one parser, one file a command in `commands/`, bad input in one sentence."""

from __future__ import annotations

import argparse
import errno
import gc
import os
import shlex
import sys
from collections.abc import Sequence
from difflib import get_close_matches
from typing import NoReturn

# before numpy comes: threads are for recordings and effects, not for small matrices
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

from ers_mj import __version__
from ers_mj.commands import COMMANDS
from ers_mj.commands.output import quietly
from ers_mj.errors import ErsError, InputError
from ers_mj.processes import stopping

# objects made before garbage is looked for: imports make a million that stay, and arrays go without
SELDOM = (50_000, 20, 20)
FULL = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG, errno.EIO)  # of a place that takes no more
LONGEST = 300  # of a sentence that refuses, in characters


class Parser(argparse.ArgumentParser):
    """A parser that raises InputError instead of printing its usage and leaving."""

    def __init__(self, **settings):
        super().__init__(formatter_class=argparse.RawDescriptionHelpFormatter, allow_abbrev=False, **settings)

    def error(self, message: str) -> NoReturn:
        raise InputError(f"{message} (see {self.prog} --help)")

    def _check_value(self, action: argparse.Action, value: object) -> None:
        if action.choices is not None and value not in action.choices:
            near = get_close_matches(str(value), list(action.choices), n=1, cutoff=0.6)
            hint = f"did you mean {near[0]}? " if near else ""
            what = "command" if isinstance(action, argparse._SubParsersAction) else "/".join(action.option_strings)
            self.error(f"there is no {what} {str(value)[:40]!r}; {hint}there are {', '.join(action.choices)}")


def build_parser() -> Parser:
    """The whole command line."""
    parser = Parser(
        prog="ers",
        description="Finds, names and models the physics that a servo simulation leaves out.",
        epilog="example: ers diagnose run1.csv run2.csv --datasheet table1 --holdout run3.csv",
    )
    parser.add_argument("--version", action="version", version=f"ers {__version__}")
    commands = parser.add_subparsers(title="commands", metavar="COMMAND", dest="command", required=True)
    for command in COMMANDS:
        command.add_parser(commands)
    for each in commands.choices.values():
        each.add_argument("--quiet", action="store_true", help="say nothing but errors, and JSON where it is asked for")
    return parser


def parse(argv: Sequence[str]) -> argparse.Namespace:
    """The arguments of one call. In `--holdout H A B` without other recordings, A and B are the recordings.

    Raises:
        InputError: argv is no call of ers.
    """
    try:
        return build_parser().parse_args(argv)
    except InputError as error:
        if "--holdout" not in argv or "required: REC" not in str(error):
            raise
        return build_parser().parse_args(_recordings_first(list(argv)))


def _recordings_first(argv: list[str]) -> list[str]:
    """argv with what follows the last `--holdout H` moved to the place of the recordings."""
    begin = len(argv) - argv[::-1].index("--holdout") + 1
    end = next((k for k in range(begin, len(argv)) if argv[k].startswith("-")), len(argv))
    return [argv[0], *argv[begin:end], *argv[1:begin], *argv[end:]]


def shortened(text: str) -> str:
    """A sentence without its middle where it is long: what is at fault stands at its beginning, what is expected at its
    end.
    """
    return text if len(text) <= LONGEST else f"{text[: LONGEST // 2]} ... {text[-LONGEST // 2 + 5 :]}"


def main(argv: Sequence[str] | None = None) -> int:
    """Run one command; the exit code: 0 done, 1 a check failed, 2 bad input, 130 interrupted."""
    _ready_streams()
    gc.set_threshold(*SELDOM)
    try:
        given = list(sys.argv[1:] if argv is None else argv)
        arguments = parse(given)
        arguments.told = shlex.join(["ers", *given])  # on the page that this call makes
        with quietly(arguments.quiet, getattr(arguments, "json", False)):
            code = arguments.run(arguments)
            sys.stdout.flush()  # here, where a full disk still gets its sentence
            return code
    except ErsError as error:
        print(f"ers: {shortened(str(error))}", file=sys.stderr)
        return 2
    except MemoryError:
        print("ers: this takes more memory than there is, shorter recordings would do", file=sys.stderr)
        return 2
    except KeyboardInterrupt:
        stopping.tell(", nothing was written")
        return stopping.STOPPED
    except BrokenPipeError:  # the reader of our output has left
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 0
    except OSError as error:
        if error.filename is not None:  # a name too long, a loop of links, a folder that is closed: none that we made
            print(f"ers: {shortened(f'{error.filename}: {error.strerror}')}", file=sys.stderr)
            return 2
        if error.errno not in FULL:
            raise
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        print(f"ers: standard output cannot be written ({error.strerror})", file=sys.stderr)
        return 2


def _ready_streams() -> None:
    """A terminal without a degree sign gets a question mark; a stream that was closed swallows what is printed."""
    for name in ("stdout", "stderr"):
        stream = getattr(sys, name)
        if stream is None:
            setattr(sys, name, open(os.devnull, "w"))  # noqa: SIM115
        elif hasattr(stream, "reconfigure"):
            stream.reconfigure(errors="replace")
