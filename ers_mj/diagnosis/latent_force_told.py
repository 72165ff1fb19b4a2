"""What acceleration does a recording ask for beside the answer, over time?"""

from __future__ import annotations

import math

import numpy as np

from ers_mj.diagnosis.case import Case
from ers_mj.diagnosis.evidence import LatentForce
from ers_mj.effects import BY_NAME
from ers_mj.plants.reduced import lumped
from ers_mj.selection.latent_force import asked_for, span_of


def latent_forces(case: Case) -> LatentForce | None:
    """That of the recording on which the answer is told; None where no more than noise is left."""
    if not case.more_is_left:
        return None
    judged = case.confirmed
    trace, models = judged.parts[0].held_out, judged.models if case.answer is case.model else judged.base_models
    model = models[0]
    begins, speed, asked = asked_for(model, trace)
    if begins.size < 2:
        return None
    tabled = None
    if case.unknown is not None:
        level, c = case.answer.values["c_2"], lumped(case.answer.values)
        tabled = np.zeros(begins.size)
        for name, values in case.unknown.tables:
            p = BY_NAME[name].constants(values, c)
            tabled += [_tabled(name, p, level, trace.y[k], w) for k, w in zip(begins, speed, strict=True)]
    span = span_of(trace) * trace.sample_time
    noise = 2.0 * trace.sigma / span**2 * math.sqrt(2.0 + 0.5)
    return LatentForce(trace.name, trace.t[begins], asked, tabled, noise)


def _tabled(name: str, constants: np.ndarray, level: float, y: float, speed: float) -> float:
    """The acceleration of a table there; a friction's against the motion."""
    effect, p = BY_NAME[name], tuple(constants)
    if effect.torque:
        return float(effect.torque(p, y, speed, 0.0, 0.0))
    way = math.copysign(1.0, speed)
    return -way * (float(effect.friction(p, level, y, speed, 0.0, way)) - level)
