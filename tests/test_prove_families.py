"""The families of the proof: drawn by seed and number alone, read by the package, their truth law reproduces what is in
the file, what they always have is set aside.
"""

import io

import numpy as np
import pytest

from ers_mj.data.recording import read_recording
from ers_mj.errors import InputError
from ers_mj.proving import scoring, world
from ers_mj.proving.bench import Bench, from_states, recorded
from ers_mj.proving.catalogue import CATALOGUE, IN_LOOP
from ers_mj.proving.families.base import Units, lumped
from ers_mj.proving.faults import FAULTS, with_faults
from ers_mj.proving.forms import draw_either
from ers_mj.proving.making import files_of, real_lumped
from ers_mj.proving.parameters import covered
from ers_mj.proving.plans import Plan
from ers_mj.proving.plant import TABLE_1, plant_of
from ers_mj.proving.quick import simulate
from ers_mj.report.proof_families import told_families
from ers_mj.servo.datasheet import read_datasheet

KIND = {"hobby": {"voltage", "duty"}, "direct": {"torque"}, "position": {"position"}}


@pytest.fixture(scope="module")
def bare():
    """{family: (servo, its recordings without any effect)}."""
    out = {}
    for name, family in world.FAMILIES.items():
        servo = family.draw(np.random.default_rng(5), ())
        out[name] = servo, recorded(servo, [], 1e-4)
    return out


def handed_out(servo, runs):
    return files_of(np.random.default_rng(1), servo, runs, [], "full")


# -- what is drawn ---------------------------------------------------------------------------------------------------


def test_a_case_is_the_same_whatever_else_is_asked_for():
    everything = world.plans(80, 7)
    assert [p.family for p in everything[:9]] == [*world.NAMES, world.NAMES[0]]
    screws = [(p.kind, p.labels, p.number) for p in everything if p.family == "screw"]
    assert screws == [(p.kind, p.labels, p.number) for p in world.plans(10, 7, ("screw",))]
    assert screws != [(p.kind, p.labels, p.number) for p in world.plans(10, 8, ("screw",))]


def test_kinds_come_in_their_shares_in_every_family():
    plans = world.plans(40, 3, ("position",))
    assert [sum(p.kind == kind for p in plans) for kind in ("null", "single", "several", "outside")] == [10, 20, 6, 4]
    singles = [p.labels[0] for p in plans if p.kind == "single"]
    assert set(singles) == set(world.FAMILIES["position"].effects)


def test_families_conceal_what_the_proof_knows():
    for family in world.FAMILIES.values():
        assert set(family.effects) <= {name for name, e in (CATALOGUE | IN_LOOP).items() if e.listed}
        assert set(family.outside) <= {name for name, e in CATALOGUE.items() if not e.listed}


def test_an_unknown_family_is_one_sentence():
    with pytest.raises(InputError, match="'rotor' is no family, there are rudder, hobby"):
        world.chosen(["rotor"])


def test_own_forms_are_drawn_half_of_the_time():
    rng, context = np.random.default_rng(0), {"travel": (-0.2, 0.2), "peak_V": 9.0, "peak_A": 2.0, "umax_V": 14.0}
    own = [draw_either(rng, CATALOGUE["stribeck"], context) for _ in range(200)]
    assert 70 < sum(shape["own_form"] for shape in own) < 130
    assert {shape["form"] for shape in own if shape["own_form"]} == {"exp(-(w/v)^2)"}


# -- laws ------------------------------------------------------------------------------------------------------------


def test_units_of_its_own_leave_the_motion_as_it_is():
    """A rudder in units of its own moves as it does in SI, in another unit of angle and time."""
    units = Units(angle=2.0, torque=3.0, volt=0.5, amp=0.7, time=4.0)
    t = np.arange(0.0, 1.0, 1e-3)
    u = 8.0 * np.sign(np.sin(9.0 * t))
    real = simulate(TABLE_1, [], t, u, step=2e-5, stand=0.0).true
    own = simulate(units.own(TABLE_1), [], t / units.time, u / units.volt, step=5e-6, stand=0.0).true
    assert np.allclose(own * units.angle, real, atol=1e-6 * np.ptp(real))
    a, b = lumped(TABLE_1), lumped(units.own(TABLE_1))
    assert b["a_2"] == pytest.approx(a["a_2"] * units.time)


def test_a_window_goes_on_from_the_truth():
    t = np.arange(0.0, 1.0, 1e-3)
    u = 9.0 * np.sin(7.0 * t)
    run = simulate(TABLE_1, [], t, u, step=2e-5)
    states = np.column_stack([run.true, run.omega, run.i_A])
    windows = from_states(plant_of(TABLE_1), u, states, 200, 1e-3, 50)
    assert np.abs(windows - run.true).max() < 1e-5 < np.ptp(run.true)


def test_a_servo_without_an_effect_leaves_less_than_the_noise(bare):
    """Two integrations at other steps: what they differ by is no effect."""
    for name in ("screw", "throttle", "position"):
        servo, runs = bare[name]
        bench = Bench(servo)
        assert bench.pooled([np.sqrt(np.mean(miss**2)) for miss in bench.misses(servo, runs)]) < 0.7, name


def test_bristles_too_stiff_for_the_step_are_stepped_finer(bare):
    servo, _ = bare["direct"]
    shape = {"form": "Dahl", "bristle_damping_ratio": 0.0, "v_d_rad_s": 0.0, "delta": 1.5}
    runs = recorded(servo, [{"label": "presliding", "strength": 0.002, "shape": shape}], 1e-4)
    assert all(np.isfinite(run.true).all() for run in runs)


def test_what_is_concealed_leaves_what_was_drawn_and_the_seed_alone_draws_it():
    files, truth = world.make(Plan(0, "single", ("stribeck",), "screw", 0), 5)
    (effect,) = truth["effects"]
    assert truth["visibility_after_refit_sigma"] == pytest.approx(effect["target_sigma"], rel=0.5)
    assert world.make(Plan(17, "single", ("stribeck",), "screw", 0), 5)[0] == files


# -- what is handed out ----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", list(world.FAMILIES))
def test_every_recording_can_be_read(bare, name, tmp_path):
    servo, runs = bare[name]
    for file, text in handed_out(servo, runs).items():
        (tmp_path / file).write_text(text)
    records = [read_recording(tmp_path / f"rec{k + 1}.csv") for k in range(4)]
    assert {r.input_kind for r in records} <= KIND.get(name, {"voltage"})
    for r, run, record in zip(records, runs, servo.records):
        true = run.true[record.lead :: servo.stride] * servo.units.angle + servo.shift
        assert np.abs(r.y - true).max() < 8.0 * servo.sensor["noise_sigma_eff_rad"] * servo.units.angle
    assert read_datasheet(tmp_path / "datasheet.toml").sample_rate_hz == servo.sensor["sample_rate_hz"]


@pytest.mark.parametrize("name", ["screw", "gimbal", "direct"])
def test_the_files_obey_the_lumped_law_of_the_truth(bare, name):
    """theta'' = -a_2 theta' - c_2 sgn theta' + b u, in the file's own units, over windows that move one way."""
    servo, runs = bare[name]
    law, fits = real_lumped(servo), []
    for file, text in handed_out(servo, runs).items():
        if file.startswith("rec"):
            table = np.genfromtxt(io.StringIO(text), delimiter=",", names=True)
            fits.append(weak(*(table[column] for column in table.dtype.names[:3]), servo.units.time))
    left, right = (np.concatenate(part) for part in zip(*fits))
    b, a_2, c_2 = np.linalg.lstsq(right, left, rcond=None)[0]
    assert b == pytest.approx(law["b"], rel=0.1)
    assert (-a_2, -c_2) == (pytest.approx(law["a_2"], rel=0.25), pytest.approx(law["c_2"], rel=0.25))


def weak(t, u, y, slow):
    """Weak form over bumps (left (K,), right (K, 3)): no derivative of the output is taken."""
    good = np.isfinite(y) & np.isfinite(u)
    t, u, y = t[good], u[good], y[good]
    half = max(int(0.04 * t.size / (t[-1] - t[0]) * slow), 6)
    s = np.arange(-half, half + 1) / half
    bump = (1 - s**2) ** 3
    dt = np.median(np.diff(t))
    first = np.gradient(bump, dt)
    second = np.gradient(first, dt)
    second -= second.mean()
    rate = np.convolve(y, first, "same")
    smooth = np.convolve(y, second, "same")
    pull, sign = np.convolve(u, bump, "same"), np.convolve(np.sign(rate), bump, "same")
    inside = np.abs(sign) > 0.999 * bump.sum()
    inside[: 3 * half] = inside[-3 * half :] = False
    return smooth[inside], np.column_stack([pull, rate, sign])[inside]


@pytest.mark.parametrize("kind", list(FAULTS))
def test_faults_leave_a_file_of_rows(kind):
    n = np.arange(4000)
    table = {"t_s": 0.01 * n, "u_V": 5.0 * np.sin(0.1 * n), "theta_rad": 3.0 * np.sin(0.01 * n)}
    fault = {"kind": kind, "seed": 3, "s": 1e-4, "at": 2.0}
    columns = {"input": "u_V", "output": "theta_rad"}
    out = with_faults(table, [fault], 0, columns)
    assert len({x.size for x in out.values()}) == 1 and np.all(np.diff(out["t_s"]) > 0.0)
    assert any(name not in table or not np.array_equal(out[name], table[name]) for name in out)
    assert np.array_equal(with_faults(table, [fault], 0, columns)["theta_rad"], out["theta_rad"], equal_nan=True)


# -- scores ----------------------------------------------------------------------------------------------------------


def row(family, labels, named, inherent=(), parameters=None, lumped_truth=None):
    truth = {
        "case": "case-001",
        "family": family,
        "kind": "single" if labels else "null",
        "labels": labels,
        "inherent": list(inherent),
        "linkage": "constant",
        "lumped": lumped_truth or {},
        "visibility_after_refit_sigma": 9.0,
    }
    document = {
        "verdict": "missing_physics" if named else "consistent",
        "missing": [{"effect": name, "probability": 0.9} for name in named],
        "parameters": parameters or {},
    }
    return scoring.row_of(truth, {"document": document, "error": None, "cpu_s": 1.0, "wall_s": 1.0, "peak_MiB": 1.0})


def test_what_a_family_always_has_is_set_aside_before_counting():
    arm = ("gravity_imbalance",)
    results = scoring.scored(
        [
            row("hobby", [], ["gravity_imbalance"], arm),
            row("hobby", ["stribeck"], ["gravity_imbalance", "stribeck"], arm),
            row("hobby", ["stribeck"], ["stribeck", "quadratic_drag"], arm),
            row("screw", ["stribeck"], ["backlash"]),
        ]
    )
    hobby, screw = results["families"]["hobby"], results["families"]["screw"]
    assert (hobby["false_alarm_rate"], hobby["top1"], hobby["exact"], hobby["of"]["arm_recall"]) == (0, 1, 0.5, [2, 3])
    assert (screw["top1"], screw["of"]["arm_recall"], results["cases"]) == (0, [0, 0], 4)
    assert results["of"]["exact_clear"] == [1, 3]
    assert any(line.strip().startswith("hobby") for line in told_families(results))


def test_intervals_are_counted_by_family_where_they_are_told():
    rows = {
        "b": {"value": 10.0, "ci95": [9.0, 11.0], "identifiable": True},
        "a_2": {"value": 3.0, "ci95": [2.0, 4.0], "identifiable": True},
        "c_2": {"value": 3.0, "ci95": [2.0, 2.5], "identifiable": False},
        "a_1": {"value": 0.0, "ci95": [0.0, 0.0], "identifiable": True},
    }
    true = {"a_1": 0.0, "a_2": 5.0, "b": 10.5, "c_2": 3.0}
    table = scoring.scored([row("screw", [], [], parameters=rows, lumped_truth=true)])["coverage"]["screw"]
    assert {name: (c["inside"], c["of"]) for name, c in table.items()} == {"all": (1, 2), "a_2": (0, 1), "b": (1, 1)}


def test_an_effects_number_is_compared_where_its_form_is_the_packages():
    effect = {"label": "backlash", "strength": 1.0, "shape": {"own_form": True}}
    truth = {
        "effects": [effect],
        "units": {"angle": 2.0, "time": 1.0},
        "shift": 0.0,
        "true_parameters": {"n": 10.0, "theta_0": 0.0},
    }
    gap = {"value": 0.0175, "ci95": [0.017, 0.018]}
    document = {"missing": [{"effect": "backlash", "parameters": {"gap": gap}}]}
    assert [(e["name"], e["inside"]) for e in covered(truth, document)] == [("backlash gap", True)]
    other = {**truth, "effects": [{**effect, "shape": {"own_form": False}}]}
    assert covered(other, document) == []
