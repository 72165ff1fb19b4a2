"""An input that never changes: nothing is named, and an input that moves is asked for."""

import numpy as np
import pytest

from ers_mj.data.prepared import trace_of
from ers_mj.data.recording import from_arrays
from ers_mj.diagnosis.pipeline import diagnose
from ers_mj.diagnosis.unexcited import is_unexcited, moving_input

T = 0.005 * np.arange(130)


def released(volts, seed):
    """A load that swings down and comes to rest under a held voltage, in whole degrees."""
    theta = 90.0 * (1 - np.exp(-4 * T) * np.cos(9 * T + seed))
    return from_arrays(T, np.full(T.size, volts), np.radians(np.round(theta)), name=f"rec{seed}.csv")


def test_only_one_level_throughout_all_recordings_is_unexcited():
    same, other = [released(5.0, 0), released(5.0, 1)], [released(5.0, 0), released(-5.0, 1)]
    assert is_unexcited(same)
    assert not is_unexcited(other)


def test_the_advice_moves_as_far_as_what_was_held():
    found = moving_input([trace_of(released(-5.0, 0), None)], "V", "rad")
    assert found["excitation"]["kind"] == "multisine"
    assert found["excitation"]["amplitude"] == pytest.approx(5.0)
    assert "up to 5 V" in found["sentence"]
    assert moving_input([trace_of(released(0.0, 0), None)], "V", "rad")["excitation"] == {}


def test_a_diagnosis_names_nothing_and_says_why():
    document = diagnose([released(5.0, 0), released(5.0, 1)], None, jobs=1).document
    assert document["missing"] == []
    assert document["verdict"] != "missing_physics"
    assert "a gain cannot be told from a load" in document["sentence"]
    assert document["parameters"]["b"]["value"] is document["parameters"]["theta_0"]["value"] is None
    faults = [fault["kind"] for fault in document["data"]["faults"]]
    assert sorted(faults) == ["constant_input", "constant_input", "converter", "converter"]
