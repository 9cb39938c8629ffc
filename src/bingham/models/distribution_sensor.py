"""A sensor whose every measurement comes with an uncertainty of its own."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bingham.distributions.bingham import Bingham
from bingham.distributions.checks import check_distribution
from bingham.errors import InvalidArgumentError
from bingham.models.sensors import Likelihood
from bingham.validation import described

__all__ = ["DistributionSensor"]

FloatArray = NDArray[np.float64]


@dataclass(frozen=True)
class DistributionSensor:
    """Measurements that are distributions of the orientation: f(z | x) = exp(xᵀ A x) / F, L = A.

    With ``z = x ⊕ v`` and noise v symmetric about the identity, f(z | x) as a function of x is the Bingham distribution
    about z with the covariance of v. A row is what `rows` makes of it: the upper triangle of A and log F.

    Parameters
    ----------
    dim : int
        d, 2 or 4.

    Examples
    --------
    >>> from bingham import BinghamFilter, Diffusion
    >>> z = np.tile([1.0, 0.0, 0.0, 0.0], (2, 1))
    >>> wide = Bingham.from_covariance(z, [0.01 * np.eye(3), 0.04 * np.eye(3)], frame="world")
    >>> f = BinghamFilter(Diffusion(1e-3), DistributionSensor(4))
    >>> track = f.run(Bingham.uniform(4), DistributionSensor.rows(wide), times=[0.0, 0.1])
    >>> track.final.covariance(frame="world")[0, 0].round(4)  # 1 / (1 / 0.01 + 1 / 0.04)
    np.float64(0.008)
    """

    dim: int

    def __post_init__(self) -> None:
        if self.dim not in (2, 4):
            raise InvalidArgumentError("dim", "2 or 4", described(self.dim))

    @property
    def size(self) -> int:
        """Numbers in a measurement: d(d + 1)/2 + 1."""
        return self.dim * (self.dim + 1) // 2 + 1

    @staticmethod
    def rows(distributions: Bingham) -> FloatArray:
        """Return the measurements (..., d(d + 1)/2 + 1) that distributions (...) are."""
        check_distribution(distributions, "distributions")
        upper = np.triu_indices(distributions.dim)
        log_f = np.asarray(distributions.log_normalizer)[..., None]
        return np.concatenate([distributions.matrix[..., upper[0], upper[1]], log_f], axis=-1)

    def likelihood(self, z: ArrayLike, predicted: Bingham) -> Likelihood:
        """Return the likelihood of a row; the prediction makes no difference."""
        row = np.asarray(z, dtype=np.float64)
        if row.shape != (self.size,) or not np.isfinite(row).all():
            raise InvalidArgumentError("z", f"a row ({self.size},) of DistributionSensor.rows", described(z))
        matrix = np.empty((self.dim, self.dim))
        matrix[self._upper] = row[:-1]
        matrix.T[self._upper] = row[:-1]
        return Likelihood(matrix, float(row[-1]), self.dim - 1)

    @cached_property
    def _upper(self) -> Any:
        return np.triu_indices(self.dim)
