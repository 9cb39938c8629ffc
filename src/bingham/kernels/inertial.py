"""The plain inertial filter: gyroscope rotates and diffuses, gravity and the field's heading add to it."""

from __future__ import annotations

import math

import numpy as np

from bingham.kernels.compile import compiled
from bingham.kernels.normalizer import derivatives_2, gradient_4
from bingham.kernels.quaternion import from_rotation_vector, rotate_rows_right
from bingham.kernels.step import ACCEPTED, MISSING, REJECTED, add_matrix_4, diffuse_4, work_space_4

__all__ = ["run_inertial"]

# Seconds of white noise that one sample averages at most (below 20 Hz it counts as one sample), and the first one.
LONGEST_SHARE = 0.05
FIRST_SHARE = 0.01


@compiled()
def gravity_likelihood(b0, b1, b2, concentration, matrix):
    """Write κ (K(r, b) − I) for r = up and the body vector b, scaled to unit length, to matrix (4, 4).

    K is Davenport's matrix (see `models.sensors.davenport_matrix`) with r = (0, 0, 1). Returns False for a zero vector.
    """
    n = math.sqrt(b0 * b0 + b1 * b1 + b2 * b2)
    if not n > 0.0:
        return False
    k = concentration / n
    x, y, z = k * b0, k * b1, k * b2
    matrix[0, 0] = z - concentration
    matrix[0, 1] = matrix[1, 0] = y
    matrix[0, 2] = matrix[2, 0] = -x
    matrix[0, 3] = matrix[3, 0] = 0.0
    matrix[1, 1] = -z - concentration
    matrix[1, 2] = matrix[2, 1] = 0.0
    matrix[1, 3] = matrix[3, 1] = x
    matrix[2, 2] = -z - concentration
    matrix[2, 3] = matrix[3, 2] = y
    matrix[3, 3] = z - concentration
    return True


@compiled()
def heading_likelihood(q, m, east, north, concentration, matrix):
    """Write −2κ v vᵀ, v = k ⊗ q_h, to matrix (4, 4): q rotated about the vertical until m points to (east, north).

    q (4,) predicted mode, m (3,) body vector. Returns False where m is vertical and has no heading.
    """
    w, x, y, z = q[0], q[1], q[2], q[3]
    e = (1.0 - 2.0 * (y * y + z * z)) * m[0] + 2.0 * (x * y - w * z) * m[1] + 2.0 * (x * z + w * y) * m[2]
    n = 2.0 * (x * y + w * z) * m[0] + (1.0 - 2.0 * (x * x + z * z)) * m[1] + 2.0 * (y * z - w * x) * m[2]
    # The turn that takes (e, n) to (east, north).
    c, s = e * east + n * north, e * north - n * east
    r = math.hypot(c, s)
    if not r > 0.0:
        return False
    half = 0.5 * math.atan2(s, c)
    c, s = math.cos(half), math.sin(half)
    # v = k ⊗ (c + k s) ⊗ q = (−s + k c) ⊗ q.
    v0, v1, v2, v3 = -s * w - c * z, -s * x - c * y, -s * y + c * x, -s * z + c * w
    k = -2.0 * concentration
    matrix[0, 0], matrix[0, 1], matrix[0, 2], matrix[0, 3] = k * v0 * v0, k * v0 * v1, k * v0 * v2, k * v0 * v3
    matrix[1, 0], matrix[1, 1], matrix[1, 2], matrix[1, 3] = k * v1 * v0, k * v1 * v1, k * v1 * v2, k * v1 * v3
    matrix[2, 0], matrix[2, 1], matrix[2, 2], matrix[2, 3] = k * v2 * v0, k * v2 * v1, k * v2 * v2, k * v2 * v3
    matrix[3, 0], matrix[3, 1], matrix[3, 2], matrix[3, 3] = k * v3 * v0, k * v3 * v1, k * v3 * v2, k * v3 * v3
    return True


@compiled()
def run_inertial(z, frame, steps, gyroscope, gaps, accelerometer, magnetometer, gyroscope_variance, gravity_information,
                 heading_information, east, north, gravity_threshold, heading_threshold,
                 keep_z, keep_frame, keep_evidence, keep_statistic, keep_decision):  # fmt: skip
    """Filter T inertial samples; z (4,), frame (4, 4; by rows) hold the end state.

    steps (T,): seconds since the sample before, 0 for none. gyroscope (T, 3) rad/s; gaps (T,): variance, rad² per axis,
    of the rotation in a gap before the sample, else 0; accelerometer, magnetometer (T, 3)
    or (0, 3); NaN rows are skipped. Rates per second: gyroscope_variance (rad²/s), gravity_information,
    heading_information (1/rad²/s); the last two times the share of a sample give its κ. keep_statistic and
    keep_decision are (T, 2): gravity, heading.
    """
    work = work_space_4()
    matrix = np.empty((4, 4))
    turn = np.empty(4)
    old_z, old_frame = np.empty(4), np.empty((4, 4))
    for t in range(steps.size):
        dt = steps[t]
        if dt > 0.0:
            g = gyroscope[t]
            turn[0], turn[1], turn[2], turn[3] = from_rotation_vector(g[0] * dt, g[1] * dt, g[2] * dt)
            rotate_rows_right(frame, turn)
            log_f = diffuse_4(z, -math.expm1(-(gyroscope_variance * dt + gaps[t])), work)
        else:
            log_f = math.log(gradient_4(z, work[0]))
        # A sample speaks for the time since the last one, but not for a gap.
        share = min(dt, LONGEST_SHARE) if dt > 0.0 else FIRST_SHARE
        keep_evidence[t] = 0.0
        for sensor in range(2):
            keep_statistic[t, sensor] = math.nan
            keep_decision[t, sensor] = MISSING
            vectors = accelerometer if sensor == 0 else magnetometer
            if vectors.shape[0] == 0:
                continue
            b = vectors[t]
            if math.isnan(b[0] + b[1] + b[2]):
                continue
            if sensor == 0:
                k = gravity_information * share
                usable = gravity_likelihood(b[0], b[1], b[2], k, matrix)
                # ∫ exp(κ (u·b − 1)) du over the sphere.
                log_noise = math.log(-2.0 * math.pi * math.expm1(-2.0 * k) / k)
                threshold = gravity_threshold
            else:
                k = heading_information * share
                usable = heading_likelihood(frame[3], b, east, north, k, matrix)
                # ∫ exp(κ (cos ψ − 1)) dψ = 2π e^{−κ} I₀(κ) is the normaliser of d = 2 at z = (−2κ, 0).
                log_noise = derivatives_2(-2.0 * k)[0]
                threshold = heading_threshold
            if not usable:
                continue
            old_z[:] = z
            old_frame[:] = frame
            top = add_matrix_4(z, frame, matrix, work)
            log_posterior = math.log(gradient_4(z, work[0]))
            keep_evidence[t] += log_posterior + top - log_f - log_noise
            keep_statistic[t, sensor] = -2.0 * top
            if -2.0 * top > threshold:
                keep_decision[t, sensor] = REJECTED
                z[:] = old_z
                frame[:] = old_frame
            else:
                keep_decision[t, sensor] = ACCEPTED
                log_f = log_posterior
        keep_z[t] = z
        for i in range(4):
            for j in range(4):
                keep_frame[t, j, i] = frame[i, j]
