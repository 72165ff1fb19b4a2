"""What cannot be used of a recording is refused with one sentence."""

import numpy as np
import pyarrow as pa
import pyarrow.parquet
import pytest
from csv_made import N, changed, csv_text, put, text_cell

from ers_mj.data.recording import from_arrays, read_recording
from ers_mj.errors import InputError

MALFORMED = {
    "empty": (lambda c: "", "empty"),
    "blank": (lambda c: " \n\n ", "empty"),
    "header only": (lambda c: "t_s,u_V,theta_rad\n", "no samples"),
    "no header": (lambda c: csv_text(c).split("\n", 1)[1], "there is no time"),
    "binary": (lambda c: bytes(range(256)) * 20, "UTF-8"),
    "binary that decodes": (lambda c: b"t_s,u_V\0\1\2\n" * 20, "binary"),
    "Parquet called CSV": (lambda c: b"PAR1" + bytes(400) + b"PAR1", "binary"),
    "one line of prose": (lambda c: "dear colleague, the recording follows", "no samples"),
    "duplicate column": (lambda c: csv_text(c).replace("u_V,", "t_s,", 1), "t_s stands there more than once"),
    "short row": (lambda c: csv_text(c) + "9,9\n", "data row 401 has 2 cells, the header has 3"),
    "long row": (lambda c: csv_text(c) + "9,9,9,9\n", "data row 401 has 4 cells"),
    "missing time": (lambda c: csv_text(c).replace("t_s", "clock"), "the columns are clock, u_V, theta_rad"),
    "missing input": (
        lambda c: csv_text(c).replace("u_V", "voltage"),
        "no input, u_V, u_duty_pct, tau_cmd_Nm, i_cmd_A, theta_ref_rad",
    ),
    "missing output": (lambda c: csv_text(c).replace("theta_rad", "angle"), "no output"),
    "unknown input unit": (lambda c: csv_text(c).replace("u_V", "u_mV"), "u_mV has an unknown unit, known are u_V,"),
    "unknown output unit": (lambda c: csv_text(c).replace("theta_rad", "theta_grad"), "theta_grad has an unknown unit"),
    "output without unit": (lambda c: csv_text(c).replace("theta_rad", "theta"), "theta has an unknown unit"),
    "unknown time unit": (lambda c: csv_text(c).replace("t_s", "t_ms"), "t_ms has an unknown unit"),
    "two outputs": (lambda c: csv_text(c | {"theta_deg": c["u_V"]}), "theta_rad, theta_deg are all columns of"),
    "two inputs": (lambda c: csv_text(c | {"u_duty_pct": c["u_V"]}), "choose one with --input"),
    "text": (lambda c: text_cell(c, "u_V", 16, "off"), "u_V has the text 'off' in data row 17"),
    "text in an optional column": (lambda c: text_cell(c | {"i_A": c["u_V"]}, "i_A", 3, "n.a."), "'n.a.' in data row"),
    "text over lines": (lambda c: text_cell(c, "u_V", 0, "a\x0bb" * 200), "u_V has the text"),
    "inf": (lambda c: csv_text(changed(c, "u_V", 9, np.inf)), "u_V is infinite in data row 10"),
    "minus inf in y": (lambda c: csv_text(changed(c, "theta_rad", 0, -np.inf)), "infinite"),
    "a number beyond floats": (lambda c: text_cell(c, "theta_rad", 3, "1e999"), "theta_rad"),
    "time repeats": (lambda c: csv_text(changed(c, "t_s", 7, c["t_s"][6])), "repeats in data row 8"),
    "time runs backwards": (lambda c: csv_text(changed(c, "t_s", 7, 0.0)), "runs backwards in data row 8"),
    "time missing": (lambda c: csv_text(changed(c, "t_s", 7, np.nan)), "missing in data row 8"),
    "a quarter of y missing": (lambda c: csv_text(changed(c, "theta_rad", slice(0, N, 4), np.nan)), "lacks 25%"),
    "most of u missing": (lambda c: csv_text(changed(c, "u_V", slice(0, 300), np.nan)), "at most 20%"),
    "all of y missing": (lambda c: csv_text(changed(c, "theta_rad", slice(None), np.nan)), "lacks 100%"),
    "constant output": (lambda c: csv_text(changed(c, "theta_rad", slice(None), 0.25)), "constant at 0.25"),
    "99 samples": (lambda c: csv_text({k: x[:99] for k, x in c.items()}), "has 99 samples, at least 100"),
    "row that never ends": (lambda c: csv_text(c).replace("\n0.005,", '\n"0.005,', 1), "rec.csv"),
}


@pytest.mark.parametrize("case", MALFORMED)
def test_malformed_csv_is_refused_in_one_sentence(tmp_path, columns, case):
    build, words = MALFORMED[case]
    with pytest.raises(InputError) as refusal:
        read_recording(put(tmp_path, build(columns)))
    message = str(refusal.value)
    assert "rec.csv" in message and words in message
    assert len(message.splitlines()) == 1 and len(message) < 400


@pytest.mark.parametrize(
    ("name", "content", "words"),
    [
        ("rec.parquet", "t_s,u_V,theta_rad\n1,2,3\n", "is no Parquet file"),
        ("rec.parquet", "", "empty"),
        ("rec.parquet", b"PAR1" + bytes(100) + b"PAR1", "not a readable Parquet file"),
        ("rec.xyz", "t_s,u_V,theta_rad\n1,2,3\n", "ends in '.xyz', recordings end in .csv, "),
        ("rec", "t_s,u_V,theta_rad\n1,2,3\n", "ends in ''"),
    ],
)
def test_other_files_are_refused_by_what_they_are(tmp_path, name, content, words):
    with pytest.raises(InputError, match=words) as refusal:
        read_recording(put(tmp_path, content, name))
    assert name in str(refusal.value)


@pytest.mark.parametrize("spec", ["nothing.csv", ".", "nothing.parquet#run=3", "a\0b.csv", "x" * 5000 + ".csv"])
def test_paths_that_lead_nowhere(tmp_path, spec):
    with pytest.raises(InputError, match=r"no such file|cannot be read|is a folder| \.\.\. "):
        read_recording(f"{tmp_path}/{spec}")


def test_parquet_columns_that_are_no_numbers(tmp_path, columns):
    times = pa.array(np.arange(N), pa.timestamp("ms"))
    pa.parquet.write_table(pa.table(columns | {"u_V": times}), tmp_path / "rec.parquet")
    with pytest.raises(InputError, match=r"rec.parquet: the column u_V holds timestamp\[ms\], numbers were expected"):
        read_recording(tmp_path / "rec.parquet")


@pytest.mark.parametrize(
    ("spec", "words"),
    [
        ("rec.csv", "holds the runs 1, 2, choose one as in rec.csv#run=1"),
        ("rec.csv#run=9", "there is no run '9', the runs are 1, 2"),
        ("rec.csv#run=", "there is no run '', the runs are 1, 2"),
        ("single.csv#run=1", "has no column run or episode_index or episode, its columns are t_s, u_V, theta_rad"),
    ],
)
def test_runs_that_cannot_be_chosen(tmp_path, columns, spec, words):
    put(tmp_path, csv_text(columns | {"run": np.repeat([1, 2], N // 2)}))
    put(tmp_path, csv_text(columns), "single.csv")
    with pytest.raises(InputError) as refusal:
        read_recording(f"{tmp_path}/{spec}")
    assert words in str(refusal.value)


@pytest.mark.parametrize(
    ("mapping", "words"),
    [
        ({"u_V": "voltag"}, "asks for the column 'voltag', the columns are t_s, u_V, theta_rad"),
        ({"theta": "theta_rad"}, "--map gives 'theta', the names it knows are t_s, u_V"),
    ],
)
def test_a_mistyped_map_lists_what_there_is(tmp_path, columns, mapping, words):
    with pytest.raises(InputError) as refusal:
        read_recording(put(tmp_path, csv_text(columns)), mapping)
    assert words in str(refusal.value)


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"u": np.zeros(N - 1)}, "u has 399 samples, the time has 400"),
        ({"y": np.zeros((N, 2))}, r"y has shape \(400, 2\)"),
        ({"y": ["a"] * N}, "y is not an array of numbers"),
        ({"input_unit": "mV"}, "unknown unit 'mV'; known are V, pct"),
        ({"output_unit": "deg"}, "unknown unit 'deg'; known are rad, m, V"),
        ({"speed": np.zeros(N)}, "no field speed; there are omega"),
    ],
)
def test_arrays_are_checked_like_files(columns, changes, words):
    with pytest.raises(InputError, match=words):
        from_arrays(**(dict(zip("tuy", columns.values(), strict=True)) | changes))
