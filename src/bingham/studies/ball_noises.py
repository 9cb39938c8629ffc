"""Published noises and priors of the spinning-ball study (Glover & Kaelbling 2013, §6), and what follows from them."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from bingham.distributions.bingham import Bingham
from bingham.rotations import compose, conjugate

__all__ = ["BACK", "DARK", "DARK_RUN", "IDENTITY", "INFORMED", "LOGO", "PROCESS", "SPIN_PRIOR", "STEADY", "turns"]

FloatArray = NDArray[np.float64]
IDENTITY = np.array([1.0, 0.0, 0.0, 0.0])
FRAME = np.eye(4)[:, [1, 2, 3, 0]]


def _distribution(*z: float) -> Bingham:
    return Bingham([*z, 0.0], FRAME)


# The published parameters.
PROCESS = _distribution(-400.0, -400.0, -400.0)
LOGO = _distribution(-40.0, -40.0, -10.0)
# Logo out of sight: as if seen at the centre of the back, at any angle about its own axis. It is the distribution
# fitted to all orientations with the logo on the far half, whose second moment about that centre is diag(1, 1, 3, 3)/8.
DARK = _distribution(-3.6, -3.6, 0.0)
BACK = np.array([0.0, 1.0, 0.0, 0.0])
SPIN_PRIOR = _distribution(-3.0, -3.0, -3.0)
INFORMED = _distribution(-10.0, -10.0, -10.0)
# The adapted mixture's own, chosen on 60 flights of another seed: noise by evidence, weight by spin error. Spins
# as steady as the gun's; and dark frames, which come in runs of three or so that all say the same, at a third each.
STEADY = _distribution(-6400.0, -6400.0, -6400.0)
DARK_RUN = _distribution(-1.2, -1.2, 0.0)


def _turn_noise(one: Bingham, other: Bingham) -> Bingham:
    """Return the distribution of e* ⊗ e' on the axes both have, the identity last: a mode of a girdle."""
    z = np.einsum("ij,ij->j", FRAME, one.inverse().compose(other).matrix @ FRAME)
    return _distribution(*np.minimum(z[:3] - z[3], 0.0))


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
