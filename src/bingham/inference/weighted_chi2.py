"""Tail of a weighted sum of χ² variables, the limit of statistics like Giné's."""

from __future__ import annotations

import math
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.special import comb, eval_gegenbauer, eval_legendre

__all__ = ["sine_kernel_weights", "weighted_chi2_pvalue"]

FloatArray = NDArray[np.float64]

# Harmonics kept; what is left out is replaced by its mean.
DEGREES = 40


@cache
def sine_kernel_weights(d: int, c: float) -> tuple[tuple[float, ...], tuple[int, ...], float]:
    """Return weights λₖ, multiplicities mₖ and the mean of the rest of the limit Σ λₖ χ²(mₖ) of Giné's G.

    G = n⁻¹ Σᵢⱼ h(θᵢⱼ) with h = ¼ c (E sin − sin θ), c as in `gine_statistic`; only even harmonics of degree 2, 4, …
    have weight, and λₖ is the kernel's eigenvalue there, an average over the sphere by the Funk–Hecke theorem.
    """
    nodes, gauss = np.polynomial.legendre.leggauss(400)
    angle = 0.5 * np.pi * (nodes + 1.0)
    mass = gauss * np.sin(angle) ** (d - 2)
    mass /= mass.sum()
    weights, counts = [], []
    for degree in range(2, 2 * DEGREES + 1, 2):
        if d == 2:
            zonal, count = np.cos(degree * angle), 2
        elif d == 3:
            zonal, count = eval_legendre(degree, np.cos(angle)), 2 * degree + 1
        else:
            alpha = 0.5 * d - 1.0
            zonal = eval_gegenbauer(degree, alpha, np.cos(angle)) / eval_gegenbauer(degree, alpha, 1.0)
            count = int(comb(degree + d - 1, d - 1, exact=True)) - int(comb(degree + d - 3, d - 1, exact=True))
        weights.append(-0.5 * c * float(mass @ (np.sin(angle) * zonal)))
        counts.append(count)
    # E[G] = 1/2 exactly: n/2 of the sum is what the mean sine leaves of the diagonal.
    rest = 0.5 - sum(w * m for w, m in zip(weights, counts, strict=True))
    return tuple(weights), tuple(counts), rest


def weighted_chi2_pvalue(
    statistic: ArrayLike, weights: tuple[float, ...], counts: tuple[int, ...], rest: float = 0.0
) -> Any:
    """Return P(Σ λₖ χ²(mₖ) + rest ≥ statistic), from the characteristic function (Imhof 1961).

    The integral is a midpoint sum (Davies 1973): with step Δ its error is the probability beyond 2π/Δ, nil here.
    """
    w, m = np.array(weights), np.array(counts, dtype=np.float64)
    values = np.asarray(statistic, dtype=np.float64) - rest
    mean, deviation = float(m @ w), math.sqrt(2.0 * float(m @ w**2))
    reach = float(np.max(np.abs(values), initial=0.0)) + mean + 60.0 * max(deviation, float(w.max()))
    step = 2.0 * np.pi / reach
    # Up to where the modulus of the characteristic function is below rounding.
    end = step
    while float(m @ np.log1p((w * end) ** 2)) < 4.0 * 36.0:
        end *= 1.3
    u = step * (np.arange(int(end / step) + 1) + 0.5)
    angle, log_modulus = np.zeros_like(u), np.zeros_like(u)
    for weight, count in zip(w, m, strict=True):
        angle += 0.5 * count * np.arctan(weight * u)
        log_modulus -= 0.25 * count * np.log1p((weight * u) ** 2)
    factor = np.exp(log_modulus) / (u / step)
    flat = values.ravel()
    tail = np.empty_like(flat)
    for k, value in enumerate(flat):
        tail[k] = 0.5 + float(np.sin(angle - 0.5 * value * u) @ factor) / np.pi
    return np.clip(tail, 0.0, 1.0).reshape(values.shape)[()]
