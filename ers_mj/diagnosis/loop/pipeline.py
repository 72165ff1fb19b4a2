"""The main job under a position command: runs -> bare loop -> selection -> held-out confirmation -> intervals."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

from ers_mj.data.recording import Recording
from ers_mj.decisions.thresholds import Policy
from ers_mj.diagnosis.document import Diagnosis
from ers_mj.diagnosis.loop.case import LoopCase
from ers_mj.diagnosis.loop.document import told
from ers_mj.position_loop.confirmation import confirmed
from ers_mj.position_loop.fit import polished
from ers_mj.position_loop.intervals import Intervals, passed_over, turned_over
from ers_mj.position_loop.runs import runs_of
from ers_mj.position_loop.selection import Selector
from ers_mj.servo.datasheet import Datasheet

Progress = Callable[[str, float], None]


def diagnose_loop(
    recordings: Sequence[Recording],
    holdout: Sequence[Recording],
    datasheet: Datasheet | None,
    *,
    seed: int,
    jobs: int,
    progress: Progress,
    policy: Policy,
) -> Diagnosis:
    """As pipeline.diagnose, of recordings of a position command."""
    runs = runs_of(recordings)
    selector = Selector(runs, recordings[0].output_unit == "rad", jobs, policy)
    selection = selector.run(progress)
    progress("judging on held-out data", 0.75)
    selection, found = confirmed(selector, selection, runs_of(holdout, recordings[0]), policy)
    selection = replace(selection, chosen=polished(selection.chosen, selector.data))
    progress("running the MuJoCo plant", 0.88)
    left_out = found.models if found.folds[0].training is not None and len(runs) > 1 else ()
    rivals = passed_over(selection, policy) + turned_over(selection.chosen, selector.data, policy)
    intervals = Intervals.of(selection.chosen, selector.data, left_out, rivals)
    return told(LoopCase(recordings, holdout, selector, selection, found, intervals, datasheet, seed, policy))
