"""What acceleration does a recording ask for beside the answer, over time?

Begun where the output was measured to be, the answer misses it after a short while T by e; held over T, an acceleration
of 2 e / T^2 would have brought it there. Nothing where stick holds both.
"""

from __future__ import annotations

import math

import numpy as np

from ers_mj.data.prepared import Trace
from ers_mj.diagnosis.case import Case
from ers_mj.diagnosis.evidence import LatentForce
from ers_mj.effects import BY_NAME
from ers_mj.plants.reduced import lumped
from ers_mj.servo.model import Model

SPAN = 8  # samples over which an error grows, and over which a speed is taken
LONGEST = 0.1  # [s] of a span
MOST = 1500  # spans of a recording that are looked at


def latent_forces(case: Case) -> LatentForce | None:
    """That of the recording on which the answer is told; None where no more than noise is left."""
    if not case.more_is_left:
        return None
    judged = case.confirmed
    trace, models = judged.parts[0].held_out, judged.models if case.answer is case.model else judged.base_models
    model = models[0]
    n = max(2, min(SPAN, int(LONGEST / trace.sample_time)))
    begins = np.arange(n, trace.t.size - n - 1, max(n, (trace.t.size - 2 * n) // MOST))
    begins = np.array([k for k in begins if trace.valid[k - n : k + n + 1].all()], int)
    if begins.size < 2:
        return None
    speed = (trace.y[begins + n] - trace.y[begins - n]) / (trace.t[begins + n] - trace.t[begins - n])
    asked = np.array([_asked(model, trace, int(k), n, float(w)) for k, w in zip(begins, speed, strict=True)])
    tabled = None
    if case.unknown is not None:
        level, c = case.answer.values["c_2"], lumped(case.answer.values)
        tabled = np.zeros(begins.size)
        for name, values in case.unknown.tables:
            p = BY_NAME[name].constants(values, c)
            tabled += [_tabled(name, p, level, trace.y[k], w) for k, w in zip(begins, speed, strict=True)]
    span = n * trace.sample_time
    noise = 2.0 * trace.sigma / span**2 * math.sqrt(2.0 + 0.5)
    return LatentForce(trace.name, trace.t[begins], asked, tabled, noise)


def _asked(model: Model, trace: Trace, k: int, n: int, speed: float) -> float:
    """The acceleration that is asked for over n samples from the k-th on."""
    part = trace.part(k, k + n + 1)
    run = model.predict(part, start=(float(trace.y[k]), float(speed)))
    return 2.0 * float(trace.y[k + n] - run[-1]) / float(part.t[-1] - part.t[0]) ** 2


def _tabled(name: str, constants: np.ndarray, level: float, y: float, speed: float) -> float:
    """The acceleration of a table there; a friction's against the motion."""
    effect, p = BY_NAME[name], tuple(constants)
    if effect.torque:
        return float(effect.torque(p, y, speed, 0.0, 0.0))
    way = math.copysign(1.0, speed)
    return -way * (float(effect.friction(p, level, y, speed, 0.0, way)) - level)
