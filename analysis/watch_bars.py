"""`ers watch` against its bars: how soon it finds a change, how soon it flags a play, and how often it flags nothing.

    python analysis/watch_bars.py --seed 1
 Streams of 1 kHz under the package's multisine, which is the persistent excitation of the bars (the named input, over
and over), watched from Table 1's datasheet whatever the servo is. Reduced plant and MuJoCo; servos are Table 1's with J
B K_t K_e k_s T_LH F_c R scattered within a factor --scatter. Noise
0.01 deg where nothing else is said. A change of F_c by 20 % counts as found from when c_2 stays within 5 % of its new
value; a play opens to +-0.5 deg. Times are counted from the change, and show the hop of the estimates. "x real time" is
over processor time, of one core.
"""

from __future__ import annotations

import argparse
import itertools
import math
import time
from dataclasses import replace

import numpy as np

from ers_mj.control.monte_carlo import scattered
from ers_mj.online.horizon import HORIZON
from ers_mj.online.moving_horizon import Estimate, Tracker, opening
from ers_mj.plants.inputs import INPUTS
from ers_mj.servo.datasheet import Datasheet, read_datasheet
from ers_mj.servo.simulation import build_plant

RATE = 1000.0  # [Hz]
NOISE = math.radians(0.01)
STEP, GAP, NEAR = 0.2, math.radians(0.5), 0.05
Part = tuple[float, Datasheet, float]  # seconds, servo, half-width of its play [rad]


def stream(
    parts: list[Part], plant: str, noise: float, random: np.random.Generator, named: str = "multisine"
) -> tuple[np.ndarray, ...]:
    """t, u, y (N,) of a servo that changes from part to part; angle and speed go on."""
    angles, inputs, state, at = [], [], None, 0
    for seconds, sheet, gap in parts:
        n = round(seconds * RATE)
        t = np.arange(at, at + n + 1) / RATE
        motion = build_plant(sheet, plant=plant, gap=gap).simulate(t, INPUTS[named](t), state)
        state, at = (float(motion.theta[-1]), float(motion.omega[-1])), at + n
        angles.append(motion.theta[:-1])
        inputs.append(INPUTS[named](t[:-1]))
    y = np.concatenate(angles)
    return np.arange(y.size) / RATE, np.concatenate(inputs), y + noise * random.standard_normal(y.size)


def watched(t: np.ndarray, u: np.ndarray, y: np.ndarray) -> tuple[list[Estimate], float]:
    """The estimates, and how many times faster than real time they came."""
    before, head = time.process_time(), round(HORIZON.opening * RATE)
    tracker, found = Tracker(opening(t[:head], u[:head], y[:head], read_datasheet("table1"), True)), []
    for k in range(0, t.size, 50):
        found += tracker.push(t[k : k + 50], u[k : k + 50], y[k : k + 50])
    return found, (t[-1] - t[0]) / (time.process_time() - before)


def changed(sheet: Datasheet, factor: float) -> Datasheet:
    """The servo with its Coulomb friction times a factor."""
    return replace(sheet, parameters={**sheet.parameters, "F_c": factor * sheet.parameters["F_c"]})


def flags(found: list[Estimate]) -> int:
    """Times that the flag rose."""
    return sum(b.flag and not a.flag for a, b in itertools.pairwise(found)) + found[0].flag


def steps(plant: str, count: int, spread: float, random: np.random.Generator) -> None:
    seconds, told, raised, speeds = [], 0, 0, []
    for k in range(count):
        sheet, factor, at = servo(spread, random), 1 + STEP if k % 2 else 1 - STEP, round(random.uniform(4.0, 8.0), 3)
        found, speed = watched(*stream([(at, sheet, 0.0), (4.0, changed(sheet, factor), 0.0)], plant, NOISE, random))
        c_2 = changed(sheet, factor).to_lumped()["c_2"]
        far = [e.t for e in found if abs(e.values["c_2"] / c_2 - 1) > NEAR]
        after = [e.t for e in found if e.t > max(far)]
        seconds.append((after[0] if after else math.inf) - at)
        told += any("c_2" in e.changed for e in found if e.t > at)
        raised += flags(found)
        speeds.append(speed)
    print(
        f"F_c -+20 %, {plant:7} {count} streams: found after {np.median(seconds):.2f} s (median), {max(seconds):.2f} s"
        f" (largest), within 1 s in {sum(s <= 1 for s in seconds)}; announced in {told}; flags {raised};"
        f" {np.median(speeds):.1f}x real time ({min(speeds):.1f} least)",
        flush=True,
    )


def plays(plant: str, count: int, spread: float, random: np.random.Generator) -> None:
    seconds, early, speeds = [], 0, []
    for _ in range(count):
        sheet, at = servo(spread, random), round(random.uniform(4.0, 8.0), 3)
        found, speed = watched(*stream([(at, sheet, 0.0), (6.0, sheet, GAP)], plant, NOISE, random))
        up = [e.t - at for e in found if e.flag and e.t > at]
        early += any(e.flag for e in found if e.t <= at)
        seconds.append(up[0] if up else math.inf)
        speeds.append(speed)
    print(
        f"play opens, {plant:7} {count} streams: flagged in {sum(map(math.isfinite, seconds))}, after"
        f" {np.median(seconds):.2f} s (median), {max(seconds):.2f} s (largest); flags before {early};"
        f" {np.median(speeds):.1f}x real time ({min(speeds):.1f} least)",
        flush=True,
    )


def nothing(
    plant: str, minutes: float, noise_deg: float, spread: float, random: np.random.Generator, named: str = "multisine"
) -> None:
    raised, announced, worst, speeds, errors, left = 0, 0, [], [], [], minutes * 60
    while left > 1:
        seconds, sheet = min(100.0, left), servo(spread, random)
        found, speed = watched(*stream([(seconds, sheet, 0.0)], plant, math.radians(noise_deg), random, named))
        raised, announced, left = raised + flags(found), announced + sum(bool(e.changed) for e in found), left - seconds
        settled = [e for e in found if e.t > 3.0]
        worst.append(max(e.misfit for e in settled))
        errors += [e.values["c_2"] / sheet.to_lumped()["c_2"] - 1 for e in settled]
        speeds.append(speed)
    print(
        f"unchanged, {plant:7} {named:9} {minutes:4.1f} min, noise {noise_deg:g} deg: flags {raised}, changes announced"
        f" {announced}, largest misfit {max(worst):.2f} (median over streams {np.median(worst):.2f}), RMS error of c_2"
        f" {100 * np.sqrt(np.mean(np.square(errors))):.2f} %, {np.median(speeds):.1f}x real time ({min(speeds):.1f}"
        " least)",
        flush=True,
    )


def drifting(spread: float, random: np.random.Generator) -> None:
    """F_c swings by 30 % with a period of 60 s, in parts of 0.1 s."""
    sheet = servo(spread, random)
    share = lambda t: 1 + 0.3 * np.sin(2 * np.pi * t / 60)
    found, speed = watched(
        *stream([(0.1, changed(sheet, share(k / 10)), 0.0) for k in range(1200)], "reduced", NOISE, random)
    )
    c_2 = sheet.to_lumped()["c_2"]
    at = lambda lag: [e.values["c_2"] / c_2 - share(e.t - lag) for e in found if e.t > 5]
    lags = np.arange(0, 3, 0.1)
    left = [np.sqrt(np.mean(np.square(at(lag)))) for lag in lags]
    print(
        f"drift of F_c by +-30 %, period 60 s, 120 s: RMS error of c_2 {100 * left[0]:.2f} %, of which a lag of"
        f" {lags[int(np.argmin(left))]:.1f} s explains all but {100 * min(left):.2f} %; flags {flags(found)};"
        f" {speed:.1f}x real time",
        flush=True,
    )


def servo(spread: float, random: np.random.Generator) -> Datasheet:
    return scattered(read_datasheet("table1"), (), spread, random)[0]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--scatter", type=float, default=1.25)
    parser.add_argument(
        "--streams", type=int, default=30, help="of each kind of change on the reduced plant; a third in MuJoCo"
    )
    parser.add_argument(
        "--minutes",
        type=float,
        default=30.0,
        help="unchanged, reduced; a sixth in MuJoCo and at each other noise level and input",
    )
    arguments = parser.parse_args()
    random, spread = np.random.default_rng(arguments.seed), arguments.scatter
    for plant, count in (("reduced", arguments.streams), ("mujoco", -(-arguments.streams // 3))):
        steps(plant, count, spread, random)
        plays(plant, count, spread, random)
    drifting(spread, random)
    nothing("reduced", arguments.minutes, 0.01, spread, random)
    nothing("mujoco", arguments.minutes / 6, 0.01, spread, random)
    for noise_deg in (0.001, 0.003, 0.03, 0.1):
        nothing("reduced", arguments.minutes / 6, noise_deg, spread, random)
    for named in ("chirp", "steps", "square", "ramp"):
        nothing("reduced", arguments.minutes / 6, 0.01, spread, random, named)


if __name__ == "__main__":
    main()
