"""A servo that closes its own loop: simulated, identified, diagnosed, written and read again."""

import control
import numpy as np
import pytest

from ers_mj.cli import main
from ers_mj.data.recording import from_arrays, from_columns, write_recording
from ers_mj.diagnosis.pipeline import diagnose
from ers_mj.door.identifying import identify
from ers_mj.door.known import known
from ers_mj.door.model import load_model
from ers_mj.effects.backlash import Backlash
from ers_mj.effects.gravity_imbalance import GravityImbalance
from ers_mj.effects.input_delay import InputDelay
from ers_mj.effects.load_dependent_friction import LoadDependentFriction
from ers_mj.effects.presliding import Presliding
from ers_mj.effects.rate_limit import RateLimit
from ers_mj.effects.voltage_saturation import VoltageSaturation
from ers_mj.errors import InputError
from ers_mj.plants.mujoco.looped import LoopedPlant
from ers_mj.plants.mujoco.plant import MechanicalPlant
from ers_mj.position_loop.identify import identify_loop
from ers_mj.position_loop.intervals import Intervals
from ers_mj.position_loop.model import LoopModel
from ers_mj.position_loop.runs import Run, runs_of
from ers_mj.position_loop.saved import looped_plant, model_of, simulate_loop
from ers_mj.position_loop.weak_form import rough_starts
from ers_mj.servo.datasheet import Datasheet, read_datasheet
from ers_mj.servo.model_file import write_model
from ers_mj.servo.simulation import kernel_effects

PRESLIDING = ((Presliding.name, {"x_s": 0.03, "zeta": 0.4}),)
LIMITED = {"K": 900.0, "L": 150.0, "a_2": 20.0, "c_2": 8.0, "tau_s": 0.012}


def steps_of(seed: int, seconds: float = 4.0, rate: float = 100.0, size: float = 0.6) -> tuple[np.ndarray, np.ndarray]:
    """Steps of mixed size, at rest at first."""
    t = np.arange(0.0, seconds, 1.0 / rate)
    levels = np.concatenate([[0.0], np.random.default_rng(seed).uniform(-size, size, 12)])
    return t, levels[np.minimum((t / (seconds / 13)).astype(int), 12)]


def run_of(t: np.ndarray, r: np.ndarray, start: float = 0.0) -> Run:
    yes = np.ones(t.size, bool)
    return Run("run", t, np.ascontiguousarray(r, float), r, yes, yes, 1e-4, 0.0, (start, 0.0), float(r[0]))


def recorded(values: dict, seeds=(1, 2), noise: float = 3e-4, effects=(), side: str = "load", fresh: bool = False):
    model, out = LoopModel(values, (), effects, side, fresh=fresh), []
    for seed in seeds:
        t, r = steps_of(seed)
        y = model.predicted(run_of(t, r)) + noise * np.random.default_rng(seed + 50).standard_normal(t.size)
        out.append(from_arrays(t, r, y, name=f"steps {seed}", input_unit="rad"))
    return out


def test_a_loop_without_friction_follows_its_transfer_function():
    from scipy.signal import lsim

    t = np.arange(0.0, 1.0, 0.002)
    motion = LoopModel({"K": 400.0, "D": 12.0, "a_2": 8.0}, ()).predicted(run_of(t, np.where(t < 0.1, 0.0, 0.5)))
    fine = np.arange(0.0, 1.0, 1e-4)
    _, y, _ = lsim(([400.0], [1.0, 20.0, 400.0]), np.where(fine < 0.1 - 1e-9, 0.0, 0.5), fine, interp=False)
    assert np.max(np.abs(motion - np.interp(t, fine, y))) < 2e-4


def test_a_late_damping_follows_its_transfer_function():
    from scipy.signal import lsim

    t, lag = np.arange(0.0, 1.0, 0.002), 0.006
    values = {"K": 400.0, "D": 12.0, "lag_s": lag, "a_2": 8.0}
    motion = LoopModel(values, ()).predicted(run_of(t, np.where(t < 0.1, 0.0, 0.5)))
    fine = np.arange(0.0, 1.0, 1e-4)
    system = [400.0 * lag, 400.0], [lag, 1.0 + 8.0 * lag, 20.0 + 400.0 * lag, 400.0]
    _, y, _ = lsim(system, np.where(fine < 0.1 - 1e-9, 0.0, 0.5), fine, interp=False)
    assert np.max(np.abs(motion - np.interp(t, fine, y))) < 3e-4
    there = looped_plant(Datasheet(lumped={"a_2": 8.0}, loop={k: values[k] for k in ("K", "D", "lag_s")}))
    twin = there.simulate(t, np.where(t < 0.1, 0.0, 0.5), (0.0, 0.0), 0.0)
    assert np.max(np.abs(twin - np.interp(t, fine, y))) < 5e-3


def test_a_filtered_derivative_does_not_bend_the_other_numbers():
    true = {"K": 1400.0, "D": 30.0, "lag_s": 0.006, "L": 200.0, "a_2": 25.0, "c_2": 10.0, "tau_s": 0.012}
    found = identify_loop(recorded(true, seeds=(1, 2, 3)))
    assert found.intervals.model.kind == "PD"
    for letter, near in (("K", 0.03), ("c_2", 0.04), ("L", 0.01), ("lag_s", 0.2)):
        assert found.intervals.told("", letter).value == pytest.approx(true[letter], rel=near), letter


@pytest.mark.parametrize("whole", [False, True])
def test_what_the_gain_register_multiplies_is_found(whole):
    true, runs = {"K": 700.0, "D": 20.0, "L": 150.0, "a_2": 20.0, "c_2": 8.0, "tau_s": 0.012}, []
    for seed, kp in ((1, 1.0), (2, 1.0), (3, 3.0), (4, 3.0)):
        t, r = steps_of(seed)
        model = LoopModel(true | {"K": true["K"] * kp, "D": true["D"] * (kp if whole else 1.0)}, ())
        y = model.predicted(run_of(t, r)) + 3e-4 * np.random.default_rng(seed).standard_normal(t.size)
        columns = {"t_s": t, "theta_ref_rad": r, "theta_rad": y, "kp": np.full(t.size, kp)}
        runs.append(from_columns(columns, input_column="theta_ref_rad"))
    found = identify_loop(runs).intervals
    assert found.model.whole is whole
    assert found.told("", "D").value == pytest.approx(20.0, rel=0.1)


def test_an_idle_bridge_takes_its_share_of_the_drive():
    t = np.arange(0.0, 1.0, 0.005)
    r = np.where(t < 0.1, 0.0, 0.4)
    idle = {"K": 400.0, "D": 12.0, "a_2": 8.0, "idle": 10.0}
    drive = LoopModel(idle, ()).motion(run_of(t, r))[:, 3]
    rests = LoopModel(idle, ()).motion(run_of(t, 0.05 * r))
    assert np.ptp(rests[:, 0]) == 0.0 and np.ptp(rests[:, 3]) == 0.0
    assert np.max(drive) == pytest.approx(400.0 * 0.4 - 10.0, rel=0.1)
    limited = idle | {"L": 100.0}  # the firmware's limit, of which the bridge loses the same
    assert np.max(LoopModel(limited, ()).motion(run_of(t, r))[:, 3]) == pytest.approx(100.0 - 10.0)
    for numbers in (idle, limited):
        twin = looped_plant(Datasheet(lumped={"a_2": 8.0}, loop={k: v for k, v in numbers.items() if k != "a_2"}))
        there = twin.simulate(t, r, (0.0, 0.0), 0.0)
        assert np.max(np.abs(there - LoopModel(numbers, ()).predicted(run_of(t, r)))) < 5e-3


def test_a_drive_that_is_late_takes_damping_and_nothing_else():
    """Two steps of the firmware late, the drive of a loop without a damping of its own."""
    true, data = {"K": 900.0, "L": 150.0, "a_2": 20.0, "c_2": 8.0, "tau_s": 0.012, "dead_time_s": 0.002}, []
    for seed in (1, 2, 3):
        t, r = steps_of(seed)
        y = LoopModel(true, ()).predicted(run_of(t, r)) + 3e-4 * np.random.default_rng(seed).standard_normal(t.size)
        data.append(from_arrays(t, r, y, input_unit="rad"))
    found = identify_loop(data).intervals
    assert "dead_time_s" not in found.model.free and found.model["D"] < 0.0
    for letter in ("K", "L", "a_2", "c_2"):
        low, high = found.told("", letter).ci95
        assert low < true[letter] < high and high / low < 1.4


def test_a_bristle_gives_and_springs_back_within_its_level():
    t = np.arange(0.0, 1.0, 0.01)
    effects = ((Presliding.name, np.array([0.03, 0.4, *4 * [np.inf]])),)
    model = LoopModel({"K": 400.0, "a_2": 8.0, "c_2": 10.0}, (), effects)
    pulse = np.where((t > 0.1) & (t < 0.5), 0.008, 0.0)
    theta = model.predicted(run_of(t, pulse))
    held = 0.008 * 400.0 / (400.0 + 10.0 / 0.03)  # the loop's spring against the bristle's
    assert theta[t < 0.5][-1] == pytest.approx(held, rel=0.25)
    assert abs(theta[-1]) < 0.2 * held
    twin = looped_plant(Datasheet(lumped={"a_2": 8.0, "c_2": 10.0}, loop={"K": 400.0}, effects=PRESLIDING))
    assert np.max(np.abs(twin.simulate(t, pulse, (0.0, 0.0), 0.0) - theta)) < 0.2 * held


def test_friction_holds_within_its_width():
    t = np.arange(0.0, 1.0, 0.01)
    model = LoopModel({"K": 400.0, "a_2": 8.0, "c_2": 10.0}, ())
    assert np.ptp(model.predicted(run_of(t, np.where(t < 0.1, 0.0, 0.024)))) == 0.0
    assert np.ptp(model.predicted(run_of(t, np.where(t < 0.1, 0.0, 0.026)))) > 0.0


def test_a_latency_moves_the_answer_smoothly():
    t, r = steps_of(3)
    of = [LoopModel({**LIMITED, "tau_s": tau}, ()).predicted(run_of(t, r)) for tau in (0.0100, 0.0101, 0.0102)]
    first, second = of[1] - of[0], of[2] - of[1]
    assert 0.0 < np.linalg.norm(first) < 0.1
    assert np.linalg.norm(second - first) < 0.2 * np.linalg.norm(first)


@pytest.mark.parametrize("values", [LIMITED, {**LIMITED, "L": np.inf}, {**LIMITED, "D": 15.0, "lag_s": 0.003}])
def test_the_longest_step_is_fine_enough_where_a_reference_switches_and_friction_turns_within_one(values):
    t, r = steps_of(3)
    model = LoopModel({**values, "tau_s": 0.0109}, ())
    coarse, fine = (model.motion(run_of(t, r), refine)[:, 0] for refine in (1, 50))
    assert np.sqrt(np.mean((coarse - fine) ** 2)) < 2e-5  # 1.1e-4 where neither parts a step


@pytest.mark.parametrize("letter", ["tau_s", "dead_time_s"])
def test_a_delay_is_as_long_as_it_says(letter):
    t = np.arange(0.0, 1.0, 0.001)
    r = np.where(t < 0.2, 0.0, 1.0)
    free = {"K": 100.0, "a_2": 20.0}
    late = LoopModel({**free, letter: 0.05}, ()).predicted(run_of(t, r))
    prompt = LoopModel(free, ()).predicted(run_of(t, r))
    assert np.all(late[t < 0.249] == 0.0)
    early = (t > 0.2) & (t < 0.22)
    shifted = np.interp(t[early], t - 0.05, late)
    assert np.max(np.abs(shifted - prompt[early])) < 2e-3


def test_the_reference_moves_no_faster_than_its_limit():
    t = np.arange(0.0, 2.0, 0.01)
    motion = LoopModel({"K": 4000.0, "D": 120.0, "R": 1.5}, ()).motion(run_of(t, np.where(t < 0.2, 0.0, 2.0)))
    assert np.max(np.abs(motion[:, 1])) == pytest.approx(1.5, rel=0.02)


def test_the_closed_form_is_near():
    rough = rough_starts(runs_of(recorded(LIMITED)), ("hold", "sin", "cos"), 0.03)[0].values
    assert rough["K"] == pytest.approx(900.0, rel=0.5)
    assert rough["L"] == pytest.approx(150.0, rel=0.3)
    assert rough["tau_s"] == pytest.approx(0.012, abs=0.008)


def test_a_bare_loop_is_identified():
    found = identify_loop(recorded(LIMITED))
    assert found.explains
    for letter in ("K", "L", "a_2", "c_2", "tau_s"):
        low, high = found.intervals.told("", letter).ci95
        assert low <= LIMITED[letter] <= high, letter


def test_a_limit_and_gravity_are_named_and_nothing_else():
    effects = ((GravityImbalance.name, np.array([12.0, 0.0])),)
    found = diagnose(recorded(LIMITED, effects=effects), None, jobs=1)
    document, told = found.document, found.evidence.told[0]
    named = [m["effect"] for m in document["missing"]]
    assert set(named) == {VoltageSaturation.name, GravityImbalance.name, InputDelay.name}
    row = document["parameters"]["L"]
    assert row["identifiable"]
    assert row["ci95"][0] <= 150.0 <= row["ci95"][1]
    assert document["data"]["input_kind"] == "position"
    assert not document["remainder"]["significant"]
    assert document["fit"]["measure"] == "free_run"
    assert list(told.without) == named
    assert all(np.std(told.measured - alone) > np.std(told.measured - told.after) for alone in told.without.values())


@pytest.mark.parametrize("fresh", [False, True])
def test_an_integral_holds_the_servo_where_a_recording_begins_or_is_empty_there(fresh):
    """Under a weight that friction holds at rest; a shaft made up for it."""
    weight = ((GravityImbalance.name, np.array([12.0, -6.0])),)
    given = recorded({**LIMITED, "I": 700.0}, effects=weight, fresh=fresh)
    found = diagnose(given, None, jobs=2).document
    assert {m["effect"] for m in found["missing"]} == {GravityImbalance.name, VoltageSaturation.name, InputDelay.name}
    assert found["fit"]["heldout_rmse_after_rad"] < 1.2 * found["fit"]["noise_floor_rad"]
    assert found["parameters"]["I"]["value"] == pytest.approx(700.0, rel=0.05)


def test_a_recorded_duty_tells_the_input_gain_and_gains_differ_between_recordings():
    recordings = []
    for seed, kp, offset in ((1, 8.0, 0.0), (2, 32.0, 0.0), (3, 8.0, 0.01)):
        t, r = steps_of(seed)
        motion = LoopModel(LIMITED | {"K": LIMITED["K"] * kp / 8.0}, ()).motion(run_of(t, r))
        noise = 3e-4 * np.random.default_rng(seed).standard_normal(t.size)
        columns = {"t_s": t, "theta_ref_rad": r, "theta_rad": motion[:, 0] + noise + offset}
        columns |= {"u_duty_pct": np.round(motion[:, 3] / 1.5, 1), "kp": np.full(t.size, kp)}
        recordings.append(from_columns(columns, input_column="theta_ref_rad", second="u_duty_pct"))
    document = diagnose(recordings, Datasheet(lumped={"a_2": 21.0}), jobs=1).document
    assert document["parameters"]["b"]["value"] == pytest.approx(1.5, rel=0.02)
    assert document["parameters"]["a_2"]["datasheet"] == 21.0
    assert any("datasheet" in problem for problem in document["data"]["problems"])
    states = {state["name"]: state["values"] for state in document["record_state"]}
    assert states["gain"] == pytest.approx([1.0, 4.0, 1.0])
    assert states["offset"][2] - states["offset"][0] == pytest.approx(0.01, abs=1e-3)
    assert {m["effect"] for m in document["missing"]} == {"voltage_saturation", "input_delay"}


def test_a_loop_that_is_never_at_its_limit_tells_sums_only():
    recordings = recorded({"K": 900.0, "a_2": 40.0, "c_2": 4.0}, seeds=(4, 5))
    document = diagnose(recordings, None, jobs=1).document
    rows = document["parameters"]
    assert document["verdict"] == "parameters_only"
    assert rows["L"]["value"] is None
    assert rows["a_2"]["value"] is None
    assert rows["a_2+D"]["ci95"][0] <= 40.0 <= rows["a_2+D"]["ci95"][1]
    assert "saturat" in document["next_recording"]["sentence"] or "limit" in document["next_recording"]["sentence"]


def test_a_speed_limit_of_the_reference_is_named():
    document = diagnose(recorded({**LIMITED, "L": 400.0, "R": 2.0}), None, jobs=1).document
    found = {m["effect"]: m for m in document["missing"]}
    assert found[RateLimit.name]["parameters"]["R"]["value"] == pytest.approx(2.0, rel=0.03)


def test_a_model_is_written_and_read_again(tmp_path):
    sheet = Datasheet(
        lumped={"a_2": 20.0, "c_2": 8.0},
        effects=((GravityImbalance.name, {"g_s": 5.0, "g_c": 1.0}),),
        loop={"K": 900.0, "L": 150.0, "tau_s": 0.01},
        loop_kind="P",
    )
    write_model(tmp_path / "model.toml", sheet)
    assert read_datasheet(tmp_path / "model.toml") == sheet
    model = model_of(sheet)
    assert model["K"] == 900.0
    assert model.names == (GravityImbalance.name,)


def test_a_light_motor_that_bears_all_friction_is_read_again():
    play = {"gap": 0.01, "rho": 0.06, "phi": 1.0}
    sheet = Datasheet(lumped={"a_2": 20.0}, effects=((Backlash.name, play),), loop={"K": 400.0}, loop_sensor="link")
    assert model_of(sheet).effects[0][1][1:3] == pytest.approx([0.06, 1.0])
    with pytest.raises(InputError, match=r"phi = 1 lies outside 0 \.\. 0\.9"):
        kernel_effects([(Backlash.name, {"gap": 0.01, "phi": 1.0})])


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ('[lumped]\na_2 = 1\n[loop]\nkind = "PX"\nK = 1\n', "one of P, PD"),
        ("[lumped]\na_2 = 1\n[loop]\nK = 0\n", "no K above zero"),
        ("[lumped]\na_2 = 1\n[loop]\nK = 1\nKd = 1\n", "there is no key 'Kd'"),
        ("[lumped]\na_2 = 1\n[loop]\nK = 1\nL = -1\n", "negative L"),
    ],
)
def test_a_loop_that_no_servo_has_is_refused(tmp_path, text, told):
    (tmp_path / "model.toml").write_text(text)
    with pytest.raises(InputError, match=told):
        read_datasheet(tmp_path / "model.toml")


@pytest.mark.parametrize("side", ["load", "link"])
def test_the_mujoco_twin_follows_the_reduced_servo(side):
    play = ((Backlash.name, np.array([0.01, 0.5, 0.8, 60.0, 0.5])),) if side == "link" else ()
    effects = tuple((name, {p.name: v for p, v in zip(Backlash.parameters, x, strict=True)}) for name, x in play)
    sheet = Datasheet(
        lumped={"a_2": 20.0, "c_2": 8.0},
        effects=effects,
        loop={**LIMITED, "D": 2.0, "rubbed": 0.4},
        loop_sensor=side,
        name="model",
    )
    t, r = steps_of(6, 2.0)
    y = [simulate_loop(sheet, t, r, plant=plant) for plant in ("reduced", "mujoco")]
    assert np.sqrt(np.mean((y[0] - y[1]) ** 2)) < 0.002


@pytest.mark.parametrize(("share", "rubbed"), [(0.8, 0.0), (0.8, 0.4), (0.1, 0.3)])
def test_a_gear_rubs_by_what_it_carries_in_mujoco_too(share, rubbed):
    t, r = steps_of(3, 2.0)
    loop, gravity = {"K": 110.0, "L": 150.0, "a_2": 30.0, "c_2": 0.3}, np.array([33.0, 0.0])
    bare = LoopModel(loop | {"share": share, "rubbed": rubbed}, (), ((GravityImbalance.name, gravity),))
    model, run = bare.with_effect(LoadDependentFriction.name, np.array([0.5, *4 * [np.inf]])), run_of(t, r)
    there = LoopedPlant(MechanicalPlant(*model.plant_of(run), timestep=2.5e-4), model.of(run)[0])
    y, own = there.simulate(t, r, run.start, run.before), model.predicted(run)
    assert np.std(y - own) < 0.05 * np.std(own - bare.predicted(run))


def test_commands_take_a_model_with_a_loop_or_refuse_it(tmp_path, capsys):
    sheet = Datasheet(lumped={"a_2": 20.0, "c_2": 8.0}, loop={"K": 900.0, "L": 150.0}, name="model.toml")
    model, out = str(tmp_path / "model.toml"), str(tmp_path / "rec.csv")
    write_model(model, sheet)
    t, r = steps_of(7)
    write_recording(tmp_path / "ref.csv", {"t_s": t, "theta_ref_rad": r})
    assert main(["simulate", model, "--input", str(tmp_path / "ref.csv"), "--out", out]) == 0
    assert main(["identify", out, "--out", str(tmp_path / "found"), "--jobs", "1"]) == 0
    assert "[loop]" in (tmp_path / "found" / "model.toml").read_text()
    capsys.readouterr()
    assert main(["simulate", model, "--input", "steps", "--out", out, "--force"]) == 2
    assert "theta_ref_rad" in capsys.readouterr().err
    assert main(["excite", model, "--out", str(tmp_path / "a.csv")]) == 2
    assert "position loop" in capsys.readouterr().err
    assert main(["identify", out, "--method", "ga", "--out", str(tmp_path / "other")]) == 2


def test_a_late_drives_damping_reaches_mujoco_as_it_is():
    """Where gain and stiffness are the same, MuJoCo reads a positive velocity bias as a damping ratio."""
    for D in (-1.8, 1.8):
        motor = looped_plant(Datasheet(lumped={"a_2": 20.0}, loop={"K": 900.0, "D": D, "L": 150.0})).spec().compile()
        assert motor.actuator("motor").biasprm[1:3] == pytest.approx([-900.0, -D])


def test_a_model_with_a_loop_becomes_a_system_of_python_control():
    """From reference to reading, whole and linear; about its rest alone."""
    sheet = {"lumped": {"a_2": 20.0, "c_2": 1.0}, "loop": {"kind": "P", "K": 900.0, "tau_s": 0.004}}
    model, t = load_model(sheet), np.arange(400) / 500.0
    r = np.where(t < 0.1, 0.0, 0.2)
    whole = control.input_output_response(model.to_nonlinear(500.0), t, r).outputs
    assert np.max(np.abs(whole - simulate_loop(known(sheet), t, r))) < 3e-3
    slipping = model.to_control()
    assert slipping.input_labels == ["theta_ref_rad"] and slipping.dcgain() == pytest.approx(1.0)
    assert model.to_control(rate_hz=500.0).dt == pytest.approx(0.002)
    with pytest.raises(InputError, match="about its rest"):
        model.to_control(theta=0.3)


def test_identify_begins_from_a_model_with_a_loop_and_holds_what_is_told(tmp_path):
    recordings = recorded(LIMITED)
    first = identify(recordings, jobs=1)
    file = tmp_path / "model.toml"
    write_model(file, first.model.datasheet)
    again = identify(recordings, file, jobs=1)
    assert again.parameters["K"] == pytest.approx(first.parameters["K"], rel=1e-3)
    held = identify(recordings, file, fix={"tau_s": 0.01}, jobs=1).to_dict()["parameters"]
    assert held["tau_s"] == held["tau_s"] | {"value": 0.01, "fixed": True}
    with pytest.raises(InputError, match=r"R cannot be fixed: this loop has K, L, tau_s"):
        identify(recordings, file, fix={"R": 3.0}, jobs=1)
    with pytest.raises(InputError, match=r"K cannot be fixed at -5: 0.001 to inf was expected"):
        identify(recordings, file, fix={"K": -5.0}, jobs=1)
    with pytest.raises(InputError, match=r"--fix needs --datasheet"):
        identify(recordings, fix={"K": 900.0}, jobs=1)
    with pytest.raises(InputError, match=r"takes a model.toml with a \[loop\]"):
        identify(recordings, "table1", jobs=1)


def test_an_overdamped_loop_tells_how_late_it_follows_though_not_how_stiff_it_is():
    found = identify_loop(recorded({"K": 1600.0, "a_2": 320.0, "c_2": 0.05}, seeds=(1, 2, 3)))
    slow = found.intervals.combined("(a_2+D)/K")
    assert slow.identifiable and slow.value == pytest.approx(0.2, rel=0.03)
    assert slow.ci95[0] < 0.2 < slow.ci95[1] < 0.22


def test_a_rival_that_parts_the_damping_moves_none_of_it():
    found = identify_loop(recorded({"K": 900.0, "a_2": 20.0, "c_2": 8.0}))
    rival = found.fit.model.having(D=0.7 * found.fit.model["a_2"], a_2=0.3 * found.fit.model["a_2"])
    plain, beside = (Intervals.of(found.fit, found.data, rivals=r).told("", "a_2") for r in ((), [(1.0, rival)]))
    assert plain.ci95 == pytest.approx(beside.ci95)
