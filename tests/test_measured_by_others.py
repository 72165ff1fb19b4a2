"""Recordings beside this checkout are read as their READMEs say, without false problems."""

from pathlib import Path

import numpy as np
import pytest
from csv_made import problem

from ers_mj.data.recording import read_recording
from ers_mj.errors import InputError

SHARED = Path(__file__).resolve().parents[2] / "shared"


def shared(name: str) -> str:
    path = SHARED / name
    if not Path(str(path).split("#")[0]).exists():
        pytest.skip(f"{name} is not beside this checkout")
    return str(path)


@pytest.mark.parametrize(
    ("name", "units", "rate_hz", "quantum"),
    [
        ("data/emps/train.csv", ("V", "m"), 1000, 5e-8),
        ("data/emps/test_pulses.csv", ("V", "m"), 1000, 0.0),
        ("data/throttle/aprbs_25s.csv", ("pct", "V"), 100, 3.2233e-4),
        ("data/throttle/aprbs_63s.csv", ("pct", "V"), 100, 3.2233e-4),
        ("data/sts3215/runs.parquet#run=17", ("V", "rad"), 100, 2 * np.pi / 4096),
    ],
)
def test_real_recordings(name, units, rate_hz, quantum):
    record = read_recording(shared(name))
    assert (record.input_unit, record.output_unit) == units
    assert record.rate_hz == pytest.approx(rate_hz, rel=0.01)
    assert record.quantum == pytest.approx(quantum, rel=1e-3)
    assert not [p for p in record.problems if "stuck" in p or "gap" in p]


def test_the_servo_on_a_bus_and_its_columns():
    record = read_recording(shared("data/sts3215/runs.parquet#run=17"))
    assert record.name == "runs.parquet#run=17"
    assert record.omega is not None and record.vin is not None and record.enable.dtype == bool
    assert problem(record, "ignored").endswith(": duty, i_slow_mA")
    with pytest.raises(InputError, match=r"the runs are 0, 1, .* 959 \(960 in all\)"):
        read_recording(shared("data/sts3215/runs.parquet#run=960"))


@pytest.mark.parametrize("case", range(1, 65, 7))
def test_concealed_cases_are_read_without_false_problems(case):
    for path in sorted(Path(shared(f"concealed/case-{case:03d}")).glob("rec*.csv")):
        record = read_recording(path)
        assert [p for p in record.problems if "converter" not in p] == []


def test_a_sensor_that_drops_out_is_told():
    words = problem(read_recording(shared("concealed/case-052/rec1.csv")), "stuck")
    assert 8 <= int(words.split(" spans")[0].split()[-1]) <= 14
