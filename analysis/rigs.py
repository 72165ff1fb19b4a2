"""The page of each real rig: what is known of it, what was found, what could not be separated, the errors.

    python analysis/rigs.py --out FOLDER [--rigs emps throttle ...] [--write]

Diagnoses the rigs of ../shared/data, keeps each answer under --out (a rig that is there is not asked again), and prints
docs/results.md; `--write` puts it there. EMPS and the throttle take two to three minutes each, the STS3215 ten.
"""

from __future__ import annotations

import argparse
import json
import textwrap
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import sts3215_loop

from ers_mj.data.recording import Recording, read_recording
from ers_mj.diagnosis import pipeline
from ers_mj.report.display import shown

ERRORS = (
    ("training", "train_rmse"),
    ("held out", "heldout_rmse"),
    ("recalibrated", "recalibrated_rmse"),
    ("held out, one free run", "heldout_free_run_rmse"),
    ("held out, in MuJoCo", "mujoco_heldout_rmse"),
    ("held out, mean absolute", "heldout_mae"),
)
ROOT = Path(__file__).resolve().parents[1]
DATA = ROOT.parent / "shared" / "data"
PAGE = ROOT / "docs" / "results.md"
RUNS = "the split of closed_loop_split.csv, from theta_ref_rad alone"

PENDULUM = """## The STS3215's weight, withheld

Told as volts, without its position loop, gravity was named as a spring that softens as the weight's sine does.
`python analysis/pendulum_ratio.py ../shared/data/sts3215 --runs 3` fits gravity to each of its eight loads alone:
linear in m l (r² 0.991), heaviest to lightest 3.63 where m l has 3.28
([each load](../analysis/results/pendulum_ratio.txt)).
"""


@dataclass(frozen=True)
class Rig:
    """A rig's recordings, what is known of it beforehand, and what others reached on the same split and measure."""

    title: str
    asked: str  # the command, or how it was asked
    known: str
    published: str
    train: Callable[[], list[Recording]]
    held: Callable[[], list[Recording]]


def _files(*names: str) -> Callable[[], list[Recording]]:
    return lambda: [read_recording(DATA / name) for name in names]


RIGS = {
    "emps": Rig(
        "EMPS, a motor, a ball screw and a carriage",
        "ers diagnose emps/train.csv --holdout emps/test_pulses.csv",
        "No spring. Its authors (Janot, Gautier and Brunot, 2019) say that the simple model leaves out a friction that"
        " differs with direction, a constant force, a flexibility that the pulses of the second recording excite, and a"
        " ripple.",
        "Open-loop simulation over the whole held-out recording: the authors' asymmetric model 9.13 mm, the best black"
        " box (dynoNet) 2.64 mm; beside them stands one free run. A carriage that nothing holds drifts in it, whatever"
        " the model: what decides here is measured in windows.",
        _files("emps/train.csv"),
        _files("emps/test_pulses.csv"),
    ),
    "throttle": Rig(
        "Electronic throttle, 25 s to 63 s",
        "ers diagnose throttle/aprbs_25s.csv --holdout throttle/aprbs_63s.csv",
        "A preloaded return spring with a limp-home place at 4.42 V, wide stiction, hard stops at 0.702 and 4.50 V"
        " (University of Kassel). Units are duty and sensor volts; more duty lowers the reading.",
        "None on this split.",
        _files("throttle/aprbs_25s.csv"),
        _files("throttle/aprbs_63s.csv"),
    ),
    "throttle_back": Rig(
        "Electronic throttle, 63 s to 25 s",
        "ers diagnose throttle/aprbs_63s.csv --holdout throttle/aprbs_25s.csv",
        "As above, the other way round.",
        "None on this split.",
        _files("throttle/aprbs_63s.csv"),
        _files("throttle/aprbs_25s.csv"),
    ),
    "sts3215": Rig(
        "STS3215, a hobby servo on a pendulum",
        RUNS,
        "24 runs to fit (lightest and heaviest mass, all gains, both arms), 96 held out (the middle masses). Gravity on"
        " an arm; a firmware loop whose gain register is recorded.",
        "Mean absolute error of the friction models M1 to M6, .0323 to .0309 rad (1.85° to 1.77°), on their authors'"
        " own choice of runs and measure. On this split and measure Coulomb-viscous friction with a latency leaves"
        " .0214 rad (1.23°), without .0261 rad (1.50°).",
        lambda: sts3215_loop.recordings_of("train"),
        lambda: sts3215_loop.recordings_of("heldout"),
    ),
}


def answer(name: str, out: Path) -> dict:
    """diagnosis.json of a rig, asked where it is not kept."""
    path = out / name / "diagnosis.json"
    if not path.exists():
        rig = RIGS[name]
        document = pipeline.diagnose(rig.train(), None, rig.held(), jobs=1).document
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(json.dumps(document, indent=1), encoding="utf-8")
    return json.loads(path.read_text(encoding="utf-8"))


def page_of(rig: Rig, document: dict) -> Iterator[str]:
    """A rig's part of the page."""
    fit, unit = document["fit"], document["data"]["output_unit"]
    errors = shown(unit, fit["heldout_rmse_before_rad"])
    yield f"## {rig.title}\n\n`{rig.asked}`\n\n{rig.known}\n"
    yield f"**{document['sentence']}** {document['remainder']['sentence']}\n"
    tabled = "heldout_rmse_with_tables_rad" in fit
    yield f"| error [{errors.label}] | before | after |{' and the unknown tabled |' if tabled else ''}"
    yield f"|---|---|---|{'---|' if tabled else ''}"
    for title, key in ERRORS:
        told = (fit.get(f"{key}_{when}_rad") for when in ("before", "after", *(["with_tables"] if tabled else [])))
        ends = ["" if x is None else errors.bare(x) for x in told]
        if any(ends):
            yield f"| {title} | {' | '.join(ends)} |"
    measure = "a free run" if fit["measure"] == "free_run" else f"windows of {fit['window_s']:.3g} s"
    yield from _tables(document)
    yield f"\nMeasured in {measure}; noise floor {errors(fit['noise_floor_rad'])}. Published: {rig.published}\n"
    yield from _found(document)


def _tables(document: dict) -> Iterator[str]:
    for table in document["remainder"].get("tables", ()):
        rows = [entry for entry in table["parameters"].values() if entry["ci95"][0] is not None]
        wide = sum(high - low for low, high in (entry["ci95"] for entry in rows)) / (2 * len(rows))
        ends = min(entry["value"] for entry in rows), max(entry["value"] for entry in rows)
        told = f"{ends[0]:.3g} to {ends[1]:.3g} {rows[0]['unit']}, each entry ±{wide:.2g}"
        yield f"\nKept as a table: {table['sentence']} ({told})."


def _found(document: dict) -> Iterator[str]:
    for effect in document["missing"]:
        told = {name: entry for name, entry in effect["parameters"].items() if entry["value"] is not None}
        numbers = "; ".join(_number(name, entry) for name, entry in told.items())
        yield f"- Found: `{effect['effect']}`, {effect['sentence']} ({numbers})."
        for other in effect["alternatives"]:
            yield f"- Not separated from it: `{other['effect']}`, {other['why_not_excluded']}."
    for state in document["record_state"]:
        yield f"- Differs between the recordings: {state['sentence']}."
    yield f"- Next: {document['next_recording']['sentence']}\n"


def _number(name: str, entry: dict) -> str:
    low, high = entry["ci95"]
    ends = "" if low is None else f" [{low:.4g}, {high:.4g}]"
    return f"{name} {entry['value']:.4g}{ends} {entry['unit']}".rstrip(" -")


def _folded(line: str) -> str:
    """A line of prose in lines of 118 characters."""
    if line.startswith(("|", "#")):
        return line
    indent = "  " if line.startswith("- ") else ""
    return textwrap.fill(line, 118, subsequent_indent=indent, break_long_words=False, break_on_hyphens=False)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--rigs", nargs="+", choices=RIGS, default=list(RIGS))
    parser.add_argument("--write", action="store_true")
    arguments = parser.parse_args()
    asked = " ".join(arguments.rigs)
    parts = [f"# Real rigs\n\nPrinted by `python analysis/rigs.py --out FOLDER --rigs {asked}`, from ../shared/data.\n"]
    for name in arguments.rigs:
        parts += page_of(RIGS[name], answer(name, arguments.out))
    text = "\n".join(map(_folded, "\n".join([*parts, PENDULUM]).rstrip().split("\n"))) + "\n"
    print(text)
    if arguments.write:
        PAGE.write_text(text, encoding="utf-8")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
