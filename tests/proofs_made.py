"""Cases of a proof, answers to them, and an asker that answers at once."""

import json

from ers_mj.proving import asking
from ers_mj.workers.base import Task


def made(name, seed):
    return {"rec1.csv": f"t_s,u_V\n{seed}\n", "datasheet.toml": ""}, {
        "case": name,
        "kind": "null",
        "labels": [],
        "effects": [],
        "visibility_after_refit_sigma": 0.0,
        "seed": seed,
    }


TASKS = [Task(f"case-{k:03d}", made, (f"case-{k:03d}", k)) for k in (1, 2, 3)]
SETTINGS = {"kind": "simulated", "seed": 1, "cases": 3}
COST = {"exit": 0, "wall_s": 2.0, "cpu_s": 1.0, "peak_MiB": 100.0}


def answering(monkeypatch) -> list:
    """Put an answer in the place of every diagnosis; the names of the files that each is handed."""
    seen = []

    def stub(self, folder):
        seen.append(sorted(p.name for p in folder.iterdir()))
        return dict(COST), json.dumps({"verdict": "consistent", "missing": []}), ""

    monkeypatch.setattr(asking.Asker, "run", stub)
    return seen


def truth_and_answer(
    kind,
    labels,
    named,
    visibility=10.0,
    significant=False,
    verdict="missing_physics",
    where="load",
    alternatives=(),
    each=None,
):
    truth = {
        "case": "case-001",
        "kind": kind,
        "labels": labels,
        "visibility_after_refit_sigma": visibility,
        "linkage": "constant",
        "effects": [
            {"label": label, "strength": None, "shape": {}, "quick_visibility_sigma": sigma}
            for label, sigma in (each or {}).items()
        ],
    }
    missing = [
        {"effect": n, "alternatives": [dict(zip(("effect", "probability"), a)) for a in alternatives]} for n in named
    ]
    document = {
        "verdict": verdict,
        "missing": missing,
        "remainder": {"significant": significant},
        "where": [{"axis": "subsystem", "label": where}],
        "fit": {"heldout_rmse_after_rad": 2.0, "noise_floor_rad": 1.0},
    }
    return truth, {**COST, "error": None, "document": document}
