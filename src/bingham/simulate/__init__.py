"""Recordings from equations, with known truth: motions of rigid bodies and the sensors that watch them."""

from bingham.simulate.bodies import simulate_precession, simulate_tumbling
from bingham.simulate.motion import Motion
from bingham.simulate.sensors import simulate_imu, simulate_orientations

__all__ = ["Motion", "simulate_imu", "simulate_orientations", "simulate_precession", "simulate_tumbling"]
