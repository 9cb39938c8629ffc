"""Time stamps: what is put right and said, what is left to be rejected, and dates of all kinds."""

import warnings
from datetime import UTC, datetime

import numpy as np
import pytest

from bingham.errors import InvalidArgumentError, RecordingError, RecordingWarning, RepairWarning
from bingham.io import read_csv, read_recording, read_tum, write_tum
from bingham.io.dates import seconds_of_dates

N = 200
T = np.arange(N) / 100
GYR = np.random.default_rng(3).normal(0, 0.5, (N, 3))


def table(time, gyr=GYR, form="{:.17g}", header="t,gx,gy,gz,ax,ay,az"):
    lines = [f"{form.format(t)},{g[0]!r},{g[1]!r},{g[2]!r},0,0,9.8" for t, g in zip(time, gyr.tolist(), strict=True)]
    return "\n".join([header, *lines]) + "\n"


@pytest.fixture
def read(tmp_path):
    def read_text(text, **options):
        file = tmp_path / "a.csv"
        file.write_text(text)
        return read_csv(file, **options)

    return read_text


def test_good_stamps_are_left_alone(read):
    with warnings.catch_warnings():
        warnings.simplefilter("error", RecordingWarning)
        np.testing.assert_array_equal(read(table(T)).time, T)
        jittered = T + np.random.default_rng(0).uniform(-0.004, 0.004, N)
        np.testing.assert_array_equal(read(table(jittered)).time, jittered)


def test_a_few_repeated_stamps_lose_their_later_row(read):
    time = T.copy()
    time[[20, 90]] = time[[19, 89]]
    with pytest.warns(RepairWarning, match="2 of 200 time stamps repeat"):
        recording = read(table(time))
    keep = np.delete(np.arange(N), [20, 90])
    np.testing.assert_array_equal(recording.time, T[keep])
    np.testing.assert_array_equal(recording.gyroscope, GYR[keep])


def test_errors_name_lines_of_the_file_after_repairs(read):
    time, gyr = T.copy(), GYR.copy()
    time[20] = time[19]
    gyr[100, 1] = np.inf
    with pytest.raises(RecordingError, match=r"line 102, columns gx gy gz"), warnings.catch_warnings():
        warnings.simplefilter("ignore")
        read(table(time, gyr))


@pytest.mark.parametrize("back", [0.18, 1.0, 3600.0])
def test_a_clock_set_back_is_bridged(read, back):
    time = T.copy()
    time[77:] -= back
    with pytest.warns(RepairWarning, match=rf"line 79, column t: the clock was set back by {back - 0.01:.6g} s"):
        recording = read(table(time))
    np.testing.assert_allclose(recording.time, T, atol=1e-9)
    with pytest.raises(RecordingError, match="set back"):
        read_recording(write(read, table(time)), strict=True)


def write(read, text):
    import tempfile
    from pathlib import Path

    file = Path(tempfile.mkdtemp()) / "a.csv"
    file.write_text(text)
    return file


def test_rows_swapped_by_a_few_are_sorted(read):
    order = np.arange(N)
    order[[50, 51, 120, 123]] = order[[51, 50, 123, 120]]
    with pytest.warns(RepairWarning, match="4 rows out of order, sorted by time"):
        recording = read(table(T[order], GYR[order]))
    np.testing.assert_array_equal(recording.time, T)
    np.testing.assert_array_equal(recording.gyroscope, GYR)


def test_a_shuffled_file_is_rejected(read):
    order = np.random.default_rng(1).permutation(N)
    with pytest.raises(RecordingError, match=r"strictly increasing seconds.*sort by time"):
        read(table(T[order], GYR[order]))


def test_stamps_rounded_to_the_second_are_spread(read):
    with pytest.warns(RepairWarning, match="rounded: usually 100 rows share one, 1 s apart; spread evenly"):
        recording = read(
            table(np.floor(1.7e9 + np.arange(1000) / 100), np.tile(GYR, (5, 1)), "{:.0f}"), units={"time": "s"}
        )
    np.testing.assert_allclose(np.diff(recording.time), 0.01, atol=1e-6)


def test_single_precision_stamps_are_recognised(read):
    start = 50_000.0  # spacing of float32: 4 ms beside steps of 10
    with pytest.warns(RecordingWarning, match=r"rounded to 0\.00391 s, where the usual step is"):
        recording = read(table((start + T).astype(np.float32).astype(float)))
    assert recording.size == N
    with pytest.warns(RepairWarning, match="put on a straight line"):
        regular = read(table((start + T).astype(np.float32).astype(float)), regularise=True)
    np.testing.assert_allclose(np.diff(regular.time), 0.01, rtol=1e-3)
    np.testing.assert_allclose(regular.time, start + T, atol=2e-3)


def test_jitter_of_arrival_is_smoothed_but_pauses_stay(read):
    rng = np.random.default_rng(2)
    true = np.concatenate([T[:100], T[100:] + 3.0])
    with pytest.warns(RepairWarning, match="straight line"):
        recording = read(table(np.sort(true + rng.exponential(0.003, N))), regularise=True)
    steps = np.diff(recording.time)
    assert np.ptp(np.delete(steps, 99)) < 2e-4 < np.ptp(np.diff(np.sort(true + rng.exponential(0.003, N)))[:99])
    assert steps[99] == pytest.approx(3.01, abs=0.01)


def test_years_between_stamps_are_no_gap(read):
    time = T.copy()
    time[3:] += 1.7e9
    with pytest.raises(RecordingError, match=r"line 5, column t: 1\.7e\+09 s after the stamp before.*3 of 200"):
        read(table(time))
    time = T.copy()
    time[100:] += 8 * 3600
    assert read(table(time)).duration_s == pytest.approx(8 * 3600 + 1.99)  # eight hours are one


def test_trajectories_are_put_right_too(tmp_path):
    file = tmp_path / "a.txt"
    write_tum(file, time=T, orientation=np.tile([1.0, 0, 0, 0], (N, 1)), position=GYR)
    lines = file.read_text().splitlines(keepends=True)
    file.write_text("".join([*lines[:60], lines[59], *lines[60:]]))
    with pytest.warns(RepairWarning, match="1 of 201 time stamps repeat"):
        recording = read_tum(file)
    np.testing.assert_array_equal(recording.position, GYR)


@pytest.mark.parametrize(
    ("form", "options"),
    [
        ("{:%Y-%m-%dT%H:%M:%S.%f}", {}),
        ("{:%Y-%m-%dT%H:%M:%S.%f+00:00}", {}),
        ("{:%Y-%m-%d %H:%M:%S.%fZ}", {}),
        ("{:%Y/%m/%d %H:%M:%S.%f}", {}),
        ("{:%d-%b-%Y %H:%M:%S.%f}", {}),
        ("{:%d.%m.%Y %H:%M:%S.%f}", {}),
        ("{:%d/%m/%Y %I:%M:%S.%f %p}", {}),
        ("{:%H:%M:%S.%f}", {}),
    ],
)
def test_dates(read, form, options):
    start = datetime(2024, 3, 13, 23, 59, 59, 200_000, tzinfo=UTC).timestamp()  # midnight is in it
    cells = [form.format(datetime.fromtimestamp(start + t, UTC)) for t in T]
    text = "Time,gx,gy,gz\n" + "".join(
        f"{c},{g[0]!r},{g[1]!r},{g[2]!r}\n" for c, g in zip(cells, GYR.tolist(), strict=True)
    )
    recording = read(text, **options)
    np.testing.assert_allclose(recording.time - recording.time[0], T, atol=1e-6)
    if "%d" in form:
        assert recording.time[0] == pytest.approx(start, abs=1e-6)


def test_zones_and_impossible_dates():
    hours = seconds_of_dates(["2024-03-01T10:00:00+0130", "2024-03-01T08:30:00Z", "2024-03-01 03:30:00-05"])
    np.testing.assert_array_equal(hours, hours[0])
    assert seconds_of_dates(["2024-03-01", "2024-02-30"]) == 1
    assert seconds_of_dates(["01/02/2024", "01/13/2024"])[1] == datetime(2024, 1, 13, tzinfo=UTC).timestamp()
    assert seconds_of_dates(["2024-03-01 25:00:00"]) == 0


def test_days_of_a_spreadsheet(read):
    with pytest.warns(RecordingWarning, match="days of a spreadsheet"):
        recording = read(table(45_352.5 + T / 86_400, form="{:.12f}"))
    assert recording.time[0] == pytest.approx(datetime(2024, 3, 1, 12, tzinfo=UTC).timestamp(), abs=1e-3)
    np.testing.assert_allclose(np.diff(recording.time), 0.01, atol=1e-4)


def test_ticks_and_rates(read):
    ticks = table(np.arange(N) * 100, form="{:.0f}")
    np.testing.assert_allclose(read(ticks, units={"time": "100us"}).time, T, atol=1e-12)
    without = "\n".join(line.partition(",")[2] for line in ticks.splitlines()) + "\n"
    np.testing.assert_allclose(read(without, rate=100).time, T, atol=1e-12)
    with pytest.raises(RecordingError, match=r"names no column t; .* or give rate= in Hz"):
        read(without)
    counts = table((250 + np.arange(N)) % 256, form="{:.0f}", header="packet,gx,gy,gz,ax,ay,az")
    np.testing.assert_allclose(read(counts, rate=100, columns={"t": "packet"}).time, T, atol=1e-12)
    for wrong in (0.0, -5.0, np.nan):
        with pytest.raises(InvalidArgumentError, match="rate"):
            read(without, rate=wrong)
    with pytest.raises(InvalidArgumentError, match="100us"):
        read(ticks, units={"time": "0us"})


def test_rows_of_zeros_are_no_samples(read):
    gyr = GYR.copy()
    gyr[50:150] = 0.0
    text = table(T, gyr).splitlines(keepends=True)
    text[51:151] = [line.replace("0,0,9.8", "0,0,0") for line in text[51:151]]
    with pytest.warns(RepairWarning, match="100 of 200 rows are zero in gyroscope and accelerometer"):
        recording = read("".join(text))
    assert recording.size == 100
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert read(table(T, gyr)).size == N  # a gyroscope that rests beside gravity


def test_rows_of_alternating_sensors(read):
    lines = ["t,gx,gy,gz,ax,ay,az"]
    for t, g in zip(T, GYR.tolist(), strict=True):
        lines += [f"{t:.4f},{g[0]!r},{g[1]!r},{g[2]!r},,,", f"{t + 0.004:.4f},,,,0.0,3.0,9.0"]
    recording = read("\n".join(lines) + "\n")
    np.testing.assert_allclose(recording.time, T, atol=1e-9)
    np.testing.assert_array_equal(recording.gyroscope, GYR)
    moved = np.array([0, 3.0, 9.0]) + 0.004 * np.cross(GYR, [0, 3.0, 9.0])
    np.testing.assert_allclose(recording.accelerometer, moved, atol=2e-3)
    assert np.abs(recording.accelerometer - [0, 3.0, 9.0]).max() > 0.02
    lines[2] = lines[2].replace("9.0", "")
    with pytest.raises(RecordingError, match="line 3, columns ax ay az: expected finite numbers, or none"):
        read("\n".join(lines) + "\n")


@pytest.mark.parametrize(
    "words", [("gyr", "acc"), ("GYROSCOPE", "ACCELEROMETER"), ("/imu/angular_velocity", "/imu/accel")]
)
def test_rows_that_name_their_sensor(read, words):
    lines = ["time,sensor,x,y,z"]
    for t, g in zip(T, GYR.tolist(), strict=True):
        lines += [
            f"{t:.4f},{words[0]},{g[0]!r},{g[1]!r},{g[2]!r}",
            f"{t:.4f},{words[1]},0.0,0.0,9.8",
            f"{t:.4f},light,1,2,3",
        ]
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        recording = read("\n".join(lines) + "\n")
    np.testing.assert_array_equal(recording.gyroscope, GYR)
    np.testing.assert_allclose(recording.accelerometer, np.tile([0, 0, 9.8], (N, 1)))
    with pytest.raises(RecordingError, match="column sensor: no gyroscope among"):
        read("\n".join(line.replace(words[0], "other") for line in lines) + "\n")
