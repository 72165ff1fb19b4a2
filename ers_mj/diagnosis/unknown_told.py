"""What of diagnosis.json and of the improved model the tables of what stays unknown make."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ers_mj.diagnosis.case import Case
from ers_mj.effects import BY_NAME
from ers_mj.estimation.intervals import half_widths
from ers_mj.selection.cross_validation import pooled, scored
from ers_mj.selection.measure import FREE_RUN
from ers_mj.servo.model import Model
from ers_mj.servo.simulation import PER_INERTIA, unit_of


def in_readers_units(case: Case, name: str, values: np.ndarray) -> dict[str, float]:
    """The numbers of an effect that are there, torques in N m where the inertia is known."""
    factors = [case.inertia if case.inertia and p.kind in PER_INERTIA else 1.0 for p in BY_NAME[name].parameters]
    told = zip(BY_NAME[name].parameters, values, factors, strict=True)
    return {p.name: float(v) * factor for p, v, factor in told if np.isfinite(v)}


def tables(case: Case) -> list[dict]:
    """The tables with their 95 % bands, the rest of the model and the other tables held: a level of friction may stand
    in any of them.
    """
    if case.unknown is None:
        return []
    return [_table(case, name, values, _bands(case, case.unknown.model, name)) for name, values in case.unknown.tables]


def _bands(case: Case, found: Model, table: str) -> dict:
    """The 95 % band of each entry of a table, all else of the model held."""
    others = tuple(held for name in found.names if name != table for held in (name, f"{name}, local"))
    model = replace(found, free=(), frozen=others, states=None)
    layout = model.layout()
    widths = half_widths(model, case.start.traces, (), case.selection.tau)
    return {(f.owner, f.name): f.ends(q, w) for f, q, w in zip(layout, model.vector(layout), widths, strict=True)}


def _table(case: Case, name: str, values: np.ndarray, bands: dict) -> dict:
    told = in_readers_units(case, name, values)
    entries = {}
    for parameter, value in zip(BY_NAME[name].parameters, values, strict=True):
        ends = bands.get((name, parameter.name))
        factor = told[parameter.name] / value if value else 1.0
        entries[parameter.name] = {
            "value": told[parameter.name],
            "unit": unit_of(parameter.kind, case.output_unit, case.input_unit, bool(case.inertia)),
            "ci95": [float(end) * factor for end in ends] if ends is not None else [None, None],
        }
    return {"law": name, "sentence": BY_NAME[name].sentence, "parameters": entries}


def sentences(case: Case) -> list[str]:
    """What is said of the tables."""
    if case.unknown is None:
        return []
    kept = " and ".join(BY_NAME[name].sentence.removesuffix(", of unknown origin") for name, _ in case.unknown.tables)
    return [f"What is unknown of it is kept as a table, {kept}, so that simulations are nearer."]


def fits(case: Case) -> dict[str, float | None]:
    """The errors of the answer with its tables, by the measure of the others; none where there are none."""
    found = case.unknown
    if found is None:
        return {}
    c = case.confirmed
    out: dict[str, float | None] = {
        "train_rmse_with_tables_rad": found.trained.rmse,
        "heldout_rmse_with_tables_rad": found.held.rmse,
        "heldout_mae_with_tables_rad": found.held.mae,
        "recalibrated_rmse_with_tables_rad": found.again.rmse,
    }
    if c.measure != FREE_RUN:
        free = [scored(model, fold.held_out) for model, fold in zip(found.models, c.parts, strict=True)]
        out["heldout_free_run_rmse_with_tables_rad"] = pooled(free).rmse
    if case.search.in_mujoco:
        out["mujoco_heldout_rmse_with_tables_rad"] = case.rig.rmse(found.models, c.parts, 1)
    return out
