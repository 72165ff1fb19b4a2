"""The proof's generator knows nothing of the library, and MuJoCo's recorder agrees with its quick simulator."""

import ast
from pathlib import Path

import numpy as np
import pytest

from ers_mj.effects import EFFECTS
from ers_mj.plants.bare_gap import MOTOR_SHARE
from ers_mj.plants.inputs import INPUTS
from ers_mj.plants.mujoco.plant import MechanicalPlant
from ers_mj.plants.reduced import lumped
from ers_mj.proving import case, plans, quick, recorder, scoring
from ers_mj.proving.catalogue import CATALOGUE, LISTED
from ers_mj.proving.forms import TEXTBOOK, draw_shape
from ers_mj.proving.plant import TABLE_1
from ers_mj.proving.sampling import Setup
from ers_mj.proving.strength import nearest
from ers_mj.servo.datasheet import read_datasheet

PACKAGE = Path(__file__).resolve().parents[1] / "ers_mj"
T = np.arange(0.0, 0.6, 1e-3)
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
    assert {p.name for p in seen if "plants" in p.relative_to(PACKAGE).parts} == {"__init__.py", "mjcf_folder.py"}


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


# -- MuJoCo against the quick simulator -------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["multisine", "chirp", "ramp", "steps", "square"])
def test_without_effects_both_simulators_agree(name):
    u = INPUTS[name](T)
    truth = quick.simulate(TABLE_1, [], T, u).true
    assert rms_deg(recorder.record(TABLE_1, [], T, u, step=5e-5).true - truth) < 0.002


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
    step = 2.5e-5 if name in ("load_dependent_friction", "supply_sag", "friction_ageing") else 5e-5  # faint, these
    bare, truth = quick.simulate(TABLE_1, [], T, u).clean, quick.simulate(TABLE_1, [effect], T, u).clean
    apart, size = rms_deg(recorder.record(TABLE_1, [effect], T, u, step=step).clean - truth), rms_deg(truth - bare)
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
        recorder.record(TABLE_1, [], T, None, setup=setup, step=5e-5),
    )
    assert rms_deg(ours.true - truth.true) < 0.01
    assert np.abs(ours.u).max() <= 14.0


def test_the_rod_is_the_packages_rod():
    u, sheet = 1.3 * INPUTS["multisine"](T), read_datasheet("table1")
    theirs = MechanicalPlant(lumped(sheet.to_lumped()), parameters=sheet.parameters, linkage="rod").simulate(T, u).theta
    ours = recorder.record({**TABLE_1, "motor_inertia_share": MOTOR_SHARE}, [], T, u, step=5e-5, linkage="rod").true
    constant = recorder.record(TABLE_1, [], T, u, step=5e-5).true
    assert rms_deg(ours - theirs) < 0.02 < 0.2 < rms_deg(ours - constant)
