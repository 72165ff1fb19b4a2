"""Plain methods and ours on the same cases: `python analysis/baselines.py DIR ANSWERS [--only NAME,...]`.

DIR is that of `ers prove --export DIR`, with DIR.truth.json beside it, or the --out of a finished `ers prove`. Each
method writes ANSWERS/NAME/case-NNN/diagnosis.json (what is there is kept); then `ers prove --score` scores each, and
ANSWERS/scores.txt holds what it says of all of them.

- whiteness: Eq. (5) by least squares (`ers identify`), then a Ljung-Box test on what the free run of the next recording
  leaves; it names nothing, it can only say that something is missing.
- all-free: one linear regression of the acceleration on a column or a few for every effect that can be written as one,
  all free at once; an effect is named where its columns pass an F test under one count of chance (Holm).
- sparse: the same columns by pysindy's sequentially thresholded least squares; what is not thresholded away is named.
- ours: `ers diagnose`, one thread.

Nothing is tuned on the cases: thresholds are 1 % and pysindy's default.
"""

from __future__ import annotations

import argparse
import json
import math
from collections.abc import Callable
from hashlib import sha256
from pathlib import Path

import numpy as np
import pysindy
from scipy import stats
from scipy.signal import butter, sosfiltfilt

import ers_mj as ers
from ers_mj.cli import main as command
from ers_mj.proving.sealing import hash_of

LEVEL = 0.01  # chance of a name where nothing is, and of a flag
CUTOFF = 25.0  # [Hz] of the filter on both sides of the regression
LAGS = 20  # samples, of the whiteness test
Columns = dict[str, np.ndarray]  # owner -> its columns (K, N); "" is the baseline's


def answer(recordings: list[Path], effects: list[str], flagged: bool) -> dict:
    """As much of a diagnosis.json as is scored."""
    return {
        "version": 1,
        "verdict": "missing_physics" if effects else "unexplained" if flagged else "parameters_only",
        "missing": [{"effect": name} for name in effects],
        "remainder": {"significant": flagged},
        "data": {"sha256": [sha256(path.read_bytes()).hexdigest() for path in recordings]},
    }


def read(path: Path) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Time [s], voltage [V] and angle [rad], each (N,)."""
    with path.open() as file:
        heads = file.readline().strip().split(",")
    table = np.loadtxt(path, delimiter=",", skiprows=1)
    t, u, theta = (table[:, heads.index(name)] for name in ("t_s", "u_V", "theta_rad"))
    return t, u, theta


# -- whiteness --------------------------------------------------------------------------------------------------------


def whiteness(recordings: list[Path], sheet: Path) -> dict:
    """Whether what the model leaves of a recording that it was not fitted to is white."""
    found = ers.identify([str(recordings[0])], str(sheet), method="ls", jobs=1)
    left = found.model.residual(str(recordings[1]))
    return answer(recordings, [], ljung_box(left[np.isfinite(left)]) < LEVEL)


def ljung_box(e: np.ndarray) -> float:
    """p-value of Ljung and Box's test (Biometrika 65, 1978) for memory within LAGS samples."""
    e = e - e.mean()
    n, power = e.size, float(e @ e)
    r = np.array([e[k:] @ e[:-k] / power for k in range(1, LAGS + 1)])
    return float(stats.chi2.sf(n * (n + 2) * np.sum(r**2 / (n - np.arange(1, LAGS + 1))), LAGS))


# -- regressions ------------------------------------------------------------------------------------------------------


def columns(u: np.ndarray, theta: np.ndarray, omega: np.ndarray, dt: float) -> Columns:
    """What each effect adds to the acceleration, where that is linear in a few numbers; the effects that it is not
    linear for (play, shafts, quantisation, dropouts, hidden states) have no column.
    """
    side, motor = np.tanh(omega / 0.02), 22.26 * theta
    dead = np.sign(u) * (np.abs(u) < 1.0)
    return {
        "": np.array([theta, omega, u, side, np.sign(theta - theta.mean())]),
        "stribeck": np.array([side * np.exp(-((omega / 0.3) ** 2))]),
        "bias_torque": np.array([np.ones_like(u)]),
        "quadratic_drag": np.array([omega * np.abs(omega)]),
        "position_dependent_friction": np.array([side * theta]),
        "load_dependent_friction": np.array([side * np.abs(u)]),
        "hinge_moment_cubic": np.array([theta**3]),
        "gravity_imbalance": np.array([np.sin(theta), np.cos(theta)]),
        "cogging": np.array([f(k * motor) for k in (4, 6, 8) for f in (np.sin, np.cos)]),
        "transmission_ripple": np.array([f(k * theta) for k in (20, 40) for f in (np.sin, np.cos)]),
        "variable_ratio": np.array([u * theta, u * theta**2]),
        "voltage_saturation": np.array([u**3]),
        "supply_sag": np.array([u * np.abs(u)]),
        "drive_dead_zone": np.array([dead]),
        "input_delay": np.array([np.gradient(u, dt)]),
        "thermal_drift": np.array([u * np.linspace(0.0, 1.0, u.size)]),
    }


def regression(recordings: list[Path]) -> tuple[np.ndarray, np.ndarray, list[str]]:
    """Columns (N, K), acceleration (N,) and the owner of each column, all recordings below one another, both sides
    filtered alike and thinned to what the filter leaves independent.
    """
    rows, aims, owners = [], [], []
    for path in recordings:
        t, u, theta = read(path)
        dt = float(np.median(np.diff(t)))
        low = butter(3, min(CUTOFF * 2.0 * dt, 0.8), output="sos")
        smooth: Callable[[np.ndarray], np.ndarray] = lambda x, low=low: sosfiltfilt(low, x, axis=-1)
        angle = smooth(theta)
        omega = np.gradient(angle, dt)
        parts = columns(u, angle, omega, dt)
        owners = [name for name, x in parts.items() for _ in x]
        thin = max(1, round(1.0 / (2.0 * CUTOFF * dt)))
        moves = (np.abs(smooth(omega)) > 0.05)[::thin]
        rows.append(smooth(np.concatenate(list(parts.values())))[:, ::thin].T[moves])
        aims.append(np.gradient(omega, dt)[::thin][moves])
    return np.concatenate(rows), np.concatenate(aims), owners


def all_free(recordings: list[Path], sheet: Path) -> dict:
    """Least squares with every effect free; each is weighed by what leaving it out costs."""
    X, y, owners = regression(recordings)
    X = X / np.linalg.norm(X, axis=0)
    left = lambda keep: float(np.sum((y - X[:, keep] @ np.linalg.lstsq(X[:, keep], y, rcond=None)[0]) ** 2))
    every = np.ones(len(owners), bool)
    whole, free = left(every), y.size - len(owners)
    p = {}
    for name in dict.fromkeys(filter(None, owners)):
        keep = np.array([owner != name for owner in owners])
        many = int(np.sum(~keep))
        p[name] = float(stats.f.sf((left(keep) - whole) / many / (whole / free), many, free))
    named = []
    for passed, name in enumerate(sorted(p, key=p.__getitem__)):
        if p[name] > LEVEL / (len(p) - passed):
            break
        named.append(name)
    return answer(recordings, named, flagged=False)


def sparse(recordings: list[Path], sheet: Path) -> dict:
    """What pysindy keeps, the largest share of the acceleration first."""
    X, y, owners = regression(recordings)
    scale = np.linalg.norm(X, axis=0) / math.sqrt(y.size)
    kept = pysindy.STLSQ().fit(X / scale, y[:, None] / y.std()).coef_[0]
    share = dict.fromkeys(filter(None, owners), 0.0)
    for owner, weight in zip(owners, kept):
        if owner:
            share[owner] = math.hypot(share[owner], weight)
    return answer(recordings, sorted((n for n in share if share[n]), key=lambda n: -share[n]), flagged=False)


def ours(recordings: list[Path], sheet: Path) -> dict:
    """What this tree's diagnosis says."""
    return ers.diagnose([str(path) for path in recordings], str(sheet), jobs=1).to_dict()


METHODS = {"whiteness": whiteness, "all-free": all_free, "sparse": sparse, "ours": ours}


# -- cases and scores -------------------------------------------------------------------------------------------------


def cases_of(folder: Path, answers: Path, first: int | None) -> tuple[dict[str, list[str]], Path]:
    """The files of each of the ``first`` cases, by its name, and their truth, sealed as an export's is."""
    if (folder / "cases.json").is_file():
        sealed = json.loads(Path(f"{folder}.truth.json").read_text())
        seed, truths = sealed["seed"], sealed["truths"]
    else:
        truths = {path.stem: json.loads(path.read_text()) for path in sorted((folder / "sealed").glob("case-*.json"))}
        seed = json.loads((folder / "settings.json").read_text())["seed"]
    truths = dict(list(truths.items())[:first])
    digest = hash_of(json.dumps(truths, indent=1).encode())
    truth = answers / "truth.json"
    truth.write_text(json.dumps({"version": 1, "truth_sha256": digest, "seed": seed, "truths": truths}, indent=1))
    return {case: sorted(said["files_sha256"]) for case, said in truths.items()}, truth


def scores(answers: Path, method: str, truth: Path) -> str:
    """What `ers prove --score` says of a method."""
    place = answers / f"{method}.scored"
    command(["prove", "--score", str(answers / method), "--truth", str(truth), "--out", str(place), "--force"])
    return (place / "summary.txt").read_text().strip()


def main() -> None:
    """Answer every case by each method, and score them."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("cases", type=Path)
    parser.add_argument("answers", type=Path)
    parser.add_argument("--first", type=int, help="so many cases")
    parser.add_argument("--only", default=",".join(METHODS), help="which methods, with commas")
    arguments = parser.parse_args()
    arguments.answers.mkdir(parents=True, exist_ok=True)
    listed, truth = cases_of(arguments.cases, arguments.answers, arguments.first)
    methods = arguments.only.split(",")
    for method in methods:
        for case, files in listed.items():
            place = arguments.answers / method / case
            if (place / "diagnosis.json").exists():
                continue
            recordings = [arguments.cases / case / file for file in files if file.endswith(".csv")]
            told = METHODS[method](recordings, arguments.cases / case / "datasheet.toml")
            place.mkdir(parents=True, exist_ok=True)
            (place / "diagnosis.json").write_text(json.dumps(told, indent=1))
            print(method, case, told["verdict"], *(m["effect"] for m in told["missing"]), flush=True)
    text = "\n\n".join(f"== {method}\n\n{scores(arguments.answers, method, truth)}" for method in methods)
    (arguments.answers / "scores.txt").write_text(text + "\n")


if __name__ == "__main__":
    main()
