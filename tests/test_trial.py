"""Closed loops: the bars, the measures, references, the sensor, the command and its page."""

import json
import math
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from test_report import read

from ers_mj import cli
from ers_mj.control.closed_loop import Run, Sensor
from ers_mj.control.controllers import CONTROLLERS, Servo
from ers_mj.control.metrics import energy, measured, overshoot, settling_time
from ers_mj.control.paper_claims import claims, headline
from ers_mj.control.references import CASES, Reference, named, read_reference
from ers_mj.control.trial import Conditions, needed, try_out
from ers_mj.data.recording import read_recording
from ers_mj.effects import BY_NAME
from ers_mj.servo.datasheet import read_datasheet
from ers_mj.servo.model_file import write_model
from ers_mj.servo.simulation import kernel_effects

SHEET = read_datasheet("table1")
SERVO = Servo.of(SHEET)
NOISY = Conditions(rate_hz=1000.0, noise=math.radians(0.01))


def tried(controllers, plants, cases, conditions=Conditions(), **options):
    """{(controller, plant, case): measures}."""
    found = try_out(SHEET, controllers, plants, cases, conditions, **options)
    return {(t.controller, t.plant, t.case): t.measures for t in found}


# -- the bars
# ------------------------------------------------------------------------------------------------------------


def test_ftrc_settles_on_both_plants_and_survives_the_play():
    closed = tried(["ftrc"], ["reduced", "mujoco"], ["step"])
    for m in closed.values():
        assert (
            m.settling_time_s < 0.1
            and m.overshoot_pct < 3
            and m.steady_state_error_rad <= math.radians(0.01)
            and m.peak_u_V <= 24
        )
    ahead, behind = (closed["ftrc", plant, "step"].settling_time_s for plant in ("reduced", "mujoco"))
    assert abs(ahead - behind) < 0.1 * ahead
    loose = tried(["ftrc"], ["mujoco"], ["step"], Conditions(gap=math.radians(0.5)))["ftrc", "mujoco", "step"]
    assert loose.stable and loose.steady_state_error_rad < math.radians(0.5)


@pytest.mark.parametrize(("plant", "amplitude_deg"), [("reduced", 3.0), ("reduced", 10.0), ("mujoco", 10.0)])
def test_our_rival_beats_ftrc_and_the_fair_pid(plant, amplitude_deg):
    laws = ["ftrc", "pid-ff", "time-optimal"]
    cases = ["square", "ramp", "chirp"] if plant == "reduced" else ["square", "ramp"]  # MuJoCo's chirp takes long
    found = tried(laws, [plant], cases, replace(NOISY, amplitude=math.radians(amplitude_deg), seed=int(amplitude_deg)))
    for case in cases:
        rmse = [found[law, plant, case].rmse_rad for law in laws]
        assert rmse[2] < 0.97 * min(rmse[:2]), (case, np.degrees(rmse))


@pytest.mark.parametrize("filter_s", [2e-4, 1e-3, 2e-3])
def test_no_other_filter_of_the_speed_lets_them_win(filter_s):
    ours = tried(["time-optimal"], ["reduced"], ["square", "ramp", "chirp"], NOISY)
    theirs = tried(["ftrc", "pid-ff"], ["reduced"], ["square", "ramp", "chirp"], replace(NOISY, filter_s=filter_s))
    for (law, _, case), m in theirs.items():
        assert ours["time-optimal", "reduced", case].rmse_rad < 0.97 * m.rmse_rad, (law, case)


def test_our_rival_needs_no_exact_model():
    for letter, factor in (("J", 1.15), ("F_c", 0.7), ("K_t", 1.15)):
        design = replace(SHEET, parameters={**SHEET.parameters, letter: factor * SHEET.parameters[letter]})
        found = tried(["ftrc", "pid-ff", "time-optimal"], ["reduced"], ["ramp"], NOISY, design=design)
        rmse = [m.rmse_rad for m in found.values()]
        assert rmse[2] < min(rmse[:2]), letter


def test_the_audited_figures():
    """notes: literal (31) never settles; (39) rests off by its missing integral; the feed-forward makes the difference
    on the chirp.
    """
    found = tried(list(CONTROLLERS), ["reduced"], ["step"])
    assert found["ftrc-literal", "reduced", "step"].settling_time_s is None
    assert math.degrees(found["hinf", "reduced", "step"].steady_state_error_rad) == pytest.approx(0.232, abs=0.005)
    assert found["pid-ff", "reduced", "step"].settling_time_s < found["pid", "reduced", "step"].settling_time_s < 0.085
    chirp = tried(
        ["ftrc", "pid", "pid-ff"], ["reduced"], ["chirp"], Conditions(amplitude=math.radians(3.0), rate_hz=5000.0)
    )
    rmse = {law: m.rmse_rad for (law, _, _), m in chirp.items()}
    assert rmse["ftrc"] < 0.3 * rmse["pid"] and rmse["pid-ff"] == pytest.approx(rmse["ftrc"], rel=0.1)


# -- conditions of the loop
# ------------------------------------------------------------------------------------------------


def test_the_same_seed_gives_the_same_run_and_another_another():
    runs = [try_out(SHEET, ["ftrc"], ["reduced"], ["step"], replace(NOISY, seed=seed))[0].run.u for seed in (1, 1, 2)]
    assert np.array_equal(runs[0], runs[1]) and not np.array_equal(runs[0], runs[2])


@pytest.mark.parametrize(
    "change",
    [
        {"u_max": 12.0},
        {"effects": (("input_delay", {"T_d": 2e-3}),)},
        {"inductance": True},
        {"effects": (("sensor_lag", {"T": 1e-3}),)},
        {"effects": (("stribeck", {"dF_s": 0.3, "v_s": 0.5}),)},
    ],
)
def test_what_hampers_the_loop_slows_it(change):
    settings = {"rate_hz": 1000.0, "amplitude": math.radians(10.0 if "u_max" in change else 3.0)}
    plain, worse = (
        tried(["time-optimal"], ["reduced"], ["chirp"], Conditions(**settings, **more))[
            "time-optimal", "reduced", "chirp"
        ]
        for more in ({}, change)
    )
    assert worse.rmse_rad > 1.1 * plain.rmse_rad and worse.stable


def test_a_loop_that_runs_away_is_given_up():
    design = replace(SHEET, parameters={}, lumped={**SHEET.to_lumped(), "b": -SERVO.b})
    design = replace(
        design, lumped={k: v for k, v in design.lumped.items() if k in ("a_1", "a_2", "b", "c_1", "c_2", "theta_0")}
    )
    trial = try_out(SHEET, ["pid"], ["reduced"], ["step"], Conditions(rate_hz=1000.0), design=design)[0]
    assert not trial.measures.stable and trial.measures.rmse_rad is None and trial.as_document()["stable"] is False
    assert "no law" in headline([trial]) and claims([trial]) == []


def test_the_sensor_reads_as_a_recording_would():
    t = np.arange(400) / 1000.0
    theta = np.sin(20 * t)
    for name, values in (
        ("sensor_lag", {"T": 0.004}),
        ("sensor_lag", {"T": 0.002, "T_d": 0.0053}),
        ("sensor_quantisation", {"step": 0.01}),
        ("sensor_dropout", {"rate": 20.0, "duration": 0.01}),
        ("sensor_nonlinearity", {"A": 0.02, "period": 0.3, "phase": 0.1}),
    ):
        ((_, p),) = kernel_effects([(name, values)])
        sensor = Sensor([(name, p)], t)
        one_by_one = np.array([sensor.read(x) for x in theta])
        np.testing.assert_allclose(one_by_one, BY_NAME[name].measure(p, t, theta), atol=1e-5, err_msg=name)


# -- measures
# --------------------------------------------------------------------------------------------------------------


def run_of(theta, reference, jumps=(), u=None, drive=0.0):
    t = np.arange(theta.size) / 100.0
    u = np.zeros(theta.size) if u is None else u
    aim = Reference("x", t, reference, 0 * t, 0 * t, jumps)
    return Run(aim, theta, 0 * t, theta, u, np.full(t.size, drive), np.full(t.size, drive))


def test_measures_of_a_first_order_rise():
    t = np.arange(200) / 100.0
    run = run_of(1 - np.exp(-t / 0.1), np.ones(200), (0,))
    assert settling_time(run) == pytest.approx(0.1 * math.log(50), abs=0.011) and overshoot(run) == 0.0
    m = measured(run, 24.0, None)
    assert m.rmse_rad == pytest.approx(math.sqrt(0.5 * 0.1 / 2.0), rel=0.06) and m.energy_J is None and m.peak_u_V == 0


def test_overshoot_and_settling_go_by_the_worst_jump():
    theta = np.r_[np.full(10, 0.5), np.full(40, 1.0), np.full(20, -1.2), np.full(30, -1.0)]
    run = run_of(theta, np.r_[np.ones(50), -np.ones(50)], (0, 50))
    assert settling_time(run) == pytest.approx(0.2) and overshoot(run) == pytest.approx(10.0)
    assert settling_time(run_of(theta + 0.1, run.reference.theta, (0, 50))) is None


def test_without_jumps_the_amplitude_is_the_measure():
    t = np.arange(100) / 100.0
    reference = np.sin(2 * np.pi * t)
    run = run_of(1.05 * reference, reference)
    assert overshoot(run) == pytest.approx(5.0, abs=0.1) and settling_time(run) > 0.9
    assert settling_time(run_of(reference, reference)) == 0.0 and settling_time(run_of(0 * t, 0 * t)) is None


def test_energy_is_voltage_times_current():
    run = run_of(np.zeros(101), np.zeros(101), u=np.full(101, 2.0), drive=30.0)
    assert energy(run, 10.0) == pytest.approx(2.0 * 3.0 * 1.0) and energy(run, None) is None


# -- references
# --------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", CASES)
def test_derivatives_are_those_of_the_angle(name):
    aim = named(name, 0.2, 0.1, 10_000.0)
    smooth = np.ones(aim.t.size - 2, bool)
    for k in (*aim.jumps, *(5000, 15000)):
        smooth[max(k - 3, 0) : k + 2] = False
    speed = (aim.theta[2:] - aim.theta[:-2]) / 2e-4
    assert np.abs(speed - aim.omega[1:-1])[smooth].max() < 1e-3 * max(np.abs(aim.omega).max(), 1)
    change = (aim.omega[2:] - aim.omega[:-2]) / 2e-4
    assert np.abs(change - aim.alpha[1:-1])[smooth].max() < 1e-3 * max(np.abs(aim.alpha).max(), 1)
    assert aim.jumps == {"step": (0,), "square": (0, 5000, 10000, 15000)}.get(name, ())
    assert np.abs(aim.theta - 0.1).max() == pytest.approx(0.2, rel=1e-3) and aim.rate_hz == pytest.approx(10_000.0)


def test_a_reference_from_a_file_has_causal_derivatives_and_its_jumps(tmp_path):
    t = np.arange(1000) / 1000.0
    theta = 15 + 3 * np.sin(2 * np.pi * 2 * t) + 5.0 * (t >= 0.5)
    file = tmp_path / "mine.csv"
    rows = zip(t.tolist(), theta.tolist(), strict=True)
    file.write_text("t_s,theta_ref_deg\n" + "\n".join(f"{a!r},{b!r}" for a, b in rows))
    aim = read_reference(file, SERVO, 24.0)
    assert aim.name == "mine" and aim.jumps == (500,) and aim.rate_hz == pytest.approx(1000.0)
    true = np.radians(3 * 4 * np.pi * np.cos(4 * np.pi * t))
    away = np.abs(np.arange(1000) - 500) > 2
    away[:2] = False
    assert np.abs(aim.omega - true)[away].max() < 0.01 and aim.omega[500] == 0.0 and np.abs(aim.alpha).max() < 9
    found = tried(["time-optimal"], ["reduced"], [str(file)], NOISY)["time-optimal", "reduced", "mine"]
    assert found.rmse_rad < math.radians(1.0) and found.settling_time_s < 0.1


def test_what_a_reference_needs_tells_whether_it_can_be_followed():
    assert (
        needed(named("chirp", math.radians(10), SERVO.theta_0, 1000.0), SERVO)
        > 24
        > needed(named("chirp", math.radians(3), SERVO.theta_0, 1000.0), SERVO)
    )


# -- the command
# ---------------------------------------------------------------------------------------------------------------


def test_json_has_the_contracts_keys_and_the_defaults(capsys):
    assert cli.main(["trial", "--controller", "ftrc,hinf", "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert [(t["controller"], t["plant"], t["case"]) for t in told["trials"]] == [
        ("ftrc", "reduced", "step"),
        ("hinf", "reduced", "step"),
    ]
    keys = {"settling_time_s", "overshoot_pct", "steady_state_error_rad", "rmse_rad", "energy_J", "peak_u_V"}
    assert all(keys <= t.keys() for t in told["trials"]) and told["trials"][1]["settling_time_s"] is None
    assert told["trials"][0]["settling_time_s"] < 0.1 and told["conditions"]["rate_hz"] == 10_000.0
    assert (
        told["conditions"]["amplitude_rad"] == pytest.approx(math.radians(10)) and told["conditions"]["u_max_V"] == 24.0
    )


def test_a_table_and_a_page_are_written(tmp_path, capsys):
    arguments = ["trial", *"--case square,chirp --rate-hz 500 --noise-deg 0.01 --out".split(), str(tmp_path / "out")]
    assert cli.main(arguments) == 0
    out = capsys.readouterr().out
    assert "time-optimal" in out and " V, 24 V are there" in out and "report.html" in out
    html = (tmp_path / "out" / "report.html").read_text()
    assert "--cd9762b: #" in html and not re.search(r'style="[^"]*: #[0-9a-f]{6}', html)  # no colour that is light only
    page = read(html)
    words = " ".join(page.words)
    assert (
        "The paper's claims are for its own servo" in words
        and "P 5, I 1.2, D 0.1" in words
        and "Square (Case 1), reduced plant" in words
        and len(page.ids) == len(set(page.ids))
    )
    assert not [x for x in page.references if not x.startswith("#")]
    assert json.loads((tmp_path / "out" / "trials.json").read_text())["notes"]
    assert cli.main(arguments) == 2 and "--force" in capsys.readouterr().err


def test_the_papers_claims_stand_beside_its_own_settings(tmp_path, capsys):
    arguments = ["trial", "--controller", "ftrc,pid", "--out", str(tmp_path / "out"), "--quiet"]
    assert cli.main(arguments) == 0
    words = " ".join(read((tmp_path / "out" / "report.html").read_text()).words)
    assert "Claims for FTRC" in words and "settles within 100 ms" in words


OWN = """from ers_mj.control.controllers import Controller

class Proportional(Controller):
    sentence = "as much as it is off"

    def law(self, s):
        return 40.0 * s.x2 + self.servo.spring(s.theta) / self.servo.b
"""


def test_a_law_of_ones_own_runs_beside_ours_and_traces_are_recordings(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    Path("mine.py").write_text(OWN)
    arguments = "trial --controller mine.py,pid --rate-hz 500 --save-traces --plants 2 --jobs 1".split()
    assert cli.main([*arguments, "--json", "--out", "out"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert [t["controller"] for t in told["trials"]] == ["mine.py", "pid"] and told["trials"][0]["stable"]
    assert told["controllers"]["mine.py"] == "as much as it is off" and len(told["robustness"]) == 2
    trace = read_recording(Path("out") / "trace-step-reduced-mine.py.csv")
    assert trace.input_unit == "V" and np.std(trace.y) > 0.01


@pytest.mark.parametrize(
    ("text", "says"),
    [
        (None, "mine.py: there is no such file"),
        ("x = 1 /", "mine.py: cannot be run (SyntaxError"),
        ("import nothing_of_that_name", "cannot be run (ModuleNotFoundError"),
        ("x = 1", "was expected, not none"),
        (OWN + OWN.replace("Proportional", "Other"), "was expected, not Proportional, Other"),
    ],
)
def test_a_file_that_is_no_law_is_one_sentence(text, says, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    if text is not None:
        Path("mine.py").write_text(text)
    assert cli.main(["trial", "--controller", "mine.py"]) == 2
    error = capsys.readouterr().err
    assert says in error and error.count("\n") == 1


def test_a_model_with_its_effects_is_a_plant_and_a_design(tmp_path, capsys):
    model = tmp_path / "model.toml"
    write_model(model, replace(SHEET, effects=(("stribeck", {"dF_s": 0.1, "v_s": 0.2}),)))
    argv = "--design table1 --controller ftrc --plant reduced,mujoco --rate-hz 1000 --json"
    assert cli.main(["trial", str(model), *argv.split()]) == 0
    told = json.loads(capsys.readouterr().out)
    errors = [t["rmse_rad"] for t in told["trials"]]
    assert (
        errors[0] == pytest.approx(errors[1], rel=0.02)
        and told["datasheet"] == "model.toml"
        and told["design"] == "table1"
    )


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (["--controller", "lqr"], "there is no 'lqr'; there are ftrc"),
        (["--plant", "adams"], "there are reduced, mujoco"),
        (["--case", "sine"], "there is no 'sine'; there are step, square, ramp, chirp"),
        (["--case", "missing.csv"], "there is no such file"),
        (["--controller", "pid,pid"], "twice"),
        (["--umax-V", "0"], "not above 0"),
        (["--rate-hz", "20"], "100 to"),
        (["--effect", "magic:x=1"], "no effect"),
        (["--linkage", "wheel"], "wheel"),
        (["--gap", "0.5", "--effect", "backlash:gap=0.01"], "twice"),
        (["--gains", "q=2"], "outside"),
        (["--delay-ms", "1", "--effect", "input_delay:T_d=0.001"], "twice"),
        (["nothing.toml"], "no such file"),
        (["--amplitude-deg", "nan"], "finite"),
        (["--amplitude-deg", "1e9"], "beyond 360"),
        (["--delay-ms", "1e9"], "samples at 10000 Hz"),
        (["--pid", "P=1,P=2"], "gives P twice"),
        (["--gains", "k_1=1,k_1=2"], "gives k_1 twice"),
        (["--gains", "k_1=1e400"], "beyond 1e+09"),
    ],
)
def test_bad_input_is_one_sentence_and_code_2(arguments, says, capsys):
    assert cli.main(["trial", "--json", *arguments]) == 2
    error = capsys.readouterr().err
    assert says in error and error.count("\n") == 1


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("t_s,x\n0,1\n", "the columns are t_s, x"),
        ("t_s,theta_ref_deg\n0,1\n1,2\n", "100 to"),
        ("t_s,theta_ref_deg\n" + "".join(f"{k},{'nan' if k == 7 else k}\n" for k in range(200)), "data row 8"),
        ("t_s,theta_ref_deg\n" + "".join(f"{k * k},1\n" for k in range(200)), "not evenly spaced"),
        ("t_s,theta_ref_deg\n" + "".join(f"{k}e-9,1\n" for k in range(200)), "1e-06 s or more"),
        ("t_s,theta_ref_rad\n" + "".join(f"{k},1e9\n" for k in range(200)), "1000 rad at most"),
    ],
)
def test_a_bad_reference_is_refused(text, says, tmp_path, capsys):
    file = tmp_path / "bad.csv"
    file.write_text(text)
    assert cli.main(["trial", "--json", "--case", str(file)]) == 2 and says in capsys.readouterr().err


def test_a_model_that_does_not_turn_is_refused_and_one_told_no_volts_is_said(tmp_path, capsys):
    screw, joint = tmp_path / "screw.toml", tmp_path / "joint.toml"
    lumped = "[lumped]\na_1 = 0.0\na_2 = 20.0\nb = 3.0\nc_1 = 0.0\nc_2 = 0.5\ntheta_0 = 0.0\n"
    screw.write_text(lumped + '[recording]\noutput_unit = "m"\n')
    joint.write_text(lumped + '[recording]\ninput_unit = "N m"\n')
    asked = ["--controller", "pid", "--rate-hz", "500", "--json"]
    assert cli.main(["trial", str(screw), *asked]) == 2
    assert "its output is in m" in capsys.readouterr().err
    assert cli.main(["trial", str(joint), *asked]) == 0
    assert "This model is told N m" in json.loads(capsys.readouterr().out)["notes"][0]
