"""Fresh servos that carry nothing but a pendulum, driven in volts: is gravity told, and nothing else?

python analysis/random_pendulums.py --seed N [--servos 20] [--travels 45,90,150,20] [--loaded] [--jobs N]

A simulator of its own (25 us steps, set-valued friction): theta'' = b u - a_2 theta' - g sin(theta - phase) - c sgn,
a servo's P loop around it that follows steps and sines within the travel; recorded are the voltage and the angle.
At +-20 degrees a spring does as well as a weight: gravity, or a spring with gravity not excluded, is right there.
`--loaded`: the gear rubs by what it carries, c = c_2 + mu |(1 - s) (b u - a_e theta') + s g sin(theta - phase)|, s the
motor's share of the inertia and a_e of the damping its back-EMF: gravity and load friction, and nothing else, is right.
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
from ers_mj.effects.load_dependent_friction import LoadDependentFriction

STEP = 25e-6  # [s]
RATE, SECONDS, LIMIT = 100, 8.0, 6.0  # [1/s] of samples, [s] of a recording, [V]
SMALL = 20.0  # [deg] of travel up to which a spring does as well


@numba.njit(cache=True)
def simulated(r, stride, gain, b, a_2, c_2, g, phase, rubs):
    """(voltage, angle) (N,) at the samples of a reference r (N,) that a limited P loop follows; ``rubs``: share mu of
    what the gear carries, back-EMF's damping a_e, motor's share s of the inertia.
    """
    mu, a_e, s = rubs
    theta, w, out = 0.0, 0.0, np.empty((2, r.size))
    for i in range(r.size):
        u = min(max(gain * (r[i] - theta), -LIMIT), LIMIT)
        out[0, i], out[1, i] = u, theta
        for _ in range(stride):
            hangs = g * math.sin(theta - phase)
            x = w + STEP * (b * u - a_2 * w - hangs)
            c = STEP * (c_2 + mu * abs((1.0 - s) * (b * u - a_e * w) + s * hangs))
            w = 0.0 if abs(x) <= c else x - math.copysign(c, x)
            theta += STEP * w
    return out


def references(rng: np.random.Generator, travel: float) -> list[np.ndarray]:
    """Steps of mixed size, and a sum of sines, within +-travel [rad]."""
    t = np.arange(0.0, SECONDS, 1.0 / RATE)
    levels = np.concatenate([[0.0], rng.uniform(-1.0, 1.0, 12)])
    steps = levels[np.minimum((t / (SECONDS / 13)).astype(int), 12)]
    waves = sum(np.sin(2 * np.pi * f * t + p) for f, p in zip((0.23, 0.61, 1.3), rng.uniform(0, 6, 3), strict=True))
    return [travel * x / np.max(np.abs(x)) for x in (steps, waves * np.minimum(t / 0.3, 1.0))]


def recordings(rng: np.random.Generator, travel: float, loaded: bool) -> tuple[list[Recording], float, float]:
    """Two recordings of a servo whose motor lifts its pendulum, the pendulum's g [rad/s^2], and the share mu that its
    gear rubs of what it carries.
    """
    b, a_2 = np.exp(rng.uniform(np.log(30.0), np.log(150.0))), rng.uniform(8.0, 30.0)
    g = rng.uniform(0.15, 0.5) * b * LIMIT
    c_2, gain, phase = rng.uniform(0.02, 0.1) * b * LIMIT, rng.uniform(15.0, 60.0), rng.uniform(-0.2, 0.2)
    mu = rng.uniform(0.05, 0.3) if loaded else 0.0
    rubs = (mu, a_2 * rng.uniform(0.5, 0.9), rng.uniform(0.3, 0.9)) if loaded else (0.0, 0.0, 0.0)
    made, count = [], 2.0 * math.pi / 4096
    for k, r in enumerate(references(rng, travel)):
        u, y = simulated(r, round(1.0 / RATE / STEP), gain, b, a_2, c_2, g, phase, rubs)
        y = np.round((y + 0.3 * count * rng.standard_normal(y.size)) / count) * count
        made.append(from_arrays((np.arange(u.size) / RATE).tolist(), u, y, name=f"rec{k + 1}"))
    return made, g, mu


def is_right(document: dict, travel: float, loaded: bool) -> bool:
    """Whether gravity (and load friction) and nothing else is told; of a small travel also without gravity, where it is
    no worse than a spring.
    """
    beside = {LoadDependentFriction.name} if loaded else set()
    named = {m["effect"] for m in document["missing"]}
    return named == beside | {GravityImbalance.name} or (travel <= SMALL and named == beside)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seed", type=int, required=True)
    parser.add_argument("--servos", type=int, default=20)
    parser.add_argument("--travels", default="45,90,150,20", help="half travels [deg], in turn")
    parser.add_argument("--loaded", action="store_true", help="a gear that rubs by what it carries")
    parser.add_argument("--jobs", type=int, default=1)
    arguments = parser.parse_args()
    travels, rng = [float(x) for x in arguments.travels.split(",")], np.random.default_rng(arguments.seed)
    right: dict[float, list[bool]] = {}
    for k in range(arguments.servos):
        travel, begun = travels[k % len(travels)], time.time()
        made, g, mu = recordings(rng, math.radians(travel), arguments.loaded)
        document = diagnose(made, None, jobs=arguments.jobs).document
        right.setdefault(travel, []).append(is_right(document, travel, arguments.loaded))
        told = [
            (m["effect"], [round(p["value"], 3) for p in m["parameters"].values() if p["value"] is not None])
            for m in document["missing"]
        ]
        rubs, verdict = f"  mu {mu:.2f}" if mu else "", "right" if right[travel][-1] else "WRONG"
        print(
            f"{k:2} +-{travel:.0f} deg  g {g:.1f}{rubs}  {verdict}  {told}  {document['verdict']}"
            f"  {time.time() - begun:.0f} s",
            flush=True,
        )
    for travel, hits in right.items():
        print(f"+-{travel:.0f} deg: {sum(hits)} of {len(hits)}")


if __name__ == "__main__":
    main()
