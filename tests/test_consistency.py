"""Data before physics: what is wrong with the columns of a recording is told, masked or mended, or refused."""

import numpy as np
import pytest

from ers_mj.data.recording import from_arrays, read_recording, write_recording
from ers_mj.errors import InputError

N = 1000
STEP = 0.005  # [s]


def motor(u, step=STEP, b=40.0, a=10.0, friction=5.0):
    """The angle (N,) [rad] of a motor with friction under u (N,) [V], by small steps."""
    theta, omega, out = 0.0, 0.0, []
    for volts in u:
        out.append(theta)
        for _ in range(10):
            push = b * volts - a * omega
            drag = friction * np.sign(omega) if omega else np.clip(push, -friction, friction)
            change = (push - drag) * step / 10
            omega = (
                0.0 if omega and np.sign(omega + change) != np.sign(omega) and abs(push) < friction else omega + change
            )
            theta += omega * step / 10
    return np.array(out)


@pytest.fixture(scope="module")
def drive():
    """Time, steps of volts of 0.4 s, and the angle of a motor without a spring, seen by an encoder."""
    rng = np.random.default_rng(7)
    u = np.repeat(rng.uniform(-5, 5, size=N // 80 + 1), 80)[:N].round(3)
    return {"t_s": STEP * np.arange(N), "u_V": u, "theta_rad": np.round(motor(u) / 0.001) * 0.001}


@pytest.fixture
def put(tmp_path):
    def write(columns, name="rec.csv"):
        write_recording(tmp_path / name, columns)
        return str(tmp_path / name)

    return write


def kinds(record):
    return [fault.kind for fault in record.faults]


def test_a_sound_recording_has_no_fault_and_keeps_its_values(drive, put):
    record = read_recording(put(drive))
    assert record.faults == ()
    for column, x in drive.items():
        np.testing.assert_array_equal(record.columns()[column], x)


# -- the clock -------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("factor", "words"), [(1e3, "milliseconds"), (1e6, "microseconds"), (1e9, "nanoseconds")])
def test_another_unit_of_time_is_refused_with_what_it_looks_like(drive, put, factor, words):
    with pytest.raises(InputError, match=rf"looks like {words}: give --map .t_s=t_s \[.*insist with --map"):
        read_recording(put(drive | {"t_s": np.rint(drive["t_s"] * factor)}))


def test_a_clock_that_jumps_is_cut_and_memory_follows_the_samples(drive, put):
    t = drive["t_s"] + 1e9 * (np.arange(N) >= 600)
    record = read_recording(put(drive | {"t_s": t}))
    assert kinds(record) == ["time_jump"]
    assert (record.t.size, record.faults[0].count, record.faults[0].region) == (600, 400, (t[600], t[-1]))
    np.testing.assert_array_equal(record.y, drive["theta_rad"][:600])


def test_a_clock_that_leaves_no_piece_is_refused(drive, put):
    t = drive["t_s"][:150] + 1e9 * (np.arange(150) >= 75)
    with pytest.raises(InputError, match=r"jumps by .* behind data row 75, which leaves 75 samples"):
        read_recording(put({name: x[:150] for name, x in drive.items()} | {"t_s": t}))


@pytest.mark.parametrize(("lone", "where"), [(slice(0, 1), "beginning"), (slice(N - 2, N), "end")])
def test_rows_alone_beside_a_long_gap_are_left_out(drive, put, lone, where):
    t = drive["t_s"] + 2.0 * (np.arange(N) >= 1) if where == "beginning" else drive["t_s"].copy()
    t[N - 2 :] += 2.0 * (where == "end")
    record = read_recording(put(drive | {"t_s": t}))
    assert kinds(record) == ["gap"]
    assert where in record.faults[0].sentence
    assert record.t.size == N - len(range(N)[lone])


# -- the output ------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("low", [0.0, -180.0])
def test_a_wrapped_angle_is_put_together_again(drive, put, low):
    theta = np.degrees(drive["theta_rad"]).round(3)
    whole = read_recording(put({"t_s": drive["t_s"], "u_V": drive["u_V"], "theta_deg": theta}))
    wrapped = {"t_s": drive["t_s"], "u_V": drive["u_V"], "theta_deg": ((theta - low) % 360.0 + low).round(3)}
    record = read_recording(put(wrapped))
    assert kinds(record) == ["wrap"]
    np.testing.assert_allclose(record.y - record.y[0], whole.y - whole.y[0], atol=1e-9)


def test_a_reference_goes_with_a_wrapped_output():
    t = STEP * np.arange(N)
    theta = 4.0 * np.sin(2 * t) + 3.0
    record = from_arrays(t, np.mod(theta + 0.05, 2 * np.pi), np.mod(theta, 2 * np.pi), input_unit="rad")
    assert kinds(record) == ["wrap", "wrap"]
    np.testing.assert_allclose(record.u - record.y, 0.05, atol=1e-9)


@pytest.mark.parametrize("period", [2, 10])
def test_of_held_samples_the_fresh_ones_count(drive, put, period):
    fresh = period * (np.arange(N) // period)
    record = read_recording(put(drive | {"theta_rad": drive["theta_rad"][fresh]}))
    assert kinds(record) == ["held"]
    assert f"each value stands for {period} rows" in record.faults[0].sentence
    np.testing.assert_array_equal(record.t, drive["t_s"][::period])
    np.testing.assert_array_equal(record.y, drive["theta_rad"][::period])
    np.testing.assert_array_equal(record.u, drive["u_V"][::period])


@pytest.mark.parametrize("lost", [True, False])
def test_held_samples_keep_step_with_the_clock_where_rows_are_lost_or_blank(drive, put, lost):
    fresh = 2 * (np.arange(N) // 2)
    theta, is_there = drive["theta_rad"][fresh], np.random.default_rng(1).random(N) > 0.01
    left = np.flatnonzero(is_there) if lost else np.arange(N)
    table = drive | {"theta_rad": np.where(is_there | lost, theta, np.nan)}
    record = read_recording(put({name: x[left] for name, x in table.items()}))
    assert "held" in kinds(record)
    np.testing.assert_array_equal(record.t[record.valid], drive["t_s"][is_there & (fresh == np.arange(N))])


def test_between_held_samples_an_input_that_never_rests_is_kept():
    """The mean of an input over a hold moves the motor as fast, and elsewhere."""
    t = STEP * np.arange(N)
    u = 5.0 * np.sin(9.0 * t) + 3.0 * np.sin(23.0 * t)
    theta = motor(u)
    record = from_arrays(t, u, theta[4 * (np.arange(N) // 4)])
    assert kinds(record) == ["held"]
    np.testing.assert_array_equal(record.u, u)
    np.testing.assert_array_equal(np.flatnonzero(record.valid), np.arange(0, N, 4))
    np.testing.assert_array_equal(record.y[record.valid], theta[::4])


def test_a_clock_of_its_own_refreshes_a_column_out_of_step(drive, put):
    taken = np.floor(np.arange(N) / 5.3) * 5.3
    theta = np.interp(taken, np.arange(N), drive["theta_rad"] + 1e-3 * np.sin(np.arange(N)))
    record = read_recording(put(drive | {"theta_rad": theta}))
    assert kinds(record) == ["held"]
    assert np.diff(record.t[record.valid]).min() > 3 * STEP
    known = record.valid
    assert set(record.y[known]) <= set(theta)


def test_an_edge_of_the_input_between_fresh_samples_is_kept(drive, put):
    u = np.roll(drive["u_V"], 3)
    theta = motor(u)[10 * (np.arange(N) // 10)]
    record = read_recording(put(drive | {"u_V": u, "theta_rad": theta}))
    edges = np.flatnonzero(np.diff(u)) + 1
    assert set(drive["t_s"][edges]) - {drive["t_s"][edges[-1]]} <= set(record.t)
    assert np.count_nonzero(record.valid) == N // 10


def test_a_slow_coarse_sensor_is_not_taken_for_a_held_one():
    t = STEP * np.arange(N)
    record = from_arrays(t, np.sin(t), np.round(np.sin(t) / 0.02) * 0.02 + 0.0)
    assert "held" not in kinds(record)


def test_a_slower_sensor_beside_the_output_is_told_and_masked(drive, put):
    rng = np.random.default_rng(0)
    current = np.repeat(rng.normal(size=N // 5), 5)
    theta = drive["theta_rad"] + 1e-4 * rng.normal(size=N)
    record = read_recording(put(drive | {"theta_rad": theta, "i_A": current}))
    assert kinds(record) == ["held"]
    np.testing.assert_array_equal(np.isfinite(record.current), np.arange(N) % 5 == 0)


def test_rows_that_repeat_in_all_sensors_at_once_are_left_out(drive, put):
    rng = np.random.default_rng(1)
    sensors = {"theta_rad": drive["theta_rad"] + 1e-4 * rng.normal(size=N), "i_A": rng.normal(size=N)}
    lost = np.r_[200:205, 333:335, 700:712]
    for k in lost:
        for x in sensors.values():
            x[k] = x[k - 1]
    record = read_recording(put(drive | sensors))
    assert "blackout" in kinds(record)
    np.testing.assert_array_equal(np.flatnonzero(~record.valid), lost)
    np.testing.assert_array_equal(np.flatnonzero(np.isnan(record.current)), lost)


def test_a_zero_that_is_lost_is_moved_back(drive, put):
    t = drive["t_s"]
    theta, omega = np.sin(2 * t), 2 * np.cos(2 * t)
    record = read_recording(put({"t_s": t, "u_V": omega, "theta_rad": theta + 0.8 * (t > 2.5), "omega_rad_s": omega}))
    assert kinds(record) == ["leap"]
    np.testing.assert_allclose(record.y, theta, atol=1e-3)


def test_whole_degrees_at_every_level_are_read_as_they_are(put):
    t = 0.01 * np.arange(300)
    record = read_recording(put({"t_s": t, "u_V": np.sin(t), "theta_deg": np.round(60 * np.sin(2 * t))}))
    assert record.quantum == pytest.approx(np.radians(1.0))


# -- units -----------------------------------------------------------------------------------------------------------


def test_counts_are_no_radians(drive, put):
    with pytest.raises(InputError, match=r"theta_rad moves in whole numbers.*insist with --map .theta_rad=theta_rad"):
        read_recording(put(drive | {"theta_rad": np.rint(drive["theta_rad"] * 650)}))


def test_counts_are_no_duty(drive, put):
    columns = {"t_s": drive["t_s"], "u_duty_pct": np.rint(drive["u_V"] * 51), "theta_rad": drive["theta_rad"]}
    with pytest.raises(InputError, match=r"u_duty_pct reaches .* %, a duty ends at 100 %"):
        read_recording(put(columns))


def test_a_speed_in_degrees_is_not_used_and_degrees_under_radians_are_refused(drive, put):
    t = drive["t_s"]
    omega = 2 * np.cos(2 * t)
    wrong_speed = read_recording(
        put({"t_s": t, "u_V": omega, "theta_rad": np.sin(2 * t), "omega_rad_s": np.degrees(omega)})
    )
    assert kinds(wrong_speed) == ["unit"]
    assert wrong_speed.omega is None
    with pytest.raises(InputError, match=r"57.3 times as fast as omega_rad_s says, as degrees would"):
        read_recording(put({"t_s": t, "u_V": omega, "theta_rad": np.degrees(np.sin(2 * t)), "omega_rad_s": omega}))


# -- what is commanded -----------------------------------------------------------------------------------------------


def test_a_magnitude_that_a_spring_answers_is_refused(put):
    t, rng = STEP * np.arange(N), np.random.default_rng(11)
    u, y, w = np.repeat(rng.uniform(-8, 8, size=N // 80 + 1), 80)[:N], np.zeros(N), 0.0
    for k in range(N - 1):
        w += STEP * (40.0 * u[k] - 10.0 * w - 60.0 * y[k] - 5.0 * np.sign(w))
        y[k + 1] = y[k] + STEP * w
    with pytest.raises(InputError, match=r"never negative and goes with the deflection's magnitude"):
        read_recording(put({"t_s": t, "u_V": np.abs(u), "theta_rad": y}))
    lifted = y + 10.0  # a servo that is only told to go one way
    assert read_recording(put({"t_s": t, "u_V": u + 8.0, "theta_rad": lifted})).u.min() >= 0.0


def test_a_magnitude_takes_its_sign_from_the_direction_or_is_refused(drive, put):
    rest = {"t_s": drive["t_s"], "theta_rad": drive["theta_rad"]}
    magnitude = {"u_duty_pct": np.abs(drive["u_V"]) * 10}
    with pytest.raises(InputError, match=r"u_duty_pct is never negative .* --map direction=COLUMN"):
        read_recording(put(rest | magnitude))
    record = read_recording(put(rest | magnitude | {"direction": (drive["u_V"] > 0).astype(float)}))
    assert kinds(record) == ["unsigned_input"]
    np.testing.assert_allclose(record.u, drive["u_V"] * 10)


def test_one_way_under_a_spring_is_no_magnitude():
    t = STEP * np.arange(N)
    u = np.clip(5 + 4 * np.sin(3 * t), 0, None)
    assert from_arrays(t, u, 0.1 * u).faults == ()


def test_a_constant_input_is_told(drive, put):
    record = read_recording(put(drive | {"u_V": np.full(N, 5.0)}))
    assert kinds(record) == ["constant_input"]


@pytest.fixture
def followed():
    t = STEP * np.arange(N)
    return {"t_s": t, "theta_ref_rad": np.sin(2 * t), "theta_rad": np.sin(2 * t - 0.2)}


def test_a_reference_of_the_other_sign_or_zero_is_mended(followed, put):
    turned = read_recording(put(followed | {"theta_ref_rad": -followed["theta_ref_rad"]}))
    assert kinds(turned) == ["unit"]
    np.testing.assert_array_equal(turned.u, followed["theta_ref_rad"])
    moved = read_recording(put(followed | {"theta_ref_rad": followed["theta_ref_rad"] + 3.14}))
    assert kinds(moved) == ["unit"]
    np.testing.assert_allclose(moved.u, followed["theta_ref_rad"], atol=0.02)


def test_a_wave_that_is_upside_down_half_a_period_later_keeps_its_sign(put):
    t = np.arange(0.0, 8.0, 0.01)
    late = 0.4 - np.pi / 9.0  # so that 0.4 s, which is tried, is later by half a period
    record = read_recording(put({"t_s": t, "theta_ref_rad": np.sin(9.0 * t), "theta_rad": np.sin(9.0 * (t - late))}))
    assert kinds(record) == []
    np.testing.assert_allclose(record.u, np.sin(9.0 * t), atol=1e-4)


def test_a_reference_in_another_unit_is_refused(followed, put):
    with pytest.raises(InputError, match=r"theta_ref_rad moves 57.3 times as far as theta_rad, which looks like deg"):
        read_recording(put(followed | {"theta_ref_rad": np.degrees(followed["theta_ref_rad"])}))


def test_a_reference_that_is_the_output_is_refused(followed, put):
    with pytest.raises(InputError, match="theta_ref_rad equals theta_rad"):
        read_recording(put(followed | {"theta_ref_rad": followed["theta_rad"]}))


@pytest.mark.parametrize(("shift", "words"), [(1, "1 row later"), (-2, "2 rows earlier")])
def test_a_reference_that_is_the_output_of_a_row_beside_is_refused(followed, put, shift, words):
    """Robots that were led by hand log the next position as the command."""
    rng = np.random.default_rng(0)
    theta = followed["theta_rad"] + 1e-3 * rng.normal(size=N)
    with pytest.raises(InputError, match=f"theta_ref_rad equals theta_rad {words}: it is what was measured"):
        read_recording(put(followed | {"theta_rad": theta, "theta_ref_rad": np.roll(theta, -shift)}))


def servo(asked, limit=np.inf, gain=0.1, step=STEP):
    """Reference (N,) as it is sent, at most ``limit`` from the output, and the output of a first-order servo."""
    theta, sent, seen = 0.0, [], []
    for goal in asked:
        seen.append(theta)
        sent.append(theta + np.clip(goal - theta, -limit, limit))
        theta += gain * (sent[-1] - theta) + 0.002 * np.sin(50.0 * len(seen) * step)
    return np.array(sent), np.array(seen)


def test_a_reference_that_was_logged_behind_a_limit_of_its_distance_is_told(put):
    t = STEP * np.arange(N)
    sent, seen = servo(np.sign(np.sin(2 * t)) * (1.0 + 0.3 * np.sin(7 * t)), limit=0.2)
    record = read_recording(put({"t_s": t, "theta_ref_rad": sent, "theta_rad": seen}))
    assert kinds(record) == ["clipped"]
    assert "stays 0.2 rad off theta_rad" in record.faults[0].sentence
    free, seen = servo(np.sign(np.sin(2 * t)) * (1.0 + 0.3 * np.sin(7 * t)))
    assert read_recording(put({"t_s": t, "theta_ref_rad": free, "theta_rad": seen})).faults == ()


@pytest.mark.parametrize(("slew", "is_told"), [(2.0, True), (np.inf, False)])
def test_a_reference_that_was_logged_behind_a_limit_of_its_speed_is_told(put, slew, is_told):
    t = STEP * np.arange(N)
    asked = np.repeat([0.0, 0.5, -0.3, 0.4, 0.9, -0.5, 0.1, 0.7, 0.2, 0.0], N // 10)
    sent = [0.0]
    for goal in asked[1:]:
        sent.append(sent[-1] + np.clip(goal - sent[-1], -slew * STEP, slew * STEP))
    record = read_recording(put({"t_s": t, "theta_ref_rad": np.array(sent), "theta_rad": servo(sent)[1]}))
    assert record.faults == ()
    assert any("behind a limit of its speed" in p for p in record.problems) is is_told


def test_the_supply_and_a_drive_that_is_off_are_told(drive, put):
    vin = np.where(np.arange(N) == 300, 0.0, 12.0 + 0.1 * np.sin(drive["t_s"]))
    on = (np.arange(N) < 800).astype(float)
    record = read_recording(put(drive | {"vin_V": vin, "torque_enable": on}))
    assert kinds(record) == ["supply", "torque_off"]
    assert record.vin.min() > 11.0
    assert record.faults[1].as_document("rec.csv") == {
        "kind": "torque_off",
        "file": "rec.csv",
        "column": "torque_enable",
        "count": 200,
        "region_s": [4.0, drive["t_s"][-1]],
        "sentence": record.faults[1].sentence,
    }


# -- a clock that is not even ----------------------------------------------------------------------------------------


def jittering(drive, moves: bool, rms: float = 0.03):
    """The drive's columns with stamps off its clock, at which the output was read where it ``moves`` with them."""
    t = drive["t_s"]
    stamps = t + np.clip(rms * np.random.default_rng(4).standard_normal(N), -0.15, 0.15) * STEP
    exact = motor(drive["u_V"])
    y = np.interp(stamps, t, exact) if moves else exact
    return drive | {"t_s": stamps, "theta_rad": np.round(y / 1e-5) * 1e-5}


def test_stamps_with_which_nothing_moves_are_the_ticks_of_a_clock(drive, put):
    record = read_recording(put(jittering(drive, moves=False)))
    assert np.ptp(np.diff(record.t)) < 1e-9 and kinds(record) == ["jitter"]
    assert record.sample_time == pytest.approx(STEP, rel=1e-12)  # of one clock in all recordings
    assert any("regular clock of 0.005" in problem for problem in record.problems)


def test_stamps_with_which_the_output_moves_stand(drive, put):
    columns = jittering(drive, moves=True)
    record = read_recording(put(columns))
    np.testing.assert_array_equal(record.t, columns["t_s"])
    assert any("jitter" in problem for problem in record.problems)


def test_a_clock_that_wanders_stands(drive, put):
    t = np.cumsum(STEP * (1.0 + 0.02 * np.random.default_rng(5).standard_normal(N)))
    record = read_recording(put(drive | {"t_s": t}))
    np.testing.assert_array_equal(record.t, t)
