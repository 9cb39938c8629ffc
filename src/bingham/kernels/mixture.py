"""Densities of a Bingham mixture and one expectation step, over many rows, without an array of responsibilities.

A component k is a frame by rows with concentrations z (K, d), and an offset log αₖ − log Fₖ. Only squares of
projections on the rows occur, so the sign of a sample changes no bit of a result. Sums run over chunks of fixed size in
a fixed order, so the number of threads changes none either.
"""

from __future__ import annotations

import math

import numpy as np
from numba import prange

from bingham.kernels.compile import compiled

__all__ = ["CHUNK", "expectation", "expectation_rows", "log_joint"]

# Rows a chunk: large enough to hide the scheduling of a thread, small enough to balance two of them.
CHUNK = 4096
# Responsibilities below e^{-45} = 3e-20 do not change a sum in double precision.
NEGLIGIBLE = -45.0


@compiled(fast=True)
def log_joint(x, frames, z, offsets, out):
    """Write out[n, k] = offsets[k] + Σ_j z[k, j] (frames[k, j]·x[n])² for x (n, d)."""
    n, d = x.shape
    for i in range(n):
        for k in range(z.shape[0]):
            q = offsets[k]
            for j in range(d):
                s = 0.0
                for m in range(d):
                    s += frames[k, j, m] * x[i, m]
                q += z[k, j] * s * s
            out[i, k] = q


@compiled(fast=True)
def expectation_rows(x, weights, frames, z, offsets, background, masses, moments):
    """Add one chunk to masses (K,) and moments (K, d, d); see `expectation`."""
    n, d = x.shape
    size = z.shape[0]
    t, r = np.empty((size, d)), np.empty(size)
    value = 0.0
    for i in range(n):
        top = background
        for k in range(size):
            q = offsets[k]
            for j in range(d):
                s = 0.0
                for m in range(d):
                    s += frames[k, j, m] * x[i, m]
                t[k, j] = s
                q += z[k, j] * s * s
            r[k] = q
            top = max(top, q)
        total = math.exp(background - top)
        for k in range(size):
            q = r[k] - top
            r[k] = math.exp(q) if q > NEGLIGIBLE else 0.0
            total += r[k]
        w = weights[i]
        value += w * (top + math.log(total))
        for k in range(size):
            if r[k] > 0.0:
                s = w * r[k] / total
                masses[k] += s
                for a in range(d):
                    u = s * t[k, a]
                    for b in range(a, d):
                        moments[k, a, b] += u * t[k, b]
    return value


@compiled(parallel=True, fast=True)
def expectation(x, weights, frames, z, offsets, background, masses, moments):
    """One E step: return Σₙ wₙ log f(xₙ), f(x) = e^{background} + Σₖ exp(offsetsₖ + Σ_j z[k, j] (frames[k, j]·x)²).

    With responsibilities r and t = frames[k] x, added to are masses (K,) with Σₙ wₙ rₙₖ and moments (K, d, d) with
    Σₙ wₙ rₙₖ t tᵀ, upper triangles: the moment in the frame of its component, where small eigenvalues keep their
    accuracy. x (n, d), weights (n,), background = log(weight / area), −inf for none.
    """
    n, d = x.shape
    size = z.shape[0]
    chunks = (n + CHUNK - 1) // CHUNK
    part_value = np.zeros(chunks)
    part_mass = np.zeros((chunks, size))
    part_moment = np.zeros((chunks, size, d, d))
    for c in prange(chunks):
        i, j = c * CHUNK, min(n, (c + 1) * CHUNK)
        part_value[c] = expectation_rows(
            x[i:j], weights[i:j], frames, z, offsets, background, part_mass[c], part_moment[c]
        )
    value = 0.0
    for c in range(chunks):
        value += part_value[c]
        masses += part_mass[c]
        moments += part_moment[c]
    return value
