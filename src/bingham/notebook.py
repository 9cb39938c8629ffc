"""How values show themselves in notebooks: small pictures and tables, as HTML without scripts."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import fields, is_dataclass
from html import escape
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bingham.decimate import envelope_indices
from bingham.rotations import rotate

__all__ = ["AXIS_COLOURS", "Pictured", "Tabled", "curves", "framed", "project", "table", "words"]

FloatArray = NDArray[np.float64]

# Okabe & Ito's palette: told apart by colour-blind readers too.
AXIS_COLOURS = ("#D55E00", "#009E73", "#0072B2")
# Azimuth and elevation of the eye, rad: all three world axes are in front.
EYE = (np.radians(35.0), np.radians(25.0))
SIZE = 150  # pixels, width and height of a sphere
SAMPLES = 150
WIDTH, HEIGHT, COLUMNS = 360, 90, 180  # pixels of a panel with curves, and stretches that keep their extremes


def project(v: ArrayLike) -> tuple[FloatArray, FloatArray, NDArray[np.bool_]]:
    """Return screen coordinates right and up (...) of vectors (..., 3), and whether they are in front."""
    azimuth, elevation = EYE
    towards = np.array([np.cos(elevation) * np.cos(azimuth), np.cos(elevation) * np.sin(azimuth), np.sin(elevation)])
    right = np.array([-np.sin(azimuth), np.cos(azimuth), 0.0])
    x = np.asarray(v, dtype=np.float64)
    return x @ right, x @ np.cross(towards, right), x @ towards >= 0


class Pictured:
    """Shows a distribution by samples, beside its text: of a batch or in more than four dimensions the text alone."""

    __slots__ = ()

    def _repr_html_(self) -> str:
        single = getattr(self, "shape", ()) == ()
        samples = np.asarray(self.rvs(SAMPLES, rng=0)) if single else np.empty((0, 0))  # type: ignore[attr-defined]
        return framed(_dots(samples), words(repr(self)))


class Tabled:
    """Shows a result as a table of its fields; long arrays by their shape."""

    __slots__ = ()

    def _repr_html_(self) -> str:
        assert is_dataclass(self)
        return framed("", table({f.name: _told(getattr(self, f.name)) for f in fields(self)}, type(self).__name__))


def framed(picture: str, text: str) -> str:
    """Return a picture with text beside it."""
    return f'<div style="display:flex;gap:1em;align-items:center">{picture}<div>{text}</div></div>'


def words(text: str) -> str:
    """Return text as it is laid out, in lines no wider than the page."""
    return f'<pre style="white-space:pre-wrap">{escape(text)}</pre>'


def table(rows: Mapping[str, str], title: str = "") -> str:
    """Return two columns, names and texts, with a heading."""
    head = f"<caption><b>{escape(title)}</b></caption>" if title else ""
    left = 'style="text-align:left"'
    body = "".join(f"<tr><th {left}>{escape(k)}</th><td {left}>{escape(v)}</td></tr>" for k, v in rows.items())
    return f"<table>{head}{body}</table>"


def curves(values: Sequence[FloatArray], colours: Sequence[str] = AXIS_COLOURS, *, half: float) -> str:
    """Return curves (T,) between −half and half as a small picture; no line where they jump by more than `half`."""
    lines: list[str] = []
    for y, colour in zip(values, colours, strict=False):
        broken = np.array(y)
        broken[1:][np.abs(np.diff(y)) > half] = np.nan
        kept = envelope_indices(broken, COLUMNS)
        x = kept * (WIDTH / max(len(y) - 1, 1))
        up = 0.5 * HEIGHT * (1.0 - broken[kept] / half)
        known = np.isfinite(up)
        begins = known & ~np.concatenate([[False], known[:-1]])
        moves = zip(x[known], up[known], begins[known], strict=True)
        path = "".join(f"{'M' if begin else 'L'}{a:.1f} {b:.1f}" for a, b, begin in moves)
        lines.append(f'<path d="{path}" stroke="{colour}" fill="none" stroke-linecap="round"/>')
    return _svg(WIDTH, HEIGHT, f"0 0 {WIDTH} {HEIGHT}", "".join(lines))


def _svg(width: int, height: int, box: str, body: str) -> str:
    return f'<svg style="flex:none" width="{width}" height="{height}" viewBox="{box}" role="img">{body}</svg>'


def _dots(samples: FloatArray) -> str:
    """Return a circle or sphere with samples: axes (n, 2), (n, 3), or where rotations carry the body's x, y and z."""
    if samples.shape[1:] == (2,):
        clouds = [(samples[:, 0], samples[:, 1], np.ones(len(samples), dtype=np.bool_))]
    elif samples.shape[1:] == (3,):
        clouds = [project(samples)]
    elif samples.shape[1:] == (4,):
        clouds = [project(rotate(samples, tip)) for tip in np.eye(3)]
    elif samples.shape[1:] == (3, 3):
        clouds = [project(samples[:, :, k]) for k in range(3)]
    else:
        return ""
    paths: list[str] = []
    for (right, up, front), colour in zip(clouds, AXIS_COLOURS if len(clouds) == 3 else AXIS_COLOURS[2:], strict=True):
        for side, strength in ((~front, 0.2), (front, 0.7)):
            path = "".join(f"M{a:.3f} {-b:.3f}h0" for a, b in zip(right[side], up[side], strict=True))
            style = f'stroke="{colour}" stroke-opacity="{strength}" stroke-width="0.05" stroke-linecap="round"'
            paths.append(f'<path d="{path}" {style}/>' if path else "")
    circle = '<circle r="1" fill="none" stroke="#888888" stroke-width="0.015"/>'
    return _svg(SIZE, SIZE, "-1.1 -1.1 2.2 2.2", circle + "".join(paths))


def _told(value: Any) -> str:
    if isinstance(value, np.ndarray):
        return np.array2string(value, precision=4) if value.size <= 16 else f"array of shape {value.shape}"
    if isinstance(value, Tabled):
        return f"a {type(value).__name__}"
    return f"{value:.6g}" if isinstance(value, float) else str(value)
