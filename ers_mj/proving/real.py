"""Conceals effects in real recordings: EMPS, a throttle valve, a Feetech servo (their README says where they come
from).

What is done to the untouched records of a rig, by a sealed seed: the command acts later than it says (input_delay),
the reading lags (sensor_lag), is rounded down (sensor_quantisation) or held for a while (sensor_dropout), or a constant
part of the command goes unrecorded, which is a constant torque (bias_torque). Each rig is also diagnosed as it is: what
is named there is its own.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pyarrow.csv
import pyarrow.parquet

from ers_mj.errors import InputError
from ers_mj.proving.concealed.base import between, spells
from ers_mj.proving.scoring import class_of, scored

RIGS = {"emps": ("u_V", "x_m"), "throttle": ("u_duty_pct", "y_sensor_V"), "sts3215": ("u_V", "theta_rad")}
FILES = {
    "emps": ("train.csv", "test_pulses.csv"),
    "throttle": ("aprbs_25s.csv", "aprbs_63s.csv"),
    "sts3215": ("runs.parquet", "runs_index.csv"),
}
EFFECTS = ("input_delay", "sensor_lag", "sensor_quantisation", "sensor_dropout", "bias_torque")
COVERAGE = [(rig, name) for rig in RIGS for name in (None, *EFFECTS)]
LATE = {
    "emps": (0.002, 0.03),
    "throttle": (0.02, 0.1),
    "sts3215": (0.02, 0.1),
}  # [s] delay or lag, a few samples and more
UNTOUCHED = "untouched"  # the kind of a case that is a rig as it is: what is named there is no false positive
ALSO = ("torque_enable", "vin_V", "pulse_V")  # columns handed on as they are


@dataclass(frozen=True)
class RealPlan:
    """What a case is to be: its number from 0, the rig, what is concealed in its records (None: nothing)."""

    index: int
    rig: str
    label: str | None

    @property
    def name(self) -> str:
        return f"case-{self.index + 1:03d}"


def plans(count: int, seed: int) -> list[RealPlan]:
    """Rigs as they are come first, then rigs and effects in random order, anew once all have had their turn."""
    rng = np.random.default_rng([seed, 2])
    chosen: list[tuple[str, str | None]] = [(rig, None) for rig in RIGS]
    pairs = [pair for pair in COVERAGE if pair[1]]
    while len(chosen) < count:
        chosen += [pairs[k] for k in rng.permutation(len(pairs))]
    return [RealPlan(index, *pair) for index, pair in enumerate(chosen[:count])]


def refuse_missing(folder: Path, chosen: Sequence[RealPlan]) -> None:
    """Raise InputError where a file that these cases need is not in the folder."""
    for rig in dict.fromkeys(plan.rig for plan in chosen):
        for name in FILES[rig]:
            if not (folder / rig / name).is_file():
                raise InputError(
                    f"{folder / rig / name}: there is no such file, --real needs a folder with {', '.join(RIGS)} as"
                    " ../shared/data has them"
                )


def make(plan: RealPlan, folder: Path, seed: int) -> tuple[dict[str, str], dict]:
    """({file name: text}, the truth) of one case."""
    rng = np.random.default_rng([seed, 3, plan.index])
    records = _records(folder, plan.rig, np.random.default_rng([seed, 4]))
    u, y = RIGS[plan.rig]
    strength = draw(rng, plan, records, u, y)
    touched, moved = [], []
    for record in records:
        new, change = conceal(rng, record, plan.label, strength, u, y)
        touched.append(new)
        moved.append(change)
    size = None if plan.label in (None, "bias_torque") else float(np.sqrt(np.nanmean(np.concatenate(moved) ** 2)))
    effects = (
        [
            {
                "label": plan.label,
                "strength": strength,
                "shape": {"form": "rounded down" if plan.label == "sensor_quantisation" else ""},
            }
        ]
        if plan.label
        else []
    )
    truth = {
        "case": plan.name,
        "kind": "single" if plan.label else UNTOUCHED,
        "labels": [plan.label] if plan.label else [],
        "rig": plan.rig,
        "effects": effects,
        "size": size,
        "size_unit": y.rpartition("_")[2],
        "visibility_after_refit_sigma": None,
        "seed": [seed, plan.index],
    }
    return {f"rec{k + 1}.csv": _csv(record) for k, record in enumerate(touched)}, truth


def _records(folder: Path, rig: str, rng: np.random.Generator) -> list[dict[str, np.ndarray]]:
    """Columns by name of every record of a rig; of the many of the servo, those of one trajectory and load, the same in
    every case.
    """
    wanted = ("t_s", *RIGS[rig], *ALSO)
    if rig == "sts3215":
        return _runs(folder / rig, [c for c in wanted if c != "pulse_V"], rng)
    tables = [pyarrow.csv.read_csv(folder / rig / name) for name in FILES[rig]]
    return [{c: np.asarray(table[c], float) for c in wanted if c in table.column_names} for table in tables]


def _runs(folder: Path, columns: Sequence[str], rng: np.random.Generator) -> list[dict[str, np.ndarray]]:
    """Three runs at most of one setup, drawn from those without brutal hits and drops."""
    index = pyarrow.csv.read_csv(folder / "runs_index.csv").to_pydict()
    rows = [k for k, trajectory in enumerate(index["trajectory"]) if trajectory not in ("brutal", "lift_and_drop")]
    setup_of = {k: tuple(index[c][k] for c in ("trajectory", "kp", "mass_kg", "length_m")) for k in rows}
    setups = sorted(set(setup_of.values()))
    setup = setups[int(rng.integers(len(setups)))]
    runs = [index["run"][k] for k in rows if setup_of[k] == setup][:3]
    table = pyarrow.parquet.read_table(folder / "runs.parquet", columns=["run", *columns])
    number = np.asarray(table["run"])
    return [{c: np.asarray(table[c], float)[number == run] for c in table.column_names if c != "run"} for run in runs]


# -- what is concealed -----------------------------------------------------------------------------------------


def draw(rng: np.random.Generator, plan: RealPlan, records: Sequence[Mapping], u: str, y: str) -> float:
    """Strength: delay or lag [s], step [output unit], mean length of a dropout [s], unrecorded part of the command
    [input unit].
    """
    if plan.label in ("input_delay", "sensor_lag"):
        return between(rng, *LATE[plan.rig])
    if plan.label == "sensor_quantisation":
        return float(np.nanmax([np.nanmax(r[y]) - np.nanmin(r[y]) for r in records])) * between(rng, 1 / 200, 1 / 30)
    if plan.label == "sensor_dropout":
        return between(rng, 0.05, 0.4)
    if plan.label == "bias_torque":
        return (
            float(np.nanmean([np.nanstd(r[u]) for r in records]))
            * between(rng, 0.05, 0.3)
            * float(rng.choice([-1.0, 1.0]))
        )
    return 0.0


def conceal(
    rng: np.random.Generator, record: Mapping[str, np.ndarray], label: str | None, s: float, u: str, y: str
) -> tuple[dict, np.ndarray]:
    """(the record with the effect, how far it moved the output (N,))."""
    out = {name: values.copy() for name, values in record.items()}
    t, theta = out["t_s"], out[y]
    if label == "input_delay":
        late = max(1, round(s / float(np.median(np.diff(t)))))
        out = {
            name: values[late:] if name in (u, "pulse_V") else values[: values.size - late]
            for name, values in out.items()
        }
        return out, theta[late:] - theta[:-late]
    if label == "sensor_lag":
        out[y] = lagged(t, theta, s)
    elif label == "sensor_quantisation":
        out[y] = np.floor(theta / s) * s
    elif label == "sensor_dropout":
        held = spells(rng, t.size, float(np.median(np.diff(t))), 0.7, s)
        last = np.maximum.accumulate(np.where(held, 0, np.arange(t.size)))
        out[y] = theta[last]
    elif label == "bias_torque":
        out[u] = out[u] - s
    return out, out[y] - theta


def lagged(t: np.ndarray, theta: np.ndarray, tau: float) -> np.ndarray:
    """theta (N,) behind a first-order lag, straight between samples; NaN is passed over."""
    out, state, last, before = theta.copy(), np.nan, np.nan, np.nan
    for k in range(t.size):
        if not np.isfinite(theta[k]):
            continue
        if not np.isfinite(state):
            state = theta[k]
        else:
            dt = t[k] - before
            slope = (theta[k] - last) / dt
            state = theta[k] - slope * tau + (state - last + slope * tau) * np.exp(-dt / tau)
        out[k], last, before = state, theta[k], t[k]
    return out


def _csv(record: Mapping[str, np.ndarray]) -> str:
    columns = {
        name: np.round(values).astype(int) if name == "torque_enable" else values for name, values in record.items()
    }
    rows = zip(*([("" if x != x else f"{x:.10g}") for x in values.tolist()] for values in columns.values()))
    return "\n".join([",".join(columns), *(",".join(row) for row in rows), ""])


# -- scores ----------------------------------------------------------------------------------------------------


def scored_real(rows: Sequence[dict]) -> dict:
    """The shares of the contract, and those that count here: what was concealed found again beside what the rig has of
    its own.
    """
    own = {r["rig"]: r for r in rows if r["kind"] == UNTOUCHED}
    singles = [r for r in rows if r["kind"] == "single"]
    told = [_beside_its_own(r, own.get(r["rig"], {"named": [], "floor": None})) for r in singles]
    fresh = [x for x in told if not x["was_its_own"]]
    return {
        **scored(singles),
        "cases": len(rows),
        "untouched": len(own),
        "found": _share_found(told),
        "found_new": _share_found(fresh),
        "found_new_of": len(fresh),
        "own": {rig: r["named"] for rig, r in own.items()},
        "concealed_in_real": told,
    }


def _beside_its_own(row: Mapping, alone: Mapping) -> dict:
    """What is told of one effect in a rig, beside the answer to the rig ``alone``."""
    its_own, named = {class_of(n) for n in alone["named"]}, {class_of(n) for n in row["named"]}
    wanted = class_of(row["labels"][0])
    return {
        "case": row["case"],
        "rig": row["rig"],
        "concealed": row["labels"][0],
        "strength": row["strength"],
        "size_over_floor": row["size"] / alone["floor"] if row["size"] and alone["floor"] else None,
        "named": row["named"],
        "found": wanted in named,
        "was_its_own": wanted in its_own,
        "own_kept": sum(c in named for c in its_own),
        "own": len(its_own),
        "others": sorted(n for n in row["named"] if class_of(n) not in its_own | {wanted}),
    }


def _share_found(told: Sequence[Mapping]) -> float | None:
    return sum(x["found"] for x in told) / len(told) if told else None
