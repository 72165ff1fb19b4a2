"""The families of a proof beside one another: what was named in each, and how often its intervals hold the truth."""

from __future__ import annotations

from collections.abc import Mapping

COLUMNS = {
    "top1_class_clear": "class right, from 3 sigma",
    "exact_clear": "exactly right, from 3 sigma",
    "false_alarm_rate": "nulls with a name",
    "pair_recall": "of several found",
    "unexplained_recall": "outside flagged",
    "arm_recall": "gravity of arms named",
}


def families_of(results: Mapping) -> list[list[str]]:
    """A line a family: its name, its cases, a count of each column, and of intervals that hold the truth."""
    lines = []
    for name, part in results.get("families", {}).items():
        held = results["coverage"][name]["all"]
        counts = [_of(*part["of"].get(column, (0, 0))) for column in COLUMNS]
        lines.append([name, str(part["cases"]), *counts, _of(held["inside"], held["of"])])
    return lines


def heads() -> list[str]:
    """Of the columns."""
    return ["family", "cases", *COLUMNS.values(), "95 % intervals hold"]


def coverage_of(results: Mapping) -> list[tuple[str, str]]:
    """(family, its parameters, each with how many of its intervals hold the truth)."""
    return [
        (name, ", ".join(f"{p} {_of(c['inside'], c['of'])}" for p, c in table.items() if p != "all"))
        for name, table in results.get("coverage", {}).items()
        if table["all"]["of"]
    ]


def told_families(results: Mapping) -> list[str]:
    """Both as lines of a terminal; none where there is one family alone."""
    lines = families_of(results)
    if len(lines) < 2:
        shown = []
    else:
        table = [heads(), *lines]
        wide = [max(len(line[k]) for line in lines) for k in range(len(lines[0]))]
        legend = [f"  {chr(97 + k)}: {head}" for k, head in enumerate(heads()[2:])]
        marks = [*table[0][:2], *(chr(97 + k) for k in range(len(legend)))]
        wide = [max(w, len(mark)) for w, mark in zip(wide, marks)]
        shown = ["", "by family", *legend]
        shown += ["  " + "  ".join(cell.ljust(w) for cell, w in zip(line, wide)).rstrip() for line in [marks, *lines]]
    covered = coverage_of(results)
    return (
        shown
        + (["", "95 % intervals that hold the truth"] if covered else [])
        + [f"  {name:12} {parameters}" for name, parameters in covered]
    )


def _of(k: int, n: int) -> str:
    return f"{k} of {n}" if n else "-"
