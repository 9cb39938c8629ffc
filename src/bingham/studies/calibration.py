"""Whether the uncertainty that a study's filters state is right: coverage, calibration and normalised error."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from bingham.distributions.bingham import Bingham
from bingham.metrics import coverage, uniformity_statistic
from bingham.studies.study import Arrays, Row, joined, mean_row

__all__ = ["calibration_arrays", "calibration_rows", "moment_error"]

FloatArray = NDArray[np.float64]


def moment_error(distribution: Bingham, truth: FloatArray) -> FloatArray:
    """Return Σᵢ (mᵢᵀx)²/ωᵢ/(d − 1) (...), x the truth (..., d), over all principal axes but the mode.

    Its mean is 1 if x ~ distribution, as ωᵢ = E[(mᵢᵀx)²]: a Bingham distribution's normalised estimation error over
    its degrees of freedom, beside a Gaussian's eᵀC⁻¹e/(d − 1).
    """
    across = np.einsum("...ij,...i->...j", distribution.M, truth)[..., :-1]
    return np.mean(across**2 / distribution.axis_moments[..., :-1], axis=-1)


def calibration_arrays(name: str, probability: FloatArray, error: FloatArray, every: int = 1) -> Arrays:
    """Return what a chunk keeps of filter ``name``: coverage and mean normalised error (R,), probabilities (R, kept).

    Parameters
    ----------
    name : str
        The filter.
    probability, error : (R, T) ndarray
        Probability integral transform of the angle; normalised error over its degrees of freedom.
    every : int
        Steps between probabilities that are kept: neighbours say nearly the same.
    """
    return {
        f"coverage/{name}": coverage(probability, axis=-1),
        f"nees/{name}": np.mean(error, axis=-1),
        f"pit/{name}": probability[:, ::every].astype(np.float32),
    }


def calibration_rows(case: str, label: str, results: Mapping[str, Arrays], prefix: str, name: str) -> list[Row]:
    """Return the rows of all chunks whose key starts with ``prefix``, under the filter's label.

    ``coverage_95``, 0.95 if right; ``calibration_ks``, Kolmogorov's distance of the probabilities from uniform, 0 if
    right; ``nees``, 1 if right.
    """
    return [
        mean_row(case, label, "coverage_95", joined(results, prefix, f"coverage/{name}")),
        Row(case, label, "calibration_ks", uniformity_statistic(joined(results, prefix, f"pit/{name}"))),
        mean_row(case, label, "nees", joined(results, prefix, f"nees/{name}")),
    ]
