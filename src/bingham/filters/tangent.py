"""Between a covariance of the rotation error and the Bingham distribution of the rotation, at any spread.

Rotating at random about three fixed orthogonal axes with variances λ₁, λ₂, λ₃ (Brownian motion of covariance P =
Σ λᵢ uᵢuᵢᵀ) leaves the second moment of the quaternion diagonal in the axes 1, u₁, u₂, u₃ and mixes it by characters of
the Klein four-group: with χ₁ = e^{−(λ₂+λ₃)/2} and so on, ω₀ = (1 + χ₁ + χ₂ + χ₃)/4, ω₁ = (1 + χ₁ − χ₂ − χ₃)/4, ….
A narrow P gives ω = λ/4; one infinite λ gives the girdle, three the uniform distribution.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from bingham.distributions.bingham import Bingham
from bingham.rotations import compose, conjugate

__all__ = ["covariance_of_distribution", "distribution_of_covariance"]

FloatArray = NDArray[np.float64]

# Characters below this are an unknown angle; e^{-5} is a heading with 160° standard deviation.
UNKNOWN = np.exp(-10.0)


def distribution_of_covariance(mode: FloatArray, p: FloatArray) -> Bingham:
    """Return the Bingham with the second moment of Exp(θ) ⊗ mode, θ Brownian with covariance p, world axes.

    Parameters
    ----------
    mode : (..., 4) ndarray
        Unit quaternions, body to world.
    p : (..., 3, 3) ndarray
        Covariances, rad².
    """
    values, vectors = np.linalg.eigh(p)
    values = np.maximum(values, 1e-14)
    x, y, z = np.moveaxis(values, -1, 0)
    # ω₁ = (e^{−(y+z)/2} − e^{−(x+z)/2} + 1 − e^{−(x+y)/2})/4, each pair without cancellation.
    w = np.stack(
        [
            _axis_moment(x, y, z),
            _axis_moment(y, x, z),
            _axis_moment(z, x, y),
        ],
        axis=-1,
    )
    frame = np.concatenate([np.zeros((*values.shape, 1)), np.swapaxes(vectors, -1, -2)], axis=-1)
    axes = compose(frame, mode[..., None, :])
    rest = mode[..., :, None] * mode[..., None, :] * (1.0 - w.sum(axis=-1))[..., None, None]
    return Bingham.from_moment(np.einsum("...ki,...k,...kj->...ij", axes, w, axes) + rest)


def _axis_moment(a: FloatArray, b: FloatArray, c: FloatArray) -> FloatArray:
    return 0.25 * (-np.exp(-0.5 * (b + c)) * np.expm1(0.5 * (b - a)) - np.expm1(-0.5 * (a + b)))


def covariance_of_distribution(distribution: Bingham) -> FloatArray:
    """Return p (3, 3), world axes, with `distribution_of_covariance(mode, p)` giving it; unknown angles: 20 rad²."""
    w = distribution.axis_moments
    chi = np.array([w[3] + w[i] - w[j] - w[k] for i, j, k in ((0, 1, 2), (1, 0, 2), (2, 0, 1))])
    pair = -2.0 * np.log(np.clip(chi, UNKNOWN, 1.0 - 1e-15))
    values = np.maximum(0.5 * pair.sum() - pair, 1e-14)
    axes = compose(np.swapaxes(distribution.M, -1, -2)[:3], conjugate(distribution.mode))[:, 1:]
    return np.einsum("ki,k,kj->ij", axes, values, axes)
