"""What bias estimation and reported uncertainty are worth on recordings: python benchmarks/inertial.py FILE ...

Files are recordings with reference and scored samples in any format that `bingham.io` reads, for example the trials of
BROAD (github.com/dlaidig/broad, data_hdf5). ``--sets DATA [--subset N]`` prints, for sets of recordings, what constants
that were chosen on the other sets are worth on each: `inertial_sets`.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
from bingham import ImuFilter, ImuRecording
from bingham.filters import ImuStream, ImuTrack
from bingham.io import read_recording
from bingham.metrics import broad_rmse
from bingham.rotations import compose, conjugate

BIAS_HELD = ImuFilter(gyroscope_bias=1e-7, gyroscope_wide_bias=1e-7, gyroscope_bias_walk=0.0, rest_time=1e9)
STRIDE = 50  # the filter's own covariance is read at every 50th sample


def no_bias(r: ImuRecording) -> ImuTrack:
    """Take the gyroscope at its word."""
    return BIAS_HELD.run(r)


def first_rest(r: ImuRecording) -> ImuTrack:
    """Take the mean of the gyroscope before the first movement for its bias, and hold it."""
    start = int(np.argmax(r.scored))
    return BIAS_HELD.run(replace(r, gyroscope=r.gyroscope - r.gyroscope[: start // 2].mean(axis=0)))


def motion_only(r: ImuRecording) -> ImuTrack:
    """Learn the bias from its correlation with the orientation, never from rest."""
    return ImuFilter(rest_time=1e9).run(r)


def online(r: ImuRecording) -> ImuTrack:
    """Learn it from both: the default."""
    return ImuFilter().run(r)


def smoothed(r: ImuRecording) -> ImuTrack:
    """The default, smoothed."""
    return ImuFilter().smooth(r)


def own(r: ImuRecording) -> ImuTrack:
    """The default with the covariance that the filter carries instead of the one it states."""
    track, stream = ImuFilter().run(r), ImuStream()
    covariance = np.full((r.size, 3, 3), np.nan)
    for k in range(r.size):
        stream.gyroscope(r.time[k], r.gyroscope[k])
        if r.accelerometer is not None and np.isfinite(r.accelerometer[k, 0]):
            stream.accelerometer(r.time[k], r.accelerometer[k])
        if r.magnetometer is not None and np.isfinite(r.magnetometer[k, 0]):
            stream.magnetometer(r.time[k], r.magnetometer[k])
        if k % STRIDE == 0:
            covariance[k : k + STRIDE] = stream.state.covariance[:3, :3]
    return replace(track, rotation_covariance=covariance)


def judge(track: ImuTrack, r: ImuRecording) -> tuple[float, ...]:
    """Return total and inclination RMSE, spread of the heading error (degrees), actual over reported, coverage."""
    there = r.scored
    errors = broad_rmse(track.modes, r.reference, there)
    e = compose(r.reference[there], conjugate(track.modes[there]))
    e *= np.sign(e[:, :1])
    spread = np.std(np.unwrap(2.0 * np.arctan2(e[:, 3], e[:, 0])))
    tilt, p = 2.0 * e[:, 1:3], track.rotation_covariance[there][:, :2, :2]
    ratio = np.sqrt(np.mean(np.sum(tilt**2, axis=1)) / np.mean(np.trace(p, axis1=1, axis2=2)))
    squared = np.einsum("ni,nij,nj->n", tilt, np.linalg.inv(p), tilt)
    degrees = np.degrees([errors.total, errors.inclination, spread])
    return *degrees, ratio, np.mean(squared < -2.0 * np.log(0.05))


def main(paths: list[Path]) -> None:
    """Print the means of each variant and, where uncertainty is the question, a line for each trial."""
    recordings = [read_recording(path) for path in paths]
    variants: list[Callable[[ImuRecording], ImuTrack]] = [no_bias, first_rest, motion_only, online, own, smoothed]
    for variant in variants:
        rows = {r.name: judge(variant(r), r) for r in recordings}
        mean = np.mean(list(rows.values()), axis=0)
        print(f"{variant.__name__}: total {mean[0]:.2f}, inclination {mean[1]:.2f}, heading spread {mean[2]:.2f}")
        if variant in (online, own, smoothed):
            for name, row in rows.items():
                print(f"    {name}: inclination {row[1]:.2f}, actual/reported {row[3]:.2f}, coverage {row[4]:.3f}")


if __name__ == "__main__":
    if sys.argv[1:2] == ["--sets"]:
        from inertial_sets import main as leave_one_out

        leave_one_out(sys.argv[2:])
    else:
        main([Path(argument) for argument in sys.argv[1:]])
