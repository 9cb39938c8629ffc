"""Fixed-interval smoothing of the inertial filter: Rauch, Tung & Striebel's recursion on its error coordinates."""

from __future__ import annotations

import math

import numpy as np

from bingham.kernels.compile import compiled
from bingham.kernels.imu_reported import JUDGED_TIME
from bingham.kernels.imu_state import covariance_step, transition_rows
from bingham.kernels.quaternion import from_rotation_vector, product

__all__ = ["smooth"]

# Share of the smoother's gain in variance that is not claimed: an error that lasts for seconds is in the samples before
# and after alike.
SHARED = 0.1
# Such an error is no larger than a few of the smoother's own; the filter's ignorance at the start is not one.
SHARED_LIMIT = 10.0

# Error of the linear recursion, in squares of the tilt (rad) that it corrects: half the second-order term.
BENDING = 0.25


@compiled()
def _solve(a, b):
    """Replace b (12, n) by a⁻¹ b for a positive definite a (12, 12), which is overwritten by its Cholesky factor."""
    n = b.shape[1]
    size = a.shape[0]
    for j in range(size):
        for k in range(j):
            f = a[j, k]
            for i in range(j, size):
                a[i, j] -= a[i, k] * f
        root = 1.0 / math.sqrt(a[j, j])
        for i in range(j, size):
            a[i, j] *= root
    for i in range(size):
        for k in range(i):
            f = a[i, k]
            for c in range(n):
                b[i, c] -= f * b[k, c]
        f = 1.0 / a[i, i]
        for c in range(n):
            b[i, c] *= f
    for i in range(size - 1, -1, -1):
        for k in range(i + 1, size):
            f = a[k, i]
            for c in range(n):
                b[i, c] -= f * b[k, c]
        f = 1.0 / a[i, i]
        for c in range(n):
            b[i, c] *= f


@compiled()
def smooth(indices, time, filtered, transitions, corrections, factors, readout, modes, covariances, bias, bias_std):
    """Condition every state on the whole recording, in place.

    indices (E,) into time (N,), filtered (E, 12, 12), transitions (E, 26), corrections (E, 12), factors (E, 2) and
    readout (N, 3, 3) as `imu.run` leaves them; `filtered` is overwritten by the smoothed covariances, `corrections` by
    the smoothed errors of the filtered states. modes (N, 4), covariances (N, 3, 3), bias and bias_std (N, 3) are the
    filter's and become the smoother's.

    P_s = P + G (P_s⁺ − P⁻) Gᵀ, e_s = G (e_s⁺ + correction), G = P Fᵀ (P⁻)⁻¹ (Rauch, Tung & Striebel 1965). Across a
    restart of the filter nothing is handed back. Variances are reported as the filter's: by `factors` (E, 2), averaged
    backwards as they were forwards, plus `readout` (N, 3, 3).
    """
    count = indices.size
    size = corrections.shape[1]
    predicted = np.empty((12, 12))
    factor = np.empty((12, 12))
    work = np.empty((12, 12))
    gain = np.empty((12, 12))  # Gᵀ
    online = filtered[:, :3, :3].copy()
    root = np.empty(3)
    before = np.zeros((count, 12))  # smoothed error relative to the state just before each update
    for e in range(count - 1, -1, -1):
        if e == count - 1:
            for i in range(size):
                before[e, i] = corrections[e, i]
                corrections[e, i] = 0.0
            continue
        step = transitions[e + 1]
        turn = step[0:9].reshape(3, 3)
        coupling = step[9:18].reshape(3, 3)
        p = filtered[e]
        if step[23] > 0.0:
            for i in range(size):
                before[e, i] = corrections[e, i]
                corrections[e, i] = 0.0
            continue
        transition_rows(p, gain, turn, coupling, step[22])
        predicted[:, :] = p
        for i in range(3):
            predicted[i, i] += step[24]
            predicted[3 + i, 3 + i] += step[25]
        covariance_step(predicted, turn, coupling, step[22], step[18:22], work)
        factor[:, :] = predicted
        _solve(factor, gain)
        later = filtered[e + 1]
        for i in range(size):
            for j in range(size):
                predicted[i, j] = later[i, j] - predicted[i, j]
        # work = difference · Gᵀ, then p += G · work.
        for i in range(size):
            for j in range(size):
                work[i, j] = 0.0
            for k in range(size):
                f = predicted[i, k]
                for j in range(size):
                    work[i, j] += f * gain[k, j]
        for k in range(size):
            for i in range(size):
                f = gain[k, i]
                for j in range(size):
                    p[i, j] += f * work[k, j]
        for i in range(size):
            total = 0.0
            for k in range(size):
                total += gain[k, i] * before[e + 1, k]
            before[e, i] = total + corrections[e, i]
            corrections[e, i] = total
    for e in range(count - 2, -1, -1):
        share = min(1.0, (time[indices[e + 1]] - time[indices[e]]) / JUDGED_TIME)
        for i in range(2):
            factors[e, i] = factors[e + 1, i] + share * (factors[e, i] - factors[e + 1, i])
    e = -1
    for t in range(modes.shape[0]):
        while e + 1 < count and indices[e + 1] <= t:
            e += 1
        if e + 1 == count:
            share = 0.0
        elif e < 0:
            share = 1.0
        else:
            share = (t - indices[e] + 1.0) / (indices[e + 1] - indices[e])
        left = corrections[max(e, 0)]
        right = before[min(e + 1, count - 1)]
        nearest = max(e, 0)
        tilt_x, tilt_y = left[0] + share * (right[0] - left[0]), left[1] + share * (right[1] - left[1])
        a, b, c, d = from_rotation_vector(tilt_x, tilt_y, left[2] + share * (right[2] - left[2]))
        bent = BENDING * (tilt_x * tilt_x + tilt_y * tilt_y)
        modes[t, 0], modes[t, 1], modes[t, 2], modes[t, 3] = product(
            a, b, c, d, modes[t, 0], modes[t, 1], modes[t, 2], modes[t, 3]
        )
        for i in range(3):
            bias[t, i] += left[6 + i] + share * (right[6 + i] - left[6 + i])
            bias_std[t, i] = math.sqrt(filtered[nearest, 6 + i, 6 + i])
            gained = online[nearest, i, i] - filtered[nearest, i, i]
            most = SHARED_LIMIT * filtered[nearest, i, i]
            root[i] = math.sqrt(SHARED * (most / gained if gained > most else 1.0))
        for i in range(3):
            for j in range(3):
                scale = factors[nearest, 0 if i < 2 else 1] * factors[nearest, 0 if j < 2 else 1]
                gained = online[nearest, i, j] - filtered[nearest, i, j]
                claimed = filtered[nearest, i, j] + root[i] * root[j] * gained
                covariances[t, i, j] = math.sqrt(scale) * claimed + readout[t, i, j]
            covariances[t, i, i] += bent * bent
