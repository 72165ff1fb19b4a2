"""A batch of 20 servos, alone and on two Dask workers of which one is killed: `python analysis/fleet.py [--servos N]
[--only same,time]`.

`same`: the serial table beside that of two workers, one killed after the third servo, byte for byte. `time`: one worker
and two, after each has done a servo, so that start-up is not counted; it means something on two idle cores only.
Recordings are a second long and diagnosed by `--quick`: what is measured is the sharing out, not the diagnosis.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests"))
from dask_cluster import Cluster

from ers_mj.fleet.batch import conduct
from ers_mj.fleet.diagnosing import Settings
from ers_mj.fleet.manifest import Servo, read_manifest
from ers_mj.workers.here import Here
from ers_mj.workers.hiring import crew

QUICK = Settings(quick=True, made_by="analysis/fleet.py")


def record(path: Path, seed: int) -> None:
    """A servo of its own under steps, 110 samples at 100 Hz."""
    random = np.random.default_rng(seed)
    gain, drag, theta, omega = random.uniform(40.0, 80.0), random.uniform(30.0, 50.0), 0.0, 0.0
    rows = ["t_s,u_V,theta_rad"]
    for k in range(110):
        u = 4.0 * ((k // 20) % 2) - 2.0
        rows.append(f"{k / 100:.2f},{u},{theta + 1e-4 * random.standard_normal():.6f}")
        omega += 0.01 * (gain * u - drag * omega)
        theta += 0.01 * omega
    path.write_text("\n".join(rows) + "\n")


def fleet(folder: Path, count: int) -> list[Servo]:
    """So many servos."""
    rows = ["name,recordings"]
    for k in range(count):
        record(folder / f"r{k:02}.csv", k)
        rows.append(f"unit-{k:02},r{k:02}.csv")
    (folder / "servos.csv").write_text("\n".join(rows) + "\n")
    return read_manifest(str(folder / "servos.csv"))


def same(folder: Path, servos: list[Servo]) -> None:
    """Print whether the table of a cluster that loses a worker is the serial one."""
    serial = conduct(folder / "serial", servos, QUICK, Here(1)).table()
    with Cluster(2) as two:
        hired, done = crew(1, two.address), []

        def lose(text: str, share: float) -> None:
            done.append(text)
            if len(done) == 3:
                two.workers[0].kill()

        shared = conduct(folder / "shared", servos, QUICK, hired, progress=lose).table()
        hired.close()
    print(
        f"{len(servos)} servos, a worker of two killed: {len(done)} answers, tables equal: {serial == shared}",
        flush=True,
    )


def timed(folder: Path, servos: list[Servo]) -> None:
    """Print how long one worker and two take."""
    took = {}
    for count in (1, 2):
        with Cluster(count) as cluster:
            hired = crew(1, cluster.address)
            conduct(folder / f"warm-{count}", servos[: 2 * count], QUICK, hired)
            began = time.monotonic()
            conduct(folder / f"time-{count}", servos, QUICK, hired)
            took[count] = time.monotonic() - began
            hired.close()
    print(f"one worker {took[1]:.1f} s, two {took[2]:.1f} s: {took[1] / took[2]:.2f} times as fast", flush=True)


def main() -> None:
    """Both, or one of them."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--servos", type=int, default=20)
    parser.add_argument("--only", default="same,time")
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory(prefix="ers-fleet-") as passing:
        servos = fleet(Path(passing), arguments.servos)
        for what in arguments.only.split(","):
            {"same": same, "time": timed}[what](Path(passing), servos)


if __name__ == "__main__":
    main()
