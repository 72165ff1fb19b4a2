"""Scores answers against the truth, as the contract defines every share; names and classes are the contract's words.

An answer that failed or ran out of time counts as wrong, and as neither a flag nor a name.
"""

from __future__ import annotations

import itertools
from collections import Counter
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence

import numpy as np
from scipy.stats import binomtest

from ers_mj.proving.parameters import covered

CLASSES = (
    {"bias_torque", "asymmetric_friction"},
    {"inductance", "input_delay", "sensor_lag"},
    {"voltage_saturation", "current_limit", "supply_sag"},
    {"cogging", "transmission_ripple"},
)
SUBSYSTEMS = {
    "drive": {
        "cogging",
        "voltage_saturation",
        "current_limit",
        "drive_dead_zone",
        "inductance",
        "input_delay",
        "thermal_drift",
        "supply_sag",
        "rate_limit",
    },
    "transmission": {"backlash", "shaft_compliance", "variable_ratio", "transmission_ripple"},
    "sensor": {"sensor_lag", "sensor_nonlinearity", "sensor_quantisation", "sensor_dropout"},
}
"""All else, friction included, is load."""
ARM = "gravity_imbalance"  # of what a family always has, the one that an answer must name
NOTHING, NO_ANSWER, UNEXPLAINED, OUTSIDE, SEVERAL = "nothing", "no answer", "unexplained", "outside", "several"
EDGES = (0.0, 0.5, 1.0, 2.0, 5.0, 12.0, 30.0, np.inf)  # [sigma] of the accuracy against visibility
SURE = (0.0, 0.2, 0.4, 0.6, 0.8, 0.95, 1.0)  # edges of the reliability diagram


def class_of(name: str) -> frozenset[str]:
    """The names that count as one with this one."""
    return frozenset(next((c for c in CLASSES if name in c), {name}))


def subsystem_of(name: str) -> str:
    """Where an effect acts."""
    return next((part for part, names in SUBSYSTEMS.items() if name in names), "load")


def row_of(truth: Mapping, answer: Mapping) -> dict:
    """What counts of one case: truth and answer side by side."""
    return (
        _concealed(truth)
        | _answered(answer, truth.get("inherent") or [])
        | {"parameters": covered(truth, answer.get("document") or {})}
    )


def _concealed(truth: Mapping) -> dict:
    """What counts of a truth."""
    effects = truth.get("effects") or []
    return {
        "case": truth["case"],
        "kind": truth["kind"],
        "labels": truth["labels"],
        **{key: truth.get(key) for key in ("family", "sheet", "linkage", "rig", "size")},
        "faults": [fault["kind"] for fault in truth.get("faults", [])],
        "clutter": [e["label"] for e in truth.get("clutter", [])],
        "strength": effects[0]["strength"] if effects else None,
        "visibility": _or_nan(truth["visibility_after_refit_sigma"]),
        "each": {e["label"]: e.get("quick_visibility_sigma") for e in effects},
        "inherent": truth.get("inherent") or [],
    }


def _answered(answer: Mapping, inherent: Collection[str]) -> dict:
    """What counts of an answer; what the family always has is set aside."""
    document = answer.get("document") or {}
    fit, every = document.get("fit") or {}, document.get("missing") or []
    missing = [m for m in every if m["effect"] not in inherent]
    where = [entry.get("label") for entry in document.get("where") or [] if entry.get("axis") == "subsystem"]
    return {
        "named": [m["effect"] for m in missing],
        "inherent_named": [m["effect"] for m in every if m["effect"] in inherent],
        "verdict": document.get("verdict") or NO_ANSWER,
        "significant": bool((document.get("remainder") or {}).get("significant")),
        "where": where[:1],
        "beliefs": beliefs(missing),
        "before": fit.get("heldout_rmse_before_rad"),
        "after": fit.get("heldout_rmse_after_rad"),
        "floor": fit.get("noise_floor_rad"),
        **{key: answer.get(key) for key in ("error", "cpu_s", "wall_s", "peak_MiB")},
    }


def _or_nan(x: float | None) -> float:
    return float("nan") if x is None else x


def beliefs(missing: Sequence[Mapping]) -> list[tuple[str, float]]:
    """(name, probability) of the first named effect and of its alternatives; what they leave is the first one's."""
    if not missing:
        return []
    others = [
        (o["effect"], float(o["probability"]))
        for o in missing[0].get("alternatives") or []
        if o.get("probability") is not None
    ]
    own = missing[0].get("probability")
    return [(missing[0]["effect"], float(own) if own is not None else 1.0 - sum(p for _, p in others)), *others]


def first(row: Mapping) -> str:
    """What the answer comes down to: the first name, or why there is none."""
    if row["named"]:
        return row["named"][0]
    return row["verdict"] if row["verdict"] in (UNEXPLAINED, NO_ANSWER) else NOTHING


def right(row: Mapping, same: Callable[[str], object] = class_of) -> bool:
    """Whether the first name is one of the concealed effects, by class or by name."""
    return bool(row["named"]) and same(row["named"][0]) in {same(label) for label in row["labels"]}


def exact(row: Mapping) -> bool:
    """Whether the names are the concealed effects and no other, by class."""
    return {class_of(name) for name in row["named"]} == {class_of(label) for label in row["labels"]}


def scored(rows: Sequence[Mapping]) -> dict:
    """All that the contract asks for, the counts behind every share, and the same by family."""
    families = dict.fromkeys(row["family"] for row in rows if row.get("family"))
    parts = {name: [row for row in rows if row.get("family") == name] for name in families}
    return {
        **shares(rows),
        "families": {name: shares(part) for name, part in parts.items()},
        "coverage": {name: coverage(part) for name, part in parts.items()},
        "accuracy": accuracy([row for row in rows if row["kind"] == "single"]),
        "reliability": reliability(rows),
        "error_over_floor": _over_floor(rows),
        "parameters": _parameters(rows),
        "failures": [f"{r['case']}: {r['error']}" for r in rows if r["error"]],
        **_costs(rows, [row for row in rows if row["kind"] == SEVERAL]),
    }


def shares(rows: Sequence[Mapping]) -> dict:
    """Every share of these cases, with its counts and interval."""
    by = {kind: [r for r in rows if r["kind"] == kind] for kind in ("null", "single", SEVERAL, OUTSIDE)}
    nulls, singles = by["null"], by["single"]
    counted = {
        **_named(singles),
        "false_alarm_rate": (sum(bool(r["named"]) for r in nulls), len(nulls)),
        **_found(by[SEVERAL]),
        **_flagged(rows, by[OUTSIDE]),
        **_inherent(rows),
        "subsystem_recall": (sum(r["where"] == [subsystem_of(r["labels"][0])] for r in singles), len(singles)),
    }
    return {
        "cases": len(rows),
        "counts": {kind: len(group) for kind, group in by.items()},
        **{name: k / n if n else None for name, (k, n) in counted.items()},
        "confusion": confusion(rows),
        "of": {name: list(pair) for name, pair in counted.items()},
        "ci95": {name: list(wilson(k, n)) for name, (k, n) in counted.items() if n and k <= n},
    }


Counted = dict[str, tuple[int, int]]
"""Share by name: how many, of how many."""


def _named(singles: Sequence[Mapping]) -> Counted:
    visible = [r for r in singles if r["visibility"] >= 1.0]  # [sigma]
    clear = [r for r in singles if r["visibility"] >= 3.0]
    return {
        "top1": (sum(right(r, str) for r in singles), len(singles)),
        "top1_class": (sum(map(right, singles)), len(singles)),
        "top1_class_visible": (sum(map(right, visible)), len(visible)),
        "top1_class_clear": (sum(map(right, clear)), len(clear)),
        "exact": (sum(map(exact, singles)), len(singles)),
        "exact_clear": (sum(map(exact, clear)), len(clear)),
    }


def _inherent(rows: Sequence[Mapping]) -> Counted:
    """The arms whose gravity is named."""
    arms = [r for r in rows if ARM in r.get("inherent", ())]
    return {"arm_recall": (sum(ARM in r["inherent_named"] for r in arms), len(arms))}


def _found(several: Sequence[Mapping]) -> Counted:
    concealed, found, spurious = _several(several)
    seen = [hit for r in several for sigma, hit in _hits(r) if sigma >= 1.0]
    return {
        "pair_recall": (found, concealed),
        "pair_recall_visible": (sum(seen), len(seen)),
        "pair_spurious": (spurious, concealed),
    }


def _flagged(rows: Sequence[Mapping], outside: Sequence[Mapping]) -> Counted:
    """What is flagged as unexplained, rightly and wrongly."""
    return {
        "unexplained_recall": (sum(r["significant"] for r in outside), len(outside)),
        "false_flag_rate": (sum(r["significant"] for r in rows if r["kind"] != OUTSIDE), len(rows) - len(outside)),
    }


def _costs(rows: Sequence[Mapping], several: Sequence[Mapping]) -> dict:
    return {
        "cpu_s": _spread([r["cpu_s"] for r in rows]),
        "wall_s": _spread([r["wall_s"] for r in rows]),
        "cpu_s_of_a_pair": _spread([r["cpu_s"] for r in several if len(r["labels"]) == 2]),
        "peak_MiB": max((r["peak_MiB"] for r in rows if r["peak_MiB"] is not None), default=None),
    }


def _several(rows: Iterable[Mapping]) -> tuple[int, int, int]:
    """(concealed, of these named by class, false positives); a class named twice is found once."""
    concealed = found = spurious = 0
    for row in rows:
        truth, named = Counter(map(class_of, row["labels"])), Counter(map(class_of, row["named"]))
        hit = sum((truth & named).values())
        concealed, found, spurious = concealed + len(row["labels"]), found + hit, spurious + len(row["named"]) - hit
    return concealed, found, spurious


def _hits(row: Mapping) -> list[tuple[float, bool]]:
    """(visibility of its own [sigma], whether it is named by class) of each effect of several; a linkage, which has no
    such number, is seen.
    """
    named, own, out = Counter(map(class_of, row["named"])), row.get("each") or {}, []
    for label in sorted(row["labels"], key=lambda label: -(own.get(label) or np.inf)):
        out.append((own.get(label) or np.inf, named[class_of(label)] > 0))
        named[class_of(label)] -= 1
    return out


def confusion(rows: Iterable[Mapping]) -> dict[str, dict[str, int]]:
    """{truth: {named: count}}: singles by label, what is none of the library's as `outside`, several joined by +."""
    table: dict[str, Counter] = {}
    for row in rows:
        truth = {"null": NOTHING, OUTSIDE: OUTSIDE}.get(row["kind"]) or "+".join(sorted(row["labels"]))
        table.setdefault(truth, Counter())[
            "+".join(sorted(row["named"])) if row["kind"] == SEVERAL and row["named"] else first(row)
        ] += 1
    return {truth: dict(named.most_common()) for truth, named in sorted(table.items())}


def wilson(k: int, n: int) -> tuple[float, float]:
    """95 % interval of a share, Wilson's."""
    low, high = binomtest(k, n).proportion_ci(method="wilson")
    return float(low), float(high)


def accuracy(singles: Sequence[Mapping]) -> list[dict]:
    """Right by class against visibility, in bins, with Wilson's intervals."""
    out = []
    for low, high in itertools.pairwise(EDGES):
        inside = [r for r in singles if low <= r["visibility"] < high]
        k = sum(map(right, inside))
        out += (
            [
                {
                    "from_sigma": low,
                    "to_sigma": high if np.isfinite(high) else None,
                    "right": k,
                    "of": len(inside),
                    "ci95": list(wilson(k, len(inside))),
                }
            ]
            if inside
            else []
        )
    return out


def reliability(rows: Iterable[Mapping]) -> list[dict]:
    """How often what was said with a probability was so: bins of mean probability and share that was right."""
    said = [(p, class_of(name) in {class_of(label) for label in r["labels"]}) for r in rows for name, p in r["beliefs"]]
    out = []
    for low, high in itertools.pairwise(SURE):
        inside = [(p, so) for p, so in said if low <= p < high or (high == 1.0 and p == 1.0)]
        if inside:
            k = sum(so for _, so in inside)
            out.append(
                {
                    "probability": float(np.mean([p for p, _ in inside])),
                    "right": k,
                    "of": len(inside),
                    "ci95": list(wilson(k, len(inside))),
                }
            )
    return out


def _over_floor(rows: Iterable[Mapping]) -> dict:
    ratios = [r["after"] / r["floor"] for r in rows if r["after"] is not None and r["floor"]]
    return {"values": ratios, **_spread(ratios)}


def _parameters(rows: Iterable[Mapping]) -> dict:
    """Error and coverage of the 95 % intervals, by parameter and pooled: the baseline's, the same where nothing at all
    is concealed (clutter moves parameters, too), the effects'."""
    entries = [e for r in rows for e in r["parameters"]]
    bare = [
        e for r in rows for e in r["parameters"] if e["owner"] == "baseline" and not r["labels"] and not r["clutter"]
    ]
    out = {"baseline_alone": {"all": _coverage(bare)}}
    for owner in ("baseline", "effect"):
        mine = [e for e in entries if e["owner"] == owner]
        out[owner] = {"all": _coverage(mine)} | {
            name: _coverage([e for e in mine if e["name"] == name]) for name in dict.fromkeys(e["name"] for e in mine)
        }
    return out


def coverage(rows: Iterable[Mapping]) -> dict:
    """By parameter and over `all`: how often the 95 % interval of what is called identifiable holds the truth, where
    nothing from outside the library is concealed; what is zero in truth is no parameter, and theta_0 is known.
    """
    entries = [
        e
        for r in rows
        if r["kind"] != OUTSIDE
        for e in r["parameters"]
        if e["true"] and e["name"] != "theta_0" and e.get("identifiable", True) and e["inside"] is not None
    ]
    names = sorted({e["name"] for e in entries})
    return {"all": _coverage(entries)} | {name: _coverage([e for e in entries if e["name"] == name]) for name in names}


def _coverage(entries: Sequence[Mapping]) -> dict:
    """Share of intervals that hold the truth, how many there are, and the median relative error."""
    known = [e for e in entries if e["inside"] is not None]
    k, errors = (
        sum(e["inside"] for e in known),
        [e["relative_error"] for e in entries if e["relative_error"] is not None],
    )
    return {
        "inside": k,
        "of": len(known),
        "coverage": k / len(known) if known else None,
        "ci95": list(wilson(k, len(known))) if known else None,
        "median_relative_error": float(np.median(errors)) if errors else None,
    }


def _spread(values: Iterable[float | None]) -> dict:
    known = [x for x in values if x is not None]
    return (
        {"median": float(np.median(known)), "p90": float(np.quantile(known, 0.9)), "max": float(max(known))}
        if known
        else {}
    )
