"""A proof under way: its truth is sealed before the first question, answers are kept, `ers prove` tells."""

import json
import shutil
import signal

import pytest
from proofs_made import COST, SETTINGS, TASKS, answering, made

from ers_mj.cli import main
from ers_mj.errors import InputError
from ers_mj.proving import asking, conduct, sealing, world
from ers_mj.workers.held import held


@pytest.fixture
def asked(monkeypatch):
    return answering(monkeypatch)


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


# -- the command ------------------------------------------------------------------------------------------------------


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


def test_real_records_are_sought_beside_the_checkout(tmp_path, monkeypatch, capsys):
    (tmp_path / "here").mkdir()
    monkeypatch.chdir(tmp_path / "here")
    assert main(["prove", "--real", "--cases", "3"]) == 2
    assert f"{tmp_path / 'here' / '..' / 'shared' / 'data'}" in capsys.readouterr().err


def test_a_folder_with_other_files_is_refused(tmp_path, capsys):
    (tmp_path / "mine.txt").write_text("mine")
    assert main(["prove", "--cases", "1", "--out", str(tmp_path)]) == 2
    assert "holds files already" in capsys.readouterr().err
