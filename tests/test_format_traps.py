"""What the readers of the field do that one would not guess comes out right, or is said."""

import struct

import numpy as np
import pytest
from files_made import BEGUN, COLUMNS, THETA, WRITERS, N, T, U, can_log, mat_73, needs, ros_bag

from ers_mj.data.recording import from_columns, read_recording
from ers_mj.errors import ErsError


def told(record, words):
    return any(words in problem for problem in record.problems)


# -- MATLAB ------------------------------------------------------------------------------------------------------------


def test_empties_of_matlab_are_no_data(tmp_path):
    """h5py reads them as their shape."""

    def build(root):
        empty = root.create_dataset("notes", data=np.array([0, 0], np.uint64))
        empty.attrs["MATLAB_class"], empty.attrs["MATLAB_empty"] = np.bytes_("double"), 1
        root.create_dataset("title", data=np.array([[98], [101]], np.uint16)).attrs["MATLAB_class"] = np.bytes_("char")
        root.create_dataset("state", data=np.vstack([THETA, U])).attrs["MATLAB_class"] = np.bytes_("double")

    made = mat_73(tmp_path, COLUMNS, build)
    record = read_recording(made.path, {"theta_rad": "state[0]"})
    np.testing.assert_array_equal(record.y, THETA)
    assert not told(record, "notes") and told(record, "title")


HOW = r"ts?.*an object of MATLAB \(a timeseries\?\), save its numbers instead, as in t_s = ts.Time"


def test_a_timeseries_of_matlab_7_3_is_refused_with_what_to_do(tmp_path):
    def build(root):
        root.create_dataset("ts", data=np.zeros((1, 6), np.uint32)).attrs["MATLAB_object_decode"] = 3

    with pytest.raises(ErsError, match=HOW):
        read_recording(mat_73(tmp_path, COLUMNS, build).path)


def mat_5_element(kind, data):
    return struct.pack("<II", kind, len(data)) + data + bytes(-len(data) % 8)


def test_a_timeseries_of_matlab_5_is_refused_with_what_to_do(tmp_path):
    """An opaque object (class 17) as MATLAB saves one: its name, its system, its class, and where its data lies."""
    flags = mat_5_element(6, struct.pack("<II", 17, 0))
    names = b"".join(mat_5_element(1, text) for text in (b"ts", b"MCOS", b"timeseries"))
    place = (
        mat_5_element(6, struct.pack("<II", 13, 0)) + mat_5_element(5, struct.pack("<ii", 6, 1)) + mat_5_element(1, b"")
    )
    place += mat_5_element(6, struct.pack("<6I", 0xDD000000, 2, 1, 1, 1, 1))
    head = b"MATLAB 5.0 MAT-file".ljust(116) + bytes(8) + b"\x00\x01IM"
    (tmp_path / "rec.mat").write_bytes(head + mat_5_element(14, flags + names + mat_5_element(14, place)))
    with pytest.raises(ErsError, match=HOW):
        read_recording(tmp_path / "rec.mat")


# -- waveforms and rasters ---------------------------------------------------------------------------------------------


def held(every=5):
    return U[every * (np.arange(N) // every)]


@pytest.mark.parametrize("kind", [float, np.int16])
def test_a_channel_on_a_slower_clock_is_held_whatever_its_type(tmp_path, kind):
    """asammdf's rasters ramp floats and hold integers."""
    asammdf = needs("asammdf")
    volts = (1000 * U[::5]).astype(kind)
    with asammdf.MDF(version="4.10") as mdf:
        mdf.append([asammdf.Signal(np.degrees(THETA), T + BEGUN, name="Angle", unit="deg")])
        mdf.append([asammdf.Signal(volts, T[::5] - 0.002 + BEGUN, name="Volts", unit="mV")])
        mdf.save(tmp_path / "rec.mf4")
    record = read_recording(tmp_path / "rec.mf4", {"theta_rad": "Angle", "u_V": "Volts"})
    np.testing.assert_allclose(record.y, THETA)
    np.testing.assert_allclose(record.u, 1e-3 * volts[np.arange(N) // 5])
    assert told(record, "hold their last value")


@pytest.mark.parametrize("late", [-0.004, -1e-5, 0.0, 1e-5, 0.004])
def test_a_command_is_that_of_the_step_it_acts_in(tmp_path, late):
    """A loop sends its command just after it has read the output, or just before the next reading."""
    asammdf = needs("asammdf")
    with asammdf.MDF(version="4.10") as mdf:
        mdf.append([asammdf.Signal(THETA, T + BEGUN, name="Angle", unit="rad")])
        mdf.append([asammdf.Signal(U, T + late + BEGUN, name="Volts", unit="V")])
        mdf.save(tmp_path / "rec.mf4")
    record = read_recording(tmp_path / "rec.mf4", {"theta_rad": "Angle", "u_V": "Volts"})
    first = N - record.t.size  # the first angle comes before a command that is late
    assert first <= 1
    np.testing.assert_allclose(record.u, U[first:])
    np.testing.assert_allclose(record.y, THETA[first:])


def waveform(nptdms, name, x, offset, unit):
    begun = np.datetime64("2024-05-01T12:00:00", "us")
    properties = {"wf_start_time": begun, "wf_increment": 0.01, "wf_start_offset": offset, "unit_string": unit}
    return nptdms.ChannelObject("bench", name, x, properties=properties)


def test_each_waveform_of_tdms_begins_at_its_own_offset(tmp_path):
    nptdms = needs("nptdms")
    with nptdms.TdmsWriter(str(tmp_path / "rec.tdms")) as writer:
        angle = waveform(nptdms, "angle", np.degrees(THETA), 2.0, "deg")
        writer.write_segment([angle, waveform(nptdms, "volts", U, 2.0 - 0.005, "V")])
    record = read_recording(tmp_path / "rec.tdms", {"theta_rad": "angle", "u_V": "volts"})
    np.testing.assert_allclose(record.t, T, atol=1e-9)
    np.testing.assert_allclose(record.u, U)
    np.testing.assert_allclose(record.y, THETA)


def test_each_run_of_tdms_begins_at_its_own_offset(tmp_path):
    """npTDMS gives the offset of the last run to all of them, so that the pause between them is lost."""
    nptdms = needs("nptdms")
    with nptdms.TdmsWriter(str(tmp_path / "rec.tdms")) as writer:
        for part, offset in ((slice(0, 250), 2.0), (slice(250, N), 5.5)):
            angle = waveform(nptdms, "angle", THETA[part], offset, "rad")
            writer.write_segment([angle, waveform(nptdms, "volts", U[part], offset, "V")])
    record = read_recording(tmp_path / "rec.tdms", {"theta_rad": "angle", "u_V": "volts"})
    np.testing.assert_allclose(record.t, T + np.where(np.arange(N) < 250, 0.0, 1.0), atol=1e-9)
    np.testing.assert_array_equal(record.y, THETA)
    assert told(record, "holds 2 runs") and told(record, "gap")


# -- robots ------------------------------------------------------------------------------------------------------------


def test_efforts_that_are_not_one_a_joint_are_left_out_and_said(tmp_path):
    made = ros_bag(tmp_path, COLUMNS)
    record = read_recording(made.path, made.mapping)
    assert told(record, "effort differ in length from the joints' names and are left out")
    turned = read_recording(made.path, {**made.mapping, "theta_rad": "-/theta_rad.position[elbow]"})
    np.testing.assert_allclose(turned.y, -record.y)


def test_a_multiplier_that_pymavlink_leaves_to_the_unit_is_applied(tmp_path):
    made = WRITERS["ArduPilot"](tmp_path, COLUMNS)
    record = read_recording(made.path, made.mapping)
    np.testing.assert_allclose(record.y, THETA, atol=1e-4)
    assert told(record, "theta_rad is ENC.Ang, in cdeg as its file says")


@pytest.mark.parametrize(
    ("column", "step"), [("omega_rad_s=speed [rev/s]", 0.00025), ("theta_rad=turns [rev]", 0.0001)]
)
def test_the_end_of_a_register_of_16_bits_is_said(column, step):
    """moteus clips speeds at 8.19 rev/s and positions at 3.28 rev, without a flag."""
    motion = 40000 * step * np.sin(2 * T)
    register = np.rint(np.clip(motion / step, -32767, 32767)) * step
    name, source = column.split("=")
    columns = {"t_s": T, "u_V": U, "theta_rad": THETA, source.split()[0]: register}
    record = from_columns(columns, {name: source})
    assert told(record, "32767 steps of") and told(record, "the end of a 16-bit register, which clips without a flag")
    free = from_columns(columns | {source.split()[0]: np.rint(0.7 * motion / step) * step}, {name: source})
    assert not told(free, "register")


# -- CAN ---------------------------------------------------------------------------------------------------------------


def appended(first, second):
    """One candump log of two."""
    lines = first.path.read_text().splitlines() + second.path.read_text().splitlines()
    first.path.write_text("\n".join(sorted(lines)) + "\n")
    return first


def test_servos_of_one_name_on_two_buses_are_kept_apart(tmp_path):
    (tmp_path / "b").mkdir()
    first = can_log(tmp_path, COLUMNS, ".log", channel="can0")
    made = appended(first, can_log(tmp_path / "b", COLUMNS | {"theta_rad": -THETA}, ".log", channel="can1"))
    record = read_recording(made.path, made.mapping, dbc=made.dbc)
    np.testing.assert_allclose(record.y, THETA, atol=1e-6)
    assert told(record, "channels can0, can1: NAME@2 is NAME on the second one")
    other = read_recording(made.path, {**made.mapping, "theta_rad": "Encoder.Angle@2"}, dbc=made.dbc)
    np.testing.assert_allclose(other.y, -THETA, atol=1e-6)


@pytest.mark.parametrize("suffix", [".asc", ".blf", ".log"])
def test_frames_of_can_fd(tmp_path, suffix):
    made = can_log(tmp_path, COLUMNS, suffix, is_fd=True)
    np.testing.assert_allclose(read_recording(made.path, made.mapping, dbc=made.dbc).y, THETA, atol=1e-6)


def test_a_trc_whose_writer_took_no_frames_of_can_fd_is_refused(tmp_path):
    made = can_log(tmp_path, COLUMNS, ".trc", is_fd=True)
    with pytest.raises(ErsError, match=r"rec.trc: the file is empty"):
        read_recording(made.path, made.mapping, dbc=made.dbc)


@pytest.mark.parametrize("suffix", [".asc", ".blf", ".log", ".trc"])
def test_a_log_whose_first_frames_come_late_begins_with_the_earlier_ones(tmp_path, suffix):
    """ASC forgets the date, and puts a frame that is earlier than the first at its absolute time."""
    swapped = np.r_[1, 0, 2:N]
    made = can_log(tmp_path, {name: x[swapped] for name, x in COLUMNS.items()}, suffix)
    record = read_recording(made.path, made.mapping, dbc=made.dbc)
    assert record.t[-1] - record.t[0] < T[-1] + 0.02
    np.testing.assert_allclose(record.y[2:], THETA[-record.y.size :][2:], atol=1e-6)
