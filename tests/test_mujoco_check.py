"""How much of what was held out runs in MuJoCo."""

import numpy as np
import pytest

from ers_mj.data.prepared import trace_of
from ers_mj.data.recording import from_arrays
from ers_mj.diagnosis.mujoco_check import HELD_SECONDS, LEFT_OUT_SECONDS, run_in_mujoco
from ers_mj.selection.cross_validation import Fold


@pytest.mark.parametrize("training, most", [(None, HELD_SECONDS), ((), LEFT_OUT_SECONDS)])
def test_mujoco_runs_a_few_seconds_of_what_was_held_out(training, most):
    def held(seconds):
        t = np.arange(0.0, seconds, 5e-3)
        return Fold(trace_of(from_arrays(t, np.sin(t), np.sin(t), name=f"{seconds} s"), None), training)

    (long,) = run_in_mujoco([held(12.0), held(2.0)])
    assert long.name == "12.0 s" and long.t[-1] == pytest.approx(most, abs=0.011)
    ran = run_in_mujoco([held(0.4 * most), held(0.5 * most), held(0.4 * most)])
    assert [trace.name for trace in ran] == [f"{0.4 * most} s", f"{0.5 * most} s"]
