"""A turning body: orientation and angular rate with their joint covariance, over a whole sequence.

Errors are rotation vectors in the world frame, x = exp(e) ⊗ x̂, and rates ω = ω̂ + a; P (6, 6) is the covariance of
(e, a). Over a time t, φ = ω̂ t: e' = R(φ) e + J(φ) t a with the left Jacobian J, and white angular acceleration of
density q² adds q² (t³/3, t²/2; t²/2, t) to P.
"""

from __future__ import annotations

import math

import numpy as np

from bingham.kernels.compile import compiled

__all__ = ["run_spin"]


@compiled()
def _product(p, q, out):
    w = p[0] * q[0] - p[1] * q[1] - p[2] * q[2] - p[3] * q[3]
    x = p[0] * q[1] + p[1] * q[0] + p[2] * q[3] - p[3] * q[2]
    y = p[0] * q[2] - p[1] * q[3] + p[2] * q[0] + p[3] * q[1]
    z = p[0] * q[3] + p[1] * q[2] - p[2] * q[1] + p[3] * q[0]
    n = 1.0 / math.sqrt(w * w + x * x + y * y + z * z)
    out[0], out[1], out[2], out[3] = w * n, x * n, y * n, z * n


@compiled()
def _exponential(r, out):
    angle = math.sqrt(r[0] * r[0] + r[1] * r[1] + r[2] * r[2])
    s = math.sin(0.5 * angle) / angle if angle > 1e-12 else 0.5
    out[0] = math.cos(0.5 * angle)
    for i in range(3):
        out[i + 1] = s * r[i]


@compiled()
def _matrices(r, rotation, jacobian):
    """Write R(r) and the left Jacobian J(r): the sum of rⁿ/n! and of rⁿ/(n+1)! of the cross-product matrix."""
    square = r[0] * r[0] + r[1] * r[1] + r[2] * r[2]
    angle = math.sqrt(square)
    if angle > 1e-4:
        a, b, c = (
            math.sin(angle) / angle,
            (1.0 - math.cos(angle)) / square,
            (angle - math.sin(angle)) / (square * angle),
        )
    else:
        a, b, c = 1.0 - square / 6.0, 0.5 - square / 24.0, 1.0 / 6.0 - square / 120.0
    for i in range(3):
        for j in range(3):
            same = 1.0 if i == j else 0.0
            outer = r[i] * r[j] - same * square
            k = 3 - i - j
            cross = 0.0 if i == j else (-r[k] if (j - i) % 3 == 1 else r[k])
            rotation[i, j] = same + a * cross + b * outer
            jacobian[i, j] = same + b * cross + c * outer


@compiled()
def _invert(m, out):
    """Write the inverse of a symmetric positive definite m (3, 3); return its determinant."""
    a, b, c, d, e, f = m[0, 0], m[0, 1], m[0, 2], m[1, 1], m[1, 2], m[2, 2]
    p, q, s = d * f - e * e, c * e - b * f, b * e - c * d
    det = a * p + b * q + c * s
    out[0, 0], out[0, 1], out[0, 2] = p / det, q / det, s / det
    out[1, 1], out[1, 2], out[2, 2] = (a * f - c * c) / det, (b * c - a * e) / det, (a * d - b * b) / det
    out[1, 0], out[2, 0], out[2, 1] = out[0, 1], out[0, 2], out[1, 2]
    return det


@compiled()
def run_spin(
    times, measured, start_time, q, rate, covariance, walk, noise, body, out_q, out_rate, out_p, evidence, nis
):
    """Filter a sequence; q (4,), rate (3,) and covariance (6, 6) come and go as the state.

    measured (T, 4), rows of NaN missing; walk in rad/s/√s; noise (3, 3), rad², in the body frame if `body` else in the
    world's. evidence: the log-density of each measurement on S³, to which a rotation vector's is 4 times denser.
    """
    p, rotation, jacobian, attitude = covariance, np.empty((3, 3)), np.empty((3, 3)), np.empty((3, 3))
    step, turn, residual, unused = np.empty(3), np.empty(4), np.empty(4), np.empty((3, 3))
    f, fp = np.zeros((6, 6)), np.empty((6, 6))
    s, inverse, gain, e = np.empty((3, 3)), np.empty((3, 3)), np.empty((6, 3)), np.empty(3)
    last = start_time
    for n in range(times.size):
        t = times[n] - last
        last = times[n]
        if t > 0.0:
            for i in range(3):
                step[i] = rate[i] * t
            _exponential(step, turn)
            _product(turn, q, q)
            _matrices(step, rotation, jacobian)
            for i in range(3):
                f[i + 3, i + 3] = 1.0
                for j in range(3):
                    f[i, j] = rotation[i, j]
                    f[i, j + 3] = t * jacobian[i, j]
            for i in range(6):
                for j in range(6):
                    v = 0.0
                    for k in range(6):
                        v += f[i, k] * p[k, j]
                    fp[i, j] = v
            for i in range(6):
                for j in range(i + 1):
                    v = 0.0
                    for k in range(6):
                        v += fp[i, k] * f[j, k]
                    p[i, j] = v
                    p[j, i] = v
            for i in range(3):
                p[i, i] += walk * walk * t * t * t / 3.0
                p[i, i + 3] += walk * walk * t * t * 0.5
                p[i + 3, i] = p[i, i + 3]
                p[i + 3, i + 3] += walk * walk * t
        evidence[n] = 0.0
        nis[n] = math.nan
        if not math.isnan(measured[n, 0]):
            # r = log(y ⊗ x̂*), the shorter way.
            turn[0], turn[1], turn[2], turn[3] = q[0], -q[1], -q[2], -q[3]
            _product(measured[n], turn, residual)
            sign = -1.0 if residual[0] < 0.0 else 1.0
            size = math.sqrt(residual[1] ** 2 + residual[2] ** 2 + residual[3] ** 2)
            factor = sign * (2.0 * math.atan2(size, abs(residual[0])) / size if size > 1e-12 else 2.0)
            for i in range(3):
                e[i] = factor * residual[i + 1]
            if body:
                turn[0], turn[1], turn[2], turn[3] = q[0], q[1], q[2], q[3]
                size = math.sqrt(turn[1] ** 2 + turn[2] ** 2 + turn[3] ** 2)
                factor = 2.0 * math.atan2(size, turn[0]) / size if size > 1e-12 else 2.0
                for i in range(3):
                    step[i] = factor * turn[i + 1]
                _matrices(step, attitude, unused)
            for i in range(3):
                for j in range(3):
                    v = noise[i, j]
                    if body:
                        v = 0.0
                        for k in range(3):
                            for l in range(3):
                                v += attitude[i, k] * noise[k, l] * attitude[j, l]
                    s[i, j] = p[i, j] + v
            det = _invert(s, inverse)
            d = 0.0
            for i in range(3):
                for j in range(3):
                    d += e[i] * inverse[i, j] * e[j]
            nis[n] = d
            evidence[n] = math.log(4.0) - 0.5 * (d + math.log(det) + 3.0 * math.log(2.0 * math.pi))
            for i in range(6):
                for j in range(3):
                    v = 0.0
                    for k in range(3):
                        v += p[i, k] * inverse[k, j]
                    gain[i, j] = v
            for i in range(3):
                step[i] = gain[i, 0] * e[0] + gain[i, 1] * e[1] + gain[i, 2] * e[2]
                rate[i] += gain[i + 3, 0] * e[0] + gain[i + 3, 1] * e[1] + gain[i + 3, 2] * e[2]
            _exponential(step, turn)
            _product(turn, q, q)
            for i in range(6):
                for j in range(6):
                    v = p[i, j]
                    for k in range(3):
                        for l in range(3):
                            v -= gain[i, k] * s[k, l] * gain[j, l]
                    fp[i, j] = v
            for i in range(6):
                for j in range(6):
                    p[i, j] = 0.5 * (fp[i, j] + fp[j, i])
        out_q[n] = q
        out_rate[n] = rate
        out_p[n] = p
