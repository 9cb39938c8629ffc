"""What faults cost ImuFilter and VQF: python benchmarks/inertial_faults.py COUNT FILE ...

Files are BROAD's trials (in motion for a minute at least). A fault of random kind, time and size is put into a random
trial; told are the seconds until the inclination is back within 2° for half a second (30 at most), and the share of
samples from the fault on, for 30 s, whose error exceeds three reported deviations. The first number is the seed's.
"""

from __future__ import annotations

import sys
import warnings
from pathlib import Path

import numpy as np
import vqf
from bingham import ImuFilter, ImuRecording
from bingham.io import read_recording
from bingham.recording import amended
from bingham.rotations import compose, conjugate, rotate

KINDS = ("clip", "freeze", "zeros", "repeat", "gap", "spike", "bias", "scale", "field")
BEFORE, AFTER, TOLD = 60.0, 100.0, 30.0  # s of the recording around the fault, and after it


def with_fault(kind: str, r: ImuRecording, i: int, rng: np.random.Generator) -> tuple[ImuRecording, int]:
    """Return the recording with a fault from sample i on, and the sample after which the fault is over."""
    time, rate = r.time, 1.0 / np.median(np.diff(r.time))
    gyr, acc, mag = (np.array(a) for a in (r.gyroscope, r.accelerometer, r.magnetometer))
    there = np.ones(r.size, bool)

    def until(low: float, high: float) -> int:
        return i + max(1, int(rng.uniform(low, high) * rate))

    end = i
    if kind == "clip":
        end = until(0.5, 5.0)
        top = max(np.abs(gyr[i:end]).max() * rng.uniform(0.4, 0.9), 2.2)
        gyr[i:end] = np.clip(gyr[i:end], -top, top)
    elif kind == "freeze":
        end = until(0.3, 3.0)
        gyr[i:end] = gyr[i]
    elif kind == "zeros":
        end = until(0.02, 3.0)
        gyr[i:end] = acc[i:end] = 0.0
    elif kind == "repeat":
        end = until(0.1, 2.0)
        for rows in (gyr, acc, mag):
            rows[i:end] = rows[2 * i - end : i]
    elif kind == "gap":
        there = (time < time[i]) | (time >= time[i] + np.exp(rng.uniform(np.log(0.05), np.log(60.0))))
    elif kind == "spike":
        rows = (gyr, acc)[rng.integers(2)]
        rows[i] += rng.standard_normal(3) * np.exp(rng.uniform(np.log(10.0), np.log(1e6)))
        end = i + 1
    elif kind == "bias":
        gyr[i:] += rng.standard_normal(3) * np.radians(np.exp(rng.uniform(np.log(0.2), np.log(5.0)))) / 1.7
    elif kind == "scale":
        gyr[i:] *= 1.0 + rng.uniform(-0.1, 0.1, 3)
    else:
        end = until(1.0, 20.0)
        angle = rng.uniform(0.2, 1.5) * rng.choice([-1.0, 1.0])
        turn = np.array([np.cos(angle / 2), 0.0, 0.0, np.sin(angle / 2)])
        q = np.where(np.isfinite(r.reference[i:end]), r.reference[i:end], [1.0, 0.0, 0.0, 0.0])
        mag[i:end] = rotate(conjugate(q), rotate(turn, rotate(q, mag[i:end])))
    rows = {"gyroscope": gyr, "accelerometer": acc, "magnetometer": mag, "time": time, "reference": r.reference}
    kept = {name: np.array(values)[there] for name, values in rows.items()}
    return amended(r, **kept, score=r.scored[there]), min(end, int(there.sum()) - 1)


def filtered(r: ImuRecording) -> dict[str, tuple[np.ndarray, np.ndarray | None]]:
    """Return quaternions of both filters, and what ours reports of the inclination."""
    track = ImuFilter().run(r)
    arrays = (np.ascontiguousarray(a) for a in (r.gyroscope, r.accelerometer, r.magnetometer))
    peer = vqf.VQF(float(np.median(np.diff(r.time)))).updateBatch(*arrays)["quat9D"]
    return {"VQF": (peer, None), "ImuFilter": (track.modes, track.inclination_std)}


def judged(r: ImuRecording, begin: int, end: int, q: np.ndarray, std: np.ndarray | None) -> tuple[float, float]:
    """Return seconds until the inclination is back (NaN if too little is scored), and the share beyond 3 deviations."""
    e = compose(q, conjugate(r.reference))
    error = 2.0 * np.arccos(np.clip(np.hypot(e[:, 0], e[:, 3]), 0.0, 1.0))
    near = r.scored & (r.time < r.time[end] + TOLD)
    after = np.flatnonzero(near & (np.arange(r.size) >= end))
    width = int(0.5 / np.median(np.diff(r.time)))
    good = error[after] <= np.radians(2.0)
    back = np.nan
    if good.size >= width:
        steady = np.flatnonzero(np.convolve(good, np.ones(width), "valid") > width - 0.5)
        back = 0.0 if good.all() else r.time[after[steady[0]]] - r.time[end] if len(steady) else TOLD
    if std is None:
        return back, np.nan
    here = near & (np.arange(r.size) >= begin)
    return back, float(np.mean(error[here] > 3.0 * std[here])) if here.any() else 0.0


def main(count: int, paths: list[Path]) -> None:
    """Print a line for each kind and filter."""
    warnings.simplefilter("ignore")
    trials = [read_recording(path) for path in paths]
    found: dict[tuple[str, str], list[tuple[float, float]]] = {}
    for k in range(count):
        rng = np.random.default_rng([7, k])
        kind, whole = KINDS[k % len(KINDS)], trials[rng.integers(len(trials))]
        scored = np.flatnonzero(whole.scored)
        start = rng.uniform(whole.time[scored[0]] + 10.0, whole.time[scored[-1]] - 30.0)
        part = (whole.time >= start - BEFORE) & (whole.time < start + AFTER)
        names = ("time", "gyroscope", "accelerometer", "magnetometer", "reference")
        r = amended(whole, **{n: np.array(getattr(whole, n))[part] for n in names}, score=whole.scored[part])
        begin = int(np.searchsorted(r.time, start))
        r, end = with_fault(kind, r, begin, rng)
        for name, (q, std) in filtered(r).items():
            found.setdefault((kind, name), []).append(judged(r, begin, end, q, std))
    for kind in (*KINDS, "all"):
        for name in ("VQF", "ImuFilter"):
            rows = np.array([row for (k, n), v in found.items() for row in v if n == name and kind in (k, "all")])
            back, beyond = rows.T
            half, most = np.nanquantile(back, [0.5, 0.9])
            said = "" if name == "VQF" else f", beyond three deviations {100 * np.mean(beyond):.1f} %"
            print(f"{kind:7} {name:10} back after {half:5.2f} s, 90 % {most:5.2f} s{said}")


if __name__ == "__main__":
    main(int(sys.argv[1]), [Path(argument) for argument in sys.argv[2:]])
