"""Python programs that share nothing but an imported numba: each runs in a process that a warm one forks for it, which
costs milliseconds where a start of Python costs a second.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path


class Warm:
    """A process that has imported numba and waits for programs; for use in a `with`."""

    def __init__(self) -> None:
        self._helper = subprocess.Popen(
            [sys.executable, __file__], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
        )

    def __enter__(self) -> Warm:
        return self

    def __exit__(self, *_: object) -> None:
        self._helper.communicate()

    def run(self, program: str, folder: Path, environment: dict[str, str]) -> tuple[int, str, str]:
        """(exit status, standard output, standard error) of a program that begins in this folder."""
        out, err = folder / "stdout.txt", folder / "stderr.txt"
        asked = {"program": program, "folder": str(folder), "environment": environment, "files": [str(out), str(err)]}
        self._helper.stdin.write(json.dumps(asked) + "\n")
        self._helper.stdin.flush()
        status = int(self._helper.stdout.readline())
        return status, out.read_text(), err.read_text()


def _become(asked: dict) -> None:
    """Be the program's process, as if Python had just been started for it."""
    import site
    import tempfile

    os.chdir(asked["folder"])
    os.environ.clear()
    os.environ.update(asked["environment"])
    for number, file in enumerate(asked["files"], start=1):
        os.dup2(os.open(file, os.O_WRONLY | os.O_CREAT | os.O_TRUNC, 0o600), number)
    sys.path[:1] = ["", *asked["environment"].get("PYTHONPATH", "").split(os.pathsep)]
    tempfile.tempdir = None
    sys.modules.pop("sitecustomize", None)
    site.execsitecustomize()
    exec(compile(asked["program"], "<string>", "exec"), {"__name__": "__main__"})


def _serve() -> None:
    """A forked process for each line of standard input; its exit status is answered."""
    import atexit
    import traceback

    import numba  # what all of them have

    numba.njit("f8(f8)")(lambda x: x)  # with what numba loads when it first compiles

    for line in sys.stdin:
        if (child := os.fork()) == 0:
            status = 0
            try:
                _become(json.loads(line))
            except BaseException:
                traceback.print_exc()
                status = 1
            atexit._run_exitfuncs()
            sys.stdout.flush()
            sys.stderr.flush()
            os._exit(status)
        print(os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]), flush=True)


if __name__ == "__main__":
    _serve()
