"""One HTML file of a track: the body in 3-D on a time slider, curves that zoom together, a summary."""

from __future__ import annotations

import json
from dataclasses import dataclass, field
from functools import cache
from html import escape
from importlib.resources import files
from pathlib import Path
from typing import Any

import numpy as np

from bingham.atomic import replaced
from bingham.errors import InvalidArgumentError
from bingham.report.content import report_content

__all__ = ["Report", "render_report", "report_track", "write_report"]

PARTS = {
    "uplot_css": "vendor/uPlot-1.6.32.min.css",
    "css": "page.css",
    "uplot": "vendor/uPlot-1.6.32.iife.min.js",
    "three": "vendor/three-0.187.0.bundle.min.js",
    "js": "page.js",
}


@cache
def _part(name: str) -> str:
    return files("bingham.report").joinpath(name).read_text(encoding="utf-8")


def render_report(time: Any, modes: Any, covariance: Any, *, title: str, **more: Any) -> str:
    """Return the page as text; arguments as for `write_report`."""
    content = json.dumps(
        report_content(time, modes, covariance, title=title, **more), ensure_ascii=False, allow_nan=False
    )
    page = _part("page.html").replace("@title@", escape(title))
    for name, path in PARTS.items():
        page = page.replace(f"@{name}@", _part(path))
    # "</script>" inside a name would end the element that holds the data.
    return page.replace("@content@", content.replace("<", "\\u003c"))


def write_report(path: str | Path, time: Any, modes: Any, covariance: Any, *, title: str, **more: Any) -> None:
    """Write a report page: one self-contained file, which asks for nothing from elsewhere.

    Curves keep the smallest and largest value of each of 20 000 stretches of time, so that peaks of any recording show;
    up to 40 000 samples are kept as they are.

    Parameters
    ----------
    path : str or Path
        The HTML file.
    time : (T,) array_like
        Seconds.
    modes : (T, 4) array_like
        Orientations (w, x, y, z), body to world; NaN where unknown.
    covariance : (T, 3, 3) array_like
        Of the rotation error in world axes, rad².
    title : str
        Name of the recording.
    truth : (T, 4) array_like, optional
        Ground truth; NaN where unknown.
    scored : (T,) array_like of bool, optional
        Evaluation mask: samples whose errors count.
    rejected : (T,) array_like of bool, optional
        Samples with rejected measurements.
    bias, bias_std : (T, 3) array_like, optional
        Gyroscope bias and its standard deviation, rad/s.
    summary : mapping of str to str, optional
        What stands on top of the page.
    warnings : sequence of str, optional
        What the reader and the filter warned of.
    world : tuple of str
        Names of the world's axes, the third one vertical.
    """
    Report(title, render_report(time, modes, covariance, title=title, **more)).save(path)


@dataclass(frozen=True)
class Report:
    """A page in memory: notebooks show it, `save` writes it.

    Parameters
    ----------
    title : str
        Name of the recording.
    html : str
        The page.
    """

    title: str
    html: str = field(repr=False)

    def save(self, path: str | Path) -> None:
        """Write the page."""
        with replaced(path) as new:
            new.write_text(self.html, encoding="utf-8")

    def _repr_html_(self) -> str:
        style = "width: 100%; height: 780px; border: 0"
        return f'<iframe title="{escape(self.title)}" style="{style}" srcdoc="{escape(self.html)}"></iframe>'


def rejected_samples(track: Any, time: Any) -> Any:
    """Return at which samples (T,) of a track a measurement was rejected, a camera's orientations included."""
    hit: Any = np.reshape(track.rejected, (len(track.rejected), -1)).any(axis=1)  # of several sensors (T, n)
    log = getattr(track, "orientations", None)
    if log is not None:
        hit[np.minimum(np.searchsorted(time, log.time[log.rejected]), len(hit) - 1)] = True
    return hit


def report_track(track: Any, path: str | Path | None = None, *, title: str = "track", **more: Any) -> Report:
    """Return the report of a track of rotations, written to `path` if one is given.

    Parameters
    ----------
    track : Track
        With times, or one row a second; d = 4, a single sequence.
    path : str or Path, optional
        HTML file to write.
    title : str
        Name of the recording.
    **more
        ``truth``, ``scored``, ``summary``, ``warnings``, ``world``: as for `write_report`.
    """
    if np.ndim(track.modes) != 2 or np.shape(track.modes)[-1] != 4:
        raise InvalidArgumentError("track", "one sequence of rotations, d = 4", f"modes {np.shape(track.modes)}")
    time = np.arange(len(track), dtype=np.float64) if track.time is None else track.time
    if "rejected" not in more:
        more["rejected"] = rejected_samples(track, time)
    for name in ("bias", "bias_std"):
        value = getattr(track, name, None)
        if name not in more and value is not None:
            more[name] = value
    page = Report(title, render_report(time, track.modes, track.covariance(frame="world"), title=title, **more))
    if path is not None:
        page.save(path)
    return page
