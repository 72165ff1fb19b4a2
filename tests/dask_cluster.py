"""A real Dask scheduler and workers on the loopback address, as processes that a test may kill."""

from __future__ import annotations

import os
import re
import subprocess
import sys
import tempfile
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
PATIENCE = 60.0  # [s] for a process that imports everything on a busy machine


class Cluster:
    """For use in a `with`: its ``address``, and its ``workers``, which have all joined."""

    def __init__(self, workers: int = 2, paths: tuple[str | Path, ...] = ()):
        found = os.pathsep.join(map(str, [*paths, ROOT, ROOT / "tests"]))
        self._environment = {**os.environ, "PYTHONPATH": found}
        self._folder = tempfile.TemporaryDirectory(prefix="ers-dask-")
        self._log = Path(self._folder.name) / "scheduler.log"
        self.workers: list[subprocess.Popen] = []
        self.scheduler = self._start("dask_scheduler", "--host", "127.0.0.1", "--port", "0", "--no-dashboard")
        try:
            self.address = self._logged(r"Scheduler at:\s+(tcp://\S+)", 1)[0]
            for _ in range(workers):
                self.workers.append(self._start("dask_worker", self.address, *"--nthreads 1 --no-nanny".split()))
            self._logged("Register worker", workers)
        except BaseException:
            self.__exit__()
            raise

    def _logged(self, pattern: str, times: int) -> list[str]:
        """What the scheduler has said, once it has said it so often."""
        end = time.monotonic() + PATIENCE
        while len(found := re.findall(pattern, self._log.read_text())) < times:
            assert time.monotonic() < end and self.scheduler.poll() is None, self._log.read_text()
            time.sleep(0.05)
        return found

    def _start(self, what: str, *options: str) -> subprocess.Popen:
        command = [sys.executable, "-W", "ignore", "-m", f"distributed.cli.{what}", *options]
        with self._log.open("a") as log:
            return subprocess.Popen(
                command, cwd=self._folder.name, env=self._environment, stdout=subprocess.DEVNULL, stderr=log
            )

    def __enter__(self) -> Cluster:
        return self

    def __exit__(self, *_: object) -> None:
        for process in (*self.workers, self.scheduler):
            process.kill()
            process.wait()
        self._folder.cleanup()
