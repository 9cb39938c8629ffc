"""Tests and confidence regions for axes and rotations.

Every function takes unit vectors as rows (..., n, d), d ≥ 2, whose signs do not matter; leading axes are a batch.
Tests return a `TestResult` with ``statistic`` and ``pvalue``; randomness comes in through ``rng=``.
"""

from __future__ import annotations

from bingham.inference.common_axis import common_axis_test
from bingham.inference.ellipse import ConfidenceEllipse, confidence_ellipse
from bingham.inference.equality import equality_test
from bingham.inference.goodness import goodness_of_fit_test
from bingham.inference.intervals import ConcentrationIntervals, concentration_intervals
from bingham.inference.mean_axis import mean_axis_test
from bingham.inference.mean_rotation import MeanRotation, mean_rotation
from bingham.inference.result import TestResult
from bingham.inference.shape import ShapeTestResult, cluster_girdle_test
from bingham.inference.symmetry import symmetry_test
from bingham.inference.uniformity import uniformity_test

__all__ = [
    "ConcentrationIntervals",
    "ConfidenceEllipse",
    "MeanRotation",
    "ShapeTestResult",
    "TestResult",
    "cluster_girdle_test",
    "common_axis_test",
    "concentration_intervals",
    "confidence_ellipse",
    "equality_test",
    "goodness_of_fit_test",
    "mean_axis_test",
    "mean_rotation",
    "symmetry_test",
    "uniformity_test",
]
