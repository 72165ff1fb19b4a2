"""Parameters along a stream: found, followed, announced; a model that stops explaining it; text that comes in pieces;
the command.
"""

import json
import math
import signal
import subprocess
import sys

import numpy as np
import pytest

from ers_mj import cli
from ers_mj.data.streaming import Stream
from ers_mj.errors import InputError
from ers_mj.online.horizon import HORIZON
from ers_mj.online.moving_horizon import Tracker, opening
from ers_mj.plants.bare_gap import stiff_play
from ers_mj.plants.inputs import INPUTS
from ers_mj.plants.reduced import ReducedModel, lumped
from ers_mj.report.watch_report import events, screen, units
from ers_mj.servo.datasheet import Datasheet, read_datasheet

RATE, NOISE = 1000.0, math.radians(0.01)
TRUTH = {
    k: v for k, v in read_datasheet("table1").to_lumped().items() if k in ("a_1", "a_2", "b", "c_1", "c_2", "theta_0")
}
OFF = Datasheet(lumped={k: v * (1.0 if k == "theta_0" else 1.2) for k, v in TRUTH.items()})


def stream(*parts, noise=NOISE, seed=0):
    """t, u, y of a servo that changes from part to part: (seconds, {letter: value}, half-width of its play)."""
    state, at, angles = (TRUTH["theta_0"], 0.0, 0.0), 0, []
    for seconds, values, gap in parts:
        t = np.arange(at, at + round(seconds * RATE) + 1) / RATE
        c = lumped({**TRUTH, **values})
        path = ReducedModel(stiff_play(c, gap) if gap else c).outputs(t, INPUTS["multisine"](t), state)[1]
        angles.append(path[:-1, 0])
        state, at = (*path[-1, :2], 0.0), at + t.size - 1
    y = np.concatenate(angles)
    t = np.arange(y.size) / RATE
    return t, INPUTS["multisine"](t), y + noise * np.random.default_rng(seed).standard_normal(y.size)


def watched(t, u, y, piece=70, datasheet=OFF):
    head = round(HORIZON.opening * RATE)
    tracker, out = Tracker(opening(t[:head], u[:head], y[:head], datasheet, True)), []
    for k in range(0, t.size, piece):
        out += tracker.push(t[k : k + piece], u[k : k + piece], y[k : k + piece])
    return out


@pytest.fixture(scope="module")
def life():
    """4 s as it is, 3 s with 20 % more friction, 3 s with a play of +-0.5 deg, 3 s without."""
    more = {"c_2": 1.2 * TRUTH["c_2"]}
    data = stream((4.0, {}, 0.0), (3.0, more, 0.0), (3.0, more, math.radians(0.5)), (3.0, more, 0.0))
    return data, watched(*data)


def between(found, begin, end):
    return [e for e in found if begin <= e.t < end]


def test_an_unchanged_servo_is_found_within_its_spread_and_never_flagged(life):
    calm = between(life[1], 1.0, 4.0)
    assert len(calm) == pytest.approx(3.0 / HORIZON.hop, abs=1) and all(
        e.misfit < HORIZON.explained and not e.flag and not e.changed for e in calm
    )
    for name, spread in calm[-1].spread.items():
        miss = calm[-1].values[name] - TRUTH[name]
        assert abs(miss if name == "theta_0" else miss / TRUTH[name]) < 5 * spread < 0.05


def test_a_step_in_friction_is_found_within_a_second_and_announced_alone(life):
    after = between(life[1], 4.0, 7.0)
    found = [e.t for e in after if abs(e.values["c_2"] / (1.2 * TRUTH["c_2"]) - 1) < 0.05]
    assert found[0] < 5.0 and len(found) >= 20 and not any(e.flag for e in after)
    changed = {name: pair for e in after for name, pair in e.changed.items()}
    assert changed.keys() == {"c_2"} and changed["c_2"][1] / changed["c_2"][0] == pytest.approx(1.2, abs=0.03)


def test_a_play_raises_the_flag_and_its_end_lowers_it(life):
    up = [e.t for e in between(life[1], 7.0, 10.0) if e.flag]
    assert 7.0 + HORIZON.patience < up[0] < 9.0 and not between(life[1], 12.0, 13.0)[-1].flag
    assert between(life[1], 12.0, 13.0)[-1].values["c_2"] == pytest.approx(1.2 * TRUTH["c_2"], rel=0.01)


def test_what_no_parameter_explains_leaves_the_parameters_as_they_were(life):
    before, during = between(life[1], 6.5, 7.0)[-1], between(life[1], 8.5, 10.0)
    assert all(e.values == during[0].values for e in during if e.misfit > HORIZON.explained)
    assert during[-1].values["b"] == pytest.approx(before.values["b"], rel=0.05)


def test_how_the_stream_is_cut_into_pieces_does_not_matter(life):
    t, u, y = (x[:2500] for x in life[0])
    one, other = watched(t, u, y, piece=1), watched(t, u, y, piece=2500)
    assert [e.t for e in one] == [e.t for e in other] and one[-1].values == other[-1].values


def test_missing_samples_spikes_and_a_gap_in_time_are_no_change():
    t, u, y = stream((6.0, {}, 0.0), seed=3)
    y[1500:1520], y[2200] = np.nan, y[2200] + 0.3
    kept = (t < 3.0) | (t > 4.2)
    found = watched(t[kept], u[kept], y[kept])
    assert not any(e.flag or e.changed for e in found)
    assert not between(found, 3.2, 4.2 + HORIZON.shortest) and abs(found[-1].values["c_2"] / TRUTH["c_2"] - 1) < 0.01


def test_a_slow_drift_is_followed():
    share = 1 + 0.01 * np.arange(80) / 10
    found = watched(*stream(*((0.1, {"c_2": s * TRUTH["c_2"]}, 0.0) for s in share)))
    assert not any(e.flag for e in found) and found[-1].values["c_2"] / TRUTH["c_2"] == pytest.approx(
        share[-1], abs=0.03
    )


# -- text --------------------------------------------------------------------------------------------------------------


def test_lines_may_come_in_any_pieces():
    text = "\ufeffnote;t_s;theta_deg;u_V\r\nx;0,0;1,5;2\r\nx;0,1;;nan\r\nx;0,2;-1e1;3"
    for size in (1, 7, 1000):
        stream = Stream("s")
        rows = [stream.feed(piece) for piece in (*(text[k : k + size] for k in range(0, len(text), size)), "\n")]
        t, u, y = (np.concatenate(column) for column in zip(*rows, strict=True))
        assert t.tolist() == [0.0, 0.1, 0.2] and u.tolist() == [2.0, 2.0, 3.0]
        assert (
            np.degrees(y[[0, 2]]) == pytest.approx([1.5, -10.0])
            and np.isnan(y[1])
            and stream.units == {"t": "s", "u": "V", "y": "rad"}
        )


@pytest.mark.parametrize(
    "body, told",
    [
        ("1,2\n", "3"),
        ("0,1,0\n0,1,0\n", "repeats"),
        ("1,1,0\n0,1,0\n", "backwards"),
        ("0,x,0\n", "'x'"),
        ("0,inf,0\n", "infinite"),
        (",1,0\n", "missing"),
        ("0,,0\n", "missing"),
    ],
)
def test_rows_that_cannot_be_meant_are_refused(body, told):
    with pytest.raises(InputError, match=told):
        Stream("s").feed("t_s,u_V,theta_rad\n" + body)


def test_what_happens_is_told(life):
    shown, told, last = units("rad", "V"), [], None
    for e in life[1]:
        told += events(last, e, shown)
        last = e
    assert (
        "friction c_2 has changed" in told[0]
        and "(+20 %)" in told[0]
        and told[1].startswith("FLAG")
        and told[-1] == "the model explains the stream again"
    )
    until = 1 + next(k for k, e in enumerate(life[1]) if e.flag)
    lines = screen("x.csv", life[1][:until], told, life[1][0].values, shown, 80)
    assert "does not explain" in lines[1] and any(line.startswith("  friction c_2") for line in lines)


# -- the command -------------------------------------------------------------------------------------------------------


def csv(data, rows=slice(None)):
    cells = zip(*(x[rows].tolist() for x in data), strict=True)
    return "t_s,u_V,theta_rad\n" + "".join(f"{t!r},{u!r},{y!r}\n" for t, u, y in cells)


def test_the_command_reads_a_file_once(life, tmp_path, capsys):
    (tmp_path / "s.csv").write_text(csv(life[0], slice(5500)))
    assert cli.main(["watch", str(tmp_path / "s.csv"), "--datasheet", "table1", "--once", "--json"]) == 0
    rows = [json.loads(line) for line in capsys.readouterr().out.splitlines()]
    assert [r["t_s"] for r in rows] == pytest.approx(
        [HORIZON.shortest + HORIZON.hop * k for k in range(len(rows))], abs=2e-3
    ) and "c_2" in {n for r in rows for n in r["changed"]}
    low, high = rows[30]["parameters"]["b"]["ci95"]
    assert low < rows[30]["parameters"]["b"]["value"] < high


def test_a_growing_file_is_followed_until_ctrl_c(life, tmp_path):
    file, text = tmp_path / "s.csv", csv(life[0], slice(3000))
    file.write_text(text[:1000])
    command = [sys.executable, "-m", "ers_mj", "watch", str(file), "--datasheet", "table1"]
    process = subprocess.Popen(
        command,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),
    )  # which a shell's background job would ignore
    with file.open("a") as handle:
        handle.write(text[1000:])
    line = process.stdout.readline()
    process.send_signal(signal.SIGINT)
    rest, errors = process.communicate()
    assert line.startswith("0.5 s") and "c_2" in line
    assert process.returncode == 130 and errors == "ers: stopped following s.csv\n"


@pytest.mark.parametrize(
    "text, told",
    [
        ("", "ended after 0 s"),
        ("t_s,u_V,theta_rad\n0,1,0\n", "ended after 0 s"),
        ("t_s,u_V\n", "no output"),
        ("t_s,u_V,theta_rad\n0,1\n", "2 cells"),
        ("\0\1\n", "binary"),
    ],
)
def test_bad_input_is_one_sentence(text, told, tmp_path, capsys):
    (tmp_path / "s.csv").write_text(text)
    assert cli.main(["watch", str(tmp_path / "s.csv"), "--once"]) == 2
    errors = capsys.readouterr().err
    assert told in errors and errors.count("\n") == 1
