"""Planar directions of a scene: a Bingham mixture on the axes of its normals, then the signs put back.

A Bingham distribution gives n and −n one density, so opposite walls share a component. Restricted to the hemisphere
around a signed direction m it becomes 2 f(n) for mᵀn > 0: two such half distributions of one component never overlap,
so that splitting a component by the sign of mᵀn is their exact maximum-likelihood fit, with no more parameters than
one share.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bingham.distributions.mixture import BinghamMixture
from bingham.errors import InvalidArgumentError
from bingham.validation import as_generator, unit_rows

__all__ = ["PlaneDirections", "fit_directions", "lift"]

FloatArray = NDArray[np.float64]

# The number of components is chosen on so many normals at most.
SELECTION_ROWS = 8_000
# Directions need no more: 1e-6 nats a normal and step.
TOLERANCE = 1e-6


@dataclass(frozen=True, slots=True, eq=False)
class PlaneDirections:
    """Directions of a scene's planes and the mixture behind them.

    Parameters
    ----------
    directions : ndarray, shape (P, 3)
        Unit normals, heaviest first; with a sign unless fitted to axes.
    weights : ndarray, shape (P,)
        Share of the normals of each.
    mixture : BinghamMixture
        Of the axes.
    owner : ndarray, shape (K, 2)
        Direction to which a component's normals on the positive and on the negative side of its mode belong.
    """

    directions: FloatArray
    weights: FloatArray
    mixture: BinghamMixture
    owner: NDArray[np.int64]

    def predict(self, normals: ArrayLike) -> NDArray[np.int64]:
        """Return the index (...) of the direction of each normal (..., 3), −1 for outliers and rows of NaN."""
        a = np.asarray(normals, dtype=np.float64)
        label = np.full(a.shape[:-1], -1, dtype=np.int64)
        seen = np.isfinite(a).all(axis=-1)
        rows = unit_rows(a[seen], 3, "normals")
        component = self.mixture.predict(rows)
        behind = np.sum(rows * self.mixture.components.mode[component], axis=-1) < 0.0
        label[seen] = np.where(component < 0, -1, self.owner[component, behind.astype(np.int64)])
        return label


def fit_directions(
    normals: ArrayLike,
    components: int | Sequence[int] = range(1, 9),
    *,
    signed: bool = True,
    min_angle: float = np.deg2rad(12.0),
    min_share: float = 0.005,
    restarts: int = 4,
    rng: Any = None,
) -> PlaneDirections:
    """Find the planar directions of unit normals.

    Parameters
    ----------
    normals : (..., 3) array_like
        Unit normals; rows of NaN are left out.
    components : int or sequence of int
        Number of axes, or numbers to choose from by BIC.
    signed : bool
        Keep opposite directions apart.
    min_angle : float
        Components closer than this, in rad, are one direction: where the noise varies over the scene a direction needs
        a sharp and a wide component.
    min_share : float
        Directions with less of the normals are outliers.
    restarts : int
        Random starts of each mixture.
    rng : None, int or numpy.random.Generator
        Passed to ``numpy.random.default_rng``.
    """
    a = np.asarray(normals, dtype=np.float64)
    if a.ndim < 1 or a.shape[-1] != 3:
        raise InvalidArgumentError("normals", "shape (..., 3)", a.shape)
    a = a.reshape(-1, 3)
    a = unit_rows(a[np.isfinite(a).all(axis=-1)], 3, "normals")
    generator = as_generator(rng)
    some = a if len(a) <= SELECTION_ROWS else a[generator.choice(len(a), SELECTION_ROWS, replace=False)]
    mixture = BinghamMixture.fit(some, components, restarts=restarts, tolerance=TOLERANCE, rng=generator)
    label = mixture.predict(a)
    modes = mixture.components.mode
    behind = np.sum(a * modes[label], axis=-1) < 0.0
    counts = np.zeros((mixture.size, 2))
    np.add.at(counts, (label[label >= 0], behind[label >= 0].astype(np.int64)), 1.0)
    sides = np.stack([modes, -modes], axis=1)
    if not signed:
        counts = np.stack([counts.sum(axis=1), np.zeros(mixture.size)], axis=1)
    owner = np.full((mixture.size, 2), -1, dtype=np.int64)
    directions: list[FloatArray] = []
    shares: list[float] = []
    for flat in np.argsort(-counts, axis=None, kind="stable"):
        k, side = divmod(int(flat), 2)
        if counts[k, side] == 0.0:
            continue
        cosine = np.array([direction @ sides[k, side] for direction in directions])
        cosine = cosine if signed else np.abs(cosine)
        near = int(np.argmax(cosine)) if len(directions) else -1
        if near >= 0 and cosine[near] > np.cos(min_angle):
            owner[k, side] = near
            shares[near] += counts[k, side]
        elif counts[k, side] >= min_share * len(a):
            owner[k, side] = len(directions)
            directions.append(sides[k, side])
            shares.append(counts[k, side])
    if not signed:
        owner[:, 1] = owner[:, 0]
    return PlaneDirections(np.array(directions).reshape(-1, 3), np.array(shares) / len(a), mixture, owner)


def lift(normals: ArrayLike) -> FloatArray:
    """Return the pure quaternions (0, n) (..., 4) of normals (..., 3).

    ±n become ±(0, n): still one axis for every antipodal distribution, on a great sphere where the second moment is
    singular. Lifting separates no opposite walls; it is here to show that.
    """
    a = np.asarray(normals, dtype=np.float64)
    return np.concatenate([np.zeros((*a.shape[:-1], 1)), a], axis=-1)
