"""A recording is read whole and in SI, or refused with one sentence; nothing is passed over in silence."""

import pickle
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet
import pytest

from ers_mj.data.prepared import start_seen
from ers_mj.data.recording import from_arrays, read_recording, write_recording
from ers_mj.data.sensor_faults import converter_step, leapt_spans, unmoved_spans
from ers_mj.errors import InputError

SHARED = Path(__file__).resolve().parents[2] / "shared"
N = 400


def shared(name: str) -> str:
    path = SHARED / name
    if not Path(str(path).split("#")[0]).exists():
        pytest.skip(f"{name} is not beside this checkout")
    return str(path)


@pytest.fixture
def columns() -> dict[str, np.ndarray]:
    rng = np.random.default_rng(1)
    t = np.arange(N) * 1e-3
    u = 5 * np.sin(40 * t) + 0.1 * rng.normal(size=N)
    theta = 0.26 + 0.1 * np.sin(40 * t - 0.5) + 1e-4 * rng.normal(size=N)
    return {"t_s": t, "u_V": u, "theta_rad": theta}


def csv_text(columns: dict, separator: str = ",", newline: str = "\n") -> str:
    rows = zip(*[map(repr, np.asarray(x).tolist()) for x in columns.values()], strict=True)
    return newline.join([separator.join(columns), *map(separator.join, rows)]) + newline


def put(tmp_path: Path, content: str | bytes, name: str = "rec.csv") -> Path:
    path = tmp_path / name
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    return path


def changed(columns: dict, column: str, rows: object, value: object) -> dict:
    x = columns[column].copy() if not isinstance(value, str) else columns[column].astype(object)
    x[rows] = value
    return columns | {column: x}


def text_cell(columns: dict, column: str, row: int, text: str) -> str:
    return csv_text(changed(columns, column, row, text)).replace(repr(text), text)


def problem(record: object, words: str) -> str:
    """The one problem that has these words."""
    (found,) = [p for p in record.problems if words in p]
    return found


# -- what is read ---------------------------------------------------------------------------------------


def test_a_clean_recording_is_read_exactly_and_has_no_problem(tmp_path, columns):
    record = read_recording(put(tmp_path, csv_text(columns)))
    for field, x in zip("tuy", columns.values(), strict=True):
        np.testing.assert_array_equal(getattr(record, field), x)
    assert record.problems == ()
    assert (record.input_unit, record.output_unit, record.name) == ("V", "rad", "rec.csv")
    assert record.valid.all() and len(record.sha256) == 64
    assert record.duration == pytest.approx(0.399)
    assert record.rate_hz == pytest.approx(1000)


@pytest.mark.parametrize(
    "rewrite",
    [
        lambda text: "\ufeff" + text,
        lambda text: text.replace("\n", "\r\n"),
        lambda text: text.replace("t_s,u_V", " t_s , u_V "),
        lambda text: text.replace("t_s,u_V", '"t_s","u_V"'),
        lambda text: text.replace(",", " , "),
        lambda text: text.replace(",", ";").replace(".", ","),
        lambda text: text.replace(",", "\t"),
        lambda text: "\n" + text + "\n\n",
    ],
    ids=["BOM", "CRLF", "header spaces", "quotes", "cell spaces", "semicolons", "tabs", "blank lines"],
)
def test_the_dialects_of_csv_say_the_same(tmp_path, columns, rewrite):
    record = read_recording(put(tmp_path, rewrite(csv_text(columns))))
    np.testing.assert_array_equal(record.y, columns["theta_rad"])
    np.testing.assert_array_equal(record.u, columns["u_V"])


@pytest.mark.parametrize(
    ("name", "factor", "unit"),
    [("theta_rad", 1, "rad"), ("theta_deg", np.pi / 180, "rad"), ("x_m", 1, "m"), ("y_sensor_V", 1, "V")],
)
def test_each_output_is_converted(tmp_path, columns, name, factor, unit):
    theta = columns.pop("theta_rad")
    record = read_recording(put(tmp_path, csv_text(columns | {name: theta})))
    np.testing.assert_array_equal(record.y, theta * factor)
    assert record.output_unit == unit


def test_optional_columns_are_taken_and_foreign_ones_told(tmp_path, columns):
    optional = ["omega_rad_s", "i_A", "theta_m_rad", "vin_V", "T_L_Nm", "temp_C", "theta_ref_deg"]
    more = dict.fromkeys(optional, columns["u_V"]) | {"torque_enable": columns["t_s"] > 0.1}
    more = {name: np.asarray(x, float) for name, x in more.items()} | {"F_N": columns["u_V"]}
    record = read_recording(put(tmp_path, csv_text(columns | more)))
    for field in ("omega", "current", "theta_m", "vin", "load", "temperature"):
        np.testing.assert_array_equal(getattr(record, field), columns["u_V"])
    np.testing.assert_allclose(record.reference, np.radians(columns["u_V"]))
    assert record.enable.dtype == bool and record.enable.sum() == N - 101
    assert problem(record, "ignored").endswith("ignored: F_N")


def test_a_reference_in_another_unit_than_the_output_is_ignored(tmp_path, columns):
    record = read_recording(put(tmp_path, csv_text(columns | {"x_ref_m": columns["u_V"]})))
    assert record.reference is None
    assert "x_ref_m" in problem(record, "ignored")


def test_map_takes_other_names_and_settles_which_output_counts(tmp_path, columns):
    t, u, theta = columns.values()
    text = csv_text({"zeit": t, "u_V": u, "theta_rad": u, "winkel": theta})
    record = read_recording(put(tmp_path, text), {"t_s": "zeit", "theta_rad": "winkel"})
    np.testing.assert_array_equal(record.y, theta)
    assert problem(record, "ignored").endswith(": theta_rad")


def test_time_may_start_anywhere(tmp_path, columns):
    record = read_recording(put(tmp_path, csv_text(columns | {"t_s": columns["t_s"] - 17.0})))
    assert record.t[0] == -17.0
    assert record.problems == ()


@pytest.mark.parametrize("dtype", ["float32", "float64", "string"])
def test_one_run_of_a_parquet_file(tmp_path, columns, dtype):
    twice = {name: np.concatenate([x, x + 1e-3]) for name, x in columns.items()}
    table = {name: pa.array(x).cast(dtype) for name, x in twice.items()} | {"run": np.repeat([3, 17], N)}
    pa.parquet.write_table(pa.table(table), tmp_path / "runs.parquet")
    record = read_recording(f"{tmp_path}/runs.parquet#run=17")
    assert record.name == "runs.parquet#run=17"
    np.testing.assert_allclose(record.y, columns["theta_rad"] + 1e-3, atol=1e-6)
    assert not [p for p in record.problems if "run" in p]


def test_a_record_is_locked_and_leaves_the_callers_arrays_alone(columns):
    given = [x.copy() for x in columns.values()]
    given[1][5] = np.nan
    before = [x.copy() for x in given]
    record = from_arrays(*given, current=given[1])
    for x, y in zip(given, before, strict=True):
        np.testing.assert_array_equal(x, y)
        assert x.flags.writeable
    for copy in (record, pickle.loads(pickle.dumps(record))):
        for x in (copy.t, copy.u, copy.y, copy.valid, copy.current):
            with pytest.raises(ValueError, match="read-only"):
                x[0] = 0


def test_writing_and_reading_is_exact(tmp_path, columns):
    columns["theta_rad"][7] = np.nan
    first = from_arrays(*columns.values(), reference=columns["u_V"], enable=columns["t_s"] > 0.2)
    write_recording(tmp_path / "copy.csv", first.columns())
    second = read_recording(tmp_path / "copy.csv")
    for field in ("t", "u", "y", "valid", "reference", "enable"):
        np.testing.assert_array_equal(getattr(first, field), getattr(second, field))
    assert (tmp_path / "copy.csv").read_text().splitlines()[0] == "t_s,u_V,theta_rad,theta_ref_rad,torque_enable"
    assert [path.name for path in tmp_path.iterdir()] == ["copy.csv"]


def test_a_write_that_fails_leaves_nothing_behind(tmp_path, columns):
    (tmp_path / "folder.csv").mkdir()
    with pytest.raises(InputError, match=r"folder\.csv: cannot be written"):
        write_recording(tmp_path / "folder.csv", columns)
    with pytest.raises(InputError, match="one length"):
        write_recording(tmp_path / "b.csv", columns | {"u_V": [1.0]})
    assert [path.name for path in tmp_path.iterdir()] == ["folder.csv"]


def test_a_long_file_is_read_whole(tmp_path):
    t = np.arange(25_000) * 1e-3
    path = tmp_path / "long.csv"
    noise = np.random.default_rng(0).normal(size=(5, t.size))
    names = ["t_s", "u_V", "theta_rad", "i_A", "omega_rad_s", "vin_V"]
    write_recording(path, dict(zip(names, [t, *noise], strict=True)))
    recording = read_recording(path)
    assert all(np.array_equal(x, recording.columns()[name]) for name, x in zip(names, [t, *noise], strict=True))


# -- what is refused ------------------------------------------------------------------------------------

MALFORMED = {
    "empty": (lambda c: "", "empty"),
    "blank": (lambda c: " \n\n ", "empty"),
    "header only": (lambda c: "t_s,u_V,theta_rad\n", "no samples"),
    "no header": (lambda c: csv_text(c).split("\n", 1)[1], "there is no time"),
    "binary": (lambda c: bytes(range(256)) * 20, "UTF-8"),
    "binary that decodes": (lambda c: b"t_s,u_V\0\1\2\n" * 20, "binary"),
    "UTF-16": (lambda c: csv_text(c).encode("utf-16"), "UTF-8"),
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
    "row that never ends": (lambda c: csv_text(c) + '"' + "1" * 10, "rec.csv"),
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
        ("rec.parquet", "t_s,u_V,theta_rad\n1,2,3\n", "not a readable Parquet file"),
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
    with pytest.raises(InputError, match=r"no such file|cannot be read"):
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


# -- what is worked around ------------------------------------------------------------------------------


def test_missing_values_are_masked_in_y_and_held_in_u(columns):
    t, u, y = columns.values()
    u, y = u.copy(), y.copy()
    u[[0, 100, 101]], y[[50, 60]] = np.nan, np.nan
    record = from_arrays(t, u, y)
    assert np.flatnonzero(~record.valid).tolist() == [50, 60]
    assert np.isnan(record.y[~record.valid]).all()
    assert record.u[0] == u[1] and (record.u[100:102] == u[99]).all()
    assert problem(record, "u is missing").endswith("in 3 samples (0.75%), which are taken as the last value before")
    assert "2 samples (0.50%)" in problem(record, "y is missing")


def test_an_optional_column_that_is_mostly_blank_is_dropped_and_told(columns):
    record = from_arrays(*columns.values(), current=np.full(N, np.nan))
    assert record.current is None
    assert problem(record, "current") == "current lacks 100% of its values and is not used"


def test_gaps_and_jitter_are_counted(columns):
    t, u, y = columns.values()
    gapped = t + 0.05 * (t >= 0.1) + 0.02 * (t >= 0.2)
    assert problem(from_arrays(gapped, u, y), "gap") == "time has 2 gaps, the largest of 0.051 s after 0.099 s"
    jittered = t + 1e-5 * np.random.default_rng(0).normal(size=N)
    share = float(problem(from_arrays(jittered, u, y), "jitter").split("by ")[1].split("%")[0])
    assert share == pytest.approx(100 * np.std(np.diff(jittered)) / 1e-3, abs=0.2)
    assert from_arrays(t + 1e-8 * np.random.default_rng(0).normal(size=N), u, y).problems == ()


def test_clipped_spans_of_input_and_output(columns):
    t, u, y = columns.values()
    record = from_arrays(t, np.clip(u, -4, 4), np.clip(y, 0.2, 0.33))
    assert "u looks clipped at -4, 4" in problem(record, "u looks clipped")
    assert "y looks clipped at 0.2, 0.33" in problem(record, "y looks clipped")


@pytest.mark.parametrize("wave", [lambda t: np.sign(np.sin(60 * t)), lambda t: np.round(2 * np.sin(60 * t))])
def test_squares_and_steps_are_not_clipped(columns, wave):
    t, _, y = columns.values()
    assert from_arrays(t, wave(t), y).problems == ()


def test_a_stuck_sensor_is_told_and_not_masked(columns):
    t, u, y = columns.values()
    stuck = y.copy()
    stuck[100:130] = stuck[100]
    record = from_arrays(t, u, stuck)
    assert "30 samples (7.50%) in 1 span, the longest for 0.029 s from 0.1 s on" in problem(record, "stuck")
    assert record.valid.all()


def test_a_rudder_at_rest_is_not_a_stuck_sensor(columns):
    t, u, _ = columns.values()
    noise = 1e-4 * np.random.default_rng(2).normal(size=N)
    moving = 0.1 * np.sin(40 * np.maximum(t - 0.15, 0))
    for step in (0, 5.113e-4, 1e-4, 1e-9):
        y = np.round((moving + noise * (step > 1e-9)) / step) * step if step else moving
        assert not [p for p in from_arrays(t, u, y).problems if "stuck" in p or "clipped" in p]


def test_a_constant_input_is_told(columns):
    t, u, y = columns.values()
    assert problem(from_arrays(t, np.full(N, 3.0), y), "constant") == "the input u is constant at 3"


# -- the converter --------------------------------------------------------------------------------------


def travel(n: int, sigma: float, seed: int) -> np.ndarray:
    rng = np.random.default_rng(seed)
    phase = np.cumsum(rng.normal(0.02, 0.01, n))
    return 0.26 + 0.2 * np.sin(phase) + sigma * rng.normal(size=n)


@pytest.mark.parametrize("decimals", [6, 7, 9, None])
@pytest.mark.parametrize("bits", [8, 10, 12, 14])
@pytest.mark.parametrize("seed", range(3))
def test_a_converter_is_found_under_the_rounding_of_print(bits, decimals, seed):
    step = 2.0944 / 2**bits
    y = np.round(travel(4000, 2e-4, seed) / step) * step
    y = y if decimals is None else np.round(y, decimals)
    assert converter_step(y) == pytest.approx(step, rel=2e-3)


@pytest.mark.parametrize("decimals", [4, 5, 6, 9, None])
@pytest.mark.parametrize("seed", range(5))
def test_print_rounding_is_no_converter(decimals, seed):
    y = travel(4000, 2e-4, seed)
    assert converter_step(y if decimals is None else np.round(y, decimals)) == 0.0
    assert converter_step(y.astype(np.float32).astype(float)) == 0.0


def test_a_converter_is_found_among_outliers():
    step = 5.113e-4
    y = np.round(travel(4000, 2e-4, 0) / step) * step
    y[::400] += 0.0123456
    assert converter_step(np.round(y, 6)) == pytest.approx(step, rel=2e-3)


@pytest.mark.parametrize(
    "coarse, fine",
    [(0.0067, 5.113e-4), (0.001722, 2.5566e-4), (1.39806e-3, 2.5566e-4), (7.3415e-4, 2.5566e-4), (8.795e-4, 1.2783e-4)],
)
def test_a_coarse_step_counts_before_the_converter_behind_it(coarse, fine):
    y = np.round(np.round(travel(4000, 2e-4, 0) / coarse) * coarse / fine) * fine
    assert converter_step(np.round(y, 6)) == pytest.approx(coarse, rel=1e-2)


def test_the_steps_ahead_are_counted_over_long_gaps_too():
    fine, gaps = 2.5566e-4, [1] * 30 + [2] * 13 + [3] * 9 + [4, 5, 5, 6, 7, 7, 8, 9, 10, 12, 12, 14]
    levels = fine * np.round(2.8 * np.cumsum(np.random.default_rng(0).permutation(gaps)))
    assert converter_step(np.round(np.repeat(levels, 5), 7)) == pytest.approx(2.8 * fine, rel=1e-2)


def test_levels_far_apart_lie_on_a_fine_lattice_by_chance():
    fine, steps = 5.114e-4, np.repeat([33, 33, 33, 32, 33, 33, 33, 33], 3)
    levels = 0.1426602 + fine * np.cumsum(steps)
    assert converter_step(np.round(np.repeat(levels, 40), 7)) == pytest.approx(fine * steps.mean(), rel=1e-2)


@pytest.mark.parametrize("times", [2.15, 2.5, 2.85])
def test_a_coarse_step_counts_where_the_converter_behind_makes_one_kind_of_gap_rare(times):
    fine = 5.1133e-4
    y = np.round(np.floor(travel(4000, 2e-4, 0) / (times * fine)) * times) * fine
    assert converter_step(np.round(y, 7)) == pytest.approx(times * fine, rel=1e-2)


@pytest.mark.parametrize("grid", [0.0, 2.5e-4])
def test_a_hold_is_known_by_the_leap_after_it_where_noise_does_not_show_it(grid):
    t = np.arange(4000) * 2e-3
    y = 0.26 + 0.2 * np.sin(4 * t) + 5e-5 * np.random.default_rng(0).normal(size=t.size)
    held = [(330, 350), (1250, 1262), (2450, 2490)]
    for first, last in held:
        y[first + 1 : last] = y[first]
    y = np.round(y / grid) * grid if grid else y
    found = [(s.start - 1, s.stop) for s in leapt_spans(y, grid, 8e-5)]
    assert all(any(abs(a - first) <= 2 and b == last for a, b in found) for first, last in held) and len(found) == len(
        held
    )


def test_a_rudder_that_breaks_loose_is_no_hold():
    t = np.arange(600) * 5e-3
    y = np.where(t < 1.5, 0.3 - 0.02 * np.exp(-8 * t), 0.3 + 40.0 * np.maximum(t - 1.5, 0.0) ** 2)
    assert leapt_spans(np.round(y / 2.5e-4) * 2.5e-4, 2.5e-4, 8e-5) == []


@pytest.mark.parametrize("resting_noise, found", [(2.5e-4, [(2000, 2600)]), (0.0, [])])
def test_a_sensor_that_hangs_at_rest_is_told_by_the_noise_that_no_longer_moves_it(resting_noise, found):
    """Noise of half a converter's step moves a reading every few samples; a rudder that comes to rest without noise is
    no hang.
    """
    rng, grid, n = np.random.default_rng(5), 5e-4, 8000
    swing = 0.1 * np.sin(2 * np.pi * np.arange(2000) / 1000)
    noise = np.where(np.abs(np.arange(n) - n / 2) < 2000, resting_noise, 2.5e-4) * rng.standard_normal(n)
    y = np.round((np.concatenate([swing, np.full(n - 4000, swing[0]), swing]) + noise) / grid) * grid
    if resting_noise:
        y[2000:2600] = y[2000]
    assert [(s.start, round(s.stop, -1)) for s in unmoved_spans(y, grid, 2.9e-4)] == found


@pytest.mark.parametrize(
    "counts, hold, noise, more",
    [
        ([0, 1, 1, 2, 3, 4, 4, 4, 7, 7, 8, 9, 10, 10], 6, 0.49, 1),
        ([0, 0, 4, 4, 7, 7, 7, 11, 12, 13, 14, 15], 5, 0.663, 2),
    ],
)
def test_a_leap_of_few_counts_is_chance(counts, hold, noise, more):
    """A rudder on its way: three alike, and at once some counts that noise and the way since make up, come about within
    some ten thousand samples.
    """
    grid = 5.1133e-4
    y = grid * np.array(counts)
    assert leapt_spans(y, grid, noise * grid) == []
    y[hold + 2 :] += more * grid
    assert leapt_spans(y, grid, noise * grid) == [slice(hold, hold + 2)]


def test_decimal_steps_in_degrees_are_told_apart_by_their_size(tmp_path, columns):
    degrees = np.degrees(columns.pop("theta_rad"))
    fine = read_recording(put(tmp_path, csv_text(columns | {"theta_deg": degrees.round(3)})))
    coarse = read_recording(put(tmp_path, csv_text(columns | {"theta_deg": degrees.round(1)})))
    assert fine.quantum == 0.0
    assert coarse.quantum == pytest.approx(np.radians(0.1))
    assert problem(coarse, "converter").startswith("the output theta_deg moves in steps of 0.1,")


@pytest.mark.parametrize("y", [[], [np.nan] * 9, [0.0] * 9, 3.0 * np.arange(300), [1e300, -1e300, 0.0]])
def test_no_lattice_where_there_is_nothing_to_tell(y):
    assert converter_step(np.array(y)) == 0.0


# -- measured by others ---------------------------------------------------------------------------------


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


@pytest.mark.parametrize(
    "motion, speed",
    [
        (lambda t: 0.0 * t, 0.0),
        (lambda t: 400.0 * t**2, 0.0),
        (lambda t: 2e4 * t**3, 0.0),
        (lambda t: np.where(t > 0.02, 300.0 * (t - 0.02) ** 2, 0.0), 0.0),
        (lambda t: 3.0 * t, 3.0),
        (lambda t: 3.0 * t - 100.0 * t**2, 3.0),
        (lambda t: np.sin(60.0 * t) / 20.0 + 2e-4 * np.sin(9e2 * t), 3.18),
    ],
)
def test_the_speed_at_the_start_is_what_the_samples_show(motion, speed):
    t = np.arange(50) / 1e3
    low, high = start_seen(t, motion(t) + 1e-4 * np.random.default_rng(3).standard_normal(t.size), 1e-4)
    assert low <= speed <= high and high - low < 2.0 and (low == high == 0.0) == (speed == 0.0)


def test_a_rudder_that_is_thrown_from_rest_had_no_speed():
    t = np.arange(11) / 200.0
    thrown = (
        np.array([0.0, 1.39, 8.6, 21.14, 35.78, 51.07, 64.8, 77.1, 87.58, 95.83, 103.27]) * 1e-3
    )  # rad, in a loop whose reference jumps
    assert start_seen(t, thrown, 1e-4) == (0.0, 0.0)
    assert start_seen(t, -3.0 * t, 1e-4)[1] < -2.0
    t = np.arange(25) / 500.0
    through_a_shaft = np.array(
        [
            0.0,
            0.9,
            -0.3,
            4.6,
            19.0,
            36.0,
            49.9,
            62.1,
            80.6,
            96.8,
            115.4,
            128.3,
            142.5,
            159.9,
            174.6,
            185.8,
            199.3,
            210.3,
            220.2,
            230.9,
            243.6,
            249.5,
            260.2,
            267.2,
            275.7,
        ]
    )  # noise levels
    assert start_seen(t, 1.36e-4 * through_a_shaft, 1.36e-4) == (0.0, 0.0)
