"""Noise over a time that is no integer number of steps: fractional powers of composition."""

from __future__ import annotations

import numpy as np

from bingham.distributions.bingham import Bingham
from bingham.distributions.normalizer import solve_moments
from bingham.errors import InvalidArgumentError
from bingham.validation import check_number

__all__ = ["repeated"]

# A noise's mode is the identity to this accuracy.
CENTRED = 1e-9


def repeated(noise: Bingham, times: float) -> Bingham:
    """Return the distribution of `times` independent noises composed, any real number ≥ 0 of them (d = 4).

    Composition multiplies mean rotation matrices: E[R(w ⊗ w')] = E[R(w)] E[R(w')]. About the noise's own axes
    E[R(w)] = diag(1 − 2(ωⱼ + ω_k)), and its power t is the mean rotation of anisotropic Brownian motion over t steps.
    An integer t gives what composing t times gives, t = 1 the noise itself; t = 0 would be narrower than any Bingham.

    Parameters
    ----------
    noise : Bingham
        A single distribution of quaternions with its mode at the identity.
    times : float
        t > 0.

    Raises
    ------
    InvalidArgumentError
        If the mode is elsewhere, or the noise so wide that a mean rotation has an eigenvalue ≤ 0.

    Examples
    --------
    >>> w = Bingham([-300.0, -90.0, -40.0, 0.0], np.eye(4)[:, [1, 2, 3, 0]])
    >>> np.allclose(repeated(w, 2.0).moment(), w.compose(w).moment())
    True
    """
    check_number(times, "times", "a finite number > 0", minimum=0.0)
    if noise.dim != 4 or noise.shape:
        raise InvalidArgumentError("noise", "a single distribution of quaternions, d = 4", repr(noise))
    if times == 1.0:
        return noise
    if not times > 0.0:
        raise InvalidArgumentError("times", "a finite number > 0", times)
    if abs(abs(noise.mode[0]) - 1.0) > CENTRED:
        raise InvalidArgumentError("noise", "mode at the identity, to last other than one step", noise.mode,
                                   "give a constant motion as control")  # fmt: skip
    w = noise.axis_moments[:3]
    decay = 2.0 * (w.sum() - w)
    if not np.all(decay < 1.0):
        raise InvalidArgumentError("noise", "narrow enough to last a fraction of a step", noise.z,
                                   "raise its concentrations")  # fmt: skip
    grown = -np.expm1(times * np.log1p(-decay))
    # Noise about two axes only has no exact root; what it lacks about the third is of second order.
    spread = np.maximum(0.25 * (grown.sum() - 2.0 * grown), 1e-3 * times * w)
    z, log_f, _ = solve_moments(np.append(spread, 1.0 - spread.sum()))
    order = np.argsort(z, kind="stable")
    return Bingham.from_spectrum(np.ascontiguousarray(z[order]), np.ascontiguousarray(noise.M[:, order]), log_f)
