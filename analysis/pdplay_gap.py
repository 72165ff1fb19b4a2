"""Which play do the recordings pdplay_*.csv of ../shared/cases hold? `python analysis/pdplay_gap.py`

Two bodies by explicit steps of 50 us, everything that their README gives fixed (gains, inertias, contact stiffness);
contact damping, friction and damping of both bodies are fitted, the gap free or held at 0.020 rad. Friction is
F tanh(w / eps). Printed: the numbers and the error [rad] beside that of the encoder's counts.
"""

from __future__ import annotations

import math
from pathlib import Path

import numba
import numpy as np
from scipy.optimize import least_squares

CASES = Path(__file__).resolve().parents[2] / "shared" / "cases"
FILES = ("pdplay_1200rows.csv", "pdplay_2000rows.csv")
STEP, ROW = 5e-5, 5e-3  # [s]
KNOWN = {"kp": 20.0, "kd": 0.6, "J_m": 0.004, "J_l": 0.02, "k": 4000.0}  # N m/rad, N m s/rad, kg m^2, N m/rad
START = {"gap": 0.025, "d": 2.0, "B_m": 0.04, "B_l": 0.03, "F_m": 0.2, "F_l": 0.06, "eps": 0.02}


@numba.njit(cache=True)
def simulated(r, kp, kd, J_m, J_l, k, gap, d, B_m, B_l, F_m, F_l, eps):
    """Angle (N,) of the load under the reference r (N,)."""
    a = b = v = w = 0.0
    out = np.empty(r.size)
    for i in range(r.size):
        out[i] = b
        for _ in range(round(ROW / STEP)):
            touch, x = 0.0, a - b
            if abs(x) > gap:
                touch = k * (x - math.copysign(gap, x)) + d * (v - w)
                touch = max(touch, 0.0) if x > 0 else min(touch, 0.0)
            v += STEP * (kp * (r[i] - a) - kd * v - B_m * v - touch - F_m * math.tanh(v / eps)) / J_m
            w += STEP * (touch - B_l * w - F_l * math.tanh(w / eps)) / J_l
            a, b = a + STEP * v, b + STEP * w
    return out


def fitted(rows: list[np.ndarray], **held: float) -> tuple[dict[str, float], float]:
    """(numbers, rms error [rad]) of the best fit with these held."""
    names = [n for n in START if n not in held]

    def numbers(z: np.ndarray) -> dict[str, float]:
        return KNOWN | held | dict(zip(names, np.exp(z).tolist(), strict=True))

    def errors(z: np.ndarray) -> np.ndarray:
        return np.concatenate([x[:, 2] - simulated(x[:, 1], **numbers(z)) for x in rows])

    z = np.log([START[n] for n in names])
    found = least_squares(errors, z, diff_step=1e-3, loss="soft_l1", f_scale=1.5e-3)
    return {n: numbers(found.x)[n] for n in names}, float(np.sqrt(np.mean(errors(found.x) ** 2)))


def main() -> None:
    rows = [np.genfromtxt(CASES / name, delimiter=",", skip_header=1) for name in FILES]
    for held in ({}, {"gap": 0.020}):
        found, rms = fitted(rows, **held)
        print(f"held {held}: {', '.join(f'{n} {x:.4g}' for n, x in found.items())}; error {rms:.2e} rad")


if __name__ == "__main__":
    main()
