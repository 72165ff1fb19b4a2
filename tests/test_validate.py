"""The reduced model against MuJoCo: the bars, what the sentences say, the command."""

import json
from dataclasses import replace

import numpy as np
import pytest
from test_report import read

from ers_mj import cli
from ers_mj.plants.inputs import INPUTS, RATE_HZ
from ers_mj.report.validation_report import validation_page
from ers_mj.report.validity import as_document, called, degrees, departures, headline
from ers_mj.servo.datasheet import Datasheet, read_datasheet
from ers_mj.validation import cases as validation
from ers_mj.validation.cases import Case, Condition, Grid, Validation, mapped, possible, rms, validate

SHEET, HALF = read_datasheet("table1"), float(np.radians(0.5))
PLAIN, PLAY, ROD, COIL = (
    Condition(0.0, "constant", False),
    Condition(HALF, "constant", False),
    Condition(0.0, "rod", False),
    Condition(0.0, "constant", True),
)


SMALL = Grid((1.2, 1.6), (2.0, 8.0), sine_s=0.25, gaps_deg=(0.0, 0.5), L_factors=(0.0, 1.0), play_s=0.2)


@pytest.fixture(scope="module")
def short() -> Validation:
    """Every default condition for half a second, with small maps."""
    return validate(SHEET, maps=SMALL, duration=0.5, jobs=1)


def case(error: np.ndarray, angle: np.ndarray, condition: Condition = ROD) -> Case:
    """A case whose MuJoCo angle is `angle` and whose models are all off by `error`, both (N,) [rad]."""
    t = np.arange(angle.size) / RATE_HZ
    return Case("steps", condition, t, np.zeros(t.size), angle, angle - error, angle - error, None, (20.0, 22.0, 21.0))


# -- the bars ---------------------------------------------------------------------------------------------------------


def test_without_play_and_rod_the_reduced_model_is_mujocos():
    found = validate(SHEET, (0.0,), ("constant",), maps=None, duration=1.5, jobs=1)
    assert [(c.input, c.condition.inductance) for c in found.cases] == [
        (name, on) for on in (False, True) for name in INPUTS
    ]
    for each in found.cases:
        assert np.degrees(each.rms) <= (0.02 if each.condition.inductance else 0.01), each.input
        assert np.degrees(each.motion) > 2 and each.t.size == 1_500


def test_the_play_is_what_is_missing(short):
    for each in short.cases:
        if each.condition.gap and each.condition.linkage == "constant":
            assert rms(each.mujoco - each.with_play) < np.radians(0.03)
        else:
            assert each.with_play is None
    steps = {c.condition: c for c in short.cases if c.input == "steps"}
    assert (
        np.degrees(steps[PLAY].rms) > 0.1
        and np.degrees(steps[ROD].rms) > 1
        and np.degrees(rms(steps[COIL].error_eq_5)) > 0.05
    )
    assert steps[ROD].ratio[1] == pytest.approx(22.26) and min(steps[ROD].ratio) < 21
    assert steps[PLAIN].ratio == pytest.approx((22.26,) * 3)


# -- what it says ---------------------------------------------------------------------------------------------------


def test_the_document_has_the_contracts_keys_and_every_combination(short):
    document = as_document(short)
    assert len(document["cases"]) == 8 * len(INPUTS)
    keys = {"input", "gap_rad", "linkage", "inductance", "rms_rad", "max_rad"}
    assert all(keys <= entry.keys() and entry["max_rad"] >= entry["rms_rad"] > 0 for entry in document["cases"])
    assert {(e["gap_rad"], e["linkage"], e["inductance"]) for e in document["cases"]} == {
        (gap, linkage, on) for gap in (0.0, HALF) for linkage in ("constant", "rod") for on in (False, True)
    }
    assert np.shape(document["maps"]["play"]["rms_rad"]) == (2, 2) and len(document["maps"]["sines"]) == 3


def test_sentences_carry_the_numbers_of_the_cases(short):
    found = departures(short)
    assert [d.condition for d in found] == [PLAY, ROD, COIL]
    for departure in found:
        worst = degrees(max(rms(c.error_eq_5) for c in short.cases if c.condition == departure.condition))
        assert f"is off by {worst} on the {departure.worst.input}" in departure.findings[0].sentence
        assert f"by up to {worst} ({departure.worst.input})" in headline(short)
        assert {f.axis for f in departure.findings} == {"size", "reason", "angle", "rest", "amplitude", "frequency"}
        assert all(
            0 <= x <= 1 for f in departure.findings for x in (f.share_of_error, f.share_of_time) if x is not None
        )
    assert "22.3 at zero" in found[1].findings[1].sentence and "L/R = 1.03 ms" in found[2].findings[1].sentence


def test_an_angle_is_named_where_the_error_lives_and_only_there():
    angle = np.radians(40 * np.sin(np.linspace(0, 20, 4000)))
    for error, words in (
        (np.where(np.abs(angle) > np.radians(25), 0.01, 0.0), "100 % of the squared error lies beyond 25° from θ₀"),
        (np.full(angle.size, 0.01), "Spread over the travel"),
    ):
        found = departures(Validation((case(error, angle),), {"b": 80.0, "theta_0": 0.0}))
        (said,) = [f for f in found[0].findings if f.axis == "angle"]
        assert said.sentence.startswith(words)


def test_rest_is_told_from_motion():
    angle = np.concatenate([np.zeros(1000), np.linspace(0, 1, 1000)])
    error = np.concatenate([np.full(1000, 0.02), np.zeros(1000)])
    (said,) = [f for f in departures(Validation((case(error, angle),), {"b": 80.0}))[0].findings if f.axis == "rest"]
    assert (
        said.sentence.startswith("It persists at rest")
        and said.share_of_error > 0.99
        and said.share_of_time == pytest.approx(0.5, abs=0.01)
    )


def test_conditions_in_words_and_the_maps_they_get():
    both = Condition(HALF, "rod", False)
    assert called(both) == "play of ±0.5° and the rod linkage" and called(PLAIN) == "no departure"
    assert mapped([PLAIN, Condition(HALF / 5, "constant", False), PLAY, ROD, both]) == [PLAY, ROD]
    assert mapped([PLAIN]) == [] and mapped([both]) == [both]


def test_a_datasheet_runs_what_it_can_make():
    assert possible(SHEET) == (validation.GAPS, validation.LINKAGES, validation.INDUCTANCES, [])
    gaps, linkages, inductances, left_out = possible(Datasheet(lumped={"b": 80.0, "c_2": 100.0}))
    assert (gaps, linkages, inductances) == (validation.GAPS, ("constant",), (False,)) and len(left_out) == 2
    loose = replace(SHEET, effects=(("backlash", {"gap": 0.01}),))
    assert possible(loose)[0] == (0.0,)


def test_the_report_stands_alone(short):
    page = validation_page(short, {"datasheet": "<b>mine</b>"})
    reader = read(page)
    assert all(reference.startswith("#") for reference in reader.references) and len(reader.ids) == len(set(reader.ids))
    words = " ".join(reader.words)
    assert headline(short) in words and "<b>mine</b>" in words and "Play of ±0.5°" in words and "amplitude [V]" in words
    assert validation_page(short, {"datasheet": "<b>mine</b>"}) == page


def test_nothing_departing_is_a_page_too(short):
    plain = Validation(tuple(c for c in short.cases if c.condition == PLAIN), short.lumped)
    assert headline(plain).endswith("RMS.") and "It is off" not in headline(plain)
    assert read(validation_page(plain, {})).tags.count("section") == 1


def test_a_rudder_that_stands_still_is_told():
    angle = np.zeros(500)
    found = departures(Validation((case(angle + 0.1, angle, Condition(7.0, "constant", False)),), {"b": 80.0}))
    assert "never gets across the play" in found[0].findings[1].sentence


# -- the command ------------------------------------------------------------------------------------------------------


@pytest.fixture
def asked(short, tmp_path, monkeypatch):
    """The calls of a validation that returns some of `short` at once; the current folder is empty."""
    calls, chosen = [], (PLAIN, PLAY)
    few = tuple(c for c in short.cases if c.input == "steps" and c.condition in chosen)

    def quick(datasheet, gaps, linkages, inductances, **options):
        calls.append((tuple(gaps), tuple(linkages), tuple(inductances), options))
        options["progress"]("simulating", 0.5)
        return Validation(few, short.lumped)

    monkeypatch.setattr(validation, "validate", quick)
    monkeypatch.chdir(tmp_path)
    return calls


@pytest.mark.parametrize(
    ("argv", "conditions"),
    [
        ("", ((0.0, HALF), ("constant", "rod"), (False, True))),
        ("--gap 0.5", ((HALF,), ("constant",), (False,))),
        ("--gap 0,0.5", ((0.0, HALF), ("constant",), (False,))),
        ("--linkage rod,constant", ((0.0,), ("rod", "constant"), (False,))),
        ("--inductance on", ((0.0,), ("constant",), (True,))),
        ("--gap 0 --linkage constant --inductance off,on", ((0.0,), ("constant",), (False, True))),
    ],
)
def test_with_no_option_every_combination_else_the_defaults(argv, conditions, asked, capsys, tmp_path):
    assert cli.main(["validate", *argv.split(), "--json", "--jobs", "1", "--no-maps"]) == 0
    assert asked[0][:3] == conditions and asked[0][3]["maps"] is None and asked[0][3]["jobs"] == 1
    assert json.loads(capsys.readouterr().out)["cases"] and list(tmp_path.iterdir()) == []


def test_it_writes_and_tells(asked, capsys, tmp_path):
    assert cli.main(["validate"]) == 0
    out, err = capsys.readouterr()
    shown = sorted(p.name for p in (tmp_path / "ers-out").iterdir() if not p.name.startswith("."))
    assert shown == ["report.html", "validation.json"] and err == ""
    assert "RMS deviation; MuJoCo has" in out and "play ±0.5°, constant linkage, L off" in out and "report.html" in out
    assert json.loads((tmp_path / "ers-out/validation.json").read_text())["sentence"] in out


def test_an_interrupt_leaves_what_there_was(asked, monkeypatch, capsys, tmp_path):
    assert cli.main(["validate"]) == 0
    before = (tmp_path / "ers-out/report.html").read_bytes()

    def stopped(*arguments, **options):
        raise KeyboardInterrupt

    monkeypatch.setattr(validation, "validate", stopped)
    assert cli.main(["validate"]) == 130
    assert (tmp_path / "ers-out/report.html").read_bytes() == before and capsys.readouterr().err.count("\n") == 1
