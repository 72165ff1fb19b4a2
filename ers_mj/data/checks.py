"""What of a recording is refused, and what is worked around and told: the checks that arrays and files get alike."""

from collections.abc import Collection, Mapping
from dataclasses import dataclass

import numpy as np

from ers_mj.data.columns import COLUMNS, CONSTANT, MEASURED
from ers_mj.data.consistency.sheet import Fault
from ers_mj.data.rails import rail_spans
from ers_mj.data.sensor_faults import at_extreme, converter_step, decimal_grain, frozen_spans, held_spans, varied
from ers_mj.data.tables import listed
from ers_mj.errors import InputError

FEWEST_SAMPLES = 100
GAP = 3.0  # a step of time longer than this many median steps is a gap


@dataclass(frozen=True)
class Limits:
    """From where on a recording is refused, or something of it told."""

    most_missing: float = 0.20  # share of a column: a required one is refused, another one not used
    least_jitter: float = 0.01  # rms share of the step from which jitter is worth a sentence
    regular: float = 0.2  # share of the step that no step of a regular clock is off a whole number of them
    largest: float = 1e25  # of any column: no sensor gives more, and its powers are still numbers
    least_travel: float = 1e-25  # of an output, below which it is constant
    ends: tuple[int, ...] = (32767, 32768)  # counts at which a register of 16 bits ends
    fewest_at_end: int = 3  # samples there


LIMITS = Limits()


# -- what is refused -------------------------------------------------------------------------------------------------


def checked(values: dict[str, np.ndarray], labels: dict[str, str], name: str) -> dict[str, np.ndarray]:
    """The fields of a recording, locked, or the first reason to refuse them."""
    for field, x in values.items():
        _refuse_length(x, labels[field], len(values["t"]), name)
        _refuse_infinite(x, labels[field], name)
        _refuse_huge(x, labels[field], name)
    refuse_time(values["t"], labels["t"], name)
    for field in ("u", "y"):
        _refuse_missing(values[field], labels[field], name)
    refuse_still(values["y"], labels["y"], name)
    used = {field: x for field, x in values.items() if field not in CONSTANT and not _sparse(x)}
    fields = {field: x if field in MEASURED else _held(x) for field, x in used.items()}
    if "enable" in fields:
        fields["enable"] = fields["enable"] > 0.5
    return {field: locked(x) for field, x in (fields | {"valid": np.isfinite(values["y"])}).items()}


def refuse_still(y: np.ndarray, label: str, name: str) -> None:
    """Raise InputError where the output y (N,) is constant."""
    known = y[np.isfinite(y)]
    if not known.size or np.ptp(known) < LIMITS.least_travel:
        told = f" at {known[0]:.6g}" if known.size else ""
        raise InputError(f"{name}: the output {label} is constant{told}")


def constants(values: dict[str, np.ndarray], labels: dict[str, str], name: str) -> dict[str, float]:
    """The fields that have one value a recording, blanks left out."""
    found = {}
    for field in CONSTANT:
        known = values[field][np.isfinite(values[field])] if field in values else np.zeros(0)
        if known.size and np.ptp(known) > 0:
            row = 1 + int(np.argmax(values[field] != known[0]))
            raise InputError(
                f"{name}: {labels[field]} changes in data row {row}, one value a recording was expected (cut the file"
                " there)"
            )
        if known.size:
            found[field] = float(known[0])
    return found


def _refuse_length(x: np.ndarray, label: str, count: int, name: str) -> None:
    if len(x) != count:
        raise InputError(f"{name}: {label} has {len(x)} samples, the time has {count}")
    if count < FEWEST_SAMPLES:
        raise InputError(f"{name}: has {count} samples, at least {FEWEST_SAMPLES} are needed")


def _refuse_infinite(x: np.ndarray, label: str, name: str) -> None:
    if np.isinf(x).any():
        raise InputError(f"{name}: {label} is infinite in data row {1 + int(np.argmax(np.isinf(x)))}")


def _refuse_huge(x: np.ndarray, label: str, name: str) -> None:
    if (huge := np.abs(x) > LIMITS.largest).any():
        row = int(np.argmax(huge))
        raise InputError(f"{name}: {label} is {x[row]:.3g} in data row {row + 1}, at most {LIMITS.largest:.0e} may be")


def refuse_time(t: np.ndarray, label: str, name: str) -> None:
    """Raise InputError where time (N,) is missing, repeats or runs backwards."""
    if np.isnan(t).any():
        raise InputError(f"{name}: the time {label} is missing in data row {1 + int(np.argmax(np.isnan(t)))}")
    if (late := np.flatnonzero(np.diff(t) <= 0)).size:
        k = int(late[0]) + 1
        what = "repeats" if t[k] == t[k - 1] else "runs backwards"
        raise InputError(f"{name}: the time {label} {what} in data row {k + 1} ({t[k - 1]:.9g} s, then {t[k]:.9g} s)")


def _refuse_missing(x: np.ndarray, label: str, name: str) -> None:
    if _sparse(x):
        raise InputError(
            f"{name}: {label} lacks {np.mean(np.isnan(x)):.0%} of its values, at most {LIMITS.most_missing:.0%} may be"
            " missing"
        )


def _sparse(x: np.ndarray) -> bool:
    return bool(np.mean(np.isnan(x)) > LIMITS.most_missing)


def _held(x: np.ndarray) -> np.ndarray:
    """x with each gap filled by the value before it (the first value, where it begins with one)."""
    known = np.flatnonzero(np.isfinite(x))
    last = np.maximum(np.searchsorted(known, np.arange(len(x)), side="right") - 1, 0)
    return x[known[last]]


def locked(x: np.ndarray) -> np.ndarray:
    """x in one piece, that nobody can write to."""
    x = np.ascontiguousarray(x)
    x.setflags(write=False)
    return x


# -- what is worked around and told ----------------------------------------------------------------------------------


def problems_of(
    fields: Mapping[str, np.ndarray],
    printed: Mapping[str, np.ndarray],
    rows: np.ndarray,
    labels: Mapping[str, str],
    step: float,
) -> list[Fault]:
    """What is told, a sentence each; `printed` are the columns as they stand in these `rows` of the file, `step` the
    converter's there.
    """
    t, u, y = fields["t"], fields["u"], printed["y"]
    frozen = frozen_spans(y, step or decimal_grain(y[np.isfinite(y)]))
    return [
        *(_told_blanks(t, x, labels[field], field) for field, x in printed.items() if np.isnan(x).any()),
        *_told_gaps(t, labels["t"]),
        *_told_jitter(t, rows, labels["t"]),
        *_told_clipped("limit", t, u, labels["u"], [s for s in held_spans(u) if at_extreme(u, s) and varied(u, s)]),
        *_told_clipped("clipped", t, y, labels["y"], rail_spans(y, step), ", which are left out"),
        *(
            fault
            for field in MEASURED
            if field in printed
            for fault in _told_register(t, printed[field], labels[field])
        ),
        *_told_stuck(t, labels["y"], [s for s in frozen if not at_extreme(y, s) and np.ptp(u[s]) > 0]),
        *_told_constant(t, u, labels["u"]),
        *_told_converter(t, labels["y"], step),
    ]


def _told_blanks(t: np.ndarray, x: np.ndarray, label: str, field: str) -> Fault:
    blank, share = np.flatnonzero(np.isnan(x)), np.mean(np.isnan(x))
    if _sparse(x):
        sentence = f"{label} lacks {share:.0%} of its values and is not used"
    else:
        remedy = "left out" if field in MEASURED else "taken as the last value before"
        sentence = f"{label} is missing in {blank.size} samples ({share:.2%}), which are {remedy}"
    return Fault("blank", label, sentence, int(blank.size), _region(t, blank[0], blank[-1]))


def _region(t: np.ndarray, first: int, last: int) -> tuple[float, float]:
    return float(t[first]), float(t[last])


def gaps_in(t: np.ndarray) -> np.ndarray:
    """The steps of time (N - 1,) in which rows are lost: of two and more of a regular clock's, else of more than GAP
    median ones.
    """
    dt = np.diff(t) / np.median(np.diff(t))
    whole = np.rint(dt)
    is_regular = bool(np.all(whole >= 1.0)) and float(np.max(np.abs(dt - whole) / whole)) < LIMITS.regular
    return whole > 1.0 if is_regular else dt > GAP


def _told_gaps(t: np.ndarray, label: str) -> list[Fault]:
    dt = np.diff(t)
    gaps = np.flatnonzero(gaps_in(t))
    if not gaps.size:
        return []
    k = gaps[np.argmax(dt[gaps])]
    sentence = f"time has {gaps.size} gap{'s'[: gaps.size > 1]}, the largest of {dt[k]:.4g} s after {t[k]:.4g} s"
    return [Fault("gap", label, sentence, int(gaps.size), _region(t, gaps[0], gaps[-1] + 1))]


def _told_jitter(t: np.ndarray, rows: np.ndarray, label: str) -> list[Fault]:
    """Steps that are not alike, between rows that follow each other in the file."""
    steps = np.flatnonzero(~gaps_in(t) & (np.diff(rows) == 1))
    off = np.diff(t)[steps] / np.median(np.diff(t)[steps]) - 1.0 if steps.size else np.zeros(1)
    jitter = float(np.sqrt(np.mean(off**2)))
    if jitter <= LIMITS.least_jitter:
        return []
    at = steps[np.abs(off) > LIMITS.least_jitter]
    sentence = f"the steps of time jitter by {jitter:.1%} rms"
    return [Fault("jitter", label, sentence, int(at.size), _region(t, at[0], at[-1] + 1))]


def _told_clipped(
    kind: str, t: np.ndarray, x: np.ndarray, label: str, spans: list[slice], done: str = ""
) -> list[Fault]:
    if not spans:
        return []
    limits = listed(f"{limit:.6g}" for limit in sorted({float(x[span.start]) for span in spans}))
    sentence = f"{label} looks clipped at {limits}: {_told_spans(spans, len(x))}{done}"
    return [_of_spans(kind, t, label, spans, sentence)]


def _told_register(t: np.ndarray, x: np.ndarray, label: str) -> list[Fault]:
    """A column that stays at the last count of a register of 16 bits (moteus logs speeds and positions so): what lay
    beyond it is lost, and no flag says so.
    """
    if not np.isfinite(x).any():
        return []
    size = np.abs(x)
    at = np.flatnonzero(size == np.nanmax(size))
    if at.size < LIMITS.fewest_at_end:
        return []
    levels = np.unique(x[np.isfinite(x)])
    grain = decimal_grain(levels)
    step = float(np.gcd.reduce(np.rint(levels / grain).astype(np.int64))) * grain if grain else converter_step(x)
    if not step or round(size[at[0]] / step) not in LIMITS.ends:
        return []
    sentence = (
        f"{label} stays at {x[at[0]]:.6g}, {round(size[at[0]] / step)} steps of {step:.4g}: the end of a 16-bit"
        f" register, which clips without a flag, in {at.size} samples"
    )
    return [Fault("clipped", label, sentence, int(at.size), _region(t, at[0], at[-1]))]


def _told_stuck(t: np.ndarray, label: str, spans: list[slice]) -> list[Fault]:
    if not spans:
        return []
    longest = max(spans, key=lambda s: s.stop - s.start)
    lasts, start = t[longest.stop - 1] - t[longest.start], t[longest.start]
    sentence = f"{label} looks stuck: {_told_spans(spans, len(t))}, the longest for {lasts:.4g} s from {start:.4g} s on"
    return [_of_spans("stuck", t, label, spans, sentence)]


def _of_spans(kind: str, t: np.ndarray, label: str, spans: list[slice], sentence: str) -> Fault:
    count = sum(span.stop - span.start for span in spans)
    return Fault(kind, label, sentence, count, _region(t, spans[0].start, spans[-1].stop - 1))


def _told_spans(spans: list[slice], total: int) -> str:
    count = sum(span.stop - span.start for span in spans)
    return f"{count} samples ({count / total:.2%}) in {len(spans)} span{'s'[: len(spans) > 1]}"


def _told_constant(t: np.ndarray, u: np.ndarray, label: str) -> list[Fault]:
    sentence = f"the input {label} is constant at {u[0]:.6g}"
    return [Fault("constant_input", label, sentence, u.size, _region(t, 0, -1))] if np.ptp(u) == 0 else []


def _told_converter(t: np.ndarray, label: str, step: float) -> list[Fault]:
    sentence = f"the output {label} moves in steps of {step:.4g}, those of its converter"
    return [Fault("converter", label, sentence, t.size, _region(t, 0, -1))] if step else []


def ignored(columns: list[str], taken: Collection[str]) -> list[Fault]:
    """Tell the columns that were not taken in; `run` chose the rows."""
    rest = [column for column in columns if column not in taken and column != "run"]
    beside = [column for column in rest if COLUMNS.get(column, COLUMNS["t_s"]).field == "u"]
    strange = [column for column in rest if column not in beside]
    told = [
        *(
            f"{column} stands beside the input and is not used (--second {column} explains it, too)"
            for column in beside
        ),
        *([f"columns that mean nothing here are ignored: {listed(strange)}"] if strange else []),
    ]
    return [Fault("ignored", "", sentence) for sentence in told]
