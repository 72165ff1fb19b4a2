"""The main job: recordings in, the missing physics out.

traces -> baseline -> selection -> held-out confirmation -> localisation -> intervals -> document (diagnosis.json) and
evidence
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from ers_mj.data.informative import searched
from ers_mj.data.prepared import Trace, counted, trace_of
from ers_mj.data.recording import Recording
from ers_mj.decisions.thresholds import POLICY, Policy
from ers_mj.diagnosis.case import Case
from ers_mj.diagnosis.document import Diagnosis, told
from ers_mj.diagnosis.loop.pipeline import diagnose_loop
from ers_mj.diagnosis.mujoco_check import Rig
from ers_mj.diagnosis.unexcited import is_unexcited
from ers_mj.effects import BY_NAME, SUSPECTS
from ers_mj.effects.quantities import Symptoms
from ers_mj.estimation.baseline import Start, baseline, sharpened
from ers_mj.estimation.fit import polished
from ers_mj.estimation.initial_state import without_spikes
from ers_mj.selection.budget import SEARCH, Budget, Search
from ers_mj.selection.comparison import Candidate
from ers_mj.selection.confirmation import Confirmed, confirmed
from ers_mj.selection.confounders import without_confounders
from ers_mj.selection.stepwise import Selection, select
from ers_mj.servo.datasheet import Datasheet
from ers_mj.servo.model import MOST_TAU, Model

Progress = Callable[[str, float], None]


def diagnose(
    recordings: Sequence[Recording],
    datasheet: Datasheet | None,
    holdout: Sequence[Recording] = (),
    *,
    seed: int = 0,
    jobs: int | None = None,
    progress: Progress = lambda text, share: None,
    policy: Policy = POLICY,
    search: Search = SEARCH,
) -> Diagnosis:
    """Locate, name and model what a simulation of these recordings leaves out.

    Args:
        recordings: training recordings of one rig, all of one output and input unit.
        datasheet: what is known of the servo, or None; under a position command it only stands beside the numbers.
        holdout: looked at only after the selection has ended.
        seed: kept in the document; nothing here draws random numbers.
        jobs: threads; all cores by default. The result does not depend on it.
        progress: called with a text and a share of the work done.
        policy: the thresholds that decide.
        search: how far it is searched, and which parts are left out.

    Raises:
        InputError: no motion of the model resembles the recordings.
    """
    jobs = jobs or _cores()
    recordings, holdout = searched(recordings, holdout)
    first = recordings[0]
    if first.input_kind == "position":
        return diagnose_loop(recordings, holdout, datasheet, seed=seed, jobs=jobs, progress=progress, policy=policy)
    inertia = datasheet.parameters.get("J") if datasheet is not None else None
    traces = [trace_of(r, inertia) for r in recordings]
    travel = float(np.ptp(np.concatenate([t.y[t.valid] for t in traces])))
    progress("fitting the baseline", 0.03)
    start = sharpened(baseline(traces, datasheet, first.output_unit == "rad", jobs), travel)
    still = is_unexcited(start.traces)  # nothing can be told then, and nothing is named
    barred = _barred(still, start.fit.model, policy, search)
    sensors = symptoms(recordings, start.traces, travel, policy, barred)
    budget, begun = Budget(start.traces, search=search), None if still else start
    grown = partial(select, jobs=jobs, progress=progress, policy=policy, budget=budget)
    start, chosen = _polished(start, grown(start.fit, start.traces, start=begun, exclude=barred))
    progress("judging on held-out data", 0.75)
    held = without_spikes(start.fit.model, counted([trace_of(r, inertia) for r in holdout], travel))
    selection, judged = confirmed(start, chosen, held, jobs, policy)
    suspects: tuple[Candidate, ...] = ()
    if not still and search.among is None:
        named, suspects = without_confounders(selection, start.traces, jobs, policy, search)
        if named is not selection:
            selection, judged = confirmed(start, named, held, jobs, policy)
    start = replace(start, fit=judged.base)
    rig = Rig(dict(datasheet.parameters) if datasheet is not None else {}, first.output_unit == "rad")
    multibody = _in_mujoco(rig, selection, judged, jobs, progress) if search.in_mujoco else (None, None)
    progress("locating", 0.92)
    given = recordings, list(holdout), datasheet
    return told(Case(*given, start, selection, judged, sensors, suspects, seed, rig, multibody, policy, search), held)


def _polished(start: Start, grown: Selection) -> tuple[Start, Selection]:
    """The baseline and the answer carried on in free run. What differs between recordings alone is no effect: it is the
    baseline's then.
    """
    named = bool(grown.chosen.model.names)
    base = polished(grown.base if named else grown.chosen, grown.traces)
    best = polished(grown.chosen, grown.traces) if named else base
    return replace(start, fit=base, traces=grown.traces), replace(grown, base=base, chosen=best)


def _in_mujoco(
    rig: Rig, selection: Selection, judged: Confirmed, jobs: int, progress: Progress
) -> tuple[float | None, float | None]:
    """The held-out errors of the MuJoCo plants before and after, the same where nothing is named."""
    progress("running the MuJoCo plant", 0.84)
    before = rig.rmse(judged.base_models, judged.parts, jobs)
    return before, rig.rmse(judged.models, judged.parts, jobs) if selection.chosen.model.effects else before


def _barred(still: bool, model: Model, policy: Policy, search: Search) -> tuple[str, ...]:
    """Effects that are not tried: all where nothing moves, those that are none here, and all but those ``among`` which
    it is searched.
    """
    among = BY_NAME if search.among is None else search.among
    others = [name for name in BY_NAME if still or name not in among]
    return tuple(dict.fromkeys((*_ordinary(model, policy), *SUSPECTS, *others)))


def _ordinary(model: Model, policy: Policy) -> list[str]:
    """Effects that are none here: a winding whose inductance a datasheet gives has it, as long as it is not about twice
    that.
    """
    known = model.scales.tau_e_datasheet
    if not known or model.values["tau_e"] >= policy.ordinary_inductance * MOST_TAU * known:
        return []
    return [effect.name for effect in BY_NAME.values() if "tau_e" in effect.absorbs]


def symptoms(
    recordings: Sequence[Recording], traces: Sequence[Trace], travel: float, policy: Policy, barred: Sequence[str]
) -> dict[str, np.ndarray]:
    """Sensor effects that show in the data itself, but for those ``barred``, with their parameters (see
    Effect.symptom).
    """
    seen = Symptoms(
        dropouts=np.array([(s.stop - s.start) * t.sample_time for t in traces for s in t.lost]),
        seconds=sum(float(t.t[-1] - t.t[0]) for t in traces),
        quanta=np.array([t.quantum for t in traces]),
        travel=travel,
        is_angle=recordings[0].output_unit == "rad",
    )
    found = ((name, effect.symptom(seen, policy)) for name, effect in BY_NAME.items() if name not in barred)
    return {name: values for name, values in found if values is not None}


def _cores() -> int:
    import os

    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
