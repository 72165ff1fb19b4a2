"""The proof: its generator knows nothing of the library, MuJoCo's recorder agrees with the quick simulator, seals hold,
scores are right.
"""

import ast
import json
import shutil
import signal
import sys
from pathlib import Path

import numpy as np
import pytest

from ers_mj.cli import main
from ers_mj.door.saving import plain
from ers_mj.effects import EFFECTS
from ers_mj.errors import InputError
from ers_mj.plants.inputs import INPUTS
from ers_mj.plants.mechanical import MechanicalPlant
from ers_mj.plants.play import MOTOR_SHARE
from ers_mj.plants.reduced import lumped
from ers_mj.proving import asking, case, conduct, plans, quick, real, recorder, scoring, sealing, world
from ers_mj.proving.catalogue import CATALOGUE, LISTED
from ers_mj.proving.forms import TEXTBOOK, draw_shape
from ers_mj.proving.parameters import covered
from ers_mj.proving.plant import TABLE_1
from ers_mj.proving.sampling import Setup
from ers_mj.proving.strength import nearest
from ers_mj.report import proof_report
from ers_mj.servo.datasheet import read_datasheet
from ers_mj.workers.base import Task
from ers_mj.workers.held import held

PACKAGE = Path(__file__).resolve().parents[1] / "ers_mj"
T = np.arange(0.0, 2.0, 1e-3)
CONTEXT = {
    "params": TABLE_1,
    "travel": (-0.2, 0.25),
    "records": 1,
    "durations": [2.0],
    "peak_V": 9.0,
    "umax_V": 14.0,
    "peak_A": 2.0,
}


def rms_deg(x):
    return float(np.degrees(np.sqrt(np.mean(np.square(x)))))


# -- the generator ---------------------------------------------------------------------------------------------


def imported(path):
    """Files of ers_mj that a file imports, at its top or anywhere in it."""
    modules = set()
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.ImportFrom) and node.module and node.module.startswith("ers_mj"):
            modules |= {node.module, *(f"{node.module}.{alias.name}" for alias in node.names)}
        elif isinstance(node, ast.ImportFrom) and node.level:
            base = ".".join(
                ["ers_mj", *path.relative_to(PACKAGE).parts[:-1]][
                    : len(path.relative_to(PACKAGE).parts) + 1 - node.level
                ]
            )
            modules |= {f"{base}.{node.module}" if node.module else f"{base}.{alias.name}" for alias in node.names}
        elif isinstance(node, ast.Import):
            modules |= {alias.name for alias in node.names if alias.name.startswith("ers_mj")}
    every = {".".join(m.split(".")[:k]) for m in modules for k in range(2, len(m.split(".")) + 1)}
    paths = [PACKAGE.joinpath(*m.split(".")[1:]) for m in every]
    return {p for q in paths for p in (q.with_suffix(".py"), q / "__init__.py") if p.is_file()}


def test_the_generator_knows_nothing_of_the_effects_folder():
    seen, todo = set(), set((PACKAGE / "proving").rglob("*.py"))
    while todo:
        path = todo.pop()
        seen.add(path)
        todo |= imported(path) - seen
    rooms = {p.relative_to(PACKAGE).parts[0].removesuffix(".py") for p in seen}
    assert rooms <= {"proving", "processes", "plants", "errors", "data", "workers", "__init__"}
    assert {p.name for p in seen if p.parent.name == "data"} <= {"__init__.py", "tables.py", "whole.py"}
    assert {p.name for p in seen if p.parent.name == "plants"} == {"__init__.py", "mjcf.py"}


def test_effects_are_those_of_the_contract_and_their_subsystems_are_right():
    named = [e for e in EFFECTS if e.named and not e.only_in_loop]  # no rudder has a position loop
    assert {e.name for e in named} == set(LISTED)
    assert {e.name: e.subsystem for e in named} == {e.name: scoring.subsystem_of(e.name) for e in named}


@pytest.mark.parametrize("name", sorted(TEXTBOOK))
def test_forms_are_not_the_librarys(name):
    rng = np.random.default_rng(0)
    assert not any(TEXTBOOK[name](draw_shape(rng, CATALOGUE[name], CONTEXT)) for _ in range(20))


def test_kinds_come_in_their_shares_and_the_seed_decides():
    drawn = case.plans(40, 5)
    assert [sum(p.kind == kind for p in drawn) for kind in plans.KINDS] == [10, 20, 6, 4]
    assert drawn == case.plans(40, 5) != case.plans(40, 6)
    assert all((len(p.labels) > 1) == (p.kind == "several") for p in drawn)
    assert case.shares(4) == {"null": 1, "single": 2, "several": 1, "outside": 0}


def test_strengths_are_found_by_secants():
    found, size = nearest(lambda s: 3.0 * np.exp(1.7 * s), 12.0, -1.0, -6.0, 4.0, 7)
    assert size == pytest.approx(3.0 * np.exp(1.7 * found)) == pytest.approx(12.0, rel=0.17)


# -- MuJoCo against the quick simulator ------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["multisine", "chirp", "ramp", "steps", "square"])
def test_without_effects_both_simulators_agree(name):
    u = INPUTS[name](T)
    truth = quick.simulate(TABLE_1, [], T, u).true
    assert rms_deg(recorder.record(TABLE_1, [], T, u, step=2.5e-5).true - truth) < 0.002


@pytest.mark.parametrize(
    "name",
    [
        "asymmetric_friction",
        "backlash",
        "cogging",
        "current_limit",
        "end_stop",
        "gravity_imbalance",
        "input_delay",
        "load_dependent_friction",
        "sensor_lag",
        "shaft_compliance",
        "stribeck",
        "supply_sag",
        "thermal_drift",
        "variable_ratio",
        "second_resonance",
        "friction_ageing",
        "viscoelastic_spring",
    ],
)
def test_with_an_effect_both_simulators_agree(name):
    rng, u = np.random.default_rng(5), INPUTS["multisine"](T)
    shape = draw_shape(rng, CATALOGUE[name], CONTEXT)
    shape = shape | {"form": "Hunt-Crossley"} if name in ("backlash", "end_stop") else shape
    effect = {"label": name, "strength": float(np.sqrt(CATALOGUE[name].low * CATALOGUE[name].high)), "shape": shape}
    bare, truth = quick.simulate(TABLE_1, [], T, u).clean, quick.simulate(TABLE_1, [effect], T, u).clean
    apart, size = rms_deg(recorder.record(TABLE_1, [effect], T, u, step=2.5e-5).clean - truth), rms_deg(truth - bare)
    assert apart < max(0.002, 0.01 * size)


def test_a_loop_is_closed_round_the_measured_angle():
    rng = np.random.default_rng(4)
    controller = {
        "KP": 25.0,
        "KI": 40.0,
        "KD": 0.3,
        "TF": 0.006,
        "UMAX": 14.0,
        "FF_ON": 0.0,
        "FF_C": 0.0,
        "FF_TLH": 0.0,
        "FF_KS": 0.0,
        "FF_TH0": 0.0,
    }
    setup = Setup(
        noise=1e-4 * rng.standard_normal(T.size),
        controller=controller,
        theta_ref=0.26 + 0.2 * np.sin(4 * T),
        decimals=4,
    )
    truth, ours = (
        quick.simulate(TABLE_1, [], T, None, setup=setup),
        recorder.record(TABLE_1, [], T, None, setup=setup, step=2.5e-5),
    )
    assert rms_deg(ours.true - truth.true) < 0.01
    assert np.abs(ours.u).max() <= 14.0


def test_the_rod_is_the_packages_rod():
    u, sheet = INPUTS["multisine"](T), read_datasheet("table1")
    theirs = MechanicalPlant(lumped(sheet.to_lumped()), parameters=sheet.parameters, linkage="rod").simulate(T, u).theta
    ours = recorder.record({**TABLE_1, "motor_inertia_share": MOTOR_SHARE}, [], T, u, step=2.5e-5, linkage="rod").true
    constant = recorder.record(TABLE_1, [], T, u, step=2.5e-5).true
    assert rms_deg(ours - theirs) < 0.02 < 0.2 < rms_deg(ours - constant)


# -- sealing and asking ----------------------------------------------------------------------------------------


def made(name, seed):
    return {"rec1.csv": f"t_s,u_V\n{seed}\n", "datasheet.toml": ""}, {
        "case": name,
        "kind": "null",
        "labels": [],
        "effects": [],
        "visibility_after_refit_sigma": 0.0,
        "seed": seed,
    }


TASKS = [Task(f"case-{k:03d}", made, (f"case-{k:03d}", k)) for k in (1, 2, 3)]
SETTINGS = {"kind": "simulated", "seed": 1, "cases": 3}
COST = {"exit": 0, "wall_s": 2.0, "cpu_s": 1.0, "peak_MiB": 100.0}


@pytest.fixture
def asked(monkeypatch):
    """Names of the files that each diagnosis is handed, its answer a stub."""
    seen = []

    def stub(self, folder):
        seen.append(sorted(p.name for p in folder.iterdir()))
        return dict(COST), json.dumps({"verdict": "consistent", "missing": []}), ""

    monkeypatch.setattr(asking.Asker, "run", stub)
    return seen


def test_the_truth_is_sealed_before_the_first_question(tmp_path, asked):
    told = []

    def tell(line):
        told.append((line, len(asked)))

    proof = conduct.conduct(tmp_path / "p", TASKS, SETTINGS, tell=tell)
    sealed = (tmp_path / "p" / "sealed" / "truth.json").read_bytes()
    assert told == [(f"the truth of 3 cases is sealed, sha256 {sealing.hash_of(sealed)}", 0)]
    assert asked == [["datasheet.toml", "rec1.csv"]] * 3
    assert proof.sha256 == sealing.hash_of(sealed) and set(proof.truths) == set(proof.answers) == {
        task.name for task in TASKS
    }


def test_a_second_run_keeps_what_is_there(tmp_path, asked):
    conduct.conduct(tmp_path / "p", TASKS, SETTINGS)
    (tmp_path / "p" / "answers" / "case-002.json").unlink()
    (tmp_path / "p" / "case-003" / "rec1.csv").write_text("touched")
    again = conduct.conduct(tmp_path / "p", TASKS, SETTINGS)
    assert len(asked) == 4  # case 3 is made anew as it was, its answer stands
    assert again.truths["case-003"]["files_sha256"] == sealing.hashes(tmp_path / "p" / "case-003")


def test_answers_that_were_taken_away_are_asked_anew(tmp_path, asked):
    conduct.conduct(tmp_path / "p", TASKS, SETTINGS)
    shutil.rmtree(tmp_path / "p" / "answers")
    conduct.conduct(tmp_path / "p", TASKS, SETTINGS)
    assert len(asked) == 6


def test_answers_of_other_code_are_asked_anew(tmp_path, asked, monkeypatch):
    conduct.conduct(tmp_path / "p", TASKS, SETTINGS)
    monkeypatch.setattr(conduct, "hash_of_diagnosis", lambda: "other")
    conduct.conduct(tmp_path / "p", TASKS, SETTINGS)
    assert len(asked) == 6


def test_a_touched_truth_is_refused(tmp_path, asked):
    proof = conduct.conduct(tmp_path / "p", TASKS, SETTINGS)
    (tmp_path / "p" / "sealed" / "truth.json").write_text("{}")
    with pytest.raises(InputError, match="changed after its hash"):
        sealing.opened(tmp_path / "p", proof.sha256)


def test_another_proof_in_the_folder_is_refused_and_forced(tmp_path, asked):
    conduct.conduct(tmp_path / "p", TASKS, SETTINGS)
    with pytest.raises(InputError, match="holds a proof with seed 1"):
        conduct.conduct(tmp_path / "p", TASKS, SETTINGS | {"seed": 2})
    conduct.conduct(tmp_path / "p", TASKS[:2], SETTINGS | {"cases": 2}, force=True)
    assert not (tmp_path / "p" / "case-003").exists()


def test_a_folder_in_which_another_run_is_at_work_is_refused(tmp_path, asked):
    with held(tmp_path / "p", "ers prove"), pytest.raises(InputError, match="another `ers prove` is at work"):
        conduct.conduct(tmp_path / "p", TASKS, SETTINGS)
    assert not any((tmp_path / "p").iterdir())
    conduct.conduct(tmp_path / "p", TASKS, SETTINGS)  # let go of, it is free again


def test_a_stopped_proof_keeps_its_answers(tmp_path, monkeypatch):
    calls = []

    def stub(self, folder):
        calls.append(1)
        if len(calls) == 2:
            raise KeyboardInterrupt
        return dict(COST), "{}", ""

    monkeypatch.setattr(asking.Asker, "run", stub)
    with pytest.raises(KeyboardInterrupt):
        conduct.conduct(tmp_path / "p", TASKS, SETTINGS)
    assert len(list((tmp_path / "p" / "answers").glob("*.json"))) >= 1
    conduct.conduct(tmp_path / "p", TASKS, SETTINGS)
    assert len(list((tmp_path / "p" / "answers").glob("*.json"))) == 3


@pytest.mark.parametrize(
    ("exit_code", "cpu", "text", "error"),
    [
        (2, 1.0, "", "ers: rec1.csv: is bad"),
        (-signal.SIGXCPU, 300.0, "", "no answer within 300 s"),
        (0, 1.0, "{", "its answer is no JSON"),
    ],
)
def test_failures_are_answers_without_a_document(tmp_path, monkeypatch, exit_code, cpu, text, error):
    monkeypatch.setattr(
        asking.Asker,
        "run",
        lambda self, folder: ({**COST, "exit": exit_code, "cpu_s": cpu}, text, "ers: rec1.csv: is bad\n"),
    )
    (tmp_path / "rec1.csv").write_text("x")
    answer = asking.Asker("code").ask(tmp_path)
    assert (answer["document"], answer["error"]) == (None, error)


def test_a_real_child_fails_in_one_sentence(tmp_path):
    (tmp_path / "rec1.csv").write_text("t_s,u_V\n0,1\n")
    answer = asking.Asker("code").ask(tmp_path)
    assert answer["exit"] == 2 and answer["error"].startswith("ers: rec1.csv") and answer["cpu_s"] > 0


# -- scores ----------------------------------------------------------------------------------------------------


def truth_and_answer(
    kind,
    labels,
    named,
    visibility=10.0,
    significant=False,
    verdict="missing_physics",
    where="load",
    alternatives=(),
    each=None,
):
    truth = {
        "case": "case-001",
        "kind": kind,
        "labels": labels,
        "visibility_after_refit_sigma": visibility,
        "linkage": "constant",
        "effects": [
            {"label": label, "strength": None, "shape": {}, "quick_visibility_sigma": sigma}
            for label, sigma in (each or {}).items()
        ],
    }
    missing = [
        {"effect": n, "alternatives": [dict(zip(("effect", "probability"), a)) for a in alternatives]} for n in named
    ]
    document = {
        "verdict": verdict,
        "missing": missing,
        "remainder": {"significant": significant},
        "where": [{"axis": "subsystem", "label": where}],
        "fit": {"heldout_rmse_after_rad": 2.0, "noise_floor_rad": 1.0},
    }
    return truth, {**COST, "error": None, "document": document}


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


# -- real recordings -------------------------------------------------------------------------------------------


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


def test_every_rig_is_diagnosed_as_it_is_first():
    plans = real.plans(18, 1)
    assert [(p.rig, p.label) for p in plans[:3]] == [(rig, None) for rig in real.RIGS] and {
        (p.rig, p.label) for p in plans
    } == set(real.COVERAGE)


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


# -- the command -----------------------------------------------------------------------------------------------


def test_the_command_prints_the_contracts_keys(tmp_path, asked, monkeypatch, capsys):
    monkeypatch.setattr(
        world,
        "make",
        lambda plan, seed: (
            {"rec1.csv": "x"},
            {
                **made(f"case-{plan.index + 1:03d}", seed)[1],
                "family": plan.family,
                "kind": plan.kind,
                "labels": list(plan.labels),
            },
        ),
    )
    assert main(["prove", "--cases", "8", "--json", "--jobs", "1"]) == 0
    printed = json.loads(capsys.readouterr().out)
    assert {
        "cases",
        "counts",
        "top1",
        "top1_class",
        "top1_class_visible",
        "false_alarm_rate",
        "pair_recall",
        "pair_spurious",
        "unexplained_recall",
        "false_flag_rate",
        "subsystem_recall",
        "confusion",
        "exact",
        "coverage",
    } <= set(printed)
    assert list(printed["families"]) == list(world.NAMES)
    assert all(part["cases"] == 1 and "exact" in part for part in printed["families"].values())
    rudders = ["prove", "--families", "rudder", "--cases", "8", "--jobs", "1", "--out", str(tmp_path / "p")]
    assert main(rudders) == 0
    lines = capsys.readouterr().out.splitlines()
    assert {
        "concealed -> named first",
        "a pair of effects: median 1.0 s, at most 1.0 s",
        "memory of a case: at most 100 MiB",
    } <= set(lines)
    assert {"results.json", "report.html", "summary.txt"} <= {p.name for p in (tmp_path / "p").iterdir()}


@pytest.mark.parametrize(
    ("argv", "sentence"),
    [
        (["--cases", "0"], "0 is not between 1"),
        (["--cases", "two"], "is not a whole number"),
        (["--limit", "1"], "is not above 1"),
        (["--families", "screw,rotor"], "'rotor' is no family, there are rudder"),
        (["--real", "nowhere"], "there is no such file"),
        (["--out", ""], "--out is empty"),
    ],
)
def test_bad_input_is_one_sentence(argv, sentence, capsys):
    assert main(["prove", *argv]) == 2
    told = capsys.readouterr().err
    assert sentence in told and told.count("\n") == 1


def test_a_folder_with_other_files_is_refused(tmp_path, capsys):
    (tmp_path / "mine.txt").write_text("mine")
    assert main(["prove", "--cases", "1", "--out", str(tmp_path)]) == 2
    assert "holds files already" in capsys.readouterr().err
