"""What stays unknown, as tables: found where it is, kept where held-out data asks for it, told nowhere as a name."""

import numpy as np
import pytest
from servo import SPARSE, recorded, started

from ers_mj.decisions.confirmation import Pair, table_pays
from ers_mj.decisions.thresholds import POLICY
from ers_mj.effects import BY_NAME, SUSPECTS, TABLES
from ers_mj.errors import InputError
from ers_mj.estimation.objective import tau_of
from ers_mj.selection.cross_validation import folds, refits
from ers_mj.selection.measure import FREE_RUN
from ers_mj.selection.unknown import unknown
from ers_mj.servo.datasheet import Datasheet, datasheet_of, read_datasheet
from ers_mj.servo.model_file import write_model

BUMPS = np.array([-0.12, 0.147, 25.0, -20.0, 30.0, -25.0, 10.0, 20.0, -30.0, 5.0, 0.0])


def beside(laws):
    """What is kept beside the baseline of a servo under these laws."""
    start = started(recorded(laws, t=SPARSE))
    parts, _ = folds(start.traces, [])
    tau = tau_of(start.fit.misfit)
    models = refits(start.fit.model, parts, tau, 1)
    return unknown(start.fit.model, models, start.traces, parts, FREE_RUN, tau, POLICY)


def test_a_torque_without_a_shape_is_kept_as_a_table():
    (table,) = beside([("unexplained_torque", BUMPS)]).tables
    law, (low, pitch) = BY_NAME["unexplained_torque"].torque, table[1][:2]
    places = np.linspace(low + pitch, low + 7 * pitch, 30)  # where the rudder has been
    told, truth = (np.array([law(tuple(p), x, 0.0, 0.0, 0.0) for x in places]) for p in (table[1], BUMPS))
    assert table[0] == "unexplained_torque" and np.corrcoef(told, truth)[0, 1] > 0.8


def test_no_table_is_kept_of_noise():
    assert beside([]) is None


def test_a_table_must_be_worth_it_one_way_and_lose_little_the_other():
    raw, again, trained = Pair(1.03, 1.0, 1.0), Pair(0.5, 1.0, 1e-3), Pair(0.9, 1.0, 1.0)
    assert table_pays([raw, again], trained, 0.01) and table_pays([again], trained, 0.01)
    assert not table_pays([raw], trained, 0.01)
    assert not table_pays([Pair(1.1, 1.0, 1.0), again], trained, 0.01)
    assert not table_pays([raw, Pair(0.5, 1.0, 0.2)], trained, 0.01)
    assert not table_pays([raw, again], Pair(1.1, 1.0, 1.0), 0.01)


def test_tables_have_a_section_of_their_own_in_a_model_file(tmp_path):
    entries = dict(zip([p.name for p in BY_NAME["unexplained_torque"].parameters], BUMPS.tolist(), strict=True))
    sheet = Datasheet(lumped={"a_2": 50.0, "b": 70.0}, effects=(("unexplained_torque", entries),))
    write_model(tmp_path / "model.toml", sheet)
    text = (tmp_path / "model.toml").read_text()
    assert "[[remainder]]" in text and "[[effect]]" not in text
    assert read_datasheet(tmp_path / "model.toml").effects == sheet.effects
    with pytest.raises(InputError, match=r"\[\[remainder\]\] was expected"):
        datasheet_of({"lumped": {"b": 70.0}, "remainder": {}})


def test_no_table_is_a_name_or_a_suspect():
    assert TABLES and not any(BY_NAME[name].named for name in TABLES) and not set(TABLES) & set(SUSPECTS)
