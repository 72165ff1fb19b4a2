"""Tangents of readings along a motion against central differences of simulations, for every coefficient and every
effect that has them.
"""

import numpy as np
import pytest
from test_reduced import SCALES, TABLE_1

from ers_mj.effects import BY_NAME, EFFECTS
from ers_mj.plants.inputs import INPUTS
from ers_mj.plants.reduced import ReducedModel, lumped

VALUES = {**TABLE_1.to_lumped(), "emf_share": 0.9}
SEEN_BY_EQ_5 = ("a_1", "a_2", "b", "c_1", "c_2", "theta_0")
T = np.arange(0.0, 4.0, 1e-3)
STEP = 1e-5
FORKS = 0.1  # share of the samples where a finite difference may have caught another stick event than the tangent
CLOSE, ROUGHLY = (
    0.1,
    0.7,
)  # distance allowed; a time constant's changes all but cancel over a motion, so that each stick's error shows
LAWS = [
    e
    for e in EFFECTS
    if e.starts(SCALES) and ReducedModel(lumped(VALUES), [(e.name, e.starts(SCALES)[0])]).has_tangents
]


def agree(plant, up, down, scale, u, **options):
    """Relative RMS distance between tangent and central difference, the worst samples left out."""
    run = {"start": (VALUES["theta_0"], 0.0), **options}
    path = plant.outputs(T, u, **run)[1]
    found = plant.tangents(T, u, path, [up], scale, **{k: v for k, v in run.items() if k != "start"})[0][:, 3]
    true = 0.5 * scale * (up.outputs(T, u, **run)[0] - down.outputs(T, u, **run)[0])
    apart = np.sort(np.abs(found - true))[: int((1 - FORKS) * T.size)]
    return np.sqrt(np.mean(apart**2)) / np.sqrt(np.mean(true**2))


@pytest.mark.parametrize(
    "name, inductance",
    [*((n, True) for n in (*SEEN_BY_EQ_5, "tau_e", "emf_share")), *((n, False) for n in SEEN_BY_EQ_5)],
)
def test_of_the_coefficients(name, inductance):
    values = VALUES | ({} if inductance else {"tau_e": 0.0})

    def plant(way):
        return ReducedModel(lumped(values | {name: values[name] * (1.0 + way * STEP)}))

    assert agree(plant(0), plant(1), plant(-1), 1 / STEP, INPUTS["multisine"](T)) < (
        ROUGHLY if name == "tau_e" else CLOSE
    )


@pytest.mark.parametrize(
    "bristle",
    [
        [0.01, 0.5, *4 * [np.inf]],
        [0.0017, 0.25, *4 * [np.inf]],
        [0.0003, 0.5, 0.3, *3 * [np.inf]],
        [0.0017, 0.25, np.inf, 1.5, np.inf, np.inf],
    ],
    ids=["soft", "firm", "stiff", "Dahl's"],
)
@pytest.mark.parametrize("name", [*SEEN_BY_EQ_5, "cogging"])
def test_of_a_rudder_on_a_bristle(name, bristle):
    """The friction holds it like a spring and lets it go; what else changes it, a coefficient or another law, does so
    along the motion that it makes.
    """

    def plant(way):
        values = VALUES if name == "cogging" else VALUES | {name: VALUES[name] * (1.0 + 1e-3 * way)}
        cog = [("cogging", np.array([2.0 + 2e-3 * way, 0.05, 0.3, np.inf, np.inf]))] if name == "cogging" else []
        return ReducedModel(lumped(values), [("presliding", np.array(bristle)), *cog])

    u = INPUTS["multisine"](T)
    y = plant(0).simulate(T, u).theta.copy()
    assert (
        name == "cogging" or agree(plant(0), plant(1), plant(-1), 1e3, u) < CLOSE
    )  # a free run forks where a tooth holds the rudder
    assert agree(plant(0), plant(1), plant(-1), 1e3, u, y=y, gain=0.025, every=5) < 1.2 * CLOSE


@pytest.mark.parametrize("effect", [e for e in LAWS if e.tangible], ids=lambda e: e.name)
def test_of_every_effect_that_has_them(effect):
    start = effect.starts(SCALES)[0]
    finite = [k for k, p in enumerate(effect.parameters) if np.isfinite(start[k]) and p.fitted and p.kind != "count"]
    k = finite[0]
    step = STEP * max(abs(start[k]), 1e-3)

    def plant(way):
        values = start.astype(float).copy()
        values[k] += way * step
        return ReducedModel(lumped(VALUES), [(effect.name, values)])

    assert agree(plant(0), plant(1), plant(-1), 1 / step, INPUTS["multisine"](T)) < (
        ROUGHLY if effect.name == "inductance" else CLOSE
    )


def test_an_observer_forgets_a_change():
    """With y given, the change decays between its causes as the observer's error does."""
    u = INPUTS["multisine"](T)
    plain, moved = ReducedModel(lumped(VALUES)), ReducedModel(lumped(VALUES | {"b": VALUES["b"] * (1 + STEP)}))
    less = ReducedModel(lumped(VALUES | {"b": VALUES["b"] * (1 - STEP)}))
    y = plain.simulate(T, u).theta.copy()
    assert agree(plain, moved, less, 1 / STEP, u, y=y, gain=0.025, every=5) < CLOSE


@pytest.mark.parametrize(
    "beside, name",
    [
        *(
            (beside, name)
            for beside in ("input_delay", "sensor_lag", "sensor_nonlinearity")
            for name in ("b", "a_2", "c_2")
        ),
        ("sensor_lag", "its own"),
        ("sensor_nonlinearity", "its own"),
    ],
)
def test_an_observer_beside_a_delay_or_a_sensors_error(beside, name):
    """Followed is what the sensor shows, and shown is what it makes of the motion."""
    start = BY_NAME[beside].starts(SCALES)[0] * 1.3  # a delay of no whole number of samples

    def plant(way):
        p, values = start.copy(), dict(VALUES)
        if name == "its own":
            p[0] *= 1.0 + way * STEP
        else:
            values[name] *= 1.0 + way * STEP
        return ReducedModel(lumped(values), [(beside, p)])

    u = INPUTS["multisine"](T)
    y = ReducedModel(lumped(VALUES)).simulate(T, u).theta + 0.002 * np.sin(3.0 * T)
    assert agree(plant(0), plant(1), plant(-1), 1 / STEP, u, y=y, gain=0.025, every=5) < CLOSE


def test_what_has_none_says_so():
    with_tangents = {e.name for e in LAWS}
    assert not with_tangents & {"backlash", "shaft_compliance", "end_stop"}
    for name in ("sensor_quantisation", "sensor_dropout"):
        values = np.array([1e-3, 0.01][: len(BY_NAME[name].parameters)])
        assert not ReducedModel(lumped(VALUES), [(name, values)]).has_tangents
    assert len(with_tangents) >= 15
