"""Signals of Glover & Kaelbling 2013, §6: nominal motion, noises, and the Gaussians that stand for them."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from bingham.distributions.bingham import Bingham
from bingham.distributions.matching import matching_covariance
from bingham.rotations import compose, conjugate
from bingham.studies.study import Arrays

__all__ = ["isotropic_distribution", "noise_covariance", "nominal_motion", "projected_draws", "simulate"]

FloatArray = NDArray[np.float64]
IDENTITY = np.array([1.0, 0.0, 0.0, 0.0])
# Euler angles of the nominal motion: amplitude, rad, and periods, steps.
AMPLITUDE = 0.5 * np.pi
PERIODS = np.array([200.0, 250.0, 300.0])


def isotropic_distribution(z: tuple[float, ...]) -> Bingham:
    """Return the distribution with its mode at the identity and concentrations (3,) along x, y and z."""
    return Bingham([*z, 0.0], np.eye(4)[:, [1, 2, 3, 0]])


@cache
def noise_covariance(z: tuple[float, ...], padded: bool = False) -> FloatArray:
    """Return the `matching_covariance` (4, 4) of the noise `isotropic_distribution` (z)."""
    return matching_covariance(isotropic_distribution(z), padded=padded)


def nominal_motion(rng: np.random.Generator, steps: int) -> tuple[FloatArray, FloatArray]:
    """Return the start (4,) and the controls (steps, 4) of a sine wave on each Euler angle, with random phases."""
    time = np.arange(steps + 1)[:, None]
    angles = AMPLITUDE * np.sin(2.0 * np.pi * (time / PERIODS + rng.random(3)))
    q: Any = Rotation.from_euler("xyz", angles).as_quat(scalar_first=True)
    return q[0], compose(q[1:], conjugate(q[:-1]))


def projected_draws(covariance: FloatArray, count: int, rng: np.random.Generator) -> FloatArray:
    """Return unit quaternions (count, 4) near the identity: projected draws from N(identity, covariance)."""
    values, axes = np.linalg.eigh(covariance)
    x = IDENTITY + (rng.standard_normal((count, 4)) * np.sqrt(np.maximum(values, 0.0))) @ axes.T
    return x / np.linalg.norm(x, axis=1, keepdims=True)


def simulate(start: FloatArray, controls: FloatArray, process: FloatArray, observation: FloatArray) -> Arrays:
    """Return truth and measurements (T, 4): x' = w ⊗ u ⊗ x, y = v ⊗ x, from noises w and v (T, 4)."""
    truth = np.empty_like(controls)
    x = start
    for t, (w, u) in enumerate(zip(process, controls, strict=True)):
        x = compose(w, compose(u, x))
        x /= np.linalg.norm(x)
        truth[t] = x
    return {"truth": truth, "measured": compose(observation, truth)}
