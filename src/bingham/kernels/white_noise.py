"""Log-evidence of an inertial recording under plain white noise, as a function of its three densities."""

from __future__ import annotations

import math

import numpy as np

from bingham.kernels.compile import compiled
from bingham.kernels.imu_model import LOG_2PI, rotation_matrix
from bingham.kernels.quaternion import from_rotation_vector, product

__all__ = ["white_noise_evidence"]


@compiled()
def _condition(p, x, h, residual, variance, column):
    """Kalman update of (x, p) by one number, residual = h·(e − x) + noise; return its log-density."""
    n = p.shape[0]
    s = variance
    for i in range(n):
        total = 0.0
        for j in range(n):
            total += p[i, j] * h[j]
        column[i] = total
    for i in range(n):
        s += h[i] * column[i]
        residual -= h[i] * x[i]
    for i in range(n):
        x[i] += column[i] * residual / s
        for j in range(n):
            p[i, j] -= column[i] * column[j] / s
    return -0.5 * (residual * residual / s + math.log(s) + LOG_2PI)


@compiled()
def white_noise_evidence(steps, gyroscope, accelerometer, magnetometer, q, field, gravity, noise, walk, bias_std):
    """Return the log-density of all samples of accelerometer and magnetometer given the gyroscope's.

    steps (N,): seconds before each sample, the first 0; magnetometer (N, 3) or (0, 3); rows of NaN are missing. q (4,):
    orientation at the start within 0.1 rad; field (2,): horizontal and upward part of the field within a fifth of it.
    noise (3,): gyroscope rad/s/√Hz, accelerometer m/s²/√Hz, magnetometer per sample; walk: rad/s/√s; bias_std: rad/s.

    Extended Kalman filter with errors θ (world), gyroscope bias (body), field: R a = g (e − θ × e) + n and
    R m = F − θ × F + n, whose isotropic noise stays white in world axes.
    """
    rotation = np.empty((3, 3))
    orientation = q.copy()
    bias = np.zeros(3)
    north, up = field[0], field[1]
    p = np.zeros((8, 8))
    for i in range(3):
        p[i, i] = 0.01
        p[3 + i, 3 + i] = bias_std * bias_std
    p[6, 6] = p[7, 7] = 0.04 * (north * north + up * up)
    x, h, column, block = np.zeros(8), np.zeros(8), np.zeros(8), np.zeros((3, 8))
    evidence = 0.0
    mean_step = steps.sum() / max(steps.size - 1, 1)
    for t in range(steps.size):
        dt = steps[t]
        if dt > 0.0:
            a, b, c, d = from_rotation_vector(
                (gyroscope[t, 0] - bias[0]) * dt, (gyroscope[t, 1] - bias[1]) * dt, (gyroscope[t, 2] - bias[2]) * dt
            )
            a, b, c, d = product(orientation[0], orientation[1], orientation[2], orientation[3], a, b, c, d)
            n = 1.0 / math.sqrt(a * a + b * b + c * c + d * d)
            orientation[0], orientation[1], orientation[2], orientation[3] = a * n, b * n, c * n, d * n
            rotation_matrix(rotation, orientation)
            # θ ← θ − R dt b.
            for i in range(3):
                for j in range(8):
                    total = 0.0
                    for k in range(3):
                        total += rotation[i, k] * p[3 + k, j]
                    block[i, j] = total * dt
            for i in range(3):
                for j in range(8):
                    p[i, j] -= block[i, j]
            for j in range(8):
                for i in range(3):
                    total = 0.0
                    for k in range(3):
                        total += rotation[i, k] * p[j, 3 + k]
                    column[i] = total * dt
                for i in range(3):
                    p[j, i] -= column[i]
            for i in range(3):
                p[i, i] += noise[0] ** 2 * dt
                p[3 + i, 3 + i] += walk**2 * dt
        else:
            rotation_matrix(rotation, orientation)
        x[:] = 0.0
        if not np.isnan(accelerometer[t, 0]):
            variance = noise[1] ** 2 / (dt if dt > 0.0 else mean_step)
            for i in range(3):
                value = 0.0
                for k in range(3):
                    value += rotation[i, k] * accelerometer[t, k]
                h[:] = 0.0
                if i == 0:
                    h[1] = -gravity
                elif i == 1:
                    h[0] = gravity
                else:
                    value -= gravity
                evidence += _condition(p, x, h, value, variance, column)
        if magnetometer.shape[0] > 0 and not np.isnan(magnetometer[t, 0]):
            variance = noise[2] ** 2
            for i in range(3):
                value = 0.0
                for k in range(3):
                    value += rotation[i, k] * magnetometer[t, k]
                h[:] = 0.0
                if i == 0:
                    h[1], h[2] = -up, north
                elif i == 1:
                    value -= north
                    h[0], h[6] = up, 1.0
                else:
                    value -= up
                    h[0], h[7] = -north, 1.0
                evidence += _condition(p, x, h, value, variance, column)
        a, b, c, d = from_rotation_vector(x[0], x[1], x[2])
        a, b, c, d = product(a, b, c, d, orientation[0], orientation[1], orientation[2], orientation[3])
        n = 1.0 / math.sqrt(a * a + b * b + c * c + d * d)
        orientation[0], orientation[1], orientation[2], orientation[3] = a * n, b * n, c * n, d * n
        for i in range(3):
            bias[i] += x[3 + i]
        north += x[6]
        up += x[7]
    return evidence
