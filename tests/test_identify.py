"""Identification: the truth from a wrong start, what cannot be told, intervals, and the command's answers."""

import json
import math
from dataclasses import replace

import numpy as np
import pytest

from ers_mj import cli
from ers_mj.data.prepared import trace_of
from ers_mj.data.recording import from_arrays, write_recording
from ers_mj.errors import InputError
from ers_mj.identification.estimate import identify
from ers_mj.identification.finding import Settings
from ers_mj.identification.misfit import forgiven, forgiving
from ers_mj.identification.precision import precision_of
from ers_mj.identification.structure import structure_of
from ers_mj.plants.inputs import INPUTS
from ers_mj.plants.mujoco.plant import MechanicalPlant
from ers_mj.plants.reduced import lumped
from ers_mj.servo.datasheet import Datasheet, read_datasheet
from ers_mj.servo.simulation import build_plant, simulate_recording

TRUTH = {
    "L": 0.003,
    "R": 1.2,
    "k_s": 0.08,
    "T_LH": 0.4,
    "F_c": 0.2,
    "J": 0.001,
    "B": 0.006,
    "K_t": 0.5,
    "K_e": 0.6,
    "theta_0": 0.0,
}
SHEET = Datasheet(parameters=TRUTH)
OFF = Datasheet(
    parameters={**TRUTH, "L": 0.006, "k_s": 0.04, "F_c": 0.5, "B": 0.01, "K_t": 0.3, "K_e": 0.4, "T_LH": 0.7}
)
T = np.arange(2000) / 1e3
TOLD = {
    "L/R": 0.0025,
    "k_s/J": 80.0,
    "T_LH/J": 400.0,
    "F_c/J": 200.0,
    "B/J": 6.0,
    "K_t/(J R)": 0.5 / 0.0012,
    "K_e": 0.6,
}


def record(noise_deg=0.0, seed=0, sheet=SHEET, current=False, inductance=True, **options):
    u = INPUTS["multisine"](T)
    columns = simulate_recording(
        sheet, T, u, noise=math.radians(noise_deg), seed=seed, inductance=inductance, **options
    )
    more = {}
    if current:
        p = sheet.parameters
        motion = build_plant(sheet, inductance=inductance).simulate(T, u)
        more = {"current": motion.drive * p["J"] / (p.get("n", 1.0) * p["K_t"])}
    return from_arrays(columns["t_s"], columns["u_V"], columns["theta_rad"], **more)


@pytest.fixture(scope="module")
def exact():
    return identify([record()], OFF)


@pytest.fixture(scope="module")
def noisy():
    return identify([record(0.01)], OFF)


def rows(found):
    return {row.name: row for row in found.rows}


def test_the_seven_that_can_be_told_are_found_and_nothing_else(exact):
    told = rows(exact)
    assert {name: told[name].value for name in TOLD} == pytest.approx(TOLD, rel=1e-6)
    assert exact.structure.rank == 8 and exact.evaluations < 400
    for name in ("L", "R", "k_s", "T_LH", "F_c", "J", "B", "K_t"):
        assert told[name].value is None and not told[name].identifiable and told[name].why


def test_noise_widens_the_intervals_and_they_hold(noisy):
    told = rows(noisy)
    for name, truth in TOLD.items():
        low, high = told[name].ci95
        assert low - 0.5 * (high - low) < truth < high + 0.5 * (high - low)
    assert 0.8 < noisy.misfit < 1.2 and noisy.explains
    width = {name: (told[name].ci95[1] - told[name].ci95[0]) / truth for name, truth in TOLD.items()}
    assert width["B/J"] > 10 * width["k_s/J"] and [p.name for p in noisy.profiles] == ["B"]


def test_the_identified_model_moves_as_the_plant_does(exact):
    u = INPUTS["steps"](T)
    true, found = (build_plant(sheet, inductance=True).simulate(T, u).theta for sheet in (SHEET, exact.model))
    assert np.abs(true - found).max() < 1e-6


def test_with_current_and_a_scale_all_are_told():
    told = rows(identify([record(current=True)], OFF, Settings(fixed={"J": TRUTH["J"]})))
    for name in ("L", "R", "k_s", "T_LH", "F_c", "B", "K_t", "K_e"):
        assert told[name].value == pytest.approx(TRUTH[name], rel=1e-3) and told[name].identifiable
    assert told["J"].fixed and told["J"].value == TRUTH["J"]


def test_without_inductance_damping_and_back_emf_are_told_together_only():
    sheet = Datasheet(parameters={k: v for k, v in OFF.parameters.items() if k != "L"})
    found = identify([record(inductance=False)], sheet)
    told = rows(found)
    assert found.structure.rank == 6 and told["B"].value is None and told["K_e"].value is None
    assert told["a_2"].value == pytest.approx(6.0 + 0.5 * 0.6 / 0.0012, rel=1e-6)
    assert any("made up for" in warning for warning in found.warnings)


@pytest.mark.parametrize("wave", ["ramp", "square"])
def test_a_winding_that_the_recording_does_not_show_is_left_out(wave):
    t, sheet = np.arange(5000) / 1e3, read_datasheet("table1")
    columns = simulate_recording(sheet, t, INPUTS[wave](t), noise=math.radians(0.01), seed=3)
    found = identify([from_arrays(columns["t_s"], columns["u_V"], columns["theta_rad"])], sheet)
    told = rows(found)
    assert (
        found.explains
        and found.structure.rank == 6
        and "L" not in told
        and any("L was left out" in w for w in found.warnings)
    )
    assert (
        told["J"].value is None
        and told["k_s/J"].value == pytest.approx(28.29, rel=0.02)
        and told["c_1"].value == pytest.approx(148.4, rel=0.02)
    )


def test_a_winding_may_be_bounded_by_nothing():
    t, sheet = np.arange(1000) / 1e3, read_datasheet("table1")
    columns = simulate_recording(sheet, t, INPUTS["multisine"](t), noise=math.radians(0.01), seed=3)
    recording = from_arrays(columns["t_s"], columns["u_V"], columns["theta_rad"])
    assert identify([recording], sheet, Settings(bounds={"L": (0.0, 1.0)})).explains


def test_bounds_of_a_guess_move_with_it():
    t, sheet = np.arange(10_000) / 1e3, read_datasheet("table1")
    columns = simulate_recording(sheet, t, INPUTS["square"](t), noise=math.radians(0.01), seed=2704)
    found = identify([from_arrays(columns["t_s"], columns["u_V"], columns["theta_rad"])], None)
    assert found.explains and not any("rests" in w for w in found.warnings)


def test_a_play_makes_the_model_wrong():
    found = identify([record(0.01, inductance=False, gap=math.radians(0.5))], SHEET)
    assert not found.explains and "the model is wrong" in found.sentence


def test_the_null_space_of_powers_is_found_without_being_told():
    """y = (a/b) s + (c^2/b) s^2 can tell two of three; the third row of any basis is b, a b^-1 and c b^-1/2 where the
    exponents are whole.
    """
    s = np.linspace(0, 1, 50)
    found = structure_of(np.column_stack([s, -s - s**2, s**2]), ("k_s", "J", "T_LH"))
    assert found.rank == 2 and [found.names[p] for p in found.pivots] == ["J"]
    assert (
        [found.combination(k) for k in found.kept] == ["k_s/J", "T_LH/J"]
        and found.told(np.array([1.0, -1.0, 0.0]))
        and not found.told(np.array([1.0, 0.0, 0.0]))
    )


def test_resampled_and_fisher_widths_agree_on_white_residuals_and_not_on_coloured_ones():
    random, trace = np.random.default_rng(0), trace_of(record(0.01), None)
    slopes = np.column_stack([np.ones(2000), np.sin(7 * T)])
    white = random.standard_normal(2000)
    coloured = np.repeat(random.standard_normal(100), 20)
    fair, bent = (precision_of(slopes, e, [trace], 0) for e in (white, coloured))
    ratio = [np.sqrt(np.diag(p.resampled) / np.diag(p.fisher)) for p in (fair, bent)]
    assert np.all((0.6 < ratio[0]) & (ratio[0] < 1.5)) and np.all(ratio[1] > 2.0)


def test_many_candidates_in_mujoco_are_what_one_is():
    from ers_mj.identification.rollouts import rollouts
    from ers_mj.identification.unknowns import unknowns_of

    sheet = read_datasheet("table1")
    u = INPUTS["multisine"](T[:300])
    columns = simulate_recording(sheet, T[:300], u, plant="mujoco")
    traces = [trace_of(from_arrays(columns["t_s"], columns["u_V"], columns["theta_rad"]), None)]
    traces = [replace(traces[0], start=(sheet.parameters["theta_0"], 0.0))]
    unknowns = unknowns_of(traces, sheet, {"L": 0.0}, {})
    candidates = [unknowns.reference, 1.1 * unknowns.reference]
    both, alone = (
        rollouts(2)(unknowns, candidates, traces, 0.0),
        [rollouts(1)(unknowns, [c], traces, 0.0)[0] for c in candidates],
    )
    assert np.allclose(both, alone, atol=1e-6) and np.abs(both[0]).max() < np.abs(both[1]).max()


def test_an_observer_in_mujoco_changes_nothing_where_it_is_right_and_comes_back_where_it_is_not():
    plant, t = build_plant(read_datasheet("table1"), plant="mujoco"), T[:400]
    u = INPUTS["multisine"](t)
    free, start = plant.simulate(t, u).theta, read_datasheet("table1").parameters["theta_0"]
    assert np.abs(plant.simulate(t, u, y=free, gain=0.3, every=5).theta - free).max() < 1e-12
    off = plant.simulate(t, u, (start - 0.05, 0.0), y=free, gain=0.3, every=5).theta - free
    assert abs(off[0]) > 0.04 and np.abs(off[200:]).max() < 2e-3


def test_forgiving_blocks_keeps_the_slope_of_the_sum_that_it_makes():
    trace, random = trace_of(record(0.01), None), np.random.default_rng(0)
    e, direction = (
        random.standard_normal(trace.rows) * (1 + 30 * (trace.block == 3)),
        random.standard_normal(trace.rows),
    )
    made = forgiving(e, [trace])
    slope = 2 * made @ (forgiven(made, [trace]) * direction)
    ahead, behind = (np.sum(forgiving(e + way * 1e-5 * direction, [trace]) ** 2) for way in (1, -1))
    assert slope == pytest.approx((ahead - behind) / 2e-5, rel=1e-5)
    assert np.sum(made[trace.block == 3] ** 2) < 0.02 * np.sum(e[trace.block == 3] ** 2)


def test_five_parameters_of_a_mujoco_plant():
    """Within twice their intervals; and with a play, which the plant that is fitted has not, the model is wrong."""
    t, step = np.arange(1000) / 1e3, 5e-4
    u, true = INPUTS["multisine"](t), read_datasheet("table1").to_lumped()
    begin = Datasheet(lumped={name: x * (1.0 if name == "theta_0" else 1.3) for name, x in true.items()})
    settings = Settings(plant="mujoco", fixed={"theta_0": true["theta_0"]}, timestep=step)
    said = []
    for gap in (0.0, math.radians(0.5)):
        plant = MechanicalPlant(lumped(true), gap=gap, timestep=step)
        y = plant.simulate(t, u).theta + math.radians(0.01) * np.random.default_rng(1).standard_normal(t.size)
        said.append(identify([from_arrays(t, u, y)], begin, settings))
    assert said[0].explains
    for name in ("a_2", "b", "c_1", "c_2"):
        row = rows(said[0])[name]
        half = 0.5 * (row.ci95[1] - row.ci95[0])
        assert abs(row.value - true[name]) < 2 * half < 0.05 * true[name]
    assert not said[1].explains


@pytest.mark.parametrize(
    "settings, said",
    [
        ({"method": "magic"}, "no method"),
        ({"fixed": {"zeta": 1.0}}, "no parameter"),
        ({"fixed": {"a_1": 1.0}}, "cannot be fixed or bounded"),
        ({"bounds": {"R": (2.0, 1.0)}}, "bounds of R"),
        ({"fixed": {"R": 1.0}, "bounds": {"R": (1.0, 2.0)}}, "is fixed and has bounds"),
    ],
)
def test_what_cannot_be_asked_is_refused(settings, said):
    with pytest.raises(InputError, match=said):
        identify([record()], OFF, Settings(**settings))


def test_the_command_writes_a_model_that_others_read(tmp_path, capsys):
    columns = simulate_recording(read_datasheet("table1"), T, INPUTS["multisine"](T), noise=1e-4, inductance=True)
    write_recording(tmp_path / "rec.csv", columns)
    out = tmp_path / "out"
    assert (
        cli.main(
            [
                "identify",
                str(tmp_path / "rec.csv"),
                "--datasheet",
                "table1",
                "--fix",
                "J=0.0031",
                "--out",
                str(out),
                "--json",
            ]
        )
        == 0
    )
    document = json.loads(capsys.readouterr().out)
    assert {"method", "plant", "parameters", "fitness", "evaluations", "wall_s"} <= document.keys()
    assert {"value", "unit", "ci95", "datasheet", "identifiable"} <= document["parameters"]["k_s"].keys()
    assert document["parameters"]["R"]["value"] is None and document["parameters"]["L/R"]["value"] == pytest.approx(
        0.0016 / 1.55, rel=0.02
    )
    assert read_datasheet(out / "model.toml").to_lumped()["b"] == pytest.approx(81.07, rel=0.01)
    assert "<svg" in (out / "report.html").read_text()
    assert cli.main(["trial", str(out / "model.toml"), *"--controller pid --rate-hz 500 --json".split()]) == 0


@pytest.mark.parametrize("method", ["iga", "cma"])
def test_other_methods_are_the_same_by_seed_whatever_the_jobs(method):
    found = [identify([record(0.01)], OFF, Settings(method=method, budget=200, seed=5, jobs=jobs)) for jobs in (1, 2)]
    assert found[0].fitness == found[1].fitness and found[0].evaluations == 200


@pytest.mark.parametrize(
    "options",
    [
        ["--fix", "J"],
        ["--fix", "J=x"],
        ["--fix", "J=1", "--fix", "J=2"],
        ["--bounds", "J=1"],
        ["--within", "2,3"],
        ["--method", "x"],
    ],
)
def test_bad_options_are_one_sentence_and_code_2(tmp_path, capsys, options):
    write_recording(tmp_path / "rec.csv", simulate_recording(SHEET, T[:200], INPUTS["multisine"](T[:200])))
    assert cli.main(["identify", str(tmp_path / "rec.csv"), "--datasheet", "table1", *options, "--json"]) == 2
    said = capsys.readouterr()
    assert said.out == "" and said.err.count("\n") == 1


@pytest.mark.parametrize(
    "u, options, said",
    [
        (0.0, [], "the input is zero throughout"),
        (None, ["--datasheet", "table1", "--fix", "J=-1"], "negative J"),
        (None, ["--datasheet", "table1", "--fix", "R=0"], "R = 0"),
    ],
)
def test_what_no_servo_has_and_what_shows_nothing_are_one_sentence_and_code_2(tmp_path, capsys, u, options, said):
    columns = dict(simulate_recording(read_datasheet("table1"), T[:700], INPUTS["multisine"](T[:700]), noise=1e-4))
    if u is not None:
        columns["u_V"] = np.full(700, u)
    write_recording(tmp_path / "rec.csv", columns)
    assert cli.main(["identify", str(tmp_path / "rec.csv"), *options, "--out", str(tmp_path / "out")]) == 2
    told = capsys.readouterr()
    assert said in told.err and told.err.count("\n") == 1 and told.out == "" and not (tmp_path / "out").exists()


def test_theta_0_that_cannot_be_told_is_no_combination():
    """Where the rudder is never near theta_0 its bounds, and nothing else, say where it is."""
    told = rows(identify([record(0.01)], OFF, Settings(bounds={"theta_0": (5.0, 6.0)})))
    assert not any("theta_0" in name for name in told if name != "theta_0")


def test_a_budget_that_ends_too_early_is_said_to_be_too_small():
    t = np.arange(0.0, 2.0, 0.002)
    columns = simulate_recording(read_datasheet("table1"), t, 8.0 * np.sin(6.0 * t))
    run = from_arrays(columns["t_s"], columns["u_V"], columns["theta_rad"])
    with pytest.raises(InputError, match="within 3 evaluations: allow more"):
        identify([run], read_datasheet("table1"), Settings(budget=3))


COGGING = (("cogging", {"A": 30.0, "period": 0.05, "phase": 0.3}),)


@pytest.mark.parametrize("plant", ["reduced", "mujoco"])
def test_effects_of_a_model_act_and_are_held(plant):
    """They had been dropped without a word, and the letters took what they do."""
    numbers = {"a_1": 80.0, "a_2": 40.0, "b": 60.0, "c_2": 20.0, "theta_0": 0.0}
    truth = Datasheet(lumped=numbers, effects=COGGING)
    u = INPUTS["multisine"](T)
    columns = simulate_recording(truth, T, u, noise=2e-5, seed=1)
    recordings = [from_arrays(T, u, columns["theta_rad"])]
    begun = Datasheet(lumped={**numbers, "a_2": 30.0, "b": 50.0}, effects=COGGING, name="model.toml")
    found = identify(recordings, begun, Settings(plant=plant))
    values = {row.name: row.value for row in found.rows}
    assert values["b"] == pytest.approx(60.0, rel=0.01) and values["a_2"] == pytest.approx(40.0, rel=0.02)
    assert found.misfit < 3.0 and [name for name, _ in found.model.effects] == ["cogging"]
    assert any("cogging acts" in warning for warning in found.warnings)
    without = identify(recordings, replace(begun, effects=()), Settings(plant=plant))
    assert without.misfit > 30.0
