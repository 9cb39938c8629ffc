"""Mean of rotations with outliers, and its covariance."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bingham.distributions.bingham import Bingham
from bingham.distributions.symmetric import SymmetricMixture
from bingham.distributions.uncertainty import frame_required
from bingham.errors import InvalidArgumentError
from bingham.notebook import Tabled
from bingham.rotations import as_quaternion, compose, conjugate
from bingham.validation import as_numbers

if TYPE_CHECKING:
    from scipy.spatial.transform import Rotation

__all__ = ["MeanRotation", "mean_rotation"]

FloatArray = NDArray[np.float64]

# Cells into which a map is divided: enough for a variance, few enough to be wider than what links neighbours.
CELLS = 10


@dataclass(frozen=True, slots=True, eq=False)
class MeanRotation(Tabled):
    """Mean of a sample of rotations; see `mean_rotation`.

    Parameters
    ----------
    mean : (4,) ndarray
        Unit quaternion, scalar first; its sign means nothing.
    distribution : Bingham
        Of a single rotation that is no outlier.
    inlier_probability : (n,) ndarray
        Of each rotation; 1 throughout without ``robust``.
    outlier_share : float
        Estimated share of outliers.
    body_covariance : (3, 3) ndarray
        Of the mean, rad², of a small rotation in the body frame.
    """

    mean: FloatArray
    distribution: Bingham
    inlier_probability: FloatArray
    outlier_share: float
    body_covariance: FloatArray

    @frame_required
    def covariance(self, *, frame: Literal["body", "world"]) -> FloatArray:
        """Return the covariance (3, 3) of the mean, rad², of a small rotation in the named frame."""
        if frame == "body":
            return self.body_covariance
        if frame != "world":
            raise InvalidArgumentError("frame", "'body' or 'world'", repr(frame))
        from scipy.spatial.transform import Rotation

        r = Rotation.from_quat(self.mean, scalar_first=True).as_matrix()
        return r @ self.body_covariance @ r.T


def mean_rotation(
    x: ArrayLike | Rotation,
    weights: ArrayLike | None = None,
    *,
    robust: bool = True,
    group: Any = "1",
    position: ArrayLike | None = None,
    rng: Any = 0,
) -> MeanRotation:
    """Return the mean of rotations and its covariance, outliers told apart.

    The mean is the mode of a Bingham distribution beside a uniform background (`SymmetricMixture`); without ``robust``
    there is no background, and it is the leading eigenvector of Σ wₙ qₙqₙᵀ. With pₙ the probability that rotation n is
    no outlier, uₙ = wₙ pₙ, tₙ > 0 and eₙ the scalar and vector parts of mean* ⊗ qₙ, the mean solves Σ uₙ tₙ eₙ = 0.
    Its covariance is the sandwich H⁻¹ (Σ uₙ² tₙ² eₙeₙᵀ) H⁻¹ · 4, H = Σ uₙ (tₙ² I − eₙeₙᵀ), times n/(n − 3)
    with Kish's n: no distribution is assumed for it. That takes the rotations for independent; points of a map are not,
    their errors are alike where they are close. With ``position`` the map is cut into about ten cells, and the
    covariance is multiplied by how much more the sums Σ uₙ tₙ eₙ of the cells scatter than independent terms would.

    Parameters
    ----------
    x : (n, 4) array_like or Rotation
        Unit quaternions, scalar first, n ≥ 5.
    weights : (n,) array_like, optional
        Non-negative.
    robust : bool
        Whether to allow for outliers.
    group : str, Rotation or (G, 4) array_like
        Symmetry up to which the rotations are known.
    position : (n, 2) or (n, 3) array_like, optional
        Where on a map each was measured, in any unit.
    rng : None, int or numpy.random.Generator
        For the starts of the fit.

    Examples
    --------
    >>> p = Bingham([-900.0, -800.0, -700.0, 0.0], np.eye(4)[:, ::-1])
    >>> x = np.concatenate([p.rvs(40, rng=1), Bingham.uniform(4).rvs(10, rng=2)])
    >>> result = mean_rotation(x)
    >>> bool(np.degrees(2 * np.arccos(abs(result.mean[0]))) < 2.0), round(result.outlier_share, 1)
    (True, 0.2)
    """
    q = np.atleast_2d(as_quaternion(x, scalar_first=True))
    if len(q) < 5:
        raise InvalidArgumentError("x", "five rotations at least", len(q))
    w = np.ones(len(q)) if weights is None else as_numbers(weights, "weights")
    fitted = SymmetricMixture.fit(q, group, background=robust, weights=w, rng=rng)
    distribution = fitted.components[0]
    mean = np.array(distribution.mode)
    probability = fitted.predict_proba(q)[:, 0]
    e = compose(conjugate(mean), fitted.equivalent(q))
    t, v = e[:, 0], e[:, 1:]
    u = w * probability
    bread = np.linalg.inv(np.sum(u * t * t) * np.eye(3) - (v.T * u) @ v)
    meat = (v.T * (u * t) ** 2) @ v
    n = u.sum() ** 2 / np.sum(u**2)
    covariance = 4.0 * bread @ meat @ bread * (n / max(n - 3.0, 1.0))
    if position is not None:
        covariance = covariance * _linked(_positions(position, len(q)), (u * t)[:, None] * v)
    return MeanRotation(mean, distribution, probability, fitted.background, covariance)


def _positions(position: ArrayLike, n: int) -> FloatArray:
    p = as_numbers(position, "position")
    if p.ndim != 2 or len(p) != n or not np.all(np.isfinite(p)):
        raise InvalidArgumentError("position", f"finite coordinates, one row for each of {n} rotations", p.shape)
    return p


def _linked(position: FloatArray, terms: FloatArray) -> float:
    """Return by how much the variance of Σ terms (n, 3) exceeds that of independent ones, 1 at least.

    Sums over square cells of a map are as good as independent once the cells are wider than the reach of the
    correlation (batch means). The cells hold n/CELLS points at the spacing of the map.
    """
    from scipy.spatial import KDTree

    n = len(position)
    apart = KDTree(position).query(position, k=2)[0][:, 1]
    spacing = float(np.median(apart[apart > 0.0])) if np.any(apart > 0.0) else 1.0
    side = spacing * max(n / CELLS, 1.0) ** (1.0 / position.shape[1])
    cell = np.unique(np.floor((position - position.min(axis=0)) / side), axis=0, return_inverse=True)[1].ravel()
    count = int(cell.max()) + 1
    sums = np.stack([np.bincount(cell, terms[:, j], minlength=count) for j in range(3)])
    within = float(np.sum(terms**2))
    if count < 2 or within == 0.0:
        return 1.0
    return max(1.0, float(np.sum(sums**2)) * count / (count - 1) / within)
