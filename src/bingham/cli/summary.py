"""What there is to say about a recording and its track, gathered piece by piece."""

from __future__ import annotations

from typing import Any

import numpy as np

from bingham.cli.thinned import Thinned

__all__ = ["Summary"]

# An interval of so many usual ones is a gap.
GAP = 5.0
# Codes of magnetometer samples that an inertial filter rejected, not merely had no use for.
REJECTED = (2, 3, 4)
JUDGED = (1, *REJECTED)
# Beyond this share of a sensor's samples rejected, the sensor or its axes are in question.
DOUBTFUL_REJECTED = 0.5
# Samples that medians are taken of; more are thinned out.
ENOUGH = 1_000_000
CHECK = "disturbed field? Or check units, axes and handedness of gyroscope and magnetometer"


class Summary:
    """Figures of one recording; angles in degrees, as their names say.

    Parameters
    ----------
    usual_step : float
        Usual time between samples, s; NaN of a lone one.
    """

    def __init__(self, usual_step: float) -> None:
        self.samples = 0
        self._first = self._last = np.nan
        self._usual = usual_step
        self._gaps, self._longest = 0, 0.0
        self._sensors: list[str] = []
        self._rejected = self._judged = 0
        self._log_evidence = 0.0
        self._deviations: dict[str, Thinned] = {}
        self._final: dict[str, float] = {}
        self._bias: dict[str, Any] = {}
        self._relative = np.nan
        self._orientations: dict[str, int] | None = None

    def add(self, piece: Any, track: Any) -> None:
        """Take a piece of a recording and its track."""
        from bingham.io.track_fields import content_of, deviations

        if not self.samples:
            self._first = float(piece.time[0])
            self._sensors = _sensors(piece)
        self._add_times(piece.time)
        self.samples += piece.size
        self._last = float(piece.time[-1])
        self._log_evidence += float(track.log_evidence.sum())
        if (code := getattr(track, "magnetometer_code", None)) is not None:
            self._rejected += int(np.isin(code, REJECTED).sum())
            self._judged += int(np.isin(code, JUDGED).sum())
        else:
            self._rejected += int(track.rejected.sum())
        for name, values in deviations(content_of(track)).items():
            angles = np.degrees(values).astype(np.float32)
            self._deviations.setdefault(name, Thinned(ENOUGH)).add(angles)
            self._final[name] = float(angles[-1])
        if (bias := getattr(track, "bias", None)) is not None:
            self._bias = {
                "bias_deg_s": dict(zip("xyz", np.degrees(bias[-1]).tolist(), strict=True)),
                "bias_std_deg_s": dict(zip("xyz", np.degrees(track.bias_std[-1]).tolist(), strict=True)),
            }

        if (relative := getattr(track, "relative_heading_std", None)) is not None and len(relative):
            self._relative = float(np.degrees(relative[-1]))
        if (log := getattr(track, "orientations", None)) is not None:
            before = self._orientations or {"count": 0, "used": 0, "rejected": 0}
            told = {"count": len(log), "used": int(log.used.sum()), "rejected": int(log.rejected.sum())}
            self._orientations = {name: value + told[name] for name, value in before.items()}

    def _add_times(self, time: Any) -> None:
        steps = np.diff(time, prepend=time[:1] if np.isnan(self._last) else self._last)
        if np.isnan(self._last):
            steps = steps[1:]
        if not len(steps):
            return
        self._longest = max(self._longest, float(steps.max()))
        self._gaps += int((steps > GAP * self._usual).sum())

    @property
    def duration_s(self) -> float:
        """Time from the first to the last sample, s."""
        return self._last - self._first

    @property
    def doubt(self) -> str:
        """What so many rejected samples of a magnetometer put in doubt; empty if there are few."""
        share = self._rejected / max(self._judged, 1)
        if not self._judged or share <= DOUBTFUL_REJECTED:
            return ""
        return f"{100 * share:.0f} % of the magnetometer's samples rejected: {CHECK}"

    def row(self) -> dict[str, Any]:
        """Return all of it by name."""
        angles = {name: kept.arrays()[0] for name, kept in self._deviations.items()}
        return {
            "samples": self.samples,
            "duration_s": self.duration_s,
            "sensors": self._sensors,
            "rate_hz": 1.0 / self._usual if self._usual > 0 else None,
            "gaps": {"count": self._gaps, "longest_s": self._longest},
            "rejected": self._rejected,
            "log_evidence": self._log_evidence,
            "final_deviation_deg": {name: _known(value) for name, value in self._final.items()},
            "median_deviation_deg": {name: _known(_median(values)) for name, values in angles.items()},
            **self._bias,
            **({} if np.isnan(self._relative) else {"relative_heading_std_deg": self._relative}),
            **({} if self._orientations is None else {"orientations": dict(self._orientations)}),
        }


def _sensors(piece: Any) -> list[str]:
    names = ("gyroscope", "accelerometer", "magnetometer", "orientation")
    there = [(name, getattr(piece, name, None)) for name in names]
    return [name for name, values in there if values is not None and np.isfinite(values).any()]


def _median(values: Any) -> float:
    known = values[np.isfinite(values)]
    return float(np.median(known)) if len(known) else np.nan


def _known(value: float) -> float | None:
    return float(value) if np.isfinite(value) else None
