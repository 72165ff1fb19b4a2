"""Bad days, many of them: damaged files, odd columns, clocks, command lines, datasheets, places and interruptions; a
table of what was tried and what survived.

    python analysis/bad_days.py [--inputs 20000] [--lines 400] [--stops 12] [--seed 0]

An input survives where it ends within a minute of a processor in an answer or in one sentence, with no traceback, and
no file is left that was not asked for. Exit code 1 where one does not; each is printed.
"""

import argparse
import os
import resource
import signal
import subprocess
import sys
import tempfile
import time
from collections import Counter
from pathlib import Path

from hypothesis import HealthCheck, Phase, given, seed, settings

ROOT = Path(__file__).resolve().parents[1]
sys.path[:0] = [str(ROOT), str(ROOT / "tests")]
os.environ["PYTHONPATH"] = os.pathsep.join(filter(None, [str(ROOT), os.environ.get("PYTHONPATH")]))

import bad_commands  # noqa: E402
import bad_inputs  # noqa: E402

MINUTE = 60.0  # [s] of a processor
HUNG = 600.0  # [s] by the clock, of what does not even use one
CODES = (0, 1, 2)


class Table:
    """What was tried and what survived, by kind."""

    def __init__(self):
        self.tried, self.survived, self.slowest = Counter(), Counter(), Counter()

    def count(self, kind: str, fault: str, seconds: float, told: object) -> None:
        """One input, and what was wrong with what came of it."""
        self.tried[kind] += 1
        self.survived[kind] += not fault
        self.slowest[kind] = max(self.slowest[kind], seconds)
        if fault:
            print(f"{kind}: {fault}\n  {str(told)[:600]}", file=sys.stderr, flush=True)

    def lines(self) -> list[str]:
        """The table, a row a kind."""
        rows = [f"{'kind':28}{'tried':>8}{'survived':>10}{'slowest [s]':>13}"]
        rows += [f"{k:28}{n:>8}{self.survived[k]:>10}{self.slowest[k]:>13.2f}" for k, n in self.tried.items()]
        return [*rows, f"{'all':28}{self.tried.total():>8}{self.survived.total():>10}"]


def drawn(strategy, count: int, number: int, use) -> None:
    """Use so many examples, of which none ends the others."""
    if not count:
        return
    mild = settings(
        max_examples=count,
        deadline=None,
        database=None,
        phases=[Phase.generate],
        suppress_health_check=list(HealthCheck),
    )
    seed(number)(mild(given(strategy)(use)))()


# -- readers, in this process -----------------------------------------------------------------------------------------


def read(table: Table, kind: str, folder: Path, survive, told: object) -> None:
    """One input of a reader."""
    began, fault = time.process_time(), ""
    try:
        survive()
    except Exception as error:
        fault = f"{type(error).__name__}: {str(error)[:300]}"
    seconds = time.process_time() - began
    left = [path.name for path in folder.iterdir()]
    fault = fault or (f"took {seconds:.0f} s" if seconds > MINUTE else f"left {left}" if left else "")
    table.count(kind, fault, seconds, told)


def try_readers(table: Table, count: int, number: int, folder: Path) -> None:
    """Damaged files of every format, odd columns in two formats and in none."""

    def damaged(file: tuple[str, bytes]) -> None:
        suffix, content = file
        survive = lambda: bad_inputs.survived(folder / f"rec{suffix}", content)
        read(table, f"damaged {suffix}", folder, survive, content)

    def odd(columns: dict) -> None:
        for suffix in (".csv", ".parquet"):
            if (content := bad_inputs.written(columns, suffix)) is not None:
                survive = lambda: bad_inputs.survived(folder / f"rec{suffix}", content)  # noqa: B023
                read(table, f"odd columns in {suffix}", folder, survive, columns)
        read(table, "odd columns as arrays", folder, lambda: bad_inputs.survived_columns(columns), columns)

    drawn(bad_inputs.damaged_files(), 2 * count // 3, number, damaged)
    drawn(bad_inputs.tables(), count // 9, number, odd)


# -- commands, each in a child of this process ------------------------------------------------------------------------


def called(argv: list[str], folder: Path) -> tuple[int | None, float, str]:
    """(exit code, None where it was ended; seconds of a processor; standard error) of a command in a folder."""
    began = time.monotonic()
    child = os.fork()
    if child == 0:
        _command(argv, folder)
    done, status, usage = os.wait4(child, os.WNOHANG)
    while not done:
        if time.monotonic() - began > HUNG:
            os.kill(child, signal.SIGKILL)
        time.sleep(0.005)
        done, status, usage = os.wait4(child, os.WNOHANG)
    code = os.waitstatus_to_exitcode(status)
    ended = code in (-signal.SIGXCPU, -signal.SIGKILL)
    complaint = (folder.parent / "stderr").read_text(errors="replace")
    return None if ended else code, usage.ru_utime + usage.ru_stime, complaint


def _command(argv: list[str], folder: Path) -> None:
    """In the child: the command, its output beside the folder."""
    os.chdir(folder)
    resource.setrlimit(resource.RLIMIT_CPU, (int(MINUTE), int(MINUTE)))
    for name, number in (("stdout", 1), ("stderr", 2)):
        os.dup2(os.open(folder.parent / name, os.O_WRONLY | os.O_CREAT | os.O_TRUNC), number)
    code = 99
    try:
        from ers_mj.cli import main

        code = main(argv)
    except SystemExit as left:  # --help
        code = left.code or 0
    except BaseException:
        sys.excepthook(*sys.exc_info())
    finally:
        sys.stdout.flush(), sys.stderr.flush()
        os._exit(code)


def fault_of(argv: list[str], code: int | None, complaint: str, before: set, after: set) -> str:
    """What is wrong with the end of a command."""
    if code is None:
        return "went on for a minute"
    if code not in CODES or "Traceback" in complaint:
        return f"exit code {code}: {complaint[-400:]}"
    if code == 2 and complaint.count("\n") != 1:
        return f"not one sentence: {complaint[-400:]}"
    left = {name for name in after - before if code or name.endswith(".part")}
    return f"left {left}" if left else ""


def try_line(table: Table, kind: str, argv: list[str], sheet: str | None = None) -> None:
    """One command in a folder of its own."""
    with tempfile.TemporaryDirectory(prefix="bad-days-") as outer:
        folder = Path(outer) / "here"
        folder.mkdir()
        bad_commands.lay_out(folder)
        if sheet is not None:
            (folder / "sheet.toml").write_text(sheet)
        before = {str(path) for path in folder.rglob("*")}
        code, seconds, complaint = called(argv, folder)
        fault = fault_of(argv, code, complaint, before, {str(path) for path in folder.rglob("*")})
    table.count(kind, fault, seconds, (argv, sheet))


def try_lines(table: Table, count: int, number: int) -> None:
    """Odd command lines, absurd datasheets, and places that results cannot go to."""
    short = ["simulate", "sheet.toml", "--input", "steps", "--duration", "0.1", "--out", "new.csv"]
    with tempfile.TemporaryDirectory(prefix="bad-days-") as folder:  # compile, however long that takes a busy machine
        for plant in ("reduced", "mujoco"):
            command = [sys.executable, "-m", "ers_mj", "simulate", *short[2:], "--plant", plant, "--force"]
            subprocess.run(command, cwd=folder, stdout=subprocess.DEVNULL, check=True)
    drawn(bad_commands.lines(), count // 2, number, lambda argv: try_line(table, "command lines", argv))
    for kind, argv in (("datasheets", short), ("datasheets in MuJoCo", [*short, "--plant", "mujoco"])):
        drawn(
            bad_commands.datasheets(),
            count // 5,
            number,
            lambda text: try_line(table, kind, argv, text),  # noqa: B023
        )
    for out in (
        "rec.csv",
        "folder",
        "x" * 300,
        "a/" * 3000,
        "",
        "/dev/null",
        "/proc/x",
        "/sys/x",
        "a\nb",
        "\udcff",
        "-",
    ):
        try_line(table, "places", ["inspect", "rec.csv", f"--out={out}"])


# -- interruptions, each of a process of its own ----------------------------------------------------------------------


def heeding() -> None:
    """In a child: Ctrl-C is heeded, also where this script runs behind a shell that has it ignored."""
    signal.signal(signal.SIGINT, signal.SIG_DFL)


def try_stops(table: Table, count: int) -> None:
    """A diagnosis that is stopped ever later."""
    for k in range(count):
        with tempfile.TemporaryDirectory(prefix="bad-days-") as outer:
            (Path(outer) / "rec.csv").write_bytes(bad_inputs.files()[".csv"][0])
            command = [sys.executable, "-m", "ers_mj", "diagnose", "rec.csv", "--out", "res"]
            child = subprocess.Popen(
                command,
                cwd=outer,
                stdout=subprocess.DEVNULL,
                stderr=subprocess.PIPE,
                text=True,
                preexec_fn=heeding,
            )
            time.sleep(0.4 + 0.25 * k)  # by then Python itself has started
            began = time.monotonic()
            child.send_signal((signal.SIGINT, signal.SIGTERM)[k % 2])
            _, complaint = child.communicate()
            seconds = time.monotonic() - began
            is_over = child.returncode in CODES
            fault = "" if is_over or (child.returncode, "Traceback" in complaint) == (130, False) else complaint[-300:]
            left = [path.name for path in Path(outer).iterdir() if not is_over and path.name != "rec.csv"]
            fault = fault or (f"left {left}" if left else f"took {seconds:.1f} s" if seconds > 2.5 else "")
        table.count("interruptions", fault, seconds, (k, child.returncode))


def main() -> int:
    """Try them all, print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    for name, usual in (("inputs", 20_000), ("lines", 400), ("stops", 12), ("seed", 0)):
        parser.add_argument(f"--{name}", type=int, default=usual)
    asked = parser.parse_args()
    table = Table()
    with tempfile.TemporaryDirectory(prefix="bad-days-") as folder:
        try_readers(table, asked.inputs, asked.seed, Path(folder))
    try_lines(table, asked.lines, asked.seed)
    try_stops(table, asked.stops)
    print("\n".join(table.lines()))
    return 0 if table.tried.total() == table.survived.total() else 1


if __name__ == "__main__":
    raise SystemExit(main())
