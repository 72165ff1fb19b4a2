"""Pool finished proofs: `python analysis/pool_proofs.py FOLDER [FOLDER ...]`, each the --out of an `ers prove` of its
own seed.

Prints the tables of `ers prove` over the cases of all of them, whole and by family, what is found of several by what
an effect leaves by itself, which effects from outside the library are flagged (those apart that have a suspect's law,
see ers_mj/selection/confounders.py), and the time by kind of case.
"""

from __future__ import annotations

import argparse
import json
import statistics
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path

from ers_mj.errors import InputError
from ers_mj.proving.scoring import class_of, scored
from ers_mj.report.proof_families import told_families
from ers_mj.report.proof_report import headline, table_of

KINDS = ("null", "single", "several", "outside")
LIKE_A_SUSPECT = (
    "angle_dependent_damping",
    "magnetic_saturation",
    "running_in",
    "tacho_eccentricity",
)  # laws of the generator that have a suspect's form
SIGMAS = ((0.0, 1.0), (1.0, 4.0), (4.0, float("inf")))


def main(arguments: Sequence[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folders", nargs="+", type=Path, metavar="FOLDER")
    try:
        proofs = _read(parser.parse_args(arguments).folders)
    except InputError as error:
        print(f"pool_proofs: {error}", file=sys.stderr)
        return 2
    print("\n".join(told(proofs)))
    return 0


def told(proofs: Sequence[Mapping]) -> list[str]:
    """The lines to print of several results.json of `ers prove`."""
    rows = [row for proof in proofs for row in proof["rows"]]
    results = scored(rows)
    seeds = ", ".join(f"{proof['seed']} ({len(proof['rows'])} cases)" for proof in proofs)
    lines = [headline(results), f"{len(rows)} cases of seeds {seeds}", ""]
    lines += [f"  {what:58}{count:>14}   {share}" for what, count, share in table_of(results)]
    lines += told_families(results)
    lines += ["", "effects found, of several, by what they leave by themselves [sigma]"]
    hits = [
        (v, class_of(label) in {class_of(name) for name in row["named"]})
        for row in rows
        if row["kind"] == "several"
        for label, v in row["each"].items()
        if v is not None
    ]
    for low, high in SIGMAS:
        some = [hit for v, hit in hits if low <= v < high]
        lines.append(f"  {low:g} to {'more' if high > 1e9 else f'{high:g}':14}{sum(some):>4} of {len(some)}")
    lines += ["", "outside the library, flagged"]
    flagged = [
        (row["labels"][0], row["verdict"] == "unexplained" or row["significant"])
        for row in rows
        if row["kind"] == "outside"
    ]
    for what, some in (
        ("kinds with a suspect's law", [hit for label, hit in flagged if label in LIKE_A_SUSPECT]),
        ("kinds without", [hit for label, hit in flagged if label not in LIKE_A_SUSPECT]),
    ):
        lines.append(f"  {what:28}{sum(some):>4} of {len(some)}")
    lines += ["", "time a case, of one processor [s]"]
    for kind in (*KINDS, "all"):
        some = [row["cpu_s"] for row in rows if kind in (row["kind"], "all")]
        lines += [_times(kind, some)] if some else []
    for effects in (2, 3):
        some = [row["cpu_s"] for row in rows if row["kind"] == "several" and len(row["labels"]) == effects]
        lines += [_times(f"several: {effects} effects", some)] if some else []
    return lines + ([f"memory of a case: at most {results['peak_MiB']:.0f} MiB"] if results["peak_MiB"] else [])


def _times(what: str, some: Sequence[float]) -> str:
    return f"  {what:20} median {statistics.median(some):.1f}, at most {max(some):.1f} ({len(some)} cases)"


def _read(folders: Sequence[Path]) -> list[dict]:
    proofs = []
    for folder in folders:
        try:
            proof = json.loads((folder / "results.json").read_text())
        except (OSError, ValueError):
            raise InputError(
                f"{folder}: a finished proof with a results.json was expected, `ers prove --out {folder}` makes one"
            ) from None
        if not isinstance(proof, dict) or not {"rows", "seed"} <= proof.keys() or "concealed_in_real" in proof:
            raise InputError(f"{folder}: its results.json is not that of a proof on simulated servos")
        if proof["seed"] in (other["seed"] for other in proofs):
            raise InputError(f"{folder}: seed {proof['seed']} is given twice, proofs of different seeds were expected")
        proofs.append(proof)
    return proofs


if __name__ == "__main__":
    raise SystemExit(main())
