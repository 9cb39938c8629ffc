"""How well the filters of the spinning-ball study know orientation and spin: errors, classification, coverage."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bingham.baselines.gaussian import GaussianState
from bingham.distributions.bingham import Bingham
from bingham.metrics import angle_probability, chi_square_probability, coverage, geodesic_error, nees
from bingham.rotations import compose, conjugate
from bingham.studies.study import Arrays

__all__ = ["AFTER", "HALF_TURN", "Found", "logo_errors", "score"]

FloatArray = NDArray[np.float64]
# The symmetry of the elliptic logo: half a rotation about its own axis.
HALF_TURN = np.array([0.0, 0.0, 0.0, 1.0])
# After how many frames errors are tabulated and coverage is counted; the last is the published one.
AFTER = (10, 20, 30)
Distribution = Bingham | GaussianState


class Found(NamedTuple):
    """What a filter says after each of T frames: orientation, if it has any, spin, and the type (T,)."""

    orientations: Sequence[Distribution] | None
    spins: Sequence[Distribution]
    chosen: Sequence[int]


def score(found: Found, flight: Arrays, kind: int) -> Arrays:
    """Return spin errors and correctness (T,), orientation errors (T,), and coverage of both in frames AFTER (k,).

    Errors are angles of rotations, that of the orientation up to the logo's symmetry; its coverage is of the nearer of
    the two orientations that look alike. Frames beyond the end of the flight count for nothing: k is smaller.
    """
    frames = [n - 1 for n in AFTER if n <= len(found.spins)]
    truth = np.tile(flight["spin"], (len(found.spins), 1))
    out: Arrays = {
        "spin_error": _error(found.spins, truth),
        "correct": np.array([chosen == kind for chosen in found.chosen], dtype=np.float64),
        "spin_covered": _covered(found.spins, truth, frames),
    }
    if found.orientations is not None:
        truth, twin = flight["orientation"], compose(flight["orientation"], HALF_TURN)
        modes = np.stack([distribution.mode for distribution in found.orientations])
        error, other = _error(found.orientations, truth), _error(found.orientations, twin)
        out["orientation_error"] = np.minimum(error, other)
        out["logo_axis_error"], out["logo_angle_error"] = logo_errors(modes, flight["orientation"])
        nearer = np.where((error <= other)[:, None], truth, twin)
        out["orientation_covered"] = _covered(found.orientations, nearer, frames)
    return out


def logo_errors(estimated: FloatArray, truth: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the angles (T,), rad, between the logo's axes and about its axis, the latter up to half a rotation.

    The error as a rotation in the body frame is a rotation about the logo's axis z and one across it.
    """
    e = compose(conjugate(truth), estimated)
    axis = 2.0 * np.arctan2(np.hypot(e[:, 1], e[:, 2]), np.hypot(e[:, 0], e[:, 3]))
    about = np.abs(2.0 * np.arctan2(e[:, 3], e[:, 0])) % np.pi
    return axis, np.minimum(about, np.pi - about)


def _error(distributions: Sequence[Distribution], truth: FloatArray) -> FloatArray:
    return 2.0 * geodesic_error(np.stack([distribution.mode for distribution in distributions]), truth)


def _covered(distributions: Sequence[Distribution], truth: FloatArray, frames: Sequence[int]) -> FloatArray:
    """Return 1.0 where the truth is within the distribution's 95 % credible set, else 0.0, in the given frames (k,)."""
    return np.array([coverage(_probability(distributions[n], truth[n])) for n in frames])


def _probability(distribution: Distribution, truth: FloatArray) -> FloatArray:
    if isinstance(distribution, Bingham):
        return angle_probability(distribution, truth)
    return chi_square_probability(nees(distribution.mode, distribution.covariance, truth), 3)
