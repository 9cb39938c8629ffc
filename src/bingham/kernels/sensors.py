"""Whole sequences of predictions and updates: any motion and any list of conjugate sensors in one compiled loop.

A distribution is carried as in `kernels.step`: concentrations z (4,) and its frame (4, 4) by rows.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bingham.kernels.compile import compiled
from bingham.kernels.linalg import orthonormalize_4
from bingham.kernels.newton import newton_2, newton_4
from bingham.kernels.quaternion import rotate_rows
from bingham.kernels.rule import moments_2, moments_4
from bingham.kernels.step import add_matrix_4, composed_moments_4, update_2, update_4, work_space_4

__all__ = ["ACCEPTED", "HEADING", "MISSING", "ORIENTATION", "REJECTED", "UNUSABLE", "VECTOR", "Kept", "Motion",
           "Sensors", "run_2", "run_sequences"]  # fmt: skip

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

ORIENTATION, VECTOR, HEADING = 0, 1, 2
# Decisions; unusable: a vector of length 0, or a vertical one where a heading is asked for.
ACCEPTED, REJECTED, MISSING, UNUSABLE = 1, 0, -1, -2


class Motion(NamedTuple):
    """How the distribution moves before each of T rows.

    ``controls`` (B, T, 4), or (B, 0, 4) for none: known rotations, on the left with ``left_control``.
    ``uniform_weights`` (T,): isotropic diffusion, 1 − e^{−σ²t}; or (0,) for the noise of `step.compose_4` with ``mode``
    (4,), ``tangents`` (n, d−1, d−1), ``weights`` (n,), n = T or 1 for all rows, on the left with ``left``.
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


@compiled(inner=True)
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


@compiled(inner=True)
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
def _log_noises(sensors, share, terms, out):
    """Write log-normalisers of the likelihoods at this factor of their concentrations to out (S,)."""
    for s in range(sensors.kind.size):
        k = sensors.concentration[s] * share
        if sensors.kind[s] == VECTOR:
            # ∫ exp(κ (u·b − 1)) du over the sphere.
            out[s] = math.log(-2.0 * math.pi * math.expm1(-2.0 * k) / k)
        elif sensors.kind[s] == HEADING:
            # ∫ exp(κ (cos ψ − 1)) dψ = 2π e^{−κ} I₀(κ) is the normaliser of d = 2 at z = (−2κ, 0).
            out[s] = moments_2(-2.0 * k, terms)[0]
        else:
            out[s] = sensors.log_normalizer[s]


@compiled()
def _orientation_likelihood(sensors, s, row, rotated):
    """Write the noise axes of sensor s about its measured orientation to rotated (4, 4); return accepted or missing."""
    i = sensors.column[s]
    if math.isnan(row[i] + row[i + 1] + row[i + 2] + row[i + 3]):
        return MISSING
    for j in range(4):
        for m in range(4):
            rotated[j, m] = sensors.noise_frame[s, j, m]
    rotate_rows(rotated, row[i : i + 4], not sensors.left[s])
    return ACCEPTED


@compiled()
def _likelihood(sensors, s, row, frame, share, rotated, matrix):
    """Write the likelihood of sensor s for a row of measurements to rotated (noise axes) or matrix, both (4, 4).

    Returns a decision: accepted so far, missing or unusable.
    """
    if sensors.kind[s] == ORIENTATION:
        return _orientation_likelihood(sensors, s, row, rotated)
    i = sensors.column[s]
    y0, y1, y2 = row[i], row[i + 1], row[i + 2]
    if math.isnan(y0 + y1 + y2):
        return MISSING
    k = sensors.concentration[s] * share
    if sensors.kind[s] == VECTOR:
        usable = vector_likelihood(y0, y1, y2, sensors.reference[s], k, matrix)
    else:
        east, north = sensors.reference[s, 0], sensors.reference[s, 1]
        usable = heading_likelihood(frame[3], y0, y1, y2, east, north, k, matrix)
    return ACCEPTED if usable else UNUSABLE


@compiled()
def run_sequences(z, frame, motion, measurements, sensors, shares, kept):
    """Filter B sequences: for every row of measurements (B, T, N) predict, then update with each sensor that has one.

    z (B, 4) and frame (B, 4, 4; by rows) hold the end states. A sensor with NaN in its columns measured nothing. An
    update whose NIS, −2 times the largest eigenvalue, exceeds the sensor's threshold is rejected. shares (T,) or (1,):
    factors of the concentrations of vectors and headings, or None if there are none: then nothing is compiled for them.
    """
    steps, count = measurements.shape[1], sensors.kind.size
    last_only = kept.z.shape[1] != steps
    work = work_space_4()
    w = work[0]
    matrix, rotated, old = np.empty((4, 4)), np.empty((4, 4)), np.empty((5, 4))
    log_noises = sensors.log_normalizer.copy()
    share = math.nan
    for b in range(z.shape[0]):
        x, f = z[b], frame[b]
        t = row = 0
        s = -1
        nis = top = log_f = evidence = 0.0
        pending = fresh = False
        while steps > 0:
            # The one place where moments are computed: a run that was interrupted goes on with the same bits.
            log_now = moments_4(x, w, work[4])
            if pending:
                pending = False
                evidence += log_now + top - log_f - log_noises[s - 1]
                kept.nis[b, row, s - 1] = nis
                if nis > sensors.threshold[s - 1]:
                    kept.decision[b, row, s - 1] = REJECTED
                    for k in range(4):
                        x[k] = old[4, k]
                        for j in range(4):
                            f[j, k] = old[j, k]
                    continue
                log_f = log_now
                fresh = True
            if s == count:
                if not fresh:
                    orthonormalize_4(f)
                for j in range(4):
                    kept.z[b, row, j] = x[j]
                    for k in range(4):
                        kept.frame[b, row, k, j] = f[j, k]
                kept.log_evidence[b, row] = evidence
                t += 1
                s = -1
                if t == steps:
                    break
            if s < 0:
                s = 0
                row = 0 if last_only else t
                evidence = 0.0
                fresh = False
                if motion.controls.shape[1] > 0:
                    rotate_rows(f, motion.controls[b, t], motion.left_control)
                log_f = log_now
                moved = True
                if motion.uniform_weights.size == 0:
                    n = t if motion.weights.size > 1 else 0
                    rotate_rows(f, motion.mode, motion.left)
                    composed_moments_4(f, motion.tangents[n], motion.weights[n], motion.left, work)
                elif motion.uniform_weights[t] > 0.0:
                    for j in range(4):
                        w[j] += motion.uniform_weights[t] * (0.25 - w[j])
                else:
                    moved = False
                if moved:
                    log_f, _ = newton_4(w, x, 4, work[4])
                if shares is not None:
                    new_share = shares[t if shares.size > 1 else 0]
                    if new_share != share:
                        share = new_share
                        _log_noises(sensors, share, work[4], log_noises)
            while s < count and not pending:
                if shares is None:
                    decision = _orientation_likelihood(sensors, s, measurements[b, t], rotated)
                else:
                    decision = _likelihood(sensors, s, measurements[b, t], f, share, rotated, matrix)
                kept.decision[b, row, s] = decision
                kept.nis[b, row, s] = math.nan
                if decision == ACCEPTED:
                    pending = True
                    for k in range(4):
                        old[4, k] = x[k]
                        for j in range(4):
                            old[j, k] = f[j, k]
                    # A condition on None alone is decided before anything is compiled.
                    if shares is None:  # noqa: SIM114
                        top = update_4(x, f, sensors.noise_z[s], rotated, work)
                    elif sensors.kind[s] == ORIENTATION:
                        top = update_4(x, f, sensors.noise_z[s], rotated, work)
                    else:
                        top = add_matrix_4(x, f, matrix, work)
                    nis = -2.0 * top
                s += 1


@compiled()
def run_2(z, frame, motion, measurements, sensors, shares, kept):
    """`run_sequences` for one sensor of d = 2, where angles add; motion.tangents[0, 0, 0] is the small moment."""
    steps = measurements.shape[1]
    noise_w = motion.tangents[0, 0, 0]
    u, v = sensors.noise_frame[0, 1, 0], sensors.noise_frame[0, 1, 1]
    terms = np.empty(32)
    for i in range(z.shape[0]):
        z1, c, s = z[i, 0], frame[i, 1, 0], frame[i, 1, 1]
        for t in range(steps):
            log_f, w, _ = moments_2(z1, terms)
            if motion.controls.shape[1] > 0:
                a, b = motion.controls[i, t, 0], motion.controls[i, t, 1]
                c, s = c * a - s * b, s * a + c * b
            if motion.uniform_weights.size == 0:
                a, b = motion.mode[0], motion.mode[1]
                c, s = c * a - s * b, s * a + c * b
                z1, log_f, _ = newton_2(w + noise_w - 2.0 * w * noise_w, terms)
            elif motion.uniform_weights[t] > 0.0:
                z1, log_f, _ = newton_2(w + motion.uniform_weights[t] * (0.5 - w), terms)
            n = 1.0 / math.hypot(c, s)
            c, s = c * n, s * n
            x, y = measurements[i, t, 0], measurements[i, t, 1]
            evidence, nis, decision = 0.0, math.nan, MISSING
            if not math.isnan(x + y):
                # x ⊕ v = measurement: the likelihood's mode is the measurement rotated back by the noise's mode, whose
                # conjugate is (u, v).
                p1, pc, ps, top = update_2(z1, c, s, sensors.noise_z[0, 0], x * u - y * v, y * u + x * v)
                nis = -2.0 * top
                log_posterior, _, _ = moments_2(p1, terms)
                evidence = log_posterior + top - log_f - sensors.log_normalizer[0]
                decision = REJECTED
                if not nis > sensors.threshold[0]:
                    decision = ACCEPTED
                    z1, c, s = p1, pc, ps
            row = t if kept.z.shape[1] == steps else 0
            kept.z[i, row, 0], kept.z[i, row, 1] = z1, 0.0
            kept.frame[i, row, 0, 0], kept.frame[i, row, 1, 0] = -s, c
            kept.frame[i, row, 0, 1], kept.frame[i, row, 1, 1] = c, s
            kept.log_evidence[i, row] = evidence
            kept.nis[i, row, 0] = nis
            kept.decision[i, row, 0] = decision
        z[i, 0], z[i, 1] = z1, 0.0
        frame[i, 0, 0], frame[i, 0, 1], frame[i, 1, 0], frame[i, 1, 1] = -s, c, c, s
