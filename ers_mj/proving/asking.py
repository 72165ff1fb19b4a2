"""Asks the diagnosis about one case, blind: a fresh process in an empty folder that holds its recordings and datasheet,
nothing else.
"""

from __future__ import annotations

import json
import math
import os
import resource
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from ers_mj.processes.passing import passing
from ers_mj.proving.sealing import hashes

LIMIT = 300.0  # [s] of one processor that a diagnosis may take
PATIENCE = 0.7  # [s] that a child has to end when it is told to
START = """import os, resource, runpy, sys
from ers_mj.processes.passing import end_with_parent, pass_with_process
pass_with_process(os.getcwd())
end_with_parent()
resource.setrlimit(resource.RLIMIT_CPU, ({limit}, {limit} + 5))
runpy.run_module("ers_mj", run_name="__main__", alter_sys=True)"""


class Asker:
    """Asks about cases, several at once if need be; `stop` ends every child that is under way."""

    def __init__(self, code: str, limit: float = LIMIT):
        self.code, self.limit = code, limit
        self.children: set[subprocess.Popen] = set()
        self.stopped_at = math.inf

    def ask(self, case: Path) -> dict | None:
        """The answer with what it cost; a failure or a run out of time is an answer without a document. None once
        stopped.
        """
        bound = {"case": case.name, "files_sha256": hashes(case), "code": self.code}
        with passing(Path(tempfile.mkdtemp(prefix="ers-blind-"))) as folder:
            for path in case.iterdir():
                shutil.copy(path, folder)
            cost, text, complaint = self.run(folder)
        if self.stopped_at < math.inf:
            return None
        document, error = None, None
        try:
            document = json.loads(text) if cost["exit"] == 0 else None
        except ValueError:
            error = "its answer is no JSON"
        if document is None and error is None:
            late = (
                cost["exit"] in (-signal.SIGXCPU, -signal.SIGKILL)
                and max(cost["cpu_s"], cost["wall_s"]) > 0.9 * self.limit
            )
            error = (
                f"no answer within {self.limit:g} s"
                if late
                else (complaint.strip().splitlines() or [f"exit code {cost['exit']}"])[-1][:300]
            )
        return {**bound, **cost, "error": error, "document": document}

    def run(self, folder: Path) -> tuple[dict, str, str]:
        """(what it cost, what it printed, what it complained of) of a diagnosis in this folder."""
        recordings = sorted(
            (p.name for p in folder.iterdir() if p.name.startswith("rec")), key=lambda name: (len(name), name)
        )
        sheet = ["--datasheet", "datasheet.toml"] if (folder / "datasheet.toml").exists() else []
        command = [
            sys.executable,
            "-c",
            START.format(limit=int(self.limit)),
            "diagnose",
            *recordings,
            *sheet,
            "--json",
            "--jobs",
            "1",
        ]
        package = str(Path(__file__).resolve().parents[2])
        paths = os.pathsep.join([package, *filter(None, [os.environ.get("PYTHONPATH")])])
        single = dict.fromkeys(("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS"), "1")
        began = time.monotonic()
        with tempfile.TemporaryFile("w+") as out, tempfile.TemporaryFile("w+") as err:
            child = subprocess.Popen(
                command,
                cwd=folder,
                env={**os.environ, **single, "PYTHONPATH": paths},
                stdin=subprocess.DEVNULL,
                stdout=out,
                stderr=err,
                start_new_session=True,
            )
            self.children.add(child)
            code, usage = self._wait(child, began)
            self.children.discard(child)
            out.seek(0), err.seek(0)
            text, complaint = out.read(), err.read()
        scale = 2**20 if sys.platform == "darwin" else 2**10
        cost = {
            "exit": code,
            "wall_s": time.monotonic() - began,
            "cpu_s": usage.ru_utime + usage.ru_stime,
            "peak_MiB": usage.ru_maxrss / scale,
        }
        return cost, text, complaint

    def _wait(self, child: subprocess.Popen, began: float) -> tuple[int, resource.struct_rusage]:
        """(exit code, resources used) of the child, killed when its time is over."""
        while True:
            pid, status, usage = os.wait4(child.pid, os.WNOHANG)
            if pid:
                child.returncode = os.waitstatus_to_exitcode(status)
                return child.returncode, usage
            # by the clock a busy machine takes longer than by the processor, which the child limits itself
            now = time.monotonic()
            if now - self.stopped_at > PATIENCE or now - began > 4.0 * self.limit:
                child.kill()
            time.sleep(0.05)

    def stop(self) -> None:
        """End every child that this asker started, leaving it a moment to tidy up."""
        self.stopped_at = time.monotonic()
        for child in list(self.children):
            child.terminate()
