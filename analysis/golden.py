"""What commit 581c791 answered, frozen: `python analysis/golden.py replay`, `python analysis/golden.py ask`.

analysis/golden/SET/CASE.json holds a case: per round and candidate what the decision read (gain, z-score, losses, best
block, size, probability, how far its blocks are from every other's), the order that was made, what held-out data said,
what the verdict read, and the answer. Deciding sets: `tuning` (the tuning half of ../shared/concealed), `seeds` (cases
of `ers prove --seed 4201`), `foreign` (../shared/foreign), `rigs` (../shared/data). `reporting` decides nothing.

- `replay` makes every decision anew from the tables, in seconds, with ers_mj.decisions and its policy, and prints what
  differs. `--policy NAME=VALUE` asks another policy; `--thresholds` asks each threshold what its absence, a fifth less
  and a fifth more would have changed; `--ranges NAME` between which values of one nothing changes.
- `ask` diagnoses the recordings anew and prints what differs: verdict, names, parameters, errors. It needs ../shared,
  and for `seeds` the recordings that `make` makes with the generator of commit 581c791 (some 45 s of a core a case).
"""

from __future__ import annotations

import argparse
import hashlib
import json
import os
import subprocess
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, fields, replace
from pathlib import Path

import numpy as np

from ers_mj.decisions import acceptance, confirmation, ordering
from ers_mj.decisions import verdict as rules
from ers_mj.decisions.acceptance import Offer
from ers_mj.decisions.thresholds import POLICY, Policy
from ers_mj.effects import BY_NAME, EQUIVALENT

TABLES = Path(__file__).resolve().parent / "golden"
SHARED = Path(__file__).resolve().parents[2] / "shared"
DECIDING = ("tuning", "seeds", "foreign", "rigs")
COMMIT, SEED = "581c791", 4201

# rules that the older commit did not have, each with the value at which it decides nothing: what they change is told
# apart
SINCE = {"far_off": np.inf, "pays": -1.0}
FACTORS = np.array([1.05, 1.1, 1.2, 1.3, 1.5, 2.0, 3.0, 5.0, 10.0, 30.0, 100.0])


def tables(sets: list[str]) -> Iterator[tuple[str, dict]]:
    """The cases of these sets that were answered, by SET/CASE."""
    for name in sets:
        for path in sorted((TABLES / name).glob("*.json")):
            table = json.loads(path.read_text())
            if table.get("answer"):
                yield f"{name}/{path.stem}", table


# -- the decisions, from the tables
# -------------------------------------------------------------------------------------


def is_clocked(name: str) -> bool:
    return name not in BY_NAME or BY_NAME[name].local


def kin_of(name: str) -> frozenset[str]:
    return next((group for group in EQUIVALENT if name in group), frozenset({name}))


def number(x: float | None) -> float:
    return np.nan if x is None else x


def offer(row: dict, size: int) -> Offer:
    """What a decision reads of a candidate's row."""
    name = row["name"]
    is_effect = name in BY_NAME
    once = is_effect and BY_NAME[name].once
    lost, best = row.get("lost", 0.0), row.get("best", 0.0)
    return Offer(name, row["gain"], row["z"], lost, best, size, is_effect, once, is_clocked(name), kin_of(name))


def asked(entry: dict, policy: Policy) -> str | None:
    """What a round names."""
    rows = entry["candidates"]
    if not rows:
        return None
    offers = [offer(row, row["size"]) for row in rows]
    left, named = entry["C"], len(entry["names"])
    bar = acceptance.bar(left, named, entry["dear"], entry["in_order"], entry["outstanding"], policy)
    alone = []
    for k, (one, row) in enumerate(zip(offers, rows, strict=True)):
        others = [o for j, o in enumerate(offers) if j != k]
        alone.append(ordering.stands_alone(one, others, row["apart"], policy))
    found, _ = acceptance.asked(offers, alone, bar, policy)
    return found.name if found else None


def leader(entry: dict, policy: Policy) -> str | None:
    """Which candidate leads."""
    rows = entry["in"]
    if not rows:
        return None
    if "gain" not in rows[0]:  # among fits that are exchanged: the likeliest
        offers = [Offer(r["name"], 0.0, 0.0, 0.0, 0.0, 0, True, False, r["clocked"], kin_of(r["name"])) for r in rows]
        return ordering.likeliest(offers, curves(rows), {r["name"]: number(r["chance"]) for r in rows}, policy)
    sizes = [round((r["gain"] - r["worth"]) / POLICY.parameter_price) for r in rows]
    offers = [offer(row, size) for row, size in zip(rows, sizes, strict=True)]
    chance = {r["name"]: r["chance"] for r in rows}

    def chances(rivals):
        known = {o.name: chance[o.name] for o in rivals if chance[o.name] is not None}
        total = sum(known.values()) or 1.0  # a rival that was none then has no probability of its own in the table
        return {o.name: known.get(o.name, 0.0) / total for o in rivals}

    really = {r["name"]: r["really"] for r in rows}
    return ordering.likeliest_first(offers, really, curves(rows), chances, policy)[0].name


def curves(rows: list[dict]) -> dict[str, str]:
    return {r["name"]: BY_NAME[r["name"]].curves for r in rows if r["name"] in BY_NAME}


def kept(row: dict, folds: dict, name: str, policy: Policy) -> bool:
    """Whether held-out data confirms an effect."""
    whole = row["pools"]["held_out"]
    p, judged = chance_of(whole, row, policy), whole
    if row["judged_by"] == "halves":
        judged = row["pools"]["halves"]
        p = chance_of(judged, row, policy)
    held = confirmation.HeldOut(
        p=p,
        rmse=(whole["rmse_with"], whole["rmse_without"]),
        noise=float(np.sqrt(np.mean(np.square(folds["noise"])))),
        cost=(whole["C_with"], whole["C_without"]),
        ratio=number(judged["sure_ratio"]),
        log_ratio=number(judged["log_ratio"]),
    )
    excluded = any(row.get(key) for key in ("may_be_none", "a_converters", "any_wave"))
    again = row.get("recalibrated") or {}

    def recalibrated() -> tuple[float, float] | None:
        return (again["after"], again["before"]) if {"after", "before"} <= again.keys() else None

    worth = row["once"] or confirmation.pays(held, recalibrated, policy)
    return confirmation.is_confirmed(held, recalibrated, policy) and worth and not excluded


def chance_of(pool: dict, row: dict, policy: Policy) -> float:
    won = confirmation.Won(pool["sum"], pool["losses"], number(pool["max"]), pool["blocks"])
    return confirmation.paired_p(won, row["once"], row["alone"], policy)


@dataclass(frozen=True)
class Findings:
    """What the verdict reads of a case's table."""

    table: dict
    policy: Policy

    def __getattr__(self, name: str):
        return self.table[name]

    @property
    def suspects(self) -> tuple:
        return tuple(self.table["nameless"])

    @property
    def recordings_differ(self) -> bool:
        return self.table.get("recordings_differ", False)

    @property
    def explained(self) -> float:
        t = self.table
        shares = [rules.share(b**2, a**2, n**2) for b, a, n in t["explained_pooled"]]
        shown = [rules.Shown(*row) for row in t["shown"]]
        return max(*shares, rules.explained_each(shown, t["left_before"], t["left"], self.policy))

    @property
    def free_held(self) -> float:
        return self.table["rmse_over_noise"]["heldout_rmse_after"]

    @property
    def least_astray(self) -> float:
        return number(self.table["astray"]["least_over_noise"])

    @property
    def datasheet_explains(self) -> bool:
        cost = self.table["datasheet_C_per_block"]
        return cost is not None and cost < self.policy.consistent


def decisions(table: dict, policy: Policy) -> Iterator[tuple[str, object, object]]:
    """Every decision of a case: what it is, what was decided, and what the policy decides on the same numbers."""
    for k, entry in enumerate(table["rounds"], 1):
        yield f"round {k} names", entry["asked"], asked(entry, policy)
    for k, entry in enumerate(table["ordering"], 1):
        yield f"order {k} ({entry['by']}) leads", entry["out"][0] if entry["out"] else None, leader(entry, policy)
    for folds in table["confirmation"]:
        for one in folds["passes"]:
            for name, row in one["effects"].items():
                yield f"{name} is kept", row["kept"], kept(row, folds, name, policy)
    found = Findings({**table["verdict"], "nameless": table["answer"]["nameless"]}, policy)
    yield "verdict", table["answer"]["verdict"], rules.verdict(found, policy)
    yield "more is left", table["answer"]["significant"], rules.is_more_left(found, policy)


def changed(sets: list[str], policy: Policy) -> list[tuple[str, str, object, object]]:
    """What a policy decides otherwise."""
    out = []
    for case, table in tables(sets):
        out += [(case, what, was, now) for what, was, now in decisions(table, policy) if was != now]
    return out


def replay(arguments: argparse.Namespace) -> int:
    asked_for = dict(named(arguments.policy))
    policy = replace(POLICY, **(SINCE | asked_for))
    begun, found = time.perf_counter(), changed(arguments.sets, policy)
    for case, what, was, now in found:
        print(f"{case}: {what}: {now}, not {was}")
    for name in SINCE.keys() - asked_for.keys():
        then = changed(arguments.sets, replace(policy, **{name: getattr(POLICY, name)}))
        new = [one for one in then if one[:2] not in {old[:2] for old in found}]
        for case, what, was, now in new:
            print(f"since, by {name}: {case}: {what}: {now}, not {was}")
    counts = Counter(case.split("/")[0] for case, _ in tables(arguments.sets))
    total = sum(1 for _, table in tables(arguments.sets) for _ in decisions(table, policy))
    cases = ", ".join(f"{count} of {name}" for name, count in counts.items())
    print(f"{total} decisions of {cases}: {len(found)} otherwise; {time.perf_counter() - begun:.1f} s")
    if arguments.thresholds:
        tell_thresholds(arguments.sets, found)
    tell_ranges(arguments.sets, arguments.ranges, found)
    return bool(found)


def named(pairs: list[str]) -> Iterator[tuple[str, float]]:
    known = {f.name for f in fields(Policy)}
    for pair in pairs:
        name, _, value = pair.partition("=")
        if name not in known:
            sys.exit(f"golden: there is no threshold {name!r}; there are {', '.join(sorted(known))}")
        yield name, float(value)


def tell_thresholds(sets: list[str], already: list) -> None:
    """How many decisions each threshold changes where it is taken away (at nought and beyond every number), and where
    it is a fifth smaller or larger.
    """
    print(f"\n{'threshold':22}{'value':>10}{'nought':>8}{'beyond':>8}{'x 0.8':>8}{'x 1.2':>8}")
    for f in fields(Policy):
        value = getattr(POLICY, f.name)
        ways = (0.0, 1e9, 0.8 * value, 1.2 * value)
        counts = []
        for way in ways:
            try:
                found = changed(sets, replace(POLICY, **{f.name: way}))
                counts.append(str(len({x[:2] for x in found} - {x[:2] for x in already})))
            except (ValueError, ZeroDivisionError, OverflowError):
                counts.append("-")
        print(f"{f.name:22}{value:10.4g}" + "".join(f"{count:>8}" for count in counts))


def tell_ranges(sets: list[str], names: list[str], already: list) -> None:
    """Between which values of a threshold, by steps of a few per cent to a factor of 100, no decision changes."""
    before = {one[:2] for one in already}
    for name in names:
        value, ends = getattr(POLICY, name), []
        for steps in (FACTORS, 1.0 / FACTORS):
            same = value
            for way in value * steps:
                if {one[:2] for one in changed(sets, replace(POLICY, **(SINCE | {name: type(value)(way)})))} - before:
                    break
                same = type(value)(way)
            ends.append(same)
        print(f"{name:22}{value:10.4g}: the same from {ends[1]:.4g} to {ends[0]:.4g}", flush=True)


# -- the cases, asked anew
# ----------------------------------------------------------------------------------------------


def recordings_of(table: dict, made: Path) -> tuple[list, list, object]:
    """(training recordings, held-out ones, datasheet) of a case.

    Raises:
        FileNotFoundError: they are not there, or not the ones that were asked.
    """
    from ers_mj.data.recording import read_recording
    from ers_mj.servo.datasheet import read_datasheet

    found = {True: [], False: []}
    sheet = None
    for one in table["inputs"]:
        path = one["path"]
        root = SHARED.parent if path.startswith("shared/") else made
        file = root / path.split("#")[0]
        if hashlib.sha256(file.read_bytes()).hexdigest() != one["sha256"]:
            raise FileNotFoundError(f"{file} is another file than the one that was asked")
        if file.suffix == ".toml":
            sheet = read_datasheet(file)
        else:
            found[bool(one.get("held_out"))].append(read_recording(root / path))
        if sheet is None and table["set"] != "rigs" and (beside := file.parent / "datasheet.toml").is_file():
            sheet = read_datasheet(beside)
    return found[False], found[True], sheet


def ask_one(case: str, table: dict, made: Path) -> tuple[str, list[str], float]:
    """What a case answers otherwise than it did, and the processor seconds that it took."""
    from ers_mj.diagnosis import pipeline
    from ers_mj.diagnosis.mujoco_check import Rig

    Rig.rmse = lambda self, *arguments: None  # nothing decides on the MuJoCo twin
    try:
        recordings, held, sheet = recordings_of(table, made)
    except OSError as error:
        return case, [f"not asked: {error}"], 0.0
    begun = time.process_time()
    document = pipeline.diagnose(recordings, sheet, held, jobs=1).document
    return case, differences(document, table["answer"]), time.process_time() - begun


def differences(document: dict, answer: dict) -> list[str]:
    """Sentences on what a document says otherwise than an answer: first what matters, then numbers beyond rounding."""
    names = [m["effect"] for m in document["missing"]]
    out = []
    if document["verdict"] != answer["verdict"]:
        out.append(f"verdict {document['verdict']}, not {answer['verdict']}")
    if names != answer["names"]:
        out.append(f"names {', '.join(names) or 'none'}, not {', '.join(answer['names']) or 'none'}")
    if document["remainder"]["significant"] != answer["significant"]:
        out.append(f"flag {document['remainder']['significant']}, not {answer['significant']}")
    before = {(m["effect"], k): v for m in answer["missing"] for k, v in m["parameters"].items()}
    after = {(m["effect"], k): v["value"] for m in document["missing"] for k, v in m["parameters"].items()}
    before |= {("fit", k): v for k, v in answer["fit"].items() if isinstance(v, float)}
    after |= {("fit", k): v for k, v in document["fit"].items() if isinstance(v, float)}
    for key in before.keys() & after.keys():
        a, b = (np.array(number(x), float) for x in (before[key], after[key]))
        if a.shape == b.shape and not np.allclose(a, b, rtol=3e-6, atol=0.0, equal_nan=True):
            out.append(f"{' '.join(key)} {b:.7g}, not {a:.7g}")
    return out


def ask(arguments: argparse.Namespace) -> int:
    asked = [(case, table) for case, table in tables(arguments.sets) if not arguments.case or case in arguments.case]
    others = 0
    with ProcessPoolExecutor(arguments.jobs) as pool:
        running = [pool.submit(ask_one, case, table, arguments.made) for case, table in asked]
        for (_, table), one in zip(asked, running, strict=True):
            case, words, seconds = one.result()
            others += bool(words)
            verdict = "; ".join(words[:5]) or "as before"
            print(f"{case}: {verdict} ({seconds:.0f} s, {table['cost']['cpu_s']:.0f} then)", flush=True)
    print(f"{others} of {len(asked)} otherwise")
    return bool(others)


def make(arguments: argparse.Namespace) -> int:
    """Recordings of `seeds`, by the generator of the commit that was frozen."""
    root = Path(__file__).resolve().parents[1]
    with tempfile.TemporaryDirectory() as folder:
        archive = subprocess.run(["git", "-C", root, "archive", COMMIT], capture_output=True, check=True).stdout
        subprocess.run(["tar", "x", "-C", folder], input=archive, check=True)
        script = (
            "import sys; from pathlib import Path; from ers_mj.proving import case\n"
            "from ers_mj.proving.sealing import keep_case\n"
            "folder = Path(sys.argv[1]); (folder / 'sealed').mkdir(parents=True, exist_ok=True)\n"
            f"for plan in case.plans(80, {SEED}):\n"
            f"    keep_case(folder, f'case-{{plan.index + 1:03d}}', *case.make(plan, {SEED}))"
        )
        environment = {**os.environ, "PYTHONPATH": folder}
        return subprocess.run([sys.executable, "-c", script, arguments.made / "seeds"], env=environment).returncode


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0], allow_abbrev=False)
    commands = parser.add_subparsers(required=True, metavar="COMMAND")
    for function, text in ((replay, "decide anew"), (ask, "diagnose anew"), (make, "make the recordings of `seeds`")):
        one = commands.add_parser(function.__name__, help=text)
        one.set_defaults(run=function)
        one.add_argument("--sets", nargs="+", default=list(DECIDING))
        one.add_argument("--made", type=Path, default=Path("golden-recordings"), help="where `make` puts recordings")
        if function is replay:
            one.add_argument("--policy", nargs="+", default=[], metavar="NAME=VALUE")
            one.add_argument("--thresholds", action="store_true")
            one.add_argument(
                "--ranges", nargs="+", default=[], choices=[f.name for f in fields(Policy)], metavar="NAME"
            )
        if function is ask:
            one.add_argument("--jobs", type=int, default=1)
            one.add_argument("--case", nargs="+", metavar="SET/CASE")
    arguments = parser.parse_args()
    return arguments.run(arguments)


if __name__ == "__main__":
    sys.exit(main())
