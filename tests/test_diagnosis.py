"""The whole way on recordings with known truth: from a wrong datasheet to the right name, number and verdict."""

import json
from dataclasses import replace

import numpy as np
import pytest

from ers_mj.data.recording import from_arrays
from ers_mj.decisions.thresholds import POLICY
from ers_mj.diagnosis.pipeline import diagnose
from ers_mj.door.saving import plain
from ers_mj.plants.inputs import INPUTS
from ers_mj.plants.reduced import ReducedModel, lumped
from ers_mj.servo.datasheet import Datasheet, read_datasheet
from ers_mj.servo.model_file import write_model

T = np.arange(0.0, 3.0, 2e-3)
COARSE = T[::4]  # where the point of a test needs no more
INPUT = ("multisine", "steps")
TRUTH = {
    "a_1": 25.0,
    "a_2": 50.0,
    "b": 70.0,
    "c_1": 135.0,
    "c_2": 115.0,
    "theta_0": 0.2625,
    "tau_e": 9e-4,
    "emf_share": 0.94,
}
NOISE = 1.5e-4
ONE = replace(POLICY, most_effects=1)  # where one round of the selection tells what is tested


def recordings(effects=(), sensor=lambda y: y, t=T):
    """Recordings of a servo that is not quite Table 1's."""
    out = []
    for k, name in enumerate(INPUT):
        u = np.round(INPUTS[name](t), 4)
        y = ReducedModel(lumped(TRUTH), effects).simulate(t, u).measured
        y = sensor(y + NOISE * np.random.default_rng(k).standard_normal(t.size))
        out.append(from_arrays(t, u, y, name=f"{name}.csv"))
    return out


@pytest.fixture(scope="module")
def dead_zone():
    return diagnose(recordings([("drive_dead_zone", np.array([0.25]))]), read_datasheet("table1"), jobs=2)


def test_a_concealed_dead_zone_is_named_and_measured(dead_zone):
    document = dead_zone.document
    assert document["verdict"] == "missing_physics"
    first = document["missing"][0]
    assert first["effect"] == "drive_dead_zone" and first["subsystem"] == "drive"
    assert first["parameters"]["d"]["value"] == pytest.approx(0.25, abs=0.01)
    assert first["evidence"]["p_value"] < 0.05
    assert document["fit"]["heldout_rmse_after_rad"] < 2 * document["fit"]["noise_floor_rad"]
    assert document["where"][0]["label"] == "drive"


def test_a_report_can_show_what_a_named_effect_does(dead_zone):
    """Taken out of the model, with nothing refitted, it leaves far more in every recording."""
    for view in dead_zone.evidence.records:
        assert list(view.without) == ["drive_dead_zone"]
        left = {name: np.sqrt(np.nanmean((run - view.measured) ** 2)) for name, run in view.without.items()}
        assert left["drive_dead_zone"] > 3 * np.sqrt(np.nanmean((view.after - view.measured) ** 2))


def test_the_document_is_whole_and_is_json(dead_zone):
    keys = {
        "version",
        "verdict",
        "sentence",
        "where",
        "missing",
        "remainder",
        "record_state",
        "fit",
        "parameters",
        "next_recording",
        "data",
        "seed",
        "versions",
    }
    assert keys <= set(json.loads(json.dumps(plain(dead_zone.document), allow_nan=False)))
    assert {"a_1", "a_2", "b", "c_1", "c_2", "theta_0"} <= set(dead_zone.document["parameters"])
    assert dead_zone.document["parameters"]["J"]["value"] is None


def test_the_model_reproduces_the_recordings(dead_zone, tmp_path):
    write_model(tmp_path / "model.toml", dead_zone.model)
    back = read_datasheet(tmp_path / "model.toml")
    assert back.effects[0][0] == "drive_dead_zone"
    assert back.lumped["b"] == pytest.approx(TRUTH["b"], rel=0.02)


def test_the_answer_does_not_depend_on_the_number_of_jobs(dead_zone):
    again = diagnose(recordings([("drive_dead_zone", np.array([0.25]))]), read_datasheet("table1"), jobs=1)
    assert plain(again.document) == plain(dead_zone.document)


def test_a_servo_with_other_numbers_is_not_missing_physics():
    document = diagnose(recordings(), read_datasheet("table1")).document
    assert document["verdict"] == "parameters_only" and document["missing"] == []
    assert document["record_state"] == []


def test_what_differs_between_training_recordings_is_told():
    """A gain and a friction of another day, which no model of both recordings has."""
    t = np.arange(0.0, 3.0, 5e-3)
    first, second = recordings(t=t)
    changed = TRUTH | {"b": 1.1 * TRUTH["b"], "c_2": 0.85 * TRUTH["c_2"]}
    y = ReducedModel(lumped(changed)).simulate(t, second.u).measured
    second = replace(second, y=y + NOISE * np.random.default_rng(5).standard_normal(t.size))
    document = diagnose([first, second], read_datasheet("table1"), jobs=2).document
    states = {state["name"]: state["values"] for state in document["record_state"]}
    assert states["gain"] == pytest.approx([1.0, 1.1], abs=0.02)
    assert states["friction_level"] == pytest.approx([1.0, 0.85], abs=0.05)
    assert document["verdict"] == "parameters_only" and document["missing"] == []
    assert "gain and friction level of its own in each recording" in document["sentence"]
    assert document["fit"]["train_rmse_after_rad"] < 1.1 * NOISE
    low, high = document["parameters"]["b"]["ci95"]
    assert low < TRUTH["b"] < high < 1.2 * low


def test_a_true_datasheet_is_consistent():
    sheet = Datasheet(lumped={k: TRUTH[k] for k in ("a_1", "a_2", "b", "c_1", "c_2", "theta_0")})
    truth = {**TRUTH, "tau_e": 0.0}
    out = []
    for k, name in enumerate(INPUT):
        u = INPUTS[name](T)
        y = ReducedModel(lumped(truth)).simulate(T, u).theta + NOISE * np.random.default_rng(k).standard_normal(T.size)
        out.append(from_arrays(T, u, y, name=f"{name}.csv"))
    assert diagnose(out, sheet).document["verdict"] == "consistent"


def test_a_coarse_sensor_is_told_from_the_data():
    step = np.radians(0.6)
    document = diagnose(recordings(sensor=lambda y: np.round(y / step) * step), read_datasheet("table1")).document
    assert document["missing"][0]["effect"] == "sensor_quantisation"
    assert document["missing"][0]["parameters"]["step"]["value"] == pytest.approx(step, rel=0.01)


def test_a_stand_in_is_not_named_where_a_law_without_a_name_explains_more(dead_zone):
    """A motor whose iron saturates is no sagging supply, which takes two thirds of it; a dead zone is no form of such a
    law.
    """
    iron = recordings([("torque_saturation", np.array([0.15, 24.0]))], t=T[:1000])
    document = diagnose(iron, read_datasheet("table1"), policy=ONE).document
    assert (document["verdict"], document["missing"]) == ("unexplained", [])
    assert [s["effect"] for s in document["suspects"][:2]] == ["torque_saturation", "supply_sag"]
    assert (
        document["remainder"]["significant"]
        and "acts like a torque that is not in proportion to the current" in document["sentence"]
    )
    assert [*document["next_recording"]["checked"]["against"]] == ["supply_sag"]
    assert "suspects" not in dead_zone.document


def test_without_a_datasheet_everything_is_identified():
    document = diagnose(recordings(t=COARSE), None).document
    assert document["verdict"] != "consistent"
    assert document["parameters"]["b"]["value"] == pytest.approx(TRUTH["b"], rel=0.1)


def acting(*per_record):
    """Recordings in each of which other effects act."""
    return [recordings(effects, t=COARSE)[k] for k, effects in enumerate(per_record)]


def test_a_gust_has_a_phase_of_its_own_in_every_recording():
    gusts = [[("periodic_gust", np.array([12.0, 2.3, phase, *[np.inf] * 4]))] for phase in (0.4, 2.0)]
    document = diagnose(acting(*gusts), read_datasheet("table1"), policy=ONE).document
    first = document["missing"][0]
    assert first["effect"] == "periodic_gust" and first["evidence"]["heldout_rmse_with_rad"] is None
    assert first["parameters"]["f"]["value"] == pytest.approx(2.3, rel=0.01)
    amplitude, phases = first["parameters"]["A"]["value"], np.array(first["parameters"]["phase"]["per_recording"])
    assert np.cos(phases - [0.4, 2.0]) * np.sign(amplitude) == pytest.approx(1.0, abs=0.05)


def test_an_impulse_in_one_recording_is_found_there():
    impulse = [("load_disturbance", np.array([60.0, 1.2, 0.3, 0.0, np.inf]))]
    document = diagnose(acting([], impulse), read_datasheet("table1"), policy=ONE).document
    first = document["missing"][0]
    assert first["effect"] == "load_disturbance" and first["parameters"]["record"]["value"] == 1
    assert first["parameters"]["t_0"]["value"] == pytest.approx(1.2, abs=0.02)
    assert first["parameters"]["t_0"]["per_recording"][0] is None


@pytest.mark.parametrize("count, length, leap", [(12, 1, 0.03), (6, 20, None)], ids=["spikes", "holds"])
def test_dropouts_are_found_in_the_data_and_left_out(count, length, leap):
    def sensor(y):
        y, random = y.copy(), np.random.default_rng(int(1e6 * y[-1]) % 1000)
        for k in random.choice(np.arange(50, y.size - 50), count, replace=False):
            y[k : k + length] = y[k] + leap if leap else y[k - 1]
        return y

    document = diagnose(recordings(sensor=sensor), read_datasheet("table1")).document
    assert [m["effect"] for m in document["missing"]] == ["sensor_dropout"]
    assert document["fit"]["heldout_rmse_before_rad"] < 3 * NOISE
