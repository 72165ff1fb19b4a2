"""Cases for others: no truth among them, altered and missing ones found out, anybody's answers scored as ours."""

import json

import pytest
from stub_tasks import made_case

from ers_mj.cli import main
from ers_mj.errors import InputError
from ers_mj.proving import world
from ers_mj.proving.contest import answered, export, refuse_places
from ers_mj.proving.sealing import hash_of
from ers_mj.workers.base import Task
from ers_mj.workers.here import Here

KINDS = {"case-001": ("null", []), "case-002": ("single", ["backlash"]), "case-003": ("outside", ["brush_drop"])}


def one(name, seed):
    files, truth = made_case(name, seed)
    return files, truth | {"kind": KINDS[name][0], "labels": KINDS[name][1]}


@pytest.fixture
def handed(tmp_path):
    tasks = [Task(name, one, (name, k)) for k, name in enumerate(KINDS)]
    settings = {"kind": "simulated", "seed": 7}
    export(tmp_path / "cases", tmp_path / "cases.truth.json", tasks, settings, Here(1), lambda *_: None)
    return tmp_path


def answer(folder, name, effects=(), flat=False, significant=False, sha256=None):
    own = hash_of((folder / "cases" / name / "rec1.csv").read_bytes())
    document = {
        "verdict": "missing_physics" if effects else "consistent",
        "missing": [{"effect": effect} for effect in effects],
        "remainder": {"significant": significant},
        "data": {"sha256": [own] if sha256 is None else sha256},
    }
    place = folder / "answers" / (f"{name}.json" if flat else f"{name}/diagnosis.json")
    place.parent.mkdir(parents=True, exist_ok=True)
    place.write_text(json.dumps(document))


def test_no_truth_lies_among_the_cases(handed):
    written = {p.relative_to(handed / "cases").as_posix(): p.read_text() for p in (handed / "cases").rglob("*.*")}
    assert {"cases.json", "servos.csv", "case-001/rec1.csv", "case-003/datasheet.toml"} <= set(written)
    for text in written.values():
        assert not any(word in text for word in ("backlash", "brush", "null", '"seed"', "labels"))
    listed = json.loads(written["cases.json"])
    assert listed["truth_sha256"] == json.loads((handed / "cases.truth.json").read_text())["truth_sha256"]
    assert listed["cases"]["case-002"]["rec1.csv"] == hash_of((handed / "cases/case-002/rec1.csv").read_bytes())


def test_the_cases_are_a_manifest_of_batch(handed):
    from ers_mj.fleet.manifest import read_manifest

    servos = read_manifest(str(handed / "cases" / "servos.csv"))
    assert [s.name for s in servos] == list(KINDS) and servos[0].path(servos[0].datasheet).is_file()


def test_answers_are_scored_by_the_same_rules(handed, capsys):
    answer(handed, "case-001")
    answer(handed, "case-002", ["backlash"], flat=True)
    answer(handed, "case-003", significant=True)
    argv = ["prove", "--score", str(handed / "answers"), "--truth", str(handed / "cases.truth.json"), "--json"]
    assert main(argv) == 0
    printed = capsys.readouterr()
    found = json.loads(printed.out)
    assert (found["top1"], found["false_alarm_rate"], found["unexplained_recall"]) == (1.0, 0.0, 1.0)
    assert found["problems"] == [] and printed.err == "" and found["seed"] == 7
    assert main([*argv[:-1], "--out", str(handed / "out")]) == 0
    assert {"results.json", "report.html", "summary.txt"} == {p.name for p in (handed / "out").iterdir()}


def test_missing_and_altered_ones_are_said_and_wrong(handed, capsys):
    answer(handed, "case-001", sha256=["0" * 64])
    answer(handed, "case-002", ["backlash"])
    (handed / "answers" / "case-002" / "rec1.csv").write_text("another")
    (handed / "answers" / "case-009.json").write_text("{}")
    assert main(["prove", "--score", str(handed / "answers"), "--truth", str(handed / "cases.truth.json")]) == 1
    said = capsys.readouterr().err
    assert "case-001: altered: it rests on recordings that were not handed out" in said
    assert "case-002: altered: rec1.csv beside the answer is not what was handed out" in said
    assert "case-003: no answer was given" in said and "case-009: is none of the cases" in said
    found = answered(handed / "answers", handed / "cases.truth.json")
    assert [row["verdict"] for row in found.rows] == ["no answer"] * 3 and found.altered == 2


@pytest.mark.parametrize("text", ["{", "[]", '{"missing": [{}]}', '{"missing": 3}', '{"missing": ["backlash"]}'])
def test_an_answer_of_another_layout_is_none(handed, text):
    answer(handed, "case-001")
    (handed / "answers" / "case-002.json").write_text(text)
    found = answered(handed / "answers", handed / "cases.truth.json")
    assert found.rows[1]["verdict"] == "no answer" and any(line.startswith("case-002: ") for line in found.told)


def test_an_answer_that_does_not_say_its_recordings_is_taken_and_said(handed):
    answer(handed, "case-002", ["backlash"], sha256=[])
    found = answered(handed / "answers", handed / "cases.truth.json")
    assert found.rows[1]["named"] == ["backlash"] and "case-002: does not say which" in found.told[1]


def test_a_changed_truth_is_refused(handed):
    answer(handed, "case-001")
    sealed = handed / "cases.truth.json"
    sealed.write_text(sealed.read_text().replace("backlash", "stribeck"))
    with pytest.raises(InputError, match="the sealed truth was changed"):
        answered(handed / "answers", sealed)


def test_places_that_give_it_away_are_refused(handed):
    for sealed, said in (("cases/truth.json", "expected elsewhere"), ("cases.truth.json", "is there already")):
        with pytest.raises(InputError, match=said):
            refuse_places(handed / "cases", handed / sealed, force=False)


@pytest.mark.parametrize(
    ("argv", "said"),
    [
        (["--score", "answers"], "--score needs the truth"),
        (["--truth", "x"], "neither was given"),
        (["--export", "a", "--score", "b", "--truth", "c"], "one of them was expected"),
        (["--export", ""], "--export is empty"),
        (["--score", "nowhere", "--truth", "cases.truth.json"], "nowhere: is no folder"),
        (["--score", ".", "--truth", "nowhere"], "nowhere: cannot be read"),
        (["--score", ".", "--truth", "cases/servos.csv"], "is no sealed truth"),
        (["--score", "cases", "--truth", "cases.truth.json"], "holds no answer to any of the 3 cases"),
    ],
)
def test_what_does_not_go_together_is_one_sentence(handed, argv, said, monkeypatch, capsys):
    monkeypatch.chdir(handed)
    assert main(["prove", *argv]) == 2
    told = capsys.readouterr().err
    assert said in told and told.count("\n") == 1


def test_without_a_seed_nobody_can_draw_the_cases_again(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(world, "make", lambda plan, seed: made_case(f"case-{plan.index + 1:03d}", seed))
    drawn = []
    for name in ("a", "b"):
        assert main(["prove", "--cases", "2", "--export", str(tmp_path / name), "--jobs", "1", "--json"]) == 0
        told = json.loads(capsys.readouterr().out)
        drawn.append(json.loads((tmp_path / f"{name}.truth.json").read_text())["seed"])
        assert told["truth_sha256"] and told["cases"] == 2
    assert drawn[0] != drawn[1]
