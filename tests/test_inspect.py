"""What a recording is, before anything is fitted."""

import json
import subprocess
import sys

import numpy as np
import pytest

from ers_mj import cli
from ers_mj.data.recording import from_arrays, write_recording

N, STEP = 2000, 0.005
T = STEP * np.arange(N)
COUNT = 2 * np.pi / 4096


@pytest.fixture
def swing():
    """A joint that swings both ways, read by 4096 counts a turn, beside a current that is refreshed every 4 rows."""
    rng = np.random.default_rng(3)
    theta = np.round((0.5 * np.sin(5 * T) + 2e-4 * rng.normal(size=N)) / COUNT) * COUNT
    return {"t_s": T, "u_V": 3 * np.sin(5 * T + 0.4), "theta_rad": theta, "i_A": np.repeat(rng.normal(size=N // 4), 4)}


def record_of(columns):
    return from_arrays(columns["t_s"], columns["u_V"], columns["theta_rad"], current=columns["i_A"])


def test_channels_tell_rate_refresh_noise_and_quantum(swing):
    found = record_of(swing).inspect()
    channels = {channel.name: channel for channel in found.channels}
    assert found.rate_hz == pytest.approx(200.0)
    assert channels["theta_rad"].quantum == pytest.approx(COUNT)
    assert channels["theta_rad"].refresh_s == pytest.approx(STEP)
    assert channels["i_A"].blanks == 3 * N // 4
    smooth = from_arrays(T, swing["u_V"], 0.5 * np.sin(5 * T) + 2e-4 * np.random.default_rng(1).normal(size=N))
    assert {c.name: c.noise for c in smooth.inspect().channels}["theta_rad"] == pytest.approx(2e-4, rel=0.1)


def test_coverage_and_spectrum_are_those_of_the_signals(swing):
    found = record_of(swing).inspect()
    for edges, share in found.coverage.values():
        assert share.sum() == pytest.approx(1.0)
        assert np.all(np.diff(edges) > 0)
    f, u, _ = found.spectrum
    assert f[np.argmax(u)] == pytest.approx(5 / (2 * np.pi), abs=0.3)
    assert found.to_dict()["input_band_hz"] == pytest.approx(5 / (2 * np.pi), abs=0.7)


def can_tell(record):
    return {told.what: told.can for told in record.inspect().tells}


def test_what_could_be_told_follows_the_motion(swing):
    both = can_tell(record_of(swing))
    assert both["dry friction, and whether it depends on the direction"]
    assert both["play and elastic parts"]
    assert not both["a supply that sags"]
    one_way = can_tell(from_arrays(T, np.full(N, 2.0), 3 * T + 1e-3 * np.sin(T)))
    assert not one_way["the gain from voltage over inertia"]
    assert not one_way["dry friction, and whether it depends on the direction"]


def test_the_command_tells_writes_and_prints_json(swing, tmp_path, capsys):
    write_recording(tmp_path / "rec.csv", swing)
    assert cli.main(["inspect", str(tmp_path / "rec.csv"), "--out", str(tmp_path / "out")]) == 0
    told = capsys.readouterr().out
    assert "i_A is refreshed every 4 rows" in told
    assert "could tell" in told
    assert (tmp_path / "out" / "report.html").read_text().count("data-chart=") == 3
    assert cli.main(["inspect", str(tmp_path / "rec.csv"), "--json"]) == 0
    document = json.loads(capsys.readouterr().out)
    assert document["input_kind"] == "voltage"
    assert {"name", "rate_hz", "refresh_s", "noise", "quantum"} <= set(document["channels"][0])
    assert {fault["kind"] for fault in document["faults"]} == {"held", "converter"}
    assert document["recordings"][0]["file"] == "rec.csv"


def test_nothing_is_compiled(swing, tmp_path):
    write_recording(tmp_path / "rec.csv", swing)
    script = (
        "import sys; from ers_mj import cli; code = cli.main(['inspect', *sys.argv[1:]])\n"
        "assert 'numba' not in sys.modules; sys.exit(code)"
    )
    asked = [str(tmp_path / "rec.csv"), "--out", str(tmp_path / "out")]
    done = subprocess.run([sys.executable, "-c", script, *asked], capture_output=True, check=False)
    assert done.returncode == 0, done.stderr
