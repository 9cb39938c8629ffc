"""Recordings read piece by piece are what they are as a whole, wherever the pieces end."""

import warnings

import numpy as np
import pytest

from bingham.errors import RecordingError
from bingham.io import clock, fast, pieces, read_csv, read_pieces
from bingham.io import table as tables
from bingham.io.running_clock import WholeNeededError

FIELDS = ("time", "gyroscope", "accelerometer", "magnetometer")


def rows(size=300, seed=0):
    rng = np.random.default_rng(seed)
    sensors = rng.normal([0.1, -0.2, 0.3, 0, 0, 9.81, 20, 0, -40], 0.1, (size, 9))
    return np.column_stack([np.round(np.arange(size) / 100, 6), np.round(sensors, 4)])


def wild(size=300):
    """Rows with one of everything that is put right."""
    x = rows(size)
    x[50:53, 1:7] = 0.0  # no samples
    x[60, 7:] = 0.0  # no field
    x[70:90, 4:7] = np.nan  # slower than the gyroscope
    x[100, 0] = x[99, 0]  # repeated
    x[101, 0] = x[99, 0]
    x[150:, 0] -= 0.18  # set back
    x[200:, 0] -= 0.25
    x[210, 0] = x[209, 0]
    x[220:230, 1:] = np.nan  # no samples
    x[240:, 0] += 30.0  # a pause
    return x


def lay(tmp_path, x, header="t,gx,gy,gz,ax,ay,az,mx,my,mz"):
    cells = [",".join("" if np.isnan(v) else repr(v) for v in row) for row in x.tolist()]
    file = tmp_path / "a.csv"
    file.write_text("\n".join([header, *cells]) + "\n", encoding="utf-8")
    return file


def pieces_of(*arguments, **options):
    return list(read_pieces(*arguments, **options))


def read(reader, *arguments, **options):
    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always")
        found = reader(*arguments, **options)
    return found, sorted(str(warning.message) for warning in said)


@pytest.mark.parametrize("block", [300, 1_100, 1 << 20])
@pytest.mark.parametrize("parser", ["by_arrow", "by_lines"])
def test_pieces_are_the_whole(tmp_path, monkeypatch, block, parser):
    if parser == "by_arrow":
        pytest.importorskip("pyarrow")
    file = lay(tmp_path, wild())
    monkeypatch.setattr(tables, "FAST", 0 if parser == "by_arrow" else 1 << 30)
    monkeypatch.setattr(fast, "BLOCK", block)
    monkeypatch.setattr("bingham.io.careful.BATCH", block // 90)
    for head in (10, 160, 1 << 20):
        monkeypatch.setattr(pieces, "HEAD", head)
        monkeypatch.setattr(clock, "HEAD", head)
        whole, said = read(read_csv, file)
        for size in (1, 37, 1000):
            parts, told = read(pieces_of, file, rows=size)
            assert [part.size for part in parts[:-1]] == [size] * (len(parts) - 1)
            for name in FIELDS:
                joined = np.concatenate([getattr(part, name) for part in parts])
                assert joined.tobytes() == getattr(whole, name).tobytes(), (head, size, name)
            assert told == said
    assert len(said) == 5
    assert any("3 of 290 rows are zero" in text for text in said)


def test_what_needs_the_whole_says_so(tmp_path):
    x = rows()
    x[100, 0], x[101, 0] = x[101, 0], x[100, 0]  # out of order, not set back
    with pytest.raises(RecordingError, match="rows out of order: not to be read in pieces"):
        list(read_pieces(lay(tmp_path, x)))
    x = rows()
    x[::2, 4:] = np.nan
    x[1::2, 1:4] = np.nan
    with pytest.raises(WholeNeededError, match="rows of their own"):
        list(pieces.pieces_of_csv(lay(tmp_path, x)))
    x = rows()
    x[150:, 0] = np.round(x[150:, 0], 1)  # found to be too many at the end
    with pytest.raises(WholeNeededError, match="rounded"):
        list(pieces.pieces_of_csv(lay(tmp_path, x)))


def test_errors_name_the_line_in_any_piece(tmp_path, monkeypatch):
    monkeypatch.setattr(pieces, "HEAD", 20)
    monkeypatch.setattr("bingham.io.careful.BATCH", 7)
    x = rows()
    x[250, 1] = 1e160
    with pytest.raises(RecordingError, match=r"line 252, columns gx gy gz: 1e\+160 is no measurement"):
        list(read_pieces(lay(tmp_path, x)))
    file = lay(tmp_path, rows())
    text = file.read_text().splitlines()
    text[200] = "1,2,three,4,5,6,7,8,9,10"
    file.write_text("\n".join(text))
    with pytest.raises(RecordingError, match="line 201, column gy: 'three' is not a number"):
        list(read_pieces(file))
