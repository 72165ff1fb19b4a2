"""Fresh servos that carry nothing but a pendulum, driven in volts: is gravity told, and nothing else?

python analysis/random_pendulums.py --seed N [--servos 20] [--travels 45,90,150,20] [--jobs N]

A simulator of its own (25 us steps, set-valued friction): theta'' = b u - a_2 theta' - g sin(theta - phase) - c_2 sgn,
a servo's P loop around it that follows steps and sines within the travel; recorded are the voltage and the angle.
At +-20 degrees a spring does as well as a weight: gravity, or a spring with gravity not excluded, is right there.
"""

from __future__ import annotations

import argparse
import math
import time

import numba
import numpy as np

from ers_mj.data.recording import Recording, from_arrays
from ers_mj.diagnosis.pipeline import diagnose
from ers_mj.effects.gravity_imbalance import GravityImbalance

STEP = 25e-6  # [s]
RATE, SECONDS, LIMIT = 100, 8.0, 6.0  # [1/s] of samples, [s] of a recording, [V]
SMALL = 20.0  # [deg] of travel up to which a spring does as well


@numba.njit(cache=True)
def simulated(r, stride, gain, b, a_2, c_2, g, phase):
    """(voltage, angle) (N,) at the samples of a reference r (N,) that a limited P loop follows."""
    theta, w, out = 0.0, 0.0, np.empty((2, r.size))
    for i in range(r.size):
        u = min(max(gain * (r[i] - theta), -LIMIT), LIMIT)
        out[0, i], out[1, i] = u, theta
        for _ in range(stride):
            x = w + STEP * (b * u - a_2 * w - g * math.sin(theta - phase))
            w = 0.0 if abs(x) <= STEP * c_2 else x - math.copysign(STEP * c_2, x)
            theta += STEP * w
    return out


def references(rng: np.random.Generator, travel: float) -> list[np.ndarray]:
    """Steps of mixed size, and a sum of sines, within +-travel [rad]."""
    t = np.arange(0.0, SECONDS, 1.0 / RATE)
    levels = np.concatenate([[0.0], rng.uniform(-1.0, 1.0, 12)])
    steps = levels[np.minimum((t / (SECONDS / 13)).astype(int), 12)]
    waves = sum(np.sin(2 * np.pi * f * t + p) for f, p in zip((0.23, 0.61, 1.3), rng.uniform(0, 6, 3), strict=True))
    return [travel * x / np.max(np.abs(x)) for x in (steps, waves * np.minimum(t / 0.3, 1.0))]


def recordings(rng: np.random.Generator, travel: float) -> tuple[list[Recording], float]:
    """Two recordings of a servo whose motor lifts its pendulum, and the pendulum's g [rad/s^2]."""
    b, a_2 = np.exp(rng.uniform(np.log(30.0), np.log(150.0))), rng.uniform(8.0, 30.0)
    g = rng.uniform(0.15, 0.5) * b * LIMIT
    c_2, gain, phase = rng.uniform(0.02, 0.1) * b * LIMIT, rng.uniform(15.0, 60.0), rng.uniform(-0.2, 0.2)
    made, count = [], 2.0 * math.pi / 4096
    for k, r in enumerate(references(rng, travel)):
        u, y = simulated(r, round(1.0 / RATE / STEP), gain, b, a_2, c_2, g, phase)
        y = np.round((y + 0.3 * count * rng.standard_normal(y.size)) / count) * count
        made.append(from_arrays((np.arange(u.size) / RATE).tolist(), u, y, name=f"rec{k + 1}"))
    return made, g


def is_right(document: dict, travel: float) -> bool:
    """Whether gravity and nothing else is told; of a small travel also no name, where it is no worse than a spring."""
    named = [m["effect"] for m in document["missing"]]
    return named == [GravityImbalance.name] or (travel <= SMALL and not named)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seed", type=int, required=True)
    parser.add_argument("--servos", type=int, default=20)
    parser.add_argument("--travels", default="45,90,150,20", help="half travels [deg], in turn")
    parser.add_argument("--jobs", type=int, default=1)
    arguments = parser.parse_args()
    travels, rng = [float(x) for x in arguments.travels.split(",")], np.random.default_rng(arguments.seed)
    right: dict[float, list[bool]] = {}
    for k in range(arguments.servos):
        travel, begun = travels[k % len(travels)], time.time()
        made, g = recordings(rng, math.radians(travel))
        document = diagnose(made, None, jobs=arguments.jobs).document
        right.setdefault(travel, []).append(is_right(document, travel))
        told = [
            (m["effect"], [round(p["value"], 3) for p in m["parameters"].values() if p["value"] is not None])
            for m in document["missing"]
        ]
        print(
            f"{k:2} +-{travel:.0f} deg  g {g:.1f}  {'right' if right[travel][-1] else 'WRONG'}  {told}"
            f"  {document['verdict']}  {time.time() - begun:.0f} s",
            flush=True,
        )
    for travel, hits in right.items():
        print(f"+-{travel:.0f} deg: {sum(hits)} of {len(hits)}")


if __name__ == "__main__":
    main()
