"""Layouts of text files, and that fast and careful parsers agree bit by bit."""

from contextlib import suppress

import numpy as np
import pytest

from bingham.errors import RecordingError, RecordingWarning
from bingham.io import fast, read_csv, read_recording
from bingham.io import table as tables
from bingham.io.layout import find_layout
from bingham.io.table import read_table
from bingham.io.text import opened_text

ROWS = [[0.0, 0.1, -0.2, 0.3], [0.01, 0.5, 0.25, -1e-3], [0.02, 1.5, 2.5, 3.5]]


def lay(tmp_path, text):
    file = tmp_path / "a.csv"
    file.write_bytes(text if isinstance(text, bytes) else text.encode())
    return file


@pytest.mark.parametrize(
    "text",
    [
        "t,gx,gy,gz\n0,0.1,-0.2,0.3\n0.01,0.5,0.25,-1e-3\n0.02,1.5,2.5,3.5\n",
        "t;gx;gy;gz\n0,0;0,1;-0,2;0,3\n0,01;0,5;0,25;-1e-3\n0,02;1,5;2,5;3,5\n",
        "t\tgx\tgy\tgz\n0\t0.1\t-0.2\t0.3\n0.01\t0.5\t0.25\t-1e-3\n0.02\t1.5\t2.5\t3.5\n",
        "t|gx|gy|gz\n0|0.1|-0.2|0.3\n0.01|0.5|0.25|-1e-3\n0.02|1.5|2.5|3.5\n",
        "t gx gy gz\n0   0.1 -0.2 0.3\n0.01 0.5  0.25 -1e-3\n 0.02 1.5 2.5 3.5\n",
        "# by\n// hand\nt , gx , gy , gz\n0 , 0.1 , -0.2 , 0.3\n0.01,0.5,0.25,-1e-3\n\n# later\n0.02,1.5,2.5,3.5\n",
        '"t","gx","gy","gz"\r\n"0","0.1","-0.2","0.3"\r\n0.01,0.5,0.25,-1e-3\r\n0.02,1.5,2.5,3.5\r\n',
        "t,gx,gy,gz,\n0,0.1,-0.2,0.3,\n0.01,0.5,0.25,-1e-3,\n0.02,1.5,2.5,3.5,\n",
        "#t,gx,gy,gz\n0,0.1,-0.2,0.3\n0.01,0.5,0.25,-1e-3\n0.02,1.5,2.5,3.5\n",
        "Device:,Left\nRate:,100\nSerial:,7,8\n\nt,gx,gy,gz\n0,0.1,-0.2,0.3\n0.01,0.5,0.25,-1e-3\n0.02,1.5,2.5,3.5\n",
        "a,1\nb,2\nc,3\nt,gx,gy,gz\n0,0.1,-0.2,0.3\n0.01,0.5,0.25,-1e-3\n0.02,1.5,2.5,3.5\n",
        "t,gx,gy,gz\ns,rad/s,rad/s,rad/s\n0,0.1,-0.2,0.3\n0.01,0.5,0.25,-1e-3\n0.02,1.5,2.5,3.5\n",
        "\ufefft,gx,gy,gz\n0,0.1,-0.2,0.3\n0.01,0.5,0.25,-1e-3\n0.02,1.5,2.5,3.5\n",
        "sep=;\nt;gx;gy;gz\n0;0.1;-0.2;0.3\n0.01;0.5;0.25;-1e-3\n0.02;1.5;2.5;3.5\n",
        "t,gx,gy,gz\n0,0.1,-0.2,0.3\n0.01,0.5,0.25,-1e-3\nt,gx,gy,gz\n0.02,1.5,2.5,3.5\n",
        "T,time,gx,gy,gz\n21.5,0,0.1,-0.2,0.3\n21.5,0.01,0.5,0.25,-1e-3\n21.6,0.02,1.5,2.5,3.5\n",
    ],
)
@pytest.mark.filterwarnings("ignore::bingham.io.RecordingWarning")
def test_layouts(tmp_path, text):
    recording = read_csv(lay(tmp_path, text))
    np.testing.assert_array_equal(np.column_stack([recording.time, recording.gyroscope]), ROWS)


def test_latin_signs_of_units(tmp_path):
    file = lay(tmp_path, "t,gx (°/s),gy (°/s),gz (°/s)\n0,90,0,0\n0.1,0,90,0\n".encode("latin-1"))
    np.testing.assert_allclose(read_csv(file).gyroscope[0], [np.pi / 2, 0, 0])
    with pytest.raises(RecordingError, match="not UTF-8 text"):
        read_csv(lay(tmp_path, b"t,gx,gy,gz,\xff\xe9\n0,1,2,3,4\n"))


def test_files_without_names(tmp_path):
    file = lay(tmp_path, "0,0.1,-0.2,0.3,9\n0.01,0.5,0.25,-1e-3,9\n0.02,1.5,2.5,3.5,9\n")
    with pytest.raises(RecordingError, match=r"line 1: holds numbers and no names of its 5 columns; .*columns=\["):
        read_csv(file)
    recording = read_csv(file, columns=["t", "gx", "gy", "gz", "-"])
    np.testing.assert_array_equal(np.column_stack([recording.time, recording.gyroscope]), ROWS)
    with pytest.raises(RecordingError, match="line 1: 5 columns, and 4 names for them"):
        read_csv(file, columns=["t", "gx", "gy", "gz"])


NUMBERS = ["0", "-0.0", "1.", ".5", "+1.25", "1e-300", "4.9e-324", "123456789.123456789", "1E5", "", "nan"]


def big(rng, size=60_000, *, extreme=True):
    values = rng.standard_normal((size, 4))
    values *= 10.0 ** rng.integers(-12, 12, (size, 4)) if extreme else 0.1
    return "".join(",".join(map(repr, row)) + "\n" for row in values.tolist())


def joined(parts):
    parts = list(parts)
    return {k: np.concatenate([part[k] for part in parts]) for k in parts[0]}


@pytest.mark.parametrize("parser", ["by_arrow", "by_numpy"])
def test_parsers_agree_bit_by_bit(tmp_path, parser):
    if parser == "by_arrow":
        pytest.importorskip("pyarrow")
    rng = np.random.default_rng(5)
    file = lay(tmp_path, "t,gx,gy,gz\n" + big(rng, 2000))
    text = opened_text(file)
    layout = find_layout(text)
    kinds = dict.fromkeys(range(4), "number")
    fast = joined(getattr(tables, parser)(text, layout, kinds))
    careful = joined(tables.by_lines(text, layout, kinds))
    for k in range(4):
        assert fast[k].tobytes() == careful[k].tobytes()


@pytest.mark.parametrize("end", ["\n", "\r\n", "\r", ""])
@pytest.mark.parametrize("threads", [1, 3])
def test_blocks_parsed_at_once_come_in_their_order(tmp_path, monkeypatch, threads, end):
    pytest.importorskip("pyarrow")
    monkeypatch.setattr(fast, "BLOCK", 5000)
    rows = big(np.random.default_rng(8), 3000).splitlines()
    file = tmp_path / "a.csv"
    file.write_bytes((end or "\n").join(["t,gx,gy,gz", *rows, "" if end else "1,2,3,4"]).encode())
    text = opened_text(file)
    layout = find_layout(text)
    kinds = dict.fromkeys(range(4), "number")
    found = joined(fast.by_arrow(text, layout, kinds, threads=threads))
    careful = joined(tables.by_lines(text, layout, kinds))
    for k in range(4):
        assert found[k].tobytes() == careful[k].tobytes()
    assert len(found[0]) == 3000 + (not end)


def test_blocks_before_one_that_no_fast_parser_takes_are_kept(tmp_path, monkeypatch):
    pytest.importorskip("pyarrow")
    monkeypatch.setattr(fast, "BLOCK", 5000)
    rows = big(np.random.default_rng(9), 3000).splitlines()
    rows[1500] = "7,'1',2,3"
    text = opened_text(lay(tmp_path, "\n".join(["t,gx,gy,gz", *rows])))
    got = []
    with pytest.raises(fast.StumbledError):
        got.extend(fast.by_arrow(text, find_layout(text), dict.fromkeys(range(4), "number"), threads=3))
    assert 1000 < sum(len(block[0]) for block in got) <= 1500


@pytest.mark.parametrize("cell", ["1_000", "١", "0x10", "1d3", "1,5", "--1", "true", "1 000", "1e"])
def test_what_is_no_number_to_one_parser_is_none_to_all(tmp_path, monkeypatch, cell):
    text = "t,gx,gy,gz\n" + big(np.random.default_rng(6)) + f'99,1,"{cell}",3\n'
    file = lay(tmp_path, text)
    assert file.stat().st_size > tables.FAST
    with pytest.raises(RecordingError, match=r"line 60002, column gy: .* is not a number"):
        read_csv(file)
    monkeypatch.setattr(tables, "by_arrow", lambda *arguments, threads: tables.by_numpy(*arguments))
    with pytest.raises(RecordingError, match=r"line 60002, column gy: .* is not a number"):
        read_csv(file)


def test_numbers_of_all_forms(tmp_path):
    pytest.importorskip("pyarrow")
    body = "".join(f"{k},{cell},1\n" for k, cell in enumerate(NUMBERS))
    text = opened_text(lay(tmp_path, "a,b,c\n" + body))
    layout = find_layout(text)
    careful = joined(tables.by_lines(text, layout, {1: "number"}))[1]
    assert careful.tolist()[:9] == [float(x) for x in NUMBERS[:9]]
    assert np.isnan(careful[9:]).all()
    with suppress(tables.StumbledError):  # it may leave a file to the other
        assert joined(tables.by_arrow(text, layout, {1: "number"}))[1].tobytes() == careful.tobytes()


@pytest.mark.parametrize(
    ("line", "problem"),
    [
        ("1,2,3", "3 columns where 4"),
        ("1,2,3,4,5", "5 columns where 4"),
        ("# a comment,", None),
        ("", None),
        ('1,2,3,"4', "cannot be split"),
        ("1,2,3," + "x" * 70_000, "a cell of 70000 characters"),
        ("1,2,3,\x00", "not text but binary"),
    ],
)
def test_places_in_large_files(tmp_path, line, problem):
    lines = big(np.random.default_rng(8), extreme=False).splitlines()
    lines[40_000] = line
    time = iter(range(len(lines)))
    lines = [f"{next(time)},{text.partition(',')[2]}" if k != 40_000 else text for k, text in enumerate(lines)]
    file = lay(tmp_path, "t,gx,gy,gz\n" + "\n".join(lines) + "\n")
    if problem is None:
        assert read_csv(file).size == len(lines) - 1
    else:
        with pytest.raises(RecordingError, match=rf"line 40002.*{problem}"):
            read_csv(file)


def test_only_columns_that_mean_something_are_read(tmp_path):
    rows = "".join(f"{k},0.1,0.2,0.3,text {k},2024-01-01\n" for k in range(40_000))
    file = lay(tmp_path, "t,gx,gy,gz,note,day\n" + rows)
    with pytest.warns(RecordingWarning, match="left out: note, day"):
        assert read_recording(file).size == 40_000
    text = opened_text(file)
    assert list(read_table(text, find_layout(text), [2]).columns) == [2]


def test_raw_counts_need_a_scale(tmp_path):
    rng = np.random.default_rng(9)
    counts = np.rint(np.column_stack([rng.normal(0, 200, (300, 3)), rng.normal([0, 0, 4096], 40, (300, 3))]))
    body = "".join(f"{10 * k}," + ",".join(f"{x:.0f}" for x in row) + "\n" for k, row in enumerate(counts))
    file = lay(tmp_path, "t_ms,gx,gy,gz,ax,ay,az\n" + body)
    for units in (None, {"gyroscope": "deg_s"}, {"gyroscope": "deg_s", "accelerometer": "g"}):
        with pytest.raises(RecordingError, match=r"accelerometer: integers.*raw counts; give the scales"):
            read_csv(file, units=units)
    recording = read_csv(file, units={"gyroscope": "1/16.4deg/s", "accelerometer": "1/4096 g"})
    np.testing.assert_allclose(recording.gyroscope, np.radians(counts[:, :3] / 16.4))
    np.testing.assert_allclose(recording.accelerometer, counts[:, 3:] * 9.80665 / 4096)
    milli = lay(tmp_path, "t_ms,gx_mdps,gy_mdps,gz_mdps,ax_mg,ay_mg,az_mg\n" + body.replace("4096", "1000"))
    with pytest.raises(RecordingError, match="raw counts"):
        read_csv(milli)  # 4 g all the time
