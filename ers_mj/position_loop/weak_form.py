"""Starts in closed form: the equation of motion, folded with a smooth window so that no derivative of the output is
needed, is linear in all but the latency and the error at which the drive reaches its limit; these two are scanned.

theta * phi'' = K clip(r(t - tau) - theta, +-e_s) - a_2 theta * phi' - c_2 sgn(theta') * phi + ...,  phi = (1 - x^2)^3
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ers_mj.position_loop.runs import Run, speed_of


@dataclass(frozen=True)
class Scan:
    """What is scanned: latencies [s], errors at which the drive is at its limit as shares of the largest error, and the
    half widths [s] of the window.
    """

    latencies: tuple[float, ...] = tuple(np.arange(0.0, 0.0601, 0.005))
    errors: tuple[float, ...] = (0.02, 0.035, 0.06, 0.1, 0.15, 0.22, 0.32, 0.45, 0.65, np.inf)
    widths: tuple[float, ...] = (0.03, 0.06)
    rotors: tuple[float, ...] = (0.1, 0.5, 2.0)


SCAN = Scan()


@dataclass(frozen=True)
class Rough:
    """A regression: the letters' values, the share of the folded acceleration that is left, and the latency and limit
    that it was made at.
    """

    values: dict[str, float]
    left: float


@dataclass(frozen=True)
class _Folded:
    """One run folded: its left side (M,), its linear columns (M, k), and what the drive's column is made of."""

    run: Run
    left: np.ndarray
    columns: np.ndarray
    theta: np.ndarray
    t: np.ndarray
    window: np.ndarray
    kept: np.ndarray


def window(half: float, step: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """phi and its first two differences over time (each 2 n + 1,); the differences sum to zero exactly."""
    n = max(3, round(half / step))
    x = np.arange(-n - 1, n + 2) / (n + 1.0)
    phi = np.maximum(1.0 - x * x, 0.0) ** 3
    first = np.gradient(phi, step)
    second = np.convolve(phi, [1.0, -2.0, 1.0], "same") / step**2
    second[[0, -1]] = phi[[1, -2]] / step**2
    second -= second.mean()
    first -= first.mean()
    return phi, first, second


def rough_starts(
    runs: Sequence[Run],
    loads: Sequence[str],
    width: float,
    speed_limit: float = np.inf,
    integral: bool = False,
    within: tuple[float, float] = (-np.inf, np.inf),
) -> list[Rough]:
    """The best regressions, one for each kind of limit (finite, none), the least left first.

    ``loads`` are of "hold", "a_1", "sin", "cos"; the reference is passed through ``speed_limit`` first; outputs beyond
    ``within`` are left out.
    """
    folded = [_fold(run, loads, width, within) for run in runs]
    largest = max(float(np.nanmax(np.abs(run.r - run.y))) for run in runs)
    rotors = SCAN.rotors if any(run.inertia != runs[0].inertia for run in runs) else (0.0,)
    found: dict[bool, Rough] = {}
    for tau in SCAN.latencies:
        references = [_late(f, tau, speed_limit) for f in folded]
        for share in SCAN.errors:
            most = share * largest
            drives = [_driven(f, r, most, integral) for f, r in zip(folded, references, strict=True)]
            for rotor in rotors:
                rough = _regressed(folded, drives, most, tau, rotor, loads)
                known = found.get(np.isfinite(share))
                if rough is not None and (known is None or rough.left < known.left):
                    found[np.isfinite(share)] = rough
    return sorted(found.values(), key=lambda rough: rough.left)


def _fold(run: Run, loads: Sequence[str], width: float, within: tuple[float, float]) -> _Folded:
    step = max(run.sample_time, 1e-3)
    t = np.arange(0.0, run.t[-1], step)
    known = np.isfinite(run.y)
    theta = np.interp(t, run.t[known], run.y[known])
    speed = np.interp(t, run.t, speed_of(run))
    phi, first, second = window(width, step)
    fold = lambda f, by: np.convolve(f, by, "valid")
    centred = theta - theta.mean()
    still = 0.01 * float(np.quantile(np.abs(speed), 0.95))
    columns = [-fold(centred, first), -fold(np.sign(speed) * (np.abs(speed) > still), phi)]
    shape = {"hold": np.ones(theta.size), "a_1": -theta, "sin": -np.sin(theta), "cos": -np.cos(theta)}
    columns += [fold(shape[load], phi) for load in loads]
    seen = (np.interp(t, run.t, run.scored.astype(float)) > 0.5) & (theta > within[0]) & (theta < within[1])
    kept = fold((~seen).astype(float), np.ones(phi.size)) < 0.5
    return _Folded(run, fold(centred, second), np.column_stack(columns), theta, t, phi, kept)


def _late(f: _Folded, tau: float, speed_limit: float) -> np.ndarray:
    """The reference (T,) that acts at the grid's times."""
    run = f.run
    k = np.searchsorted(run.t, f.t - tau + 1e-9, side="right") - 1
    r = np.where(k < 0, run.before, run.r[np.maximum(k, 0)])
    if not np.isfinite(speed_limit):
        return r
    most, out, at = speed_limit * (f.t[1] - f.t[0]), np.empty_like(r), r[0]
    for i, target in enumerate(r):
        at += min(max(target - at, -most), most)
        out[i] = at
    return out


def _driven(f: _Folded, r: np.ndarray, most: float, integral: bool) -> np.ndarray:
    """The drive's column (M, 1) of a run under the reference r (T,), and that of its integral (M, 2)."""
    e = f.run.gain * (r - f.theta)
    drive = [np.convolve(np.clip(e, -most, most), f.window, "valid")]
    if integral:
        drive.append(np.convolve(np.cumsum(np.clip(e, -most, most)) * (f.t[1] - f.t[0]), f.window, "valid"))
    return np.column_stack(drive)


def _regressed(
    folded: Sequence[_Folded],
    drives: Sequence[np.ndarray],
    most: float,
    tau: float,
    rotor: float,
    loads: Sequence[str],
) -> Rough | None:
    """One regression over all runs; None where its gain or damping has the wrong sign."""
    integral = drives[0].shape[1] > 1
    count = 3 + len(loads) + integral
    normal, right, total = np.zeros((count, count)), np.zeros(count), 0.0
    for f, drive in zip(folded, drives, strict=True):
        run, light = f.run, (rotor + 1.0) / (rotor + f.run.inertia)
        weights = np.ones(f.columns.shape[1])
        weights[2:] = [run.pull if load in ("sin", "cos") else 1.0 for load in loads]
        a = light * np.column_stack([drive[:, 0], f.columns * weights, drive[:, 1:]])[f.kept]
        left = f.left[f.kept]
        normal += a.T @ a
        right += a.T @ left
        total += float(left @ left)
    size = np.sqrt(np.maximum(np.diag(normal), 1e-30))
    x = np.linalg.solve(normal / np.outer(size, size) + 1e-9 * np.eye(count), right / size) / size
    if x[0] <= 0.0:
        return None
    left = max(1.0 - float(x @ right) / total, 1e-12)
    values = {"K": float(x[0]), "tau_s": tau, "a_2": max(float(x[1]), 0.02 * float(x[0]) ** 0.5)}
    values["c_2"] = max(float(x[2]), 1e-3 * float(x[0]) * float(np.std(folded[0].theta)))
    values |= {load: float(v) for load, v in zip(loads, x[3:])}
    if np.isfinite(most):
        values["L"] = values["K"] * most
    if rotor > 0.0:
        values["rotor"] = rotor
    if integral:
        values["I"] = max(float(x[-1]), 0.05 * values["K"])
    return Rough(values, left)
