"""What every member of the effects folder owes: a complete declaration, parameters within bounds, and nesting."""

from itertools import combinations

import numpy as np
import pytest

from ers_mj.datasheet import read_datasheet
from ers_mj.effects import BY_NAME, EFFECTS, EQUIVALENT
from ers_mj.errors import InputError
from ers_mj.simulation import simulate_recording, unit_of
from test_reduced import SCALES, T, table_1
from ers_mj.plants.inputs import INPUTS
from ers_mj.plants.reduced import ReducedModel

ids = {"ids": lambda e: e.name}


@pytest.mark.parametrize("effect", EFFECTS, **ids)
def test_a_member_declares_itself(effect):
    assert effect.name and effect.sentence and effect.parameters and type(effect).__doc__
    assert effect.subsystem in ("drive", "transmission", "load", "sensor")
    text = effect.describe({p.name: "1" for p in effect.parameters})
    assert "{" not in text
    assert all(p.meaning and unit_of(p.kind) for p in effect.parameters)


@pytest.mark.parametrize("effect", EFFECTS, **ids)
def test_starts_lie_within_bounds(effect):
    for start in effect.starts(SCALES):
        assert len(start) == len(effect.parameters)
        for value, p in zip(start, effect.parameters):
            assert not np.isfinite(value) or p.lower <= value <= p.upper
            assert not p.positive or value > 0


@pytest.mark.parametrize("effect", [e for e in EFFECTS if e.starts(SCALES) and e.name != "backlash"], **ids)
def test_an_absent_effect_leaves_the_motion_alone(effect):
    u = INPUTS["multisine"](T)
    values = np.where(effect.absent() == 0, 1e-12, effect.absent())
    if effect.name == "stribeck":
        values = np.array([1e-12, 0.1, 1.0])
    motion = ReducedModel(table_1().coefficients, [(effect.name, values)]).simulate(T, u).theta
    assert np.degrees(np.max(np.abs(motion - table_1().simulate(T, u).theta))) < 2e-4


@pytest.mark.parametrize("effect", EFFECTS, **ids)
def test_what_a_reader_may_give_acts_and_leaves_numbers(effect):
    """Any of an effect's numbers, however few, are refused or change the recording: none is swallowed in silence."""
    starts = effect.starts(SCALES)
    starts += [more for p in starts for more in effect.grown(effect.name, p, SCALES)]
    typical = {p.name: min((abs(float(s[k])) for s in starts if np.isfinite(s[k]) and s[k] != 0), default=0.3) for k, p in enumerate(effect.parameters)}
    typical |= {"rate": 5.0, "tau_max": 0.01}
    settable = [p.name for p in effect.parameters if not p.recorded]
    t, u = T[:1500], INPUTS["multisine"](T[:1500])
    sheet = read_datasheet("table1")
    plain = simulate_recording(sheet, t, u)["theta_rad"]
    accepted = 0
    for size in range(1, len(settable) + 1):
        for names in combinations(settable, size):
            values = {name: typical[name] for name in names}
            try:
                theta = simulate_recording(sheet, t, u, effects=[(effect.name, values)])["theta_rad"]
            except InputError:
                continue
            accepted += 1
            assert np.max(np.abs(theta - plain)) > 1e-6, values  # nor is it where there is no number
    assert accepted > 0


def test_equivalence_classes_hold_known_names_once():
    names = [n for group in EQUIVALENT for n in group]
    assert len(names) == len(set(names))
    assert set(BY_NAME) & set(names)


CURRENT = [e for e in EFFECTS if e.subsystem in ("drive", "transmission") and e.follows_current and e.name != "cogging"]


@pytest.mark.parametrize("effect", CURRENT, **ids)
def test_an_open_circuit_feels_nothing_of_the_current(effect):
    off, c = np.zeros(T.size, bool), table_1().coefficients
    with_it, without = (ReducedModel(c, chosen).simulate(T, np.zeros(T.size), (0.5, 8.0), enable=off).theta
                        for chosen in ([(effect.name, effect.starts(SCALES)[0])], []))
    assert np.degrees(np.max(np.abs(with_it - without))) < 1e-6
