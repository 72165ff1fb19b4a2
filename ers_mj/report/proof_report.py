"""The report of a proof: shares with intervals, pictures, every case with what was concealed and what was answered."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from ers_mj.proving.scoring import NOTHING, first
from ers_mj.report import page
from ers_mj.report.display import NONE, missing
from ers_mj.report.display import figure as digits
from ers_mj.report.drawing import restart_ids
from ers_mj.report.proof_families import coverage_of, families_of, heads
from ers_mj.report.proof_figures import drawn

TOLD = {
    "top1": "single effects named right, by name",
    "top1_class": "single effects named right, by class",
    "top1_class_visible": "of these visible from 1 sigma on",
    "top1_class_clear": "of these clear from 3 sigma on",
    "exact": "single effects named exactly, none beside them",
    "exact_clear": "of these clear from 3 sigma on, exactly",
    "false_alarm_rate": "null cases with a named effect",
    "pair_recall": "effects found, of several at once",
    "pair_recall_visible": "of these visible from 1 sigma on by themselves",
    "pair_spurious": "false positives, for an effect of several",
    "unexplained_recall": "effects outside the library flagged",
    "false_flag_rate": "all others flagged",
    "arm_recall": "arms whose gravity is named",
    "subsystem_recall": "single effects with the right subsystem first",
}

OF_THE_FIRST = (
    "top1",
    "top1_class",
    "top1_class_visible",
    "top1_class_clear",
    "exact",
    "exact_clear",
    "subsystem_recall",
)  # in real records the rig's own effects come first


def headline(results: Mapping) -> str:
    """One sentence."""
    if told := results.get("concealed_in_real"):
        fresh = [x for x in told if not x["was_its_own"]]
        return (
            f"{sum(x['found'] for x in fresh)} of {len(fresh)} effects concealed in real recordings are found again,"
            " those that the rig has of its own not counted."
        )
    k, n = results["of"].get("top1_class", (0, 0))
    null, nulls = results["of"].get("false_alarm_rate", (0, 0))
    parts = [f"{k} of {n} concealed single effects are named right by class"] if n else []
    parts += [f"{null} of {nulls} cases that hide nothing raise a false positive"] if nulls else []
    return ("; ".join(parts) or f"{results['cases']} cases were diagnosed") + "."


def _counted(results: Mapping, name: str) -> tuple[int, int]:
    """(how many, of how many) a share is; none of what asks for the first name in real records."""
    is_hidden = name in OF_THE_FIRST and "concealed_in_real" in results
    return (0, 0) if is_hidden else results["of"].get(name, (0, 0))


def table_of(results: Mapping) -> list[tuple[str, str, str]]:
    """(what, counts, share with interval) a line."""
    out = []
    for name, told in TOLD.items():
        k, n = _counted(results, name)
        if n:
            ends = results["ci95"].get(name)
            out.append((told, f"{k} of {n}", f"{k / n:.2f}" + (f" [{ends[0]:.2f}, {ends[1]:.2f}]" if ends else "")))
    for owner, told in (
        ("baseline", "95 % intervals of the baseline's parameters hold the truth"),
        ("baseline_alone", "the same, neither effect nor clutter"),
        ("effect", "95 % intervals of effects' parameters hold it"),
    ):
        c = results["parameters"][owner]["all"]
        if c["of"]:
            out.append(
                (told, f"{c['inside']} of {c['of']}", f"{c['coverage']:.2f} [{c['ci95'][0]:.2f}, {c['ci95'][1]:.2f}]")
            )
    return out


def proof_page(results: Mapping, rows: Sequence[Mapping], about: Mapping[str, str]) -> str:
    """The page as HTML."""
    restart_ids()
    shares = page.table(
        ["share", ">cases", ">with 95 % interval"], [((page.text(a), b, c), "") for a, b, c in table_of(results)]
    )
    pictures = "".join(page.figure(svg, page.text(caption)) for caption, svg in drawn(results, rows).items())
    body = "\n".join(
        [
            page.header("consistent", "What the diagnosis can do", "ers prove", headline(results), _tiles(results)),
            page.section(
                "Shares", "Wilson's intervals. An answer that failed or ran out of time counts as wrong.", shares
            ),
            page.section("Beside what the rigs have of their own", REAL, _real(results)),
            page.section("By family", FAMILIES, _families(results)),
            page.section("Pictures", "", pictures),
            page.section("Parameters", PARAMETERS, _parameters(results)),
            page.section(
                "Every case",
                "What was concealed, how much of it a refitted model leaves, what was answered.",
                _cases(rows),
            ),
            page.footer(f"{name} {value}" for name, value in about.items()),
        ]
    )
    return page.frame("What the diagnosis can do", "consistent", body)


PARAMETERS = (
    "Where a parameter means one thing whatever the form of the law. Torques are compared per inertia; the baseline's"
    " only on the constant linkage."
)


FAMILIES = (
    "What a family always has (the gravity of an arm, a loop's latency and limit, a winding whose time constant shows)"
    " is set aside before names are counted."
)


def _families(results: Mapping) -> str:
    lines, covered = families_of(results), coverage_of(results)
    if not lines:
        return ""
    table = page.table(heads(), [(tuple(page.named(cell) for cell in line), "") for line in lines])
    held = [((page.named(name), page.text(parameters)), "") for name, parameters in covered]
    return table + (page.table(["family", "95 % intervals that hold the truth"], held) if held else "")


def _tiles(results: Mapping) -> list[tuple[str, str]]:
    tiles = []
    for name, label in (
        ("top1_class", "named right"),
        ("false_alarm_rate", "false positives"),
        ("unexplained_recall", "unknown effects flagged"),
    ):
        k, n = _counted(results, name)
        tiles += [(label, f"{100 * k / n:.0f} %")] if n else []
    over, time = results["error_over_floor"].get("median"), results["cpu_s"].get("median")
    tiles += [("held-out error / noise floor", digits(over))] if over else []
    return tiles + ([("median time", f"{digits(time)} s")] if time else [])


def _parameters(results: Mapping) -> str:
    rows = []
    for owner in ("baseline", "effect"):
        for name, c in results["parameters"][owner].items():
            if c["of"] or c["median_relative_error"] is not None:
                error = NONE if c["median_relative_error"] is None else f"{100 * c['median_relative_error']:.2g} %"
                rows.append(
                    ((page.named(f"{owner}: {name}"), f"{c['inside']} of {c['of']}" if c["of"] else NONE, error), "")
                )
    return page.table(["parameter", ">95 % interval holds the truth", ">median relative error"], rows)


REAL = (
    "Effects concealed in real recordings. What is named in the untouched records is the rig's own; a concealed effect"
    " counts as found where its class is named at all."
)


def again(x: Mapping) -> str:
    """Whether what was concealed in a real record is found again: its class says nothing where the rig has it of its
    own.
    """
    return "its own" if x["was_its_own"] else "found" if x["found"] else NONE


def _real(results: Mapping) -> str:
    own = "; ".join(f"{rig}: {', '.join(names) or NOTHING}" for rig, names in results.get("own", {}).items())
    if not own:
        return ""
    tables = [
        f"<p>{told} and leaves three times the rig's own error: named first or second, the rig's own set aside, in"
        f" {results[count][0]} of {results[count][1]}.</p>" + _again(results[rows])
        for told, count, rows in (
            ("What was put into the records themselves", "foremost_visible", "concealed_in_real"),
            (
                "What was put into them by the difference that it makes in the rig's own best model",
                "foremost_visible_half_simulated",
                "half_simulated",
            ),
        )
    ]
    return f"<p>{page.named(own)}</p>" + "".join(tables)


def _again(told: Sequence[Mapping]) -> str:
    """A row for each effect that was concealed in real records."""
    rows = [
        (
            (
                page.text(x["rig"]),
                page.named(x["concealed"]),
                digits(x["strength"]),
                digits(x["visibility"]),
                again(x),
                page.named(" + ".join(x["named"]) or NOTHING),
            ),
            "",
        )
        for x in told
    ]
    head = ["rig", "concealed", ">strength (SI)", ">left / its own error", "found", "named"]
    return page.table(head, rows) if rows else ""


def _cases(rows: Sequence[Mapping]) -> str:
    lines = []
    for r in rows:
        truth = " + ".join(r["labels"]) or NOTHING
        answer = " + ".join(r["named"]) or first(r)
        over = digits(r["after"] / r["floor"]) if r["after"] is not None and r["floor"] else NONE
        lines.append(
            (
                (
                    r["case"],
                    r["kind"],
                    page.named(truth) + (" (rod)" if r["linkage"] == "rod" else ""),
                    NONE if missing(r["visibility"]) else digits(r["visibility"]),
                    page.named(answer) + (" (flagged)" if r["significant"] else ""),
                    over,
                    NONE if r["cpu_s"] is None else digits(r["cpu_s"]),
                ),
                "",
            )
        )
    return page.table(
        ["case", "kind", "concealed", ">left [sigma]", "answered", ">error / floor", ">processor [s]"], lines
    )
