"""Long recordings: the part that tells most is searched, the rest held out."""

import numpy as np
import pytest

from ers_mj.data.informative import Long, most_telling, part_of, searched
from ers_mj.data.recording import Recording

FEW = Long(samples=4000, least=1000)


def recording(n=20_000, lively=(9000, 13_000), name="long.csv"):
    """At rest but for a lively span."""
    t = 1e-3 * np.arange(n)
    u, y = np.zeros(n), np.full(n, 0.1)
    a, b = lively
    s = t[a:b] - t[a]
    u[a:b], y[a:b] = np.sin(7 * s) + np.sin(2.3 * s), 0.1 + 0.3 * np.sin(5 * s) + 0.1 * np.sin(1.7 * s)
    return Recording(t=t, u=u, y=y, valid=np.ones(n, bool), vin=12 + u, name=name)


def test_the_part_that_tells_most_is_where_it_moves():
    begin = most_telling(recording(), 4000, 1.0)
    assert abs(begin - 9000) <= 1000


def test_a_short_recording_is_searched_whole():
    short = recording(5000, (1000, 3000))
    assert searched([short], [], FEW) == ([short], [])


def test_what_is_not_searched_is_held_out_and_said():
    (part,), held = searched([recording()], [], FEW)
    assert part.t.size == 4000 and sum(h.t.size for h in held) == 16_000
    assert "which tell most, were searched, the rest was held out" in part.problems[-1]
    assert part.vin.size == part.t.size
    assert len({r.name for r in (part, *held)}) == 3


def test_held_out_recordings_stay_what_they_are():
    other = recording(3000, (0, 2000), "other.csv")
    (part,), held = searched([recording()], [other], FEW)
    assert held == [other] and "the rest was not looked at" in part.problems[-1]


@pytest.mark.parametrize("count", [1, 3])
def test_many_recordings_share_what_is_searched(count):
    parts, _ = searched([recording(name=f"{k}.csv") for k in range(count)], [], FEW)
    assert {p.t.size for p in parts} == {max(FEW.samples // count, FEW.least)}


def test_a_part_begins_where_it_is_cut():
    some = part_of(recording(), 100, 300)
    assert some.t[0] == pytest.approx(0.1) and some.t.size == some.y.size == some.valid.size == 200
