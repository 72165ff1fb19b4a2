"""Random servos with a position loop: how often the right effect is named, and how near the numbers are.

    python analysis/random_position_servos.py --seed 1 --servos 20 [--effects none,latency,rate,limit,play]

Truth is of its own: explicit steps of 25 us, set-valued friction, sampled firmware (P, or PD on a filtered difference
of the quantised angle), a 4096 encoder in loop and log, noise of 0.3 mrad, play as two bodies with a stiff stop.
"""

from __future__ import annotations

import argparse
import math
import time
from dataclasses import dataclass

import numba
import numpy as np

from ers_mj.data.recording import Recording, from_arrays
from ers_mj.diagnosis.pipeline import diagnose

STEP = 25e-6  # [s]
COUNT = 2.0 * math.pi / 4096.0  # [rad]
NAMES = {
    "none": set(),
    "latency": {"input_delay"},
    "rate": {"rate_limit"},
    "limit": {"voltage_saturation"},
    "play": {"backlash"},
}
INHERENT = {"gravity_imbalance", "input_delay", "voltage_saturation"}


@dataclass(frozen=True)
class Servo:
    """Accelerations of one servo: loop K [1/s^2], D [1/s], limit L, damping a_2, friction c_2, gravity g, latency tau
    [s], reference speed R, play [rad], firmware [Hz].
    """

    K: float
    D: float
    L: float
    a_2: float
    c_2: float
    g: float
    tau: float
    R: float
    play: float
    firmware: float


@numba.njit
def simulated(t, r, n_out, stride, K, D, L, a_2, c_2, g, tau, R, play, period, rho):
    """Angle of the load (n_out,) every ``stride`` steps, under r at the times t that are held."""
    out = np.empty(n_out)
    a = va = b = vb = 0.0
    drive, at, old, slow = 0.0, 0.0, 0.0, 0.0
    k, next_tick, two = 0, 0.0, play > 0.0
    for i in range(n_out * stride):
        now = i * STEP
        if i % stride == 0:
            out[i // stride] = b if two else a
        if now >= next_tick - 1e-12:
            while k + 1 < t.size and t[k + 1] <= now - tau:
                k += 1
            target = r[k] if now >= tau else r[0]
            at += min(max(target - at, -R * period), R * period)
            seen = round(a / COUNT) * COUNT
            slow += 0.3 * ((seen - old) / period - slow)
            old = seen
            drive = min(max(K * (at - seen) - D * slow, -L), L)
            next_tick += period
        if not two:
            push = drive - a_2 * va - g * math.sin(a)
            w = va + STEP * push
            va = 0.0 if abs(w) <= STEP * c_2 else w - math.copysign(STEP * c_2, w)
            a += STEP * va
        else:
            gap = a - b
            touch = 0.0
            if abs(gap) > play:
                touch = 4e5 * (gap - math.copysign(play, gap)) + 150.0 * (va - vb)
                touch = max(touch, 0.0) if gap > 0 else min(touch, 0.0)
            w = va + STEP * (drive - a_2 * va - touch) / rho
            lost = STEP * 0.8 * c_2 / rho
            va = 0.0 if abs(w) <= lost else w - math.copysign(lost, w)
            w = vb + STEP * (touch - g * math.sin(b)) / (1.0 - rho)
            lost = STEP * 0.2 * c_2 / (1.0 - rho)
            vb = 0.0 if abs(w) <= lost else w - math.copysign(lost, w)
            a += STEP * va
            b += STEP * vb
    return out


def drawn(rng: np.random.Generator, effect: str, firmware: float) -> Servo:
    """A servo with one effect of medium size, or none beyond a latency and a limit that its kind always has."""
    top, a_2 = rng.uniform(4.0, 10.0), np.exp(rng.uniform(np.log(15.0), np.log(80.0)))
    limit = top * a_2
    K = limit / rng.uniform(0.1, 0.5)
    D = rng.uniform(0.2, 1.0) * a_2 if rng.random() < 0.5 else 0.0
    return Servo(
        K,
        D,
        limit * (0.6 if effect == "limit" else 1.0),
        a_2,
        limit * rng.uniform(0.02, 0.1),
        limit * rng.uniform(0.03, 0.15) if rng.random() < 0.5 else 0.0,
        {"latency": 0.012}.get(effect, rng.uniform(0.003, 0.03)),
        {"rate": 6.0}.get(effect, 1e9) * (top / 8.0),
        math.radians(0.5) if effect == "play" else 0.0,
        firmware,
    )


def references(rng: np.random.Generator, rate: float) -> list[tuple[np.ndarray, np.ndarray]]:
    """Steps, a sweep and a multisine of 6 s, at rest at first."""
    t = np.arange(0.0, 6.0, 1.0 / rate)
    levels = np.concatenate([[0.0], rng.uniform(-0.8, 0.8, 15)])
    steps = levels[np.minimum((t / 0.375).astype(int), 15)]
    f = 0.25 * (4.0 / 0.25) ** (t / 6.0)
    sweep = 0.5 * np.sin(2 * np.pi * np.cumsum(f) / rate)
    phases = rng.uniform(0, 2 * np.pi, 8)
    sines = sum(np.sin(2 * np.pi * (0.3 + 0.45 * k) * t + phases[k]) for k in range(8)) * 0.15
    rise = np.minimum(t / 0.3, 1.0)
    return [(t, steps), (t, sweep * rise), (t, sines * rise)]


def recordings(servo: Servo, rng: np.random.Generator, rate: float) -> list[Recording]:
    made, stride = [], round(1.0 / rate / STEP)
    for k, (t, r) in enumerate(references(rng, rate)):
        s = servo
        y = simulated(t, r, t.size, stride, s.K, s.D, s.L, s.a_2, s.c_2, s.g, s.tau, s.R, s.play, 1.0 / s.firmware, 0.4)
        y = np.round((y + 3e-4 * rng.standard_normal(t.size)) / COUNT) * COUNT
        made.append(from_arrays(t, r, y, name=f"rec{k + 1}", input_unit="rad"))
    return made


def judged(servo: Servo, effect: str, document: dict) -> tuple[str, dict[str, float]]:
    """How the names stand, and the relative errors of the numbers (of the latency: [ms])."""
    named = [m["effect"] for m in document["missing"]]
    extra = set(named) - NAMES[effect] - INHERENT
    word = "missed" if not NAMES[effect] <= set(named) else "extra" if extra else "right"
    rows, errors = document["parameters"], {}
    for letter, true in (("K", servo.K), ("L", servo.L), ("c_2", servo.c_2), ("a_2+D", servo.a_2 + servo.D)):
        value = rows[letter]["value"]
        errors[letter] = math.nan if value is None else abs(value / true - 1.0)
    tau = rows["tau_s"]["value"]
    errors["tau_ms"] = math.nan if tau is None else abs(tau - servo.tau) * 1e3
    return f"{word} {'+'.join(named)}", errors


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seed", type=int, required=True)
    parser.add_argument("--servos", type=int, default=20)
    parser.add_argument("--effects", default="none,latency,rate,limit,play")
    parser.add_argument("--rate-hz", type=float, default=100.0)
    parser.add_argument("--firmware-hz", type=float, default=1000.0)
    parser.add_argument("--jobs", type=int, default=1)
    arguments = parser.parse_args()
    effects, rng = arguments.effects.split(","), np.random.default_rng(arguments.seed)
    bars = {"K": 0.10, "L": 0.10, "c_2": 0.15, "a_2+D": 0.15, "tau_ms": 2.0}
    counts: dict[str, list[bool]] = {}
    for k in range(arguments.servos):
        effect, begun = effects[k % len(effects)], time.time()
        servo = drawn(rng, effect, arguments.firmware_hz)
        document = diagnose(recordings(servo, rng, arguments.rate_hz), None, jobs=arguments.jobs).document
        words, errors = judged(servo, effect, document)
        counts.setdefault(f"{effect} named", []).append(words.startswith("right"))
        if effect != "play":
            for letter, bar in bars.items():
                counts.setdefault(f"{letter} within {bar:g}", []).append(errors[letter] <= bar)
        kind = "PD" if servo.D else "P"
        told = " ".join(f"{letter} {x:.3f}" for letter, x in errors.items())
        print(f"{k:2} {effect:8} {kind:2} {words:45} {told}  {time.time() - begun:.0f} s", flush=True)
    for name, hits in counts.items():
        print(f"{name:20} {sum(hits)} of {len(hits)}")


if __name__ == "__main__":
    main()
