"""Leave one set out: python benchmarks/inertial.py --sets DATA [--subset N]

For every set of recordings the constants of the inertial filter are chosen on all the other sets, and the errors on the
set left out are printed beside those of the defaults and of VQF (where installed). DATA is a folder with ``broad``,
``smartphone``, ``tumvi`` and ``imu_sets``, whose ``score.py`` prepares the references of its folders; sets that are not
there are left out.

The grid is small on purpose: one constant at a time, at half, once and twice its default. With the loss of a choice the
mean, over the other sets, of log total + log inclination error relative to the defaults, a set counts once however many
recordings it has. `--subset N` takes N recordings of each set, evenly spread.
"""

from __future__ import annotations

import argparse
import importlib.util
import warnings
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from bingham import ImuFilter, ImuRecording
from bingham.io import read_recording
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

# What a user would turn: how fast gravity is followed, what the gyroscope is worth, how fast north is followed.
CONSTANTS = ("gyroscope_bias", "slow_velocity", "gyroscope_scale_error", "accelerometer_noise", "magnetometer_time")
FACTORS = (0.5, 2.0)
LONGEST_STEP = 0.05  # s between truths to interpolate


class Trial(NamedTuple):
    """A recording, its true orientations, the samples that count, and whether its north is known."""

    recording: ImuRecording
    truth: Rotation
    scored: NDArray[np.bool_]
    north: bool


def sets_of(data: Path, subset: int | None) -> dict[str, list[Trial]]:
    """Return the trials of every set that is there."""
    found: dict[str, list[Trial]] = {}
    for name in ("broad", "smartphone", "tumvi"):
        paths = some(sorted((data / name).glob("*.npz")), subset)
        trials = [trial for path in paths if (trial := plain(read_recording(path))) is not None]
        if trials:
            found[name] = trials
    script = data / "imu_sets" / "score.py"
    if script.exists():
        spec = importlib.util.spec_from_file_location("score", script)
        assert spec is not None and spec.loader is not None
        score = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(score)
        for folder in sorted(p for p in script.parent.iterdir() if p.is_dir()):
            found[folder.name] = [prepared(score, path) for path in some(sorted(folder.glob("*.npz")), subset)]
    return {name: trials for name, trials in found.items() if trials}


def some(paths: list[Path], count: int | None) -> list[Path]:
    """Return at most `count` of them, evenly spread."""
    if count is None or len(paths) <= count:
        return paths
    return [paths[k] for k in np.linspace(0, len(paths) - 1, count).round().astype(int)]


def plain(r: Any) -> Trial | None:
    """Return a trial whose reference is against north."""
    reference, scored = r.reference, r.scored
    if reference is None and r.truth is not None:
        after = np.clip(np.searchsorted(r.truth.time, r.time), 1, r.truth.size - 1)
        near = np.where(r.time - r.truth.time[after - 1] < r.truth.time[after] - r.time, after - 1, after)
        reference = r.truth.orientation[near]
        scored = np.abs(r.truth.time[near] - r.time) < LONGEST_STEP
    if reference is None:
        return None
    known = np.isfinite(reference[:, 0])
    q = np.where(known[:, None], reference, [1.0, 0.0, 0.0, 0.0])
    return Trial(r, Rotation.from_quat(q, scalar_first=True), scored & known, r.magnetometer is not None)


def prepared(score: Any, path: Path) -> Trial:
    """Return a trial whose reference the script of its folder makes; its north is not known."""
    z = np.load(path)
    t, gyr, acc, q = (z[k].astype(float) for k in ("time", "gyr", "acc", "ref"))
    gyr, acc = score.filled(t, gyr), score.filled(t, acc)
    mag = score.filled(t, z["mag"].astype(float)) if "mag" in z.files else None
    truth, moving = score.prepare(t, gyr, acc, q)
    return Trial(ImuRecording(path.stem, t, gyr, acc, mag), truth, moving, north=False)


def errors(modes: NDArray[np.float64], trial: Trial) -> tuple[float, float]:
    """Return root mean squares of the total error and of the inclination, degrees."""
    rows = trial.scored & np.isfinite(modes[:, 0])
    x = (Rotation.from_quat(modes[rows], scalar_first=True) * trial.truth[rows].inv()).as_quat(scalar_first=True)
    heading = 2.0 * np.arctan2(x[:, 3], x[:, 0])
    if not trial.north:
        heading = heading - np.angle(np.exp(1j * heading).mean())
    heading = np.angle(np.exp(1j * heading))
    inclination = 2.0 * np.arccos(np.clip(np.hypot(x[:, 0], x[:, 3]), 0.0, 1.0))
    total = 2.0 * np.arccos(np.clip(np.abs(np.cos(heading / 2.0) * np.cos(inclination / 2.0)), 0.0, 1.0))
    return tuple(float(np.degrees(np.sqrt(np.mean(angle**2)))) for angle in (total, inclination))


def vqf_modes(r: ImuRecording) -> NDArray[np.float64]:
    """Return VQF's orientations."""
    from vqf import VQF

    dt = float(np.mean(np.diff(r.time)))
    rows = [np.ascontiguousarray(filled(r.time, x)) for x in (r.gyroscope, r.accelerometer)]
    if r.magnetometer is None:
        return VQF(dt).updateBatch(*rows)["quat6D"]
    return VQF(dt).updateBatch(*rows, np.ascontiguousarray(filled(r.time, r.magnetometer)))["quat9D"]


def filled(t: NDArray[np.float64], rows: Any) -> NDArray[np.float64]:
    """Return rows with missing ones interpolated."""
    ok = np.isfinite(rows[:, 0])
    return rows if ok.all() else np.stack([np.interp(t, t[ok], rows[ok, k]) for k in range(3)], axis=1)


def variants() -> dict[str, ImuFilter]:
    """Return the grid, by what is changed; "default" first."""
    default = ImuFilter()
    grid = {"default": default}
    for name in CONSTANTS:
        for factor in FACTORS:
            value = getattr(default, name) * factor
            grid[f"{name} {value:.3g}"] = replace(default, **{name: value})
    return grid


def leave_one_out(data: Path, subset: int | None) -> None:
    """Print the table."""
    warnings.simplefilter("ignore")
    sets, grid = sets_of(data, subset), variants()
    if len(sets) < 2:
        raise SystemExit(f"{data}: two sets at least are needed, found {', '.join(sets) or 'none'}")
    table = {
        name: {v: np.mean([errors(f.run(x.recording).modes, x) for x in trials], axis=0) for v, f in grid.items()}
        for name, trials in sets.items()
    }
    loss = {s: {v: float(np.sum(np.log(row[v] / row["default"]))) for v in grid} for s, row in table.items()}
    try:
        beside = {
            name: np.mean([errors(vqf_modes(x.recording), x) for x in trials], axis=0) for name, trials in sets.items()
        }
    except ImportError:
        beside = {}
    print("Degrees, total / inclination (where the reference knows no north: its mean difference removed).")
    heads = " ".join(f"{head:>13s}" for head in ("chosen", "defaults", "best here", "VQF"))
    print(f"{'set left out':13s} {'n':>3s}  {'chosen on the others':30s} {heads}")
    for name, trials in sets.items():
        others = {v: np.mean([loss[s][v] for s in sets if s != name]) for v in grid}
        chosen = min(others, key=lambda v: others[v])
        best = min(grid, key=lambda v: loss[name][v])
        cells = [table[name][chosen], table[name]["default"], table[name][best], beside.get(name)]
        text = " ".join(f"{'–':>13s}" if c is None else f"{c[0]:6.2f} /{c[1]:5.2f}" for c in cells)
        print(f"{name:13s} {len(trials):3d}  {chosen:30s} {text}   {'' if best == chosen else best}")


def main(arguments: list[str]) -> None:
    """Read the command line of ``--sets``."""
    parser = argparse.ArgumentParser(prog="inertial.py --sets", description=__doc__)
    parser.add_argument("data", type=Path, help="folder with broad, smartphone, tumvi, imu_sets")
    parser.add_argument("--subset", type=int, help="recordings of each set, at most")
    given = parser.parse_args(arguments)
    leave_one_out(given.data, given.subset)
