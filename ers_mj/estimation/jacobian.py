"""What a run leaves, by the numbers fitted of its model: slopes by tangents of the motion, or by finite differences."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ers_mj.data.prepared import Trace
from ers_mj.effects import BY_NAME, Effect
from ers_mj.estimation.objective import Run, begun, residuals
from ers_mj.servo.model import Columns, Free, Model


def has_tangents(model: Model, traces: Sequence[Trace]) -> bool:
    """Whether tangents of the motion tell a model's slopes."""
    return model.has_tangents and all(t.is_uniform for t in traces)


def step_of(model: Model) -> float:
    """Step of finite differences in the transformed numbers."""
    return max((BY_NAME[name].step for name in model.names), default=Effect.step)


def jacobian_of(
    run: Run, traces: Sequence[Trace], rate: float, known: Columns | None = None, by_tangents: bool = True
) -> np.ndarray:
    """Slopes (N, k) of what a run leaves by the numbers fitted of its model, but for the ``known`` ones.

    By tangents of the motion where the model has them, else by finite differences of simulations. Where stick and slip
    fork the two lead elsewhere, and either may be the better. Numbers whose effect on a motion hangs on what is finer
    than its samples go by differences.
    """
    model, layout = run.model, run.model.layout()
    z, step = model.vector(layout), step_of(model)
    jacobian = np.empty((z.size, run.left.size)).T  # a column's numbers side by side
    tangible = by_tangents and has_tangents(model, traces)
    along: list[int] = []
    apart: list[int] = []
    for k, f in enumerate(layout):
        if known and f.key in known:
            jacobian[:, k] = known[f.key]
        else:
            (along if tangible and _is_tangible(f) else apart).append(k)
    others = {k: model.at(layout, z + step * (np.arange(z.size) == k)) for k in (*along, *apart)}
    if along:
        for k, column in zip(along, model.changes(traces, rate, [others[k] for k in along], 1.0 / step, run.motions).T):
            np.negative(column, out=jacobian[:, k])
    for k in apart:
        jacobian[:, k] = (residuals(others[k], traces, rate) - run.left) / step
    jacobian[~np.isfinite(jacobian)] = 0.0
    return jacobian


def _is_tangible(f: Free) -> bool:
    """Whether tangents tell what a number does to a motion."""
    return f.owner not in BY_NAME or BY_NAME[f.owner].tangible


def columns_of(model: Model, traces: Sequence[Trace], rate: float, by_tangents: bool = True) -> Columns:
    """The columns of a model's Jacobian, with which fits that begin near by may begin."""
    run = begun(model, traces, rate)
    return {
        f.key: column
        for f, column in zip(run.model.layout(), jacobian_of(run, traces, rate, by_tangents=by_tangents).T)
    }


def central_jacobian(model: Model, layout, z: np.ndarray, traces: Sequence[Trace], rate: float) -> np.ndarray:
    """Central differences (N, k) of the residuals: tangents, good to a few per cent each, blur the directions in which
    their columns cancel.
    """
    step = step_of(model)
    ends = [
        [residuals(model.at(layout, z + way * row), traces, rate) for way in (1, -1)] for row in step * np.eye(z.size)
    ]
    return np.nan_to_num(
        np.column_stack([(ahead - behind) / (2.0 * step) for ahead, behind in ends]), nan=0.0, posinf=0.0, neginf=0.0
    )
