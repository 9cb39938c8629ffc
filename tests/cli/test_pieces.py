"""Long recordings are tracked piece by piece, to the same files as a whole."""

from pathlib import Path

import numpy as np
import pytest

from bingham.cli import filtering, source, tracking
from bingham.cli.output import Outputs
from bingham.cli.settings import Settings
from bingham.cli.thinned import Peaks, Thinned, merged
from bingham.io import clock, fast, pieces
from bingham.io import table as tables


def options():
    return filtering.FilterOptions(0.3, 0.04, 0.999, plain=False, smooth=False)


def recording(folder, *, unordered):
    rng = np.random.default_rng(3)
    t = np.arange(900) / 50
    x = np.column_stack([t, rng.normal([0.1, 0.2, 0.3, 0, 0, 9.81, 20, 0, -40], 0.05, (900, 9))])
    x[100:104, 1:7] = 0.0
    x[300, 0] = x[299, 0]
    if unordered:  # which is not to be put right piece by piece
        x[[600, 601]] = x[[601, 600]]
    else:
        x[400:, 0] -= 0.4
    file = folder / "walk.csv"
    file.write_text("t,gx,gy,gz,ax,ay,az,mx,my,mz\n" + "".join(",".join(map(repr, r)) + "\n" for r in x.tolist()))
    return file


@pytest.mark.parametrize("unordered", [False, True])
def test_pieces_make_the_files_of_the_whole(tmp_path, monkeypatch, unordered):
    for module, name, value in ((filtering, "PIECE", 250), (tables, "FAST", 0), (fast, "BLOCK", 2_000)):
        monkeypatch.setattr(module, name, value)
    for module in (pieces, clock, source):
        monkeypatch.setattr(module, "HEAD", 70)
    file = recording(tmp_path, unordered=unordered)
    outputs = Outputs(fields=("quaternion", "deviation", "bias", "covariance", "decision"), figure_format="svg")
    settings = Settings(None, {}, options(), outputs)
    whole = tracking.track_one(file, "walk", tmp_path / "whole", settings)
    monkeypatch.setattr(source, "LONG", 0)
    read = []
    monkeypatch.setattr(tracking, "opened_whole", lambda *given: read.append(1) or source.opened_whole(*given))
    parts = tracking.track_one(file, "walk", tmp_path / "parts", settings)
    assert len(read) == unordered
    names = ["walk.svg", "walk.track.csv", "walk.track.npz"]
    assert sorted(path.name for path in (tmp_path / "parts").iterdir()) == names
    for name in names[1:]:
        assert (tmp_path / "parts" / name).read_bytes() == (tmp_path / "whole" / name).read_bytes()
    assert sorted(parts["warnings"]) == sorted(whole["warnings"])
    assert len(whole["warnings"]) >= 3
    for row in (whole, parts):
        assert sorted(Path(name).name for name in row.pop("files")) == names
        del row["wall_s"], row["us_per_sample"], row["warnings"]
    assert parts == whole


@pytest.mark.parametrize("limit", [1, 3, 8, 100, None])
def test_thinned_keeps_every_so_manieth_row(limit):
    rng = np.random.default_rng(4)
    for size in (1, 7, 64, 101):
        kept = Thinned(limit)
        done = 0
        while done < size:
            step = int(rng.integers(1, 12))
            rows = np.arange(done, min(done + step, size))
            kept.add(rows, -rows)
            done += step
        stride = next(2**k for k in range(20) if limit is None or len(range(0, size, 2**k)) <= limit)
        assert kept.stride == stride
        for rows, sign in zip(kept.arrays(), (1, -1), strict=True):
            assert (rows == sign * np.arange(0, size, stride)).all()


@pytest.mark.parametrize("piece", [999, 20_000, 100_000])
def test_extremes_of_curves_are_kept_wherever_they_are(piece):
    rng = np.random.default_rng(5)
    size, stretches = 100_000, 50
    curves = rng.normal(size=(2, size))
    curves[0, 77_777], curves[1, 12_345] = 40.0, -40.0
    curves[1, 500:900] = np.nan
    thinned, peaks = Thinned(2000), Peaks(stretches)
    time = 0.01 * np.arange(size)
    for first in range(0, size, piece):
        rows = slice(first, first + piece)
        thinned.add(time[rows], curves[0, rows])
        peaks.add(curves[:, rows], time[rows], curves[0, rows])
    numbers, t, y = merged(thinned, peaks)
    np.testing.assert_array_equal(t, time[numbers])
    np.testing.assert_array_equal(y, curves[0, numbers])
    assert {0, 77_777, 12_345} <= set(numbers.tolist()) and len(numbers) < 2000 + 4 * stretches + 5
    for curve in curves:
        for first in range(0, size, 2048):  # the first power of two that leaves at most 50 stretches
            kept = curve[numbers[(numbers >= first) & (numbers < first + 2048)]]
            stretch = curve[first : first + 2048]
            assert (np.nanmin(kept), np.nanmax(kept)) == (np.nanmin(stretch), np.nanmax(stretch))
    steps = np.diff(t)
    assert np.median(steps) == pytest.approx(steps.max())  # most rows are even ones: nothing looks like a gap


def test_faults_are_counted_over_all_pieces(tmp_path, monkeypatch):
    file = recording(tmp_path, unordered=False)
    rows = file.read_text().splitlines()
    for k in (150, 350, 550, 750):
        cells = rows[k].split(",")
        rows[k] = ",".join([cells[0], "1e6", *cells[2:]])
    file.write_text("\n".join(rows) + "\n")
    settings = Settings(None, {}, options(), Outputs(figure=False))
    whole = tracking.track_one(file, "walk", tmp_path / "whole", settings)
    monkeypatch.setattr(filtering, "PIECE", 200)
    parts = tracking.track_one(file, "walk", tmp_path / "parts", settings)
    assert any("4 gyroscope samples" in text for text in whole["warnings"]), whole["warnings"]
    assert parts["warnings"] == whole["warnings"]
