"""Simulated flights of spinning balls, from the description of Glover & Kaelbling (2013, §6)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from bingham.distributions.bingham import Bingham
from bingham.rotations import compose, from_rotation_vector, rotate
from bingham.studies.ball_scores import HALF_TURN
from bingham.studies.study import Arrays

__all__ = ["BOUNCE", "DIRECTIONS", "FRAMES", "SPIN_TYPES", "simulate_flight"]

FloatArray = NDArray[np.float64]
FRAMES = 40
FRAME_RATE = 200.0
# World: z up, towards the cameras; the ball flies along x. Axes of topspin, underspin, left and right sidespin.
AXES = np.array([[0.0, 1.0, 0.0], [0.0, -1.0, 0.0], [0.0, 0.0, 1.0], [0.0, 0.0, -1.0]])
DIRECTIONS = ("topspin", "underspin", "left sidespin", "right sidespin")
REVOLUTIONS = (25.0, 37.5, 50.0)
SPIN_TYPES = from_rotation_vector(
    np.repeat(AXES, 3, axis=0) * np.tile(REVOLUTIONS, 4)[:, None] * 2.0 * np.pi / FRAME_RATE
)
# The gun's repeatability: relative spread of the speed and spread of the axis, rad; perturbation in each frame, rad.
SPEED_SPREAD, AXIS_SPREAD, WOBBLE = 0.03, 0.03, 0.01
# The logo is on the body's z axis and is found on the upper half of the ball: the published distribution of the
# orientation out of sight is the fit to exactly half of the sphere.
VISIBLE = 0.0
LEAST_VISIBLE = 12
# Frame in which the ball bounces, where it does.
BOUNCE = 20


def simulate_flight(
    kind: int, noise: tuple[float, ...], rng: np.random.Generator, push: FloatArray | None = None
) -> tuple[Arrays, int]:
    """Return one flight of spin type ``kind`` with the logo in at least 12 frames, and how many were discarded for it.

    Arrays: orientation (40, 4), spin (4,) at the end, and the two interpretations of each detected logo (40, 2, 4), NaN
    where the logo is out of sight. A ``push`` (4,) changes the spin in frame `BOUNCE`, where the ball bounces.
    """
    distribution = Bingham([*noise, 0.0], np.eye(4)[:, [1, 2, 3, 0]])
    discarded = 0
    while True:
        speed = 1.0 + SPEED_SPREAD * rng.standard_normal()
        tilt = from_rotation_vector(AXIS_SPREAD * rng.standard_normal(3))
        turn = 2.0 * np.arctan2(np.linalg.norm(SPIN_TYPES[kind, 1:]), SPIN_TYPES[kind, 0])
        axis = rotate(tilt, SPIN_TYPES[kind, 1:] / np.linalg.norm(SPIN_TYPES[kind, 1:]))
        spin = from_rotation_vector(speed * turn * axis)
        x = rng.standard_normal(4)
        x /= np.linalg.norm(x)
        orientation = np.empty((FRAMES, 4))
        for n in range(FRAMES):
            if push is not None and n == BOUNCE:
                spin = compose(push, spin)
            x = compose(from_rotation_vector(WOBBLE * rng.standard_normal(3)), compose(spin, x))
            orientation[n] = x
        visible = rotate(orientation, [0.0, 0.0, 1.0])[:, 2] > VISIBLE
        seen = compose(orientation, distribution.rvs(FRAMES, rng=rng))
        if visible.sum() >= LEAST_VISIBLE:
            both = np.stack([seen, compose(seen, HALF_TURN)], axis=1)
            both[~visible] = np.nan
            return {"orientation": orientation, "spin": spin, "seen": both}, discarded
        discarded += 1
