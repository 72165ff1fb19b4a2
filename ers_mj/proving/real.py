"""Conceals effects in real recordings: EMPS, a throttle valve, a Feetech servo (their README says where they come
from).

What is done to the untouched records of a rig, by a sealed seed: the command acts later than it says (input_delay),
the reading lags (sensor_lag), is rounded down (sensor_quantisation) or held for a while (sensor_dropout), or a constant
part of the command goes unrecorded, which is a constant torque (bias_torque). A play, a friction that grows with the
load and a limit of the input cannot be put into a record: they move it by the difference that they make in the rig's
own best model, which is half simulated and is counted apart. What acts ahead of the rig's converter is read by that
again: values that repeat to the last digit where it rests, and nowhere else, would be a fault of the sensor. Each rig
is also diagnosed as it is: what is named there is its own, and how much more than its own error a record leaves that
was touched is its visibility.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

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
SEEN = ("sensor_quantisation", "sensor_dropout")  # in the data itself, where no model is fitted to them
HALF_SIMULATED = {"backlash": "gap", "load_dependent_friction": "mu", "voltage_saturation": "u_max"}  # by their size
COVERAGE = [(rig, name) for rig in RIGS for name in (None, *EFFECTS, *HALF_SIMULATED)]
LATE = {
    "emps": (0.002, 0.03),
    "throttle": (0.02, 0.1),
    "sts3215": (0.02, 0.1),
}  # [s] delay or lag, a few samples and more
UNTOUCHED = "untouched"  # the kind of a case that is a rig as it is: what is named there is no false positive
PARTLY = "half simulated"  # of one into which the difference between two simulations is put
ALSO = ("torque_enable", "vin_V", "pulse_V")  # columns handed on as they are


@dataclass(frozen=True)
class Halves:
    """What is half simulated moves the output by an rms of ``share`` of the travel, as near as one of so many ``sizes``
    comes to it; what is found is counted from the visibility ``seen`` on, as all that is put into real records.
    """

    share: tuple[float, float] = (0.02, 0.1)
    sizes: int = 12
    seen: float = 3.0


HALVES = Halves()


class Own(Protocol):
    """A rig's own best answer (see door/own_answer.py)."""

    @property
    def error(self) -> float:
        """The held-out error that it leaves [output unit]."""

    def visibility(self, touched: Mapping[str, str]) -> float:
        """What touched records leave beyond that, over it."""

    def moved(self, effect: str, values: Mapping[str, float]) -> list[np.ndarray]:
        """By how much an effect moves the output of its model (N,) in each record."""


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


def make(plan: RealPlan, folder: Path, seed: int, own: Callable[[str], Own]) -> tuple[dict[str, str], dict]:
    """({file name: text}, the truth) of one case; ``own`` gives a rig's own answer."""
    rng = np.random.default_rng([seed, 3, plan.index])
    records = _records(folder, plan.rig, np.random.default_rng([seed, 4]))
    truth = {
        "case": plan.name,
        "kind": UNTOUCHED,
        "labels": [plan.label] if plan.label else [],
        "rig": plan.rig,
        "effects": [],
        "size": None,
        "size_unit": RIGS[plan.rig][1].rpartition("_")[2],
        "visibility_after_refit_sigma": None,
        "seed": [seed, plan.index],
    }
    if plan.label is None:
        return _files(records), truth
    answer = own(plan.rig)
    touched, moved, shape = _touched(rng, plan, records, answer)
    files, size = _files(touched), float(np.sqrt(np.nanmean(np.concatenate(moved) ** 2)))
    return files, truth | {
        "kind": PARTLY if plan.label in HALF_SIMULATED else "single",
        "effects": [{"label": plan.label, **shape}],
        "size": size or None,
        "visibility_after_refit_sigma": size / answer.error if plan.label in SEEN else answer.visibility(files),
    }


def files_of(rig: str, folder: Path, seed: int) -> dict[str, str]:
    """{file name: text} of the records of a rig as they are."""
    return _files(_records(folder, rig, np.random.default_rng([seed, 4])))


def _files(records: Sequence[Mapping[str, np.ndarray]]) -> dict[str, str]:
    return {f"rec{k + 1}.csv": _csv(record) for k, record in enumerate(records)}


def _touched(
    rng: np.random.Generator, plan: RealPlan, records: Sequence[dict], own: Own
) -> tuple[list[dict], list[np.ndarray], dict]:
    """(the records with the effect, how far it moved each output (N,), its strength and shape)."""
    u, y = RIGS[plan.rig]
    if plan.label in HALF_SIMULATED:
        strength, moved = _half_simulated(rng, plan.label, records, own, u, y)
        touched = [record | {y: read(record[y], record[y] + by)} for record, by in zip(records, moved, strict=True)]
        return touched, moved, {"strength": strength, "shape": {"form": "the rig's own model's"}}
    strength, touched, moved = draw(rng, plan, records, u, y), [], []
    for record in records:
        new, change = conceal(rng, record, plan.label, strength, u, y)
        touched.append(new)
        moved.append(change)
    form = "rounded down" if plan.label == "sensor_quantisation" else ""
    return touched, moved, {"strength": strength, "shape": {"form": form}}


def _half_simulated(
    rng: np.random.Generator, label: str, records: Sequence[Mapping], own: Own, u: str, y: str
) -> tuple[float, list[np.ndarray]]:
    """(strength, how far it moves each output (N,)) of an effect in the rig's own model, as near as one of its sizes
    comes to a drawn share of the travel.
    """
    travel = float(np.nanmax([np.nanmax(r[y]) - np.nanmin(r[y]) for r in records]))
    largest = float(np.nanmax([np.nanmax(np.abs(r[u])) for r in records]))
    low, high = {
        "backlash": (0.002 * travel, 0.2 * travel),
        "load_dependent_friction": (0.01, 0.8),
        "voltage_saturation": (0.1 * largest, 0.95 * largest),
    }[label]
    wanted, best = travel * between(rng, *HALVES.share), (np.inf, low, [np.zeros(r[y].size) for r in records])
    for strength in np.geomspace(low, high, HALVES.sizes).tolist():
        moved = own.moved(label, {HALF_SIMULATED[label]: strength})
        size = float(np.sqrt(np.nanmean(np.concatenate(moved) ** 2)))
        if size > 0:
            best = min(best, (abs(np.log(size / wanted)), strength, moved), key=lambda one: one[0])
    return best[1], best[2]


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
        out[y] = read(theta, lagged(t, theta, s))
    elif label == "sensor_quantisation":
        out[y] = np.floor(theta / s) * s
    elif label == "sensor_dropout":
        held = spells(rng, t.size, float(np.median(np.diff(t))), 0.7, s)
        last = np.maximum.accumulate(np.where(held, 0, np.arange(t.size)))
        out[y] = theta[last]
    elif label == "bias_torque":
        out[u] = out[u] - s
    return out, out[y] - theta


def read(theta: np.ndarray, moved: np.ndarray) -> np.ndarray:
    """What the converter that read theta (N,) makes of another motion (N,)."""
    step = lattice(theta)
    if not step:
        return moved
    first = theta[np.isfinite(theta)][0]
    return first + step * np.round((moved - first) / step)


def lattice(theta: np.ndarray) -> float:
    """The step of which the differences of all readings (N,) are multiples, within a tenth; 0 where few repeat."""
    seen = theta[np.isfinite(theta)]
    levels = np.unique(seen)
    if not 3 <= levels.size <= 0.95 * seen.size:
        return 0.0
    apart = np.diff(levels)
    step = float(np.median(apart[apart < 1.5 * np.quantile(apart, 0.05)]))
    whole = np.round(apart / step)
    if np.any(whole < 1) or np.mean(np.abs(apart / step - whole) < 0.1) < 0.9:
        return 0.0
    return float(np.sum(apart) / np.sum(whole))


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
    told, partly = (
        [_beside_its_own(r, own.get(r["rig"], {"named": []})) for r in rows if r["kind"] == kind]
        for kind in ("single", PARTLY)
    )
    fresh = [x for x in told if not x["was_its_own"]]
    return {
        **scored(singles),
        "accuracy": [],  # of the first name, where the rig's own stands
        "cases": len(rows),
        "untouched": len(own),
        "found": _share_found(told),
        "found_new": _share_found(fresh),
        "found_new_of": len(fresh),
        "foremost_visible": _foremost_visible(told),
        "foremost_visible_half_simulated": _foremost_visible(partly),
        "own": {rig: r["named"] for rig, r in own.items()},
        "concealed_in_real": told,
        "half_simulated": partly,
    }


def _beside_its_own(row: Mapping, alone: Mapping) -> dict:
    """What is told of one effect in a rig, beside the answer to the rig ``alone``."""
    its_own, named = {class_of(n) for n in alone["named"]}, [class_of(n) for n in row["named"]]
    wanted = class_of(row["labels"][0])
    new = list(dict.fromkeys(c for c in named if c == wanted or c not in its_own))
    return {
        "case": row["case"],
        "rig": row["rig"],
        "concealed": row["labels"][0],
        "strength": row["strength"],
        "visibility": row["visibility"],
        "named": row["named"],
        "found": wanted in named,
        "is_foremost": wanted in new[:2],
        "was_its_own": wanted in its_own,
        "own_kept": sum(c in named for c in its_own),
        "own": len(its_own),
        "others": sorted(n for n in row["named"] if class_of(n) not in its_own | {wanted}),
    }


def _foremost_visible(told: Sequence[Mapping]) -> tuple[int, int]:
    """(how many are named first or second, the rig's own set aside, of how many) of those that can be seen beside
    the rig's own error.
    """
    visible = [x["is_foremost"] for x in told if x["visibility"] >= HALVES.seen]
    return sum(visible), len(visible)


def _share_found(told: Sequence[Mapping]) -> float | None:
    return sum(x["found"] for x in told) / len(told) if told else None
