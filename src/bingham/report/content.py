"""What a report shows, as numbers that fit into a page: decimated curves, orientations, summary."""

from __future__ import annotations

import base64
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.special import ndtri

from bingham.decimate import envelope, gaps
from bingham.distributions.uncertainty import heading_and_inclination
from bingham.errors import InvalidArgumentError
from bingham.rotations import align_signs, compose, conjugate, to_rotation_vector, yaw_pitch_roll
from bingham.validation import as_numbers

__all__ = ["STRETCHES", "report_content"]

FloatArray = NDArray[np.float64]

STRETCHES = 20_000  # of the time axis: each keeps its smallest and largest value
CLOUDS = 4_000  # orientations whose covariance is kept
MISSING = -32768  # int16 for NaN
PER_AXIS = float(ndtri(0.975))  # half-width of a normal variable's 95 % interval, standard deviations
START = 30.0  # s after which scales are set, or a quarter of the recording


def report_content(
    time: ArrayLike,
    modes: ArrayLike,
    covariance: ArrayLike,
    *,
    title: str,
    truth: ArrayLike | None = None,
    scored: ArrayLike | None = None,
    rejected: ArrayLike | None = None,
    bias: ArrayLike | None = None,
    bias_std: ArrayLike | None = None,
    summary: Mapping[str, str] | None = None,
    warnings: Sequence[str] = (),
    world: tuple[str, str, str] = ("x", "y", "z"),
) -> dict[str, Any]:
    """Return the content of a page as plain numbers and texts; arguments as for `write_report`."""
    t, q = as_numbers(time, "time"), as_numbers(modes, "modes")
    c = as_numbers(covariance, "covariance")
    if t.ndim != 1 or not len(t) or q.shape != (len(t), 4) or c.shape != (len(t), 3, 3):
        expected = "time (T,), modes (T, 4) and covariance (T, 3, 3)"
        raise InvalidArgumentError("modes", expected, f"{t.shape}, {q.shape} and {c.shape}")
    seconds = t - t[0]
    if np.isfinite(q).all():
        q = align_signs(q)
    index, _ = envelope(seconds, STRETCHES)
    true = None if truth is None else as_numbers(truth, "truth")
    mask = None if scored is None else np.asarray(scored, dtype=np.bool_)
    settled = int(np.searchsorted(seconds, min(START, 0.25 * seconds[-1])))
    panels = [_angles(q, true), *_uncertainty(q, c, true, settled)]
    if bias is not None:
        panels.append(
            _bias(as_numbers(bias, "bias"), None if bias_std is None else as_numbers(bias_std, "bias_std"), settled)
        )
    cloud = np.linspace(0, len(index) - 1, min(CLOUDS, len(index))).astype(int)
    return {
        "title": title,
        "start": float(t[0]),
        "time": _packed(seconds[index], "float64"),
        "panels": [_packed_panel(panel) for panel in panels],
        "orientation": _packed(np.nan_to_num(q[index], nan=0.0) * 32767.0, "int16"),
        "truth": None if true is None else _packed(np.nan_to_num(true[index], nan=0.0) * 32767.0, "int16"),
        "cloud": cloud.tolist(),
        "covariance": _packed(c[index[cloud]][:, *np.triu_indices(3)], "float32"),
        "gaps": [[float(seconds[k]), float(seconds[k + 1])] for k in gaps(seconds)],
        "unscored": [] if mask is None else _runs(seconds, ~mask),
        "rejected": [] if rejected is None else _ticks(seconds, np.asarray(rejected, dtype=np.bool_)),
        "summary": dict(summary or {}),
        "warnings": list(warnings),
        "world": list(world),
    }


def _angles(q: FloatArray, truth: FloatArray | None) -> dict[str, Any]:
    found = np.degrees(yaw_pitch_roll(q)).T
    curves = [_curve(name, k, found[k], wraps=True) for k, name in enumerate(("yaw", "pitch", "roll"))]
    if truth is not None:
        true = np.degrees(yaw_pitch_roll(truth)).T
        curves += [
            _curve(f"true {name}", k, true[k], dash=True, wraps=True) for k, name in enumerate(("yaw", "pitch", "roll"))
        ]
    return {"title": "orientation", "unit": "°", "curves": curves, "range": None}


def _uncertainty(q: FloatArray, c: FloatArray, truth: FloatArray | None, settled: int) -> list[dict[str, Any]]:
    """Heading and inclination: 95 % bounds, and errors where the truth is known."""
    across, around = (np.minimum(np.degrees(half), 180.0) for half in heading_and_inclination(c))
    heading: list[dict[str, Any]] = []
    inclination: list[dict[str, Any]] = []
    if truth is not None:
        error = np.full((len(q), 3), np.nan)
        both = np.isfinite(q).all(axis=1) & np.isfinite(truth).all(axis=1)
        error[both] = np.degrees(to_rotation_vector(compose(q[both], conjugate(truth[both]))))
        heading.append(_curve("error", 2, error[:, 2]))
        inclination.append(_curve("error", 0, np.hypot(error[:, 0], error[:, 1])))
    heading += [_curve("95 % bound", 3, across, band="upper"), _curve("", 3, -across, band="lower")]
    inclination.append(_curve("95 % bound", 3, around, band="zero"))
    word = "error and 95 % bound" if truth is not None else "within ±, 95 %"
    return [
        {"title": f"heading: {word}", "unit": "°", "curves": heading, "range": _steady(heading, settled)},
        {
            "title": f"inclination: {word}",
            "unit": "°",
            "curves": inclination,
            "range": [0.0, _steady(inclination, settled)[1]],
        },
    ]


def _bias(bias: FloatArray, std: FloatArray | None, settled: int) -> dict[str, Any]:
    curves: list[dict[str, Any]] = []
    for k, name in enumerate("xyz"):
        value = np.degrees(bias[:, k])
        curves.append(_curve(name, k, value))
        if std is not None:
            width = np.degrees(PER_AXIS * std[:, k])
            curves += [_curve("", k, value + width, band="upper"), _curve("", k, value - width, band="lower")]
    return {"title": "gyroscope bias and 95 % band", "unit": "°/s", "curves": curves, "range": _steady(curves, settled)}


def _steady(curves: Sequence[dict[str, Any]], settled: int) -> list[float]:
    """Return the range from sample `settled` on: a start that knows nothing would set the scale of everything else."""
    after = [c["value"][settled:] for c in curves]
    ends = [(np.nanmin(y), np.nanmax(y)) for y in after if np.isfinite(y).any()]
    if not ends:
        return [-180.0, 180.0]
    low, high = min(e[0] for e in ends), max(e[1] for e in ends)
    margin = max(0.1 * (high - low), 0.05)
    return [float(low - margin), float(high + margin)]


def _curve(
    name: str, colour: int, value: FloatArray, *, dash: bool = False, band: str = "", wraps: bool = False
) -> dict[str, Any]:
    return {"name": name, "colour": colour, "value": value, "dash": dash, "band": band, "wraps": wraps}


def _packed_panel(panel: dict[str, Any]) -> dict[str, Any]:
    return {**panel, "curves": [_packed_curve(curve) for curve in panel["curves"]]}


def _packed_curve(curve: dict[str, Any]) -> dict[str, Any]:
    """Return a curve as int16 over its range: 1/65000 of it is far below a pixel."""
    index, y = envelope(curve["value"], STRETCHES)
    if curve["wraps"]:  # no line is drawn across the jump from 180° to −180°
        jump = np.flatnonzero(np.abs(np.diff(curve["value"])) > 180.0) + 1
        y = y.copy()
        y[np.searchsorted(index, jump, side="right") - 1] = np.nan
    finite = y[np.isfinite(y)]
    low, high = (float(finite.min()), float(finite.max())) if len(finite) else (0.0, 0.0)
    scale = (high - low) / 65000.0 or 1.0
    coded = np.where(np.isfinite(y), np.round((y - low) / scale) - 32500.0, MISSING)
    return {**curve, "value": _packed(coded, "int16"), "scale": scale, "offset": low + 32500.0 * scale}


def _packed(values: FloatArray, kind: str) -> str:
    coded = np.ascontiguousarray(
        np.round(values) if kind == "int16" else values, dtype=np.dtype(kind).newbyteorder("<")
    )
    return base64.b64encode(coded.tobytes()).decode("ascii")


def _runs(t: FloatArray, inside: NDArray[np.bool_]) -> list[list[float]]:
    """Return [from, to] of each run, at most 500 of them."""
    edge = np.flatnonzero(np.diff(np.concatenate([[False], inside, [False]]).astype(np.int8)))
    first, last = edge[::2], edge[1::2] - 1
    return [[float(t[a]), float(t[b])] for a, b in zip(first[:500], last[:500], strict=True)]


def _ticks(t: FloatArray, hit: NDArray[np.bool_]) -> list[float]:
    """Return times of rejected measurements, at most 5000 evenly chosen."""
    index = np.flatnonzero(hit)
    return [round(float(x), 4) for x in t[index[:: len(index) // 5000 + 1]]]
