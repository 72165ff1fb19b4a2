"""What commit 581c791 decided, the policy still decides on the same numbers (analysis/golden.py)."""

import sys
from dataclasses import replace
from pathlib import Path

import pytest

from ers_mj.decisions.thresholds import POLICY

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "analysis"))
golden = pytest.importorskip("golden", reason="analysis/ is not beside the tests")
AS_THEN = replace(POLICY, **golden.SINCE)
SETS = [path.name for path in sorted(golden.TABLES.iterdir()) if any(path.glob("*.json"))]


@pytest.mark.parametrize("name", SETS)
def test_no_decision_of_the_tables_is_another(name):
    assert golden.changed([name], AS_THEN) == []


@pytest.mark.parametrize("name", golden.SINCE)
def test_a_rule_that_came_since_takes_names_or_adds_flags_only(name):
    found = golden.changed(SETS, replace(AS_THEN, **{name: getattr(POLICY, name)}))
    ways = {what.split()[-1]: (was, now) for _, what, was, now in found}
    assert ways == {"pays": {"kept": (True, False)}, "far_off": {"left": (False, True)}}[name]


def test_another_policy_decides_otherwise_on_the_tables():
    """So that the replay reads what it should: names without a gain that matters, verdicts on noise."""
    for changes, word in (({"least_gain": 1e3, "once": 1e3, "peak": 1e9}, "names"), ({"mismatch": -1.0}, "left")):
        found = golden.changed(SETS, replace(AS_THEN, **changes))
        assert any(word in what for _, what, _, _ in found)


def test_every_kind_of_decision_is_in_the_tables():
    told = {what.split()[0] for _, table in golden.tables(SETS) for what, _, _ in golden.decisions(table, POLICY)}
    assert {"round", "order", "verdict", "more"} < told
