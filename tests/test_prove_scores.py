"""What a proof counts: its scores, and what is concealed in real recordings."""

import json
import sys
from pathlib import Path

import numpy as np
import pytest
from proofs_made import COST, truth_and_answer

from ers_mj.door.saving import plain
from ers_mj.proving import real, scoring
from ers_mj.proving.parameters import covered
from ers_mj.proving.plant import TABLE_1
from ers_mj.report import proof_report


def test_shares_are_those_of_the_contract():
    cases = [
        truth_and_answer("null", [], [], verdict="consistent"),
        truth_and_answer("null", [], ["stribeck"], significant=True),
        truth_and_answer("single", ["stribeck"], ["stribeck", "backlash"], alternatives=[("presliding", 0.25)]),
        truth_and_answer("single", ["bias_torque"], ["asymmetric_friction"], visibility=0.6),
        truth_and_answer("single", ["backlash"], [], verdict="unexplained", significant=True, where="transmission"),
        truth_and_answer(
            "several",
            ["cogging", "stribeck"],
            ["transmission_ripple", "end_stop"],
            each={"cogging": 3.0, "stribeck": 0.4},
        ),
        truth_and_answer("outside", ["second_resonance"], [], significant=True, verdict="unexplained"),
        truth_and_answer("outside", ["brush_drop"], ["stribeck"]),
    ]
    results = scoring.scored([scoring.row_of(*pair) for pair in cases])
    assert results["counts"] == {"null": 2, "single": 3, "several": 1, "outside": 2}
    assert {
        k: results["of"][k]
        for k in (
            "top1",
            "top1_class",
            "top1_class_visible",
            "false_alarm_rate",
            "pair_recall",
            "pair_spurious",
            "unexplained_recall",
            "false_flag_rate",
            "subsystem_recall",
        )
    } == {
        "top1": [1, 3],
        "top1_class": [2, 3],
        "top1_class_visible": [1, 2],
        "false_alarm_rate": [1, 2],
        "pair_recall": [1, 2],
        "pair_spurious": [1, 2],
        "unexplained_recall": [1, 2],
        "false_flag_rate": [2, 6],
        "subsystem_recall": [3, 3],
    }
    assert results["of"]["pair_recall_visible"] == [1, 1]
    assert results["confusion"]["backlash"] == {"unexplained": 1} and results["confusion"]["nothing"] == {
        "nothing": 1,
        "stribeck": 1,
    }
    assert sum(b["of"] for b in results["reliability"]) == 6 and results["error_over_floor"]["median"] == 2.0


def test_proofs_of_several_seeds_are_pooled(tmp_path, capsys):
    """The pooled shares are those of all cases together; a proof given twice, or none, is one sentence."""
    sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "analysis"))
    pooling = pytest.importorskip("pool_proofs", reason="analysis/ is not beside the tests")
    told = {
        41: [
            truth_and_answer("null", [], []),
            truth_and_answer("several", ["cogging", "stribeck"], ["cogging"], each={"cogging": 8.0, "stribeck": 0.6}),
        ],
        42: [
            truth_and_answer("single", ["cogging"], ["cogging"]),
            truth_and_answer("single", ["cogging"], ["stribeck"]),
            truth_and_answer("outside", ["running_in"], [], verdict="unexplained", significant=True),
            truth_and_answer("outside", ["brush_drop"], ["stribeck"]),
        ],
    }
    for seed, pairs in told.items():
        (tmp_path / str(seed)).mkdir()
        (tmp_path / str(seed) / "results.json").write_text(
            json.dumps(plain({"seed": seed, "rows": [scoring.row_of(*pair) for pair in pairs]}))
        )
    folders = [str(tmp_path / str(seed)) for seed in told]
    assert pooling.main(folders) == 0
    lines = {line[:58].strip(): line[58:].split() for line in capsys.readouterr().out.splitlines()}
    assert lines["single effects named right, by class"][:3] == ["1", "of", "2"]
    assert lines["effects found, of several at once"][:3] == ["1", "of", "2"]
    assert lines["null cases with a named effect"][:3] == ["0", "of", "1"]
    assert (
        "6 cases of seeds 41 (2 cases), 42 (4 cases)" in lines
        and "0 to 1                0 of 1" in lines
        and "memory of a case: at most 100 MiB" in lines
    )
    assert {"kinds with a suspect's law     1 of 1", "kinds without                  0 of 1"} <= set(lines)
    for bad, word in (([folders[0]] * 2, "twice"), ([str(tmp_path)], "results.json")):
        assert pooling.main(bad) == 2
        assert word in capsys.readouterr().err


def test_a_failed_case_is_wrong_and_counted():
    truth, _ = truth_and_answer("single", ["backlash"], [])
    results = scoring.scored([scoring.row_of(truth, {**COST, "error": "no answer within 300 s", "document": None})])
    assert (
        results["top1"] == 0
        and results["confusion"] == {"backlash": {"no answer": 1}}
        and results["failures"] == ["case-001: no answer within 300 s"]
    )


def test_without_cases_of_a_kind_its_share_is_null():
    results = scoring.scored([scoring.row_of(*truth_and_answer("null", [], []))])
    assert results["top1"] is None and results["false_alarm_rate"] == 0


def test_parameters_are_compared_where_they_mean_one_thing():
    effects = [{"label": "backlash", "strength": 1.0, "shape": {}}, {"label": "stribeck", "strength": 1.0, "shape": {}}]
    truth = {"linkage": "constant", "lumped": {"b": 80.0}, "effects": effects, "true_parameters": {**TABLE_1}}
    half = np.radians(0.5)
    document = {
        "parameters": {"b": {"value": 81.0, "ci95": [79.0, 83.0]}},
        "missing": [
            {"effect": "backlash", "parameters": {"gap": {"value": 1.2 * half, "ci95": [1.1 * half, 1.3 * half]}}},
            {"effect": "stribeck", "parameters": {"dF_s": {"value": 1.0, "ci95": [0.0, 2.0]}}},
        ],
    }
    entries = {e["name"]: (e["inside"], e["relative_error"]) for e in covered(truth, document)}
    assert entries == {"b": (True, pytest.approx(1 / 80)), "backlash gap": (False, pytest.approx(0.2))}


# -- real recordings --------------------------------------------------------------------------------------------------


def test_what_is_concealed_in_a_record():
    rng, t = np.random.default_rng(0), np.arange(300) * 0.01
    record = {"t_s": t, "u_V": np.sin(t), "theta_rad": np.sin(t - 0.1)}
    late, _ = real.conceal(rng, record, "input_delay", 0.05, "u_V", "theta_rad")
    assert np.allclose(late["u_V"], np.sin(late["t_s"] + 0.05)) and np.allclose(
        late["theta_rad"], np.sin(late["t_s"] - 0.1)
    )
    lagged, _ = real.conceal(rng, record | {"theta_rad": t.copy()}, "sensor_lag", 0.05, "u_V", "theta_rad")
    assert lagged["theta_rad"][-1] == pytest.approx(t[-1] - 0.05)
    held, _ = real.conceal(rng, record, "sensor_dropout", 0.2, "u_V", "theta_rad")
    assert 5 < np.sum(np.diff(held["theta_rad"]) == 0.0)
    biased, moved = real.conceal(rng, record, "bias_torque", 0.3, "u_V", "theta_rad")
    assert np.allclose(biased["u_V"], record["u_V"] - 0.3) and not moved.any()


def test_what_acts_ahead_of_a_converter_is_read_by_it_again():
    t, step = np.arange(2000) * 0.01, 0.003
    record = {"t_s": t, "u_V": np.sin(t), "theta_rad": 0.1 + step * np.round(np.sin(t) / step)}
    lagged, _ = real.conceal(np.random.default_rng(0), record, "sensor_lag", 0.05, "u_V", "theta_rad")
    codes = (lagged["theta_rad"] - record["theta_rad"][0]) / step
    assert np.allclose(codes, np.round(codes)) and np.allclose(
        lagged["theta_rad"][100:], 0.1 + np.sin(t[100:] - 0.05), atol=1.1 * step
    )


def test_every_rig_is_diagnosed_as_it_is_first():
    plans = real.plans(len(real.COVERAGE), 1)
    assert [(p.rig, p.label) for p in plans[:3]] == [(rig, None) for rig in real.RIGS] and {
        (p.rig, p.label) for p in plans
    } == set(real.COVERAGE)


class Gentle:
    """A rig whose own model a play moves by a tenth of its half-width, and which leaves 0.1."""

    error = 0.1

    def visibility(self, touched):
        return 4.0

    def moved(self, effect, values):
        assert effect == "backlash"
        return [np.full(300, 0.1 * values["gap"])]


def test_what_is_half_simulated_moves_a_record_by_a_share_of_its_travel(monkeypatch, tmp_path):
    t = np.arange(300) * 0.01
    record = {"t_s": t, "u_V": np.sin(t), "theta_rad": np.sin(t)}
    monkeypatch.setattr(real, "_records", lambda *_: [record])
    plan = real.RealPlan(4, "sts3215", "backlash")
    files, truth = real.make(plan, tmp_path, 3, lambda rig: Gentle())
    moved = np.loadtxt(files["rec1.csv"].splitlines(), delimiter=",", skiprows=1)[:, 2] - record["theta_rad"]
    assert np.allclose(moved, 0.1 * truth["effects"][0]["strength"], atol=1e-9)
    assert 0.5 * real.HALVES.share[0] < truth["size"] / np.ptp(record["theta_rad"]) < 1.5 * real.HALVES.share[1]
    assert truth["kind"] == real.PARTLY and truth["visibility_after_refit_sigma"] == 4.0
    untouched, alone = real.make(real.RealPlan(0, "sts3215", None), tmp_path, 3, None)
    assert alone["kind"] == real.UNTOUCHED and untouched == real.files_of("sts3215", tmp_path, 3)


def test_first_or_second_counts_without_the_rig_s_own_names():
    rows = []
    for kind, labels, named, left in (
        ("untouched", [], ["end_stop", "asymmetric_friction"], None),
        ("single", ["input_delay"], ["end_stop", "asymmetric_friction", "stribeck", "sensor_lag"], 3.5),
        ("single", ["backlash"], ["stribeck", "presliding", "backlash"], 8.0),
        ("single", ["sensor_dropout"], [], 0.5),
        (real.PARTLY, ["voltage_saturation"], ["current_limit"], 5.0),
    ):
        truth, answer = truth_and_answer(kind, labels, named)
        truth |= {"rig": "throttle", "visibility_after_refit_sigma": left}
        rows.append(
            scoring.row_of(
                truth | {"effects": [{"label": x, "strength": 0.1, "shape": {"form": ""}} for x in labels]}, answer
            )
        )
    results = real.scored_real(rows)
    assert results["foremost_visible"] == (1, 2) and results["foremost_visible_half_simulated"] == (1, 1)
    assert (
        results["accuracy"] == []
        and results["counts"]["single"] == 3
        and [x["concealed"] for x in results["half_simulated"]] == ["voltage_saturation"]
    )
    page = proof_report.proof_page(results | {"failures": []}, rows, {})
    assert "named first or second, the rig&#x27;s own set aside, in 1 of 2" in page.replace("'", "&#x27;")
    assert "named right" not in page  # which counts first names, where the rig's own stand


def test_a_rig_as_it_is_raises_no_false_alarm():
    rows = []
    for kind, labels, named in (
        ("untouched", [], ["end_stop"]),
        ("single", ["input_delay"], ["end_stop", "sensor_lag"]),
        ("single", ["bias_torque"], []),
    ):
        truth, answer = truth_and_answer(kind, labels, named)
        rows.append(scoring.row_of({**truth, "rig": "throttle", "visibility_after_refit_sigma": None}, answer))
    results = real.scored_real(rows)
    assert (results["found"], results["false_alarm_rate"], results["counts"]["null"], results["cases"]) == (
        0.5,
        None,
        0,
        3,
    )
    assert results["own"] == {"throttle": ["end_stop"]} and results["concealed_in_real"][0]["others"] == []
    told = proof_report.table_of(results)
    assert not any("single effects" in what for what, _, _ in told)  # the rig's own come first
    assert proof_report.headline(results).startswith("1 of 2 effects concealed in real recordings are found again")
