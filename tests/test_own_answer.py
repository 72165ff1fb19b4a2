"""A rig's own best answer, by which what is put into its records is measured."""

import numpy as np
import pytest

from ers_mj.door.own_answer import OwnAnswer
from ers_mj.door.simulating import simulate


def text_of(t, u, theta):
    rows = (f"{a:.6g},{b:.6g},{c:.10g}" for a, b, c in zip(t, u, theta, strict=True))
    return "\n".join(["t_s,u_V,theta_rad", *rows, ""])


@pytest.fixture(scope="module")
def records():
    """Two recordings of a servo that hides nothing but noise."""
    runs = [
        simulate("table1", name, rate_hz=200.0, duration=4.0, noise=2e-4, seed=7) for name in ("multisine", "steps")
    ]
    return {f"rec{k + 1}.csv": (run.t, run.u, run.theta) for k, run in enumerate(runs)}


@pytest.fixture(scope="module")
def own(records):
    return OwnAnswer({name: text_of(*columns) for name, columns in records.items()})


def test_what_is_put_into_a_rig_is_measured_by_what_its_own_answer_leaves(own, records):
    assert own.names == () and 1.6e-4 < own.error < 6e-4
    late = {name: text_of(t[8:], u[8:], theta[:-8]) for name, (t, u, theta) in records.items()}
    assert own.visibility(late) > 5.0


def test_a_play_moves_the_model_by_no_more_than_its_width(own, records):
    moved = own.moved("backlash", {"gap": 0.01})
    assert [len(m) for m in moved] == [t.size for t, _, _ in records.values()]
    assert 2e-3 < np.max(np.abs(np.concatenate(moved))) < 0.1


def test_touched_or_not_the_measure_is_one(monkeypatch):
    class Answer:
        def __init__(self, differ):
            errors = {"heldout_rmse_after_rad": 0.4, "recalibrated_rmse_after_rad": 0.1}
            self.document = {"missing": [], "record_state": differ, "fit": errors}

    own = OwnAnswer({})
    monkeypatch.setattr(own, "_diagnosed", lambda recordings, among: Answer(["gain"] if among is None else []))
    assert own.error == 0.1 and own.visibility({}) == 0.0
