"""One prediction or update of the first-order Bingham filter, and whole sequences of them.

A distribution is carried as concentrations z (d,), ascending with z_d = 0, and its frame (d, d) by rows: frame[j] is
the j-th principal axis, the last one the mode. Both steps work in the frame of the distribution that came in, where
small eigenvalues keep their relative accuracy and Jacobi's method starts nearly diagonal.
"""

from __future__ import annotations

import math

import numpy as np

from bingham.kernels.compile import compiled
from bingham.kernels.eigen import diagonalize_4, orthonormalize_4
from bingham.kernels.moments import concentrations_2, concentrations_4
from bingham.kernels.normalizer import derivatives_2, gradient_4
from bingham.kernels.quaternion import rotate_rows_left, rotate_rows_right

__all__ = ["ACCEPTED", "MISSING", "REJECTED", "add_matrix_4", "compose_4", "diffuse_4", "run_2", "run_4", "run_many_2",
           "run_many_4", "update_2", "update_4", "work_space_4"]  # fmt: skip

ACCEPTED, REJECTED, MISSING = 1, 0, -1


@compiled()
def work_space_4():
    """Scratch arrays shared by the d = 4 steps: moments (4,), factors (4, 4), matrix (4, 4)."""
    return np.empty(4), np.empty((4, 4)), np.empty((4, 4))


@compiled()
def diffuse_4(z, uniform_weight, work):
    """Isotropic diffusion: ω ← ω + c (¼ − ω), c = `uniform_weight` = 1 − exp(−σ²t); the frame stays. Returns log F."""
    gradient_4(z, work[0])
    return diffuse_known_4(z, uniform_weight, work)


@compiled()
def diffuse_known_4(z, uniform_weight, work):
    """`diffuse_4` with the moments of z in work[0] already."""
    w = work[0]
    for i in range(4):
        w[i] += uniform_weight * (0.25 - w[i])
    log_f, _ = concentrations_4(w, z)
    return log_f


@compiled()
def compose_4(z, frame, mode, tangent, weight, left, work):
    """Moment-matched distribution of x ⊕ v (left: v ⊕ x), in place; returns log F.

    The noise v has second moment weight·m mᵀ + Σ νᵢ (m ⊕ eᵢ)(m ⊕ eᵢ)ᵀ with mode m (left: eᵢ ⊕ m) and pure
    quaternions eᵢ; tangent (3, 3) = Σ νᵢ eᵢ eᵢᵀ, so that weight + tr tangent = 1.

    S' = Σ_m ν_m R_m S R_mᵀ (Glover & Kaelbling 2013, A.9.2), written in the rotated frame of x: right multiplication by
    a pure unit quaternion e is antisymmetric, and between the axes of an orthonormal quaternion frame its entries are
    ± aₖ·e, where a_j is the vector part of conj(frame[3]) ⊗ frame[j].
    """
    gradient_4(z, work[0])
    log_f = compose_known_4(z, frame, mode, tangent, weight, left, work)
    orthonormalize_4(frame)
    return log_f


@compiled()
def compose_known_4(z, frame, mode, tangent, weight, left, work):
    """`compose_4` with the moments of z in work[0] already; rounding drift stays in the frame."""
    w, a, b = work  # rows of a: a_0, a_1, a_2
    if left:
        rotate_rows_left(mode, frame)
    else:
        rotate_rows_right(frame, mode)
    s = -1.0 if left else 1.0
    m0, m1, m2, m3 = frame[3, 0], frame[3, 1], frame[3, 2], frame[3, 3]
    for j in range(3):
        q0, q1, q2, q3 = frame[j, 0], frame[j, 1], frame[j, 2], frame[j, 3]
        a[j, 0] = m0 * q1 - m1 * q0 - s * (m2 * q3 - m3 * q2)
        a[j, 1] = m0 * q2 - m2 * q0 - s * (m3 * q1 - m1 * q3)
        a[j, 2] = m0 * q3 - m3 * q0 - s * (m1 * q2 - m2 * q1)
    det = (
        a[0, 0] * (a[1, 1] * a[2, 2] - a[1, 2] * a[2, 1])
        - a[0, 1] * (a[1, 0] * a[2, 2] - a[1, 2] * a[2, 0])
        + a[0, 2] * (a[1, 0] * a[2, 1] - a[1, 1] * a[2, 0])
    )
    s *= math.copysign(1.0, det)
    # Q = aᵀ-frame of the tangent moment; qij = a_i·tangent·a_j.
    t0, t1, t2 = _times(tangent, a[0, 0], a[0, 1], a[0, 2])
    q00 = t0 * a[0, 0] + t1 * a[0, 1] + t2 * a[0, 2]
    q01 = t0 * a[1, 0] + t1 * a[1, 1] + t2 * a[1, 2]
    q02 = t0 * a[2, 0] + t1 * a[2, 1] + t2 * a[2, 2]
    t0, t1, t2 = _times(tangent, a[1, 0], a[1, 1], a[1, 2])
    q11 = t0 * a[1, 0] + t1 * a[1, 1] + t2 * a[1, 2]
    q12 = t0 * a[2, 0] + t1 * a[2, 1] + t2 * a[2, 2]
    t0, t1, t2 = _times(tangent, a[2, 0], a[2, 1], a[2, 2])
    q22 = t0 * a[2, 0] + t1 * a[2, 1] + t2 * a[2, 2]
    w0, w1, w2, w3 = w[0], w[1], w[2], w[3]
    b[0, 0] = weight * w0 + q00 * w3 + q22 * w1 + q11 * w2
    b[1, 1] = weight * w1 + q11 * w3 + q22 * w0 + q00 * w2
    b[2, 2] = weight * w2 + q22 * w3 + q11 * w0 + q00 * w1
    b[3, 3] = weight * w3 + q00 * w0 + q11 * w1 + q22 * w2
    b[0, 1] = (w3 - w2) * q01
    b[0, 2] = (w3 - w1) * q02
    b[1, 2] = (w3 - w0) * q12
    b[0, 3] = s * (w2 - w1) * q12
    b[1, 3] = s * (w0 - w2) * q02
    b[2, 3] = s * (w1 - w0) * q01
    diagonalize_4(b, w, frame)
    log_f, _ = concentrations_4(w, z)
    return log_f


@compiled(inline=True)
def _times(t, x, y, z):
    return (
        t[0, 0] * x + t[0, 1] * y + t[0, 2] * z,
        t[0, 1] * x + t[1, 1] * y + t[1, 2] * z,
        t[0, 2] * x + t[1, 2] * y + t[2, 2] * z,
    )


@compiled()
def _posterior_4(z, frame, work):
    """Diagonalise b = diag z + likelihood (in the frame), write z and frame; return the largest eigenvalue."""
    b = work[2]
    b[0, 0] += z[0]
    b[1, 1] += z[1]
    b[2, 2] += z[2]
    b[3, 3] += z[3]
    diagonalize_4(b, z, frame)
    orthonormalize_4(frame)
    top = z[3]
    z[0] -= top
    z[1] -= top
    z[2] -= top
    z[3] = 0.0
    return top


@compiled()
def update_4(z, frame, likelihood_z, likelihood_frame, work):
    """Multiply by exp(Σ likelihood_z[m] (n_mᵀ x)²), n_m = likelihood_frame[m]; return the largest eigenvalue.

    Posterior A + L in place (Kurz et al. 2014, eq. 53). log F(A + L) = log F(z) + the returned value.
    """
    _, c, b = work
    for i in range(4):
        for m in range(4):
            c[i, m] = (
                frame[i, 0] * likelihood_frame[m, 0]
                + frame[i, 1] * likelihood_frame[m, 1]
                + frame[i, 2] * likelihood_frame[m, 2]
                + frame[i, 3] * likelihood_frame[m, 3]
            )
    for i in range(4):
        for j in range(i, 4):
            b[i, j] = (
                likelihood_z[0] * c[i, 0] * c[j, 0]
                + likelihood_z[1] * c[i, 1] * c[j, 1]
                + likelihood_z[2] * c[i, 2] * c[j, 2]
                + likelihood_z[3] * c[i, 3] * c[j, 3]
            )
    return _posterior_4(z, frame, work)


@compiled()
def add_matrix_4(z, frame, matrix, work):
    """Multiply by exp(xᵀ L x) for a symmetric L (4, 4) with largest eigenvalue 0; as `update_4`."""
    _, c, b = work
    for i in range(4):
        for k in range(4):
            c[i, k] = (
                frame[i, 0] * matrix[0, k]
                + frame[i, 1] * matrix[1, k]
                + frame[i, 2] * matrix[2, k]
                + frame[i, 3] * matrix[3, k]
            )
    for i in range(4):
        for j in range(i, 4):
            b[i, j] = c[i, 0] * frame[j, 0] + c[i, 1] * frame[j, 1] + c[i, 2] * frame[j, 2] + c[i, 3] * frame[j, 3]
    return _posterior_4(z, frame, work)


@compiled()
def run_4(z, frame, controls, uniform_weights, mode, tangent, weight, left, measurements, sensor_z, sensor_frame,
sensor_log_f,
          threshold, keep_z, keep_frame, keep_evidence, keep_nis, keep_decision):  # fmt: skip
    """Filter a sequence: for every row of measurements (T, 4) predict, then update; z and frame hold the end state.

    controls (T, 4) or (0, 4): known rotation of each step; uniform_weights (T,) or (0,): isotropic diffusion instead
    of the noise (mode, tangent, weight) of `compose_4`, 0 for no prediction. sensor_frame holds the conjugated noise
    axes; a measurement with NaN is missing. An update whose NIS −2·top exceeds the threshold is rejected.
    keep_* are (T, …), or (1, …) to keep the last step only.
    """
    steps = measurements.shape[0]
    work = work_space_4()
    rotated = np.empty((4, 4))
    old_z, old_frame = np.empty(4), np.empty((4, 4))
    # Whether work[0] holds the moments of z: an accepted update leaves them there.
    known = False
    for t in range(steps):
        if not known:
            gradient_4(z, work[0])
        if controls.shape[0] > 0:
            if left:
                rotate_rows_left(controls[t], frame)
            else:
                rotate_rows_right(frame, controls[t])
        if uniform_weights.size == 0:
            log_f = compose_known_4(z, frame, mode, tangent, weight, left, work)
        elif uniform_weights[t] > 0.0:
            log_f = diffuse_known_4(z, uniform_weights[t], work)
        else:
            log_f = math.log(gradient_4(z, work[0]))
        row = t if keep_z.shape[0] == steps else 0
        y = measurements[t]
        if math.isnan(y[0] + y[1] + y[2] + y[3]):
            evidence, nis, decision = 0.0, math.nan, MISSING
            known = False
            orthonormalize_4(frame)
        else:
            rotated[:] = sensor_frame
            if left:
                rotate_rows_right(rotated, y)
            else:
                rotate_rows_left(y, rotated)
            old_z[:] = z
            old_frame[:] = frame
            top = update_4(z, frame, sensor_z, rotated, work)
            nis = -2.0 * top
            evidence = math.log(gradient_4(z, work[0])) + top - log_f - sensor_log_f
            decision = ACCEPTED
            known = True
            if nis > threshold:
                decision = REJECTED
                known = False
                z[:] = old_z
                frame[:] = old_frame
                orthonormalize_4(frame)
        keep_z[row] = z
        keep_frame[row] = frame
        keep_evidence[row] = evidence
        keep_nis[row] = nis
        keep_decision[row] = decision


@compiled()
def run_many_4(z, frame, controls, uniform_weights, mode, tangent, weight, left, measurements, sensor_z, sensor_frame,
               sensor_log_f, threshold, keep_z, keep_frame, keep_evidence, keep_nis, keep_decision):  # fmt: skip
    """`run_4` for independent filters: a leading batch axis on every array but the noises and uniform_weights."""
    for i in range(z.shape[0]):
        run_4(z[i], frame[i], controls[i], uniform_weights, mode, tangent, weight, left, measurements[i], sensor_z,
        sensor_frame,
              sensor_log_f, threshold, keep_z[i], keep_frame[i], keep_evidence[i], keep_nis[i],
              keep_decision[i])  # fmt: skip


@compiled()
def update_2(z1, c, s, y1, a, b):
    """Product of the d = 2 distributions with (z1, mode (c, s)) and (y1, mode (a, b)).

    With κ = −z₁/2 both are von Mises distributions of the doubled angle (Kurz et al. 2014, eq. 76), so κ e^{2iμ} add.
    Returns (z₁, mode c, mode s, largest eigenvalue of the sum).
    """
    k, j = -0.5 * z1, -0.5 * y1
    x = k * (c * c - s * s) + j * (a * a - b * b)
    y = 2.0 * (k * c * s + j * a * b)
    r = math.hypot(x, y)
    if r == 0.0:
        return 0.0, c, s, -(k + j)
    cross = c * b - s * a
    top = -4.0 * k * j * cross * cross / (k + j + r)
    # Half of the angle of (x, y), on the side of the prior's mode.
    if x > 0.0:
        p, q = x + r, y
    else:
        p, q = abs(y), math.copysign(r - x, y)
    n = 1.0 / math.hypot(p, q)
    if p * c + q * s < 0.0:
        n = -n
    return -2.0 * r, p * n, q * n, top


@compiled()
def run_2(z, frame, controls, uniform_weights, mode, noise_w, measurements, sensor_z, sensor_mode, sensor_log_f,
threshold,
          keep_z, keep_frame, keep_evidence, keep_nis, keep_decision):  # fmt: skip
    """`run_4` for d = 2, where angles add: noise_w is the small moment of the process noise, mode its mode."""
    steps = measurements.shape[0]
    z1, c, s = z[0], frame[1, 0], frame[1, 1]
    for t in range(steps):
        log_f, w, _ = derivatives_2(z1)
        if controls.shape[0] > 0:
            u, v = controls[t, 0], controls[t, 1]
            c, s = c * u - s * v, s * u + c * v
        if uniform_weights.size == 0:
            c, s = c * mode[0] - s * mode[1], s * mode[0] + c * mode[1]
            z1, log_f, _ = concentrations_2(w + noise_w - 2.0 * w * noise_w)
        elif uniform_weights[t] > 0.0:
            z1, log_f, _ = concentrations_2(w + uniform_weights[t] * (0.5 - w))
        n = 1.0 / math.hypot(c, s)
        c, s = c * n, s * n
        row = t if keep_z.shape[0] == steps else 0
        x, y = measurements[t, 0], measurements[t, 1]
        if math.isnan(x + y):
            evidence, nis, decision = 0.0, math.nan, MISSING
        else:
            # x ⊕ v = measurement: the likelihood's mode is the measurement rotated back by the noise's mode.
            a, b = x * sensor_mode[0] + y * sensor_mode[1], y * sensor_mode[0] - x * sensor_mode[1]
            p1, pc, ps, top = update_2(z1, c, s, sensor_z, a, b)
            nis = -2.0 * top
            log_posterior, _, _ = derivatives_2(p1)
            evidence = log_posterior + top - log_f - sensor_log_f
            decision = ACCEPTED
            if nis > threshold:
                decision = REJECTED
            else:
                z1, c, s = p1, pc, ps
        keep_z[row, 0] = z1
        keep_z[row, 1] = 0.0
        keep_frame[row, 0, 0], keep_frame[row, 0, 1] = -s, c
        keep_frame[row, 1, 0], keep_frame[row, 1, 1] = c, s
        keep_evidence[row] = evidence
        keep_nis[row] = nis
        keep_decision[row] = decision
    z[0], z[1] = z1, 0.0
    frame[0, 0], frame[0, 1], frame[1, 0], frame[1, 1] = -s, c, c, s


@compiled()
def run_many_2(z, frame, controls, uniform_weights, mode, noise_w, measurements, sensor_z, sensor_mode, sensor_log_f,
threshold,
               keep_z, keep_frame, keep_evidence, keep_nis, keep_decision):  # fmt: skip
    """`run_2` for independent filters: a leading batch axis on every array but the noises and uniform_weights."""
    for i in range(z.shape[0]):
        run_2(z[i], frame[i], controls[i], uniform_weights, mode, noise_w, measurements[i], sensor_z, sensor_mode,
        sensor_log_f,
              threshold, keep_z[i], keep_frame[i], keep_evidence[i], keep_nis[i], keep_decision[i])  # fmt: skip
