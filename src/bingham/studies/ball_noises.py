"""Published noises and priors of the spinning-ball study (Glover & Kaelbling 2013, §6), and what follows from them."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from bingham.distributions.bingham import Bingham
from bingham.rotations import compose, conjugate

__all__ = [
    "BACK",
    "DARK",
    "IDENTITY",
    "INFORMED",
    "LOGO",
    "PROCESS",
    "PUBLISHED_LOGO",
    "SPIN_PRIOR",
    "about_identity",
    "turns",
]

FloatArray = NDArray[np.float64]
IDENTITY = np.array([1.0, 0.0, 0.0, 0.0])
FRAME = np.eye(4)[:, [1, 2, 3, 0]]


def about_identity(*z: float) -> Bingham:
    """Return the distribution about the identity with concentrations z (3,) along x, y and z."""
    return Bingham([*z, 0.0], FRAME)


# The published parameters.
PROCESS = about_identity(-400.0, -400.0, -400.0)
PUBLISHED_LOGO = (-40.0, -40.0, -10.0)
LOGO = about_identity(*PUBLISHED_LOGO)
# Logo out of sight: as if seen at the centre of the back, at any angle about its own axis. It is the distribution
# fitted to all orientations with the logo on the far half, whose second moment about that centre is diag(1, 1, 3, 3)/8.
DARK = about_identity(-3.6, -3.6, 0.0)
BACK = np.array([0.0, 1.0, 0.0, 0.0])
SPIN_PRIOR = about_identity(-3.0, -3.0, -3.0)
INFORMED = about_identity(-10.0, -10.0, -10.0)


def _turn_noise(one: Bingham, other: Bingham) -> Bingham:
    """Return the distribution of e* ⊗ e' on the axes both have, the identity last: a mode of a girdle."""
    z = np.einsum("ij,ij->j", FRAME, one.inverse().compose(other).matrix @ FRAME)
    return about_identity(*np.minimum(z[:3] - z[3], 0.0))


# Noise of the rotation between two observations, by how many of them are out of sight.
TURN_NOISE = (_turn_noise(LOGO, LOGO), _turn_noise(LOGO, DARK), _turn_noise(DARK, DARK))


def turns(seen: FloatArray) -> Iterator[tuple[FloatArray, Bingham, FloatArray] | None]:
    """Yield, frame by frame, rotations v (k, 4) between neighbouring observations, noise n, and y; None first.

    Every frame is an observation, out of sight that of the back. With y = x ⊗ e and y' = v ⊗ x ⊗ e', y' ⊗ y* = v ⊗ n',
    n' = y ⊗ n ⊗ y*, n = e* ⊗ e'. The published filters take n for n'.
    """
    yield None
    for before, now in pairwise(seen):
        dark, dark_now = (bool(np.isnan(z).any()) for z in (before, now))
        y = BACK if dark else before[0]
        noise = TURN_NOISE[dark + dark_now]
        between = compose(np.atleast_2d(BACK) if dark_now else now, conjugate(y))
        yield between, noise, y
