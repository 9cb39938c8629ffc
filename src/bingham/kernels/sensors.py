"""Whole sequences of the quaternion filter: any motion and any list of conjugate sensors in one compiled loop.

A distribution is carried as in `kernels.step`: concentrations z (4,) and its frame (4, 4) by rows.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bingham.kernels.compile import compiled
from bingham.kernels.eigen import orthonormalize_4
from bingham.kernels.normalizer import derivatives_2, gradient_4
from bingham.kernels.quaternion import rotate_rows_left, rotate_rows_right
from bingham.kernels.step import (
    ACCEPTED,
    MISSING,
    REJECTED,
    add_matrix_4,
    compose_known_4,
    diffuse_known_4,
    update_4,
    work_space_4,
)

__all__ = ["HEADING", "ORIENTATION", "UNUSABLE", "VECTOR", "Kept", "Motion", "Sensors", "run_sequences"]

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

ORIENTATION, VECTOR, HEADING = 0, 1, 2
# A decision: a vector of length 0, or a vertical one where a heading is asked for.
UNUSABLE = -2


class Motion(NamedTuple):
    """How the distribution moves before each of T rows.

    ``controls`` (B, T, 4), or (B, 0, 4) for none: known rotations, on the left with ``left_control``.
    ``uniform_weights`` (T,): isotropic diffusion, 1 − e^{−σ²t}; or (0,) for the noise of `step.compose_4` with ``mode``
    (4,), ``tangents`` (n, 3, 3), ``weights`` (n,), n = T or 1 for all rows, on the left with ``left``.
    """

    controls: FloatArray
    left_control: bool
    uniform_weights: FloatArray
    mode: FloatArray
    tangents: FloatArray
    weights: FloatArray
    left: bool


class Sensors(NamedTuple):
    """S sensors, one entry each: ``kind``; ``column`` of its first entry in a row of measurements; ``threshold``.

    Orientations: ``noise_z`` (S, 4), ``noise_frame`` (S, 4, 4) conjugated noise axes by rows, ``log_normalizer``,
    ``left``. Vectors: ``concentration`` and the unit vector ``reference`` (S, 3). Headings: ``concentration`` and the
    horizontal unit vector ``reference`` (S, :2).
    """

    kind: IntArray
    column: IntArray
    threshold: FloatArray
    concentration: FloatArray
    reference: FloatArray
    noise_z: FloatArray
    noise_frame: FloatArray
    log_normalizer: FloatArray
    left: NDArray[np.bool_]


class Kept(NamedTuple):
    """Results (B, T, …), or (B, 1, …) for the last row only; nis and decision (B, T, S)."""

    z: FloatArray
    frame: FloatArray
    log_evidence: FloatArray
    nis: FloatArray
    decision: NDArray[np.int8]


@compiled()
def vector_likelihood(b0, b1, b2, r, concentration, matrix):
    """Write κ (K(r, b) − I) for the unit world vector r and the body vector b, scaled to unit length, to matrix (4, 4).

    K is Davenport's matrix (see `models.sensors.davenport_matrix`). Returns False for a zero vector.
    """
    n = math.sqrt(b0 * b0 + b1 * b1 + b2 * b2)
    if not n > 0.0:
        return False
    k = concentration / n
    x, y, z = k * b0, k * b1, k * b2
    r0, r1, r2 = r[0], r[1], r[2]
    dot = r0 * x + r1 * y + r2 * z
    low = -dot - concentration
    matrix[0, 0] = dot - concentration
    matrix[0, 1] = matrix[1, 0] = y * r2 - z * r1
    matrix[0, 2] = matrix[2, 0] = z * r0 - x * r2
    matrix[0, 3] = matrix[3, 0] = x * r1 - y * r0
    matrix[1, 1] = 2.0 * r0 * x + low
    matrix[2, 2] = 2.0 * r1 * y + low
    matrix[3, 3] = 2.0 * r2 * z + low
    matrix[1, 2] = matrix[2, 1] = r0 * y + r1 * x
    matrix[1, 3] = matrix[3, 1] = r0 * z + r2 * x
    matrix[2, 3] = matrix[3, 2] = r1 * z + r2 * y
    return True


@compiled()
def heading_likelihood(q, m0, m1, m2, east, north, concentration, matrix):
    """Write −2κ v vᵀ, v = k ⊗ q_h, to matrix (4, 4): q rotated about the vertical until m points to (east, north).

    q (4,) predicted mode, m a body vector. Returns False where m is vertical and has no heading.
    """
    w, x, y, z = q[0], q[1], q[2], q[3]
    e = (1.0 - 2.0 * (y * y + z * z)) * m0 + 2.0 * (x * y - w * z) * m1 + 2.0 * (x * z + w * y) * m2
    n = 2.0 * (x * y + w * z) * m0 + (1.0 - 2.0 * (x * x + z * z)) * m1 + 2.0 * (y * z - w * x) * m2
    # The rotation that takes (e, n) to (east, north).
    c, s = e * east + n * north, e * north - n * east
    r = math.hypot(c, s)
    if not r > 0.0:
        return False
    half = 0.5 * math.atan2(s, c)
    c, s = math.cos(half), math.sin(half)
    # v = k ⊗ (c + k s) ⊗ q = (−s + k c) ⊗ q.
    v = (-s * w - c * z, -s * x - c * y, -s * y + c * x, -s * z + c * w)
    for i in range(4):
        for j in range(4):
            matrix[i, j] = -2.0 * concentration * v[i] * v[j]
    return True


@compiled()
def _run(z, frame, motion, batch, measurements, sensors, shares, kept):
    steps = measurements.shape[0]
    count = sensors.kind.size
    last_only = kept.z.shape[1] != steps
    work = work_space_4()
    matrix, rotated = np.empty((4, 4)), np.empty((4, 4))
    old_z, old_frame = np.empty(4), np.empty((4, 4))
    controls = motion.controls[batch]
    share = math.nan
    log_noises = sensors.log_normalizer.copy()
    # Whether work[0] holds the moments of z: an accepted update leaves them there.
    known = False
    for t in range(steps):
        if not known:
            gradient_4(z, work[0])
        if controls.shape[0] > 0:
            if motion.left_control:
                rotate_rows_left(controls[t], frame)
            else:
                rotate_rows_right(frame, controls[t])
        if motion.uniform_weights.size == 0:
            n = t if motion.weights.size > 1 else 0
            log_f = compose_known_4(z, frame, motion.mode, motion.tangents[n], motion.weights[n], motion.left, work)
        elif motion.uniform_weights[t] > 0.0:
            log_f = diffuse_known_4(z, motion.uniform_weights[t], work)
        else:
            log_f = math.log(gradient_4(z, work[0]))
        known = False
        fresh = False
        new_share = shares[t] if shares.size > 1 else shares[0]
        if new_share != share:
            share = new_share
            for s in range(count):
                k = sensors.concentration[s] * share
                if sensors.kind[s] == VECTOR:
                    # ∫ exp(κ (u·b − 1)) du over the sphere.
                    log_noises[s] = math.log(-2.0 * math.pi * math.expm1(-2.0 * k) / k)
                elif sensors.kind[s] == HEADING:
                    # ∫ exp(κ (cos ψ − 1)) dψ = 2π e^{−κ} I₀(κ) is the normaliser of d = 2 at z = (−2κ, 0).
                    log_noises[s] = derivatives_2(-2.0 * k)[0]
        row = 0 if last_only else t
        evidence = 0.0
        for s in range(count):
            kind, i = sensors.kind[s], sensors.column[s]
            kept.nis[batch, row, s] = math.nan
            kept.decision[batch, row, s] = MISSING
            y0, y1, y2 = measurements[t, i], measurements[t, i + 1], measurements[t, i + 2]
            if math.isnan(y0 + y1 + y2):
                continue
            usable = True
            if kind == ORIENTATION:
                rotated[:] = sensors.noise_frame[s]
                y = measurements[t, i : i + 4]
                if sensors.left[s]:
                    rotate_rows_right(rotated, y)
                else:
                    rotate_rows_left(y, rotated)
            elif kind == VECTOR:
                k = sensors.concentration[s] * share
                usable = vector_likelihood(y0, y1, y2, sensors.reference[s], k, matrix)
            else:
                k = sensors.concentration[s] * share
                east, north = sensors.reference[s, 0], sensors.reference[s, 1]
                usable = heading_likelihood(frame[3], y0, y1, y2, east, north, k, matrix)
            if not usable:
                kept.decision[batch, row, s] = UNUSABLE
                continue
            old_z[:] = z
            old_frame[:] = frame
            if kind == ORIENTATION:
                top = update_4(z, frame, sensors.noise_z[s], rotated, work)
            else:
                top = add_matrix_4(z, frame, matrix, work)
            log_posterior = math.log(gradient_4(z, work[0]))
            evidence += log_posterior + top - log_f - log_noises[s]
            kept.nis[batch, row, s] = -2.0 * top
            if -2.0 * top > sensors.threshold[s]:
                kept.decision[batch, row, s] = REJECTED
                z[:] = old_z
                frame[:] = old_frame
                known = False
            else:
                kept.decision[batch, row, s] = ACCEPTED
                log_f = log_posterior
                known = fresh = True
        if not fresh:
            orthonormalize_4(frame)
        kept.z[batch, row] = z
        for i in range(4):
            for j in range(4):
                kept.frame[batch, row, j, i] = frame[i, j]
        kept.log_evidence[batch, row] = evidence


@compiled()
def run_sequences(z, frame, motion, measurements, sensors, shares, kept):
    """Filter B sequences: for every row of measurements (B, T, N) predict, then update with each sensor that has one.

    z (B, 4) and frame (B, 4, 4; by rows) hold the end states. A sensor with NaN in its columns measured nothing. An
    update whose NIS, −2·top, exceeds the sensor's threshold is rejected. shares (T,) or (1,): factors of the
    concentrations of vectors and headings.
    """
    for b in range(z.shape[0]):
        _run(z[b], frame[b], motion, b, measurements[b], sensors, shares, kept)
