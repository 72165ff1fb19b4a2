"""The main job: recordings in, the missing physics out.
 traces -> baseline -> selection -> held-out confirmation -> localisation -> intervals -> document (diagnosis.json) and
evidence
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from ers_mj.data.prepared import Trace, counted, trace_of
from ers_mj.data.quantisation import COARSE, FINE, ORDINARY
from ers_mj.data.recording import Recording
from ers_mj.diagnosis.document import Diagnosis, told
from ers_mj.diagnosis.mujoco_check import Rig
from ers_mj.diagnosis.verdict import Case
from ers_mj.effects import SUSPECTS
from ers_mj.estimation.baseline import baseline, sharpened
from ers_mj.estimation.fit import polished
from ers_mj.estimation.initial_state import without_spikes
from ers_mj.selection.confirmation import confirmed
from ers_mj.selection.confounders import unmasked
from ers_mj.selection.stepwise import select
from ers_mj.servo.datasheet import Datasheet
from ers_mj.servo.model import MOST_TAU, Model

FEWEST_LOST = 3  # dropouts from which a sensor is said to have them
# share of the most that the baseline allows of a known inductance, from which it may be more than an ordinary one
AT_BOUND = 0.95

Progress = Callable[[str, float], None]


def diagnose(
    recordings: Sequence[Recording],
    datasheet: Datasheet | None,
    holdout: Sequence[Recording] = (),
    *,
    seed: int = 0,
    jobs: int | None = None,
    progress: Progress = lambda text, share: None,
) -> Diagnosis:
    """Locate, name and model what a simulation of these recordings leaves out.

    Args:
        recordings: training recordings of one rig, all of one output and input unit.
        datasheet: what is known of the servo, or None: everything is identified.
        holdout: recordings that are looked at only after the selection has ended.
        seed: kept in the document; nothing here draws random numbers.
        jobs: threads; all cores by default. The result does not depend on it.
        progress: called with a text and a share of the work done.

    Raises:
        InputError: no motion of the model resembles the recordings.
    """
    jobs = jobs or _cores()
    first = recordings[0]
    inertia = datasheet.parameters.get("J") if datasheet is not None else None
    traces = [trace_of(r, inertia) for r in recordings]
    travel = float(np.ptp(np.concatenate([t.y[t.valid] for t in traces])))
    progress("fitting the baseline", 0.03)
    start = sharpened(baseline(traces, datasheet, first.output_unit == "rad", jobs), travel)
    sensors = _symptoms(recordings, start.traces, travel)
    chosen = select(
        start.fit,
        start.traces,
        anchors=start.anchors,
        exclude=(*_ordinary(start.fit.model), *SUSPECTS),
        jobs=jobs,
        progress=progress,
    )
    start = replace(start, fit=polished(chosen.base, chosen.traces), traces=chosen.traces)
    chosen = replace(
        chosen, base=start.fit, chosen=polished(chosen.chosen, start.traces) if chosen.chosen.model.names else start.fit
    )
    progress("judging on held-out data", 0.75)
    held = without_spikes(start.fit.model, counted([trace_of(r, inertia) for r in holdout], travel))
    selection, judged = confirmed(start, chosen, held, jobs)
    named, suspects = unmasked(selection, start.traces, jobs)
    if named is not selection:
        selection, judged = confirmed(start, named, held, jobs)
    progress("running the MuJoCo plant", 0.84)
    rig = Rig(dict(datasheet.parameters) if datasheet is not None else {}, first.output_unit == "rad")
    before = rig.rmse(judged.base_models, judged.parts, jobs)
    multibody = before, rig.rmse(judged.models, judged.parts, jobs) if selection.chosen.model.effects else before
    progress("locating", 0.92)
    case = Case(recordings, list(holdout), datasheet, start, selection, judged, sensors, suspects, seed, rig, multibody)
    return told(case, held)


def _ordinary(model: Model) -> tuple[str, ...]:
    """Effects that are none here: a winding whose inductance a datasheet gives has it, as long as it is not about twice
    that.
    """
    known = model.scales.tau_e_datasheet
    return ("inductance",) if known and model.values["tau_e"] < AT_BOUND * MOST_TAU * known else ()


def _symptoms(recordings: Sequence[Recording], traces: Sequence[Trace], travel: float) -> dict[str, np.ndarray]:
    """Sensor effects that show in the data itself, with their parameters.

    A converter is one where it is coarse for the travel, or coarser than those of rudders' angles are and not fine for
    the travel.
    """
    found = {}
    lost = [(t, span) for t in traces for span in t.lost]
    if len(lost) >= FEWEST_LOST:
        seconds = sum(float(t.t[-1] - t.t[0]) for t in traces)
        found["sensor_dropout"] = np.array(
            [len(lost) / seconds, np.mean([(s.stop - s.start) * t.sample_time for t, s in lost])]
        )
    quanta = [t.quantum for t in traces]
    unusual = recordings[0].output_unit == "rad" and np.median(quanta) > max(ORDINARY, FINE * travel)
    if max(quanta) > COARSE * travel or unusual:
        found["sensor_quantisation"] = np.array([max(quanta)])
    return found


def _cores() -> int:
    import os

    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
