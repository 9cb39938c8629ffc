"""The 8-node rule and its inverse in NumPy, for single calls that would not repay loading a compiler.

F(z) = ∫_{S^{d−1}} exp(Σ zᵢ xᵢ²) dx = 2 π^{d/2} L⁻¹{∏ᵢ (s − zᵢ)^{−1/2}}(1), so

    F = 2 π^{d/2} Σₖ Im[cₖ ∏ᵢ (sₖ − zᵢ)^{−1/2}],    max z = 0.

The nodes sₖ are the poles of the near-best (Carathéodory–Fejér) 16-pole rational approximation of eˢ on (−∞, 0]
(Trefethen, Weideman & Schmelzer 2006), shifted by ½; the weights were then fitted in high precision to F over a
family of spectra. ``tests/reference/derive_rule.py`` derives both and measures their error: for d ≤ 4 below 3e-13 in F
and 5e-13 in the moments, half of it rounding. ∂/∂zᵢ multiplies a term by ½/(sₖ−zᵢ); second derivatives by
¼/((sₖ−zᵢ)(sₖ−zⱼ)) and ¾/(sₖ−zᵢ)².
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

__all__ = ["CI", "CR", "LARGEST", "LOG_FRONT", "MAX_EVALUATIONS", "RULE_DIMENSION", "SI", "SR", "TOLERANCE",
           "diagonalize_one", "log_normalizer_few", "moments_few", "newton_one"]  # fmt: skip

FloatArray = NDArray[np.float64]

# Largest |z|: products of eight factors stay within the range of a double.
LARGEST = 1e30
# Largest dimension the rule serves; beyond it the parabola of `kernels.contour` takes over, slower and exact to 1e-13.
RULE_DIMENSION = 4

SR = np.array([6.916177699099483, 6.448152268951234, 5.493174737718069, 4.009103608415018,
               1.9193758971858133, -0.913928462488652, -4.764971343442207, -10.343917078695654])  # fmt: skip
SI = np.array([1.1941223933701346, 3.58745736201831, 5.996881713603921, 8.436198985884344,
               10.92536348449668, 13.497725698892689, 16.22022147316785, 19.27744616718121])  # fmt: skip
CR = np.array([-740.5871543094853, 336.1650904675204, -36.899671633796615, -18.964928452773304,
               5.8320508784218745, -0.5191317497809719, 0.014473454252311242, -7.986412852745128e-05])  # fmt: skip
CI = np.array([212.68793914292942, -373.9225707971421, 206.15080690186446, -49.65811712485637,
               4.877909103488713, -0.1352714380547741, -0.0006974667025341759, 1.6784694558666345e-06])  # fmt: skip
NODES, WEIGHTS = SR + 1j * SI, CR + 1j * CI
# log(2 π^{d/2}) for d = 2, 3, 4.
LOG_FRONT = np.array([math.log(2.0 * math.pi ** (0.5 * d)) for d in (2, 3, 4)])

# Newton takes three evaluations in practice; more than this many: ω is no moment of a Bingham distribution.
MAX_EVALUATIONS = 20
# It converges quadratically: a residual below this leaves an error at rounding level after the last correction.
TOLERANCE = 1e-6
# Squares of relative sizes below which an off-diagonal entry no longer moves an eigenvalue (or vector) in a double.
NEGLIGIBLE, NEGLIGIBLE_GAP = (1e-16) ** 2, (1e-17) ** 2


def log_normalizer_few(z: FloatArray) -> FloatArray:
    """Return log F (...) for z (..., d), d ≤ 4, any order and offset."""
    top = z.max(axis=-1, keepdims=True)
    factors = np.sqrt(NODES - (z - top)[..., None])
    f = (WEIGHTS / factors.prod(axis=-2)).imag.sum(axis=-1)
    return np.log(f) + (LOG_FRONT[z.shape[-1] - 2] + top[..., 0])


def moments_few(z: FloatArray) -> FloatArray:
    """Return ω (..., d) = ∇ log F for z (..., d), d ≤ 4, any order and offset."""
    inverse = 1.0 / (NODES - (z - z.max(axis=-1, keepdims=True))[..., None])
    terms = WEIGHTS * np.sqrt(inverse).prod(axis=-2)
    w = (terms[..., None, :] * inverse).imag.sum(axis=-1)
    return w / w.sum(axis=-1, keepdims=True)


def newton_one(w: FloatArray) -> tuple[FloatArray, float, int]:
    """Return (z (d,), log F, evaluations) with ∇ log F(z) = w for w (d,) ascending, d ≤ 4, as `kernels.newton` does."""
    s2, s3 = (w * w).sum(), (w * w * w).sum()
    v = w / (1.0 + 2.0 * (w * (s3 / (s2 * s2)) - w * w / s2))
    v /= v.sum()
    z = v
    for evaluation in range(1, MAX_EVALUATIONS + 1):
        z = 0.5 / v[-1] - 0.5 / v
        inverse = 1.0 / (NODES[:, None] - z)
        terms = WEIGHTS * np.sqrt(inverse).prod(axis=1)
        f = float(terms.imag.sum())
        first = terms[:, None] * inverse
        gradient = first.imag.sum(axis=0)
        gradient /= gradient.sum()
        hessian = (first.T @ inverse).imag * (0.25 / f)
        hessian.ravel()[:: w.size + 1] *= 3.0
        hessian -= gradient[:, None] * gradient
        residual = (w - gradient)[:-1]
        scale = 1.0 / np.sqrt(hessian.diagonal()[:-1])
        step = scale * np.linalg.solve(hessian[:-1, :-1] * (scale[:, None] * scale), scale * residual)
        if (np.abs(residual) <= TOLERANCE * w[:-1]).all():
            z[:-1] += step
            log_f = math.log(f) + LOG_FRONT[w.size - 2] + float((gradient[:-1] + 0.5 * residual) @ step)
            # Rounding must not leave equal entries in the wrong order.
            return np.minimum.accumulate(z[::-1])[::-1].copy(), log_f, evaluation
        step *= 2.0 * v[:-1] ** 2
        v[:-1] = np.where(step > -0.9 * v[:-1], v[:-1] + step, 0.1 * v[:-1])
    return z, math.nan, -MAX_EVALUATIONS


def diagonalize_one(a: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return ascending eigenvalues (d,) and eigenvectors (d, d; columns) of a symmetric a (d, d).

    LAPACK gives a good frame cheaply; Jacobi's method in that frame restores the relative accuracy of small eigenvalues
    (see `kernels.linalg`).
    """
    frame = np.linalg.eigh(a)[1]
    b = frame.T @ a @ frame
    identity = np.eye(len(b))
    values = b.diagonal()
    with np.errstate(divide="ignore", invalid="ignore"):  # equal eigenvalues are left to the rotations
        mixing = b / (values - values[:, None] + identity) - identity * values
    # What remains off the diagonal after one step of perturbation theory.
    rest = float(np.abs(mixing).max()) ** 2 * float(np.abs(values).max())
    if rest * rest <= NEGLIGIBLE * float(np.abs(values).min()) ** 2:
        values, frame = values + (b * mixing).sum(axis=0), frame @ (identity + mixing)
    else:
        values, frame = _rotate_away(b, frame)
    order = np.argsort(values, kind="stable")
    frame = frame[:, order]
    return values[order], frame @ (1.5 * identity - 0.5 * (frame.T @ frame))


def _rotate_away(b: FloatArray, frame: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Diagonalise b by Jacobi's method, in place; return its diagonal and the frame, both in any order."""
    d = len(b)
    for _ in range(30):
        quiet = True
        for p in range(d - 1):
            for q in range(p + 1, d):
                x, gap = float(b[p, q]), float(b[q, q] - b[p, p])
                if x * x <= NEGLIGIBLE * abs(float(b[p, p] * b[q, q])) or x * x <= NEGLIGIBLE_GAP * gap * gap:
                    continue
                quiet = False
                ratio = 0.5 * gap / x
                t = math.copysign(1.0, ratio) / (abs(ratio) + math.hypot(ratio, 1.0))
                c = 1.0 / math.hypot(t, 1.0)
                pair, rotation = [p, q], np.array([[c, t * c], [-t * c, c]])
                b[:, pair] = b[:, pair] @ rotation
                b[pair] = rotation.T @ b[pair]
                b[p, q] = b[q, p] = 0.0
                frame[:, pair] = frame[:, pair] @ rotation
        if quiet:
            break
    return b.diagonal(), frame
