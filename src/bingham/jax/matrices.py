"""log F(A), E[xxᵀ] and log-likelihoods from symmetric matrices, differentiable twice without eigenvector derivatives.

See `bingham.torch.matrices`: d log F = ⟨E[xxᵀ], dA⟩, and the derivative of E[xxᵀ] off the diagonal of the eigenframe is
a fourth moment, so that repeated eigenvalues are nothing special.
"""

from __future__ import annotations

from typing import Any

import jax
import jax.numpy as jnp

from bingham.errors import InvalidArgumentError
from bingham.jax.normalizer import derivatives, in_double

__all__ = ["eigenframe", "matrix_log_normalizer", "matrix_moment", "negative_log_likelihood"]

# Cyclic Jacobi on 4×4 matrices has converged to rounding after six sweeps, mostly after five.
SWEEPS = 7


def matrix_log_normalizer(A: Any) -> Any:
    """Return log F(A) (...), F(A) = ∫ exp(xᵀAx) dx over S^{d−1}, of the symmetric part of A (..., d, d).

    Its gradient by A is `matrix_moment`; A + c I adds c. Entries that are not finite give NaN.
    """
    return _first(_checked(A))[0]


def matrix_moment(A: Any) -> Any:
    """Return E[xxᵀ] (..., d, d) for x with density exp(xᵀAx)/F(A), A (..., d, d); trace 1."""
    return _first(_checked(A))[1]


def negative_log_likelihood(A: Any, x: Any) -> Any:
    """Return −log f(x) = log F(A) − uᵀAu (...), u = x/|x|, the symmetric part of A counting.

    Parameters
    ----------
    A : (..., d, d) array
        A + c I gives the same; computed in double precision, so that float32 does not lose digits to a large c.
    x : (..., d) array
        Unit vectors or unit quaternions (w, x, y, z), broadcast against the batch of A.

    Returns
    -------
    (...) array
        In nats relative to surface area, in the precision of A (half precision gives float32).

    Examples
    --------
    >>> import jax.numpy as jnp
    >>> negative_log_likelihood(jnp.zeros((4, 4)), jnp.array([1.0, 0.0, 0.0, 0.0]))  # log 2π²
    Array(2.9826..., dtype=float32)
    """
    a, x = _checked(A), jnp.asarray(x)
    if x.ndim == 0 or x.shape[-1] != a.shape[-1]:
        raise InvalidArgumentError("x", f"an array (..., {a.shape[-1]})", x.shape)
    return _likelihood(a, x)[0]


def _checked(a: Any) -> Any:
    a = jnp.asarray(a)
    if a.ndim < 2 or a.shape[-1] != a.shape[-2] or a.shape[-1] < 2:
        raise InvalidArgumentError("A", "an array (..., d, d) with d >= 2", a.shape)
    return a if jnp.issubdtype(a.dtype, jnp.floating) else a.astype(float)


@jax.custom_jvp
def _first(a: Any) -> Any:
    return in_double(_values)(a)


@_first.defjvp
def _(primals: Any, tangents: Any) -> Any:
    (a,), (da,) = primals, tangents
    log_f, s = _first(a)
    return (log_f, s), ((s * da).sum((-2, -1)), _curvature(a, da))


@jax.custom_jvp
def _likelihood(a: Any, x: Any) -> Any:
    """Return log F(A) − uᵀAu and its gradients E[yyᵀ] − uuᵀ by A and −2 (A − uᵀAu) u/|x| by x."""

    def values(a: Any, x: Any) -> Any:
        log_f, s = _values(a)
        length = jnp.sqrt((x * x).sum(-1, keepdims=True))
        u = x / length
        image = (0.5 * (a + jnp.swapaxes(a, -1, -2)) * u[..., None, :]).sum(-1)
        form = (image * u).sum(-1)
        by_x = -2.0 * (image - form[..., None] * u) / length
        return log_f - form, s - u[..., :, None] * u[..., None, :], by_x

    return in_double(values)(a, x)


@_likelihood.defjvp
def _(primals: Any, tangents: Any) -> Any:
    (a, x), (da, dx) = primals, tangents
    value, by_a, by_x = _likelihood(a, x)
    change = (by_a * da).sum((-2, -1)) + (by_x * dx).sum(-1)

    def second(a: Any, x: Any, da: Any, dx: Any) -> Any:
        def parts(a: Any, x: Any) -> Any:
            u = x / jnp.sqrt((x * x).sum(-1, keepdims=True))
            image = (0.5 * (a + jnp.swapaxes(a, -1, -2)) * u[..., None, :]).sum(-1)
            tangent = image - (image * u).sum(-1, keepdims=True) * u
            return u[..., :, None] * u[..., None, :], -2.0 * tangent / jnp.sqrt((x * x).sum(-1, keepdims=True))

        _, (outer, pulled) = jax.jvp(parts, (a, x), (da, dx))
        return -outer, pulled

    outer, pulled = in_double(second)(a, x, da, dx)
    return (value, by_a, by_x), (change, _curvature(a, da) + outer, pulled)


def _values(a: Any) -> Any:
    values, frames = eigenframe(a)
    log_f, w = derivatives(values, 1)
    return log_f, (w[..., :, None, None] * frames[..., :, :, None] * frames[..., :, None, :]).sum(-3)


def _curvature(a: Any, v: Any) -> Any:
    """Return the derivative of E[yyᵀ] along V; see `kernels.frames.curvature_rows`."""

    def compute(a: Any, v: Any) -> Any:
        values, frames = eigenframe(a)
        _, w, hessian = derivatives(values, 2)
        inner = frames @ (0.5 * (v + jnp.swapaxes(v, -1, -2))) @ jnp.swapaxes(frames, -1, -2)
        on = (hessian * jnp.diagonal(inner, axis1=-2, axis2=-1)[..., None, :]).sum(-1)
        eye = jnp.eye(a.shape[-1])
        off = 2.0 * inner * (hessian + w[..., :, None] * w[..., None, :]) * (1.0 - eye)
        return jnp.swapaxes(frames, -1, -2) @ (off + on[..., None] * eye) @ frames

    return in_double(compute)(a, v)


def eigenframe(a: Any) -> Any:
    """Return eigenvalues (..., d), in no order, and eigenvectors by rows (..., d, d) of the symmetric part of a."""
    d = a.shape[-1]
    if d != 4:
        values, columns = jnp.linalg.eigh(0.5 * (a + jnp.swapaxes(a, -1, -2)))
        return values, jnp.swapaxes(columns, -1, -2)
    return _jacobi_4(a)


def _jacobi_4(a: Any) -> Any:
    """Cyclic Jacobi, elementwise over the batch: LAPACK's solver takes a 4×4 matrix at a time, at ten times the cost."""
    a = jax.lax.stop_gradient(a)
    one, zero = jnp.ones_like(a[..., 0, 0]), jnp.zeros_like(a[..., 0, 0])
    b = [0.5 * (a[..., i, j] + a[..., j, i]) for i, j in PLACES]
    f = [one if i == j else zero for i in range(4) for j in range(4)]

    def sweep(_: Any, state: Any) -> Any:
        b, f = dict(zip(PLACES, state[:10], strict=True)), state[10:]
        for p, q in ((0, 1), (2, 3), (0, 2), (1, 3), (0, 3), (1, 2)):
            x, gap = b[p, q], b[q, q] - b[p, p]
            root = jnp.sqrt(gap * gap + 4.0 * x * x)
            h = gap + jnp.where(gap < 0.0, -root, root)
            h = jnp.where(h == 0.0, 1.0, h)
            n = 1.0 / jnp.sqrt(h * h + 4.0 * x * x)
            c, s, t = BARRIER((jnp.abs(h) * n, jnp.where(h < 0.0, -2.0 * n, 2.0 * n) * x, 2.0 * x * x / h))
            b[p, p], b[q, q], b[p, q] = b[p, p] - t, b[q, q] + t, zero
            for r in range(4):
                if r not in (p, q):
                    i, j = (min(p, r), max(p, r)), (min(q, r), max(q, r))
                    b[i], b[j] = c * b[i] - s * b[j], s * b[i] + c * b[j]
                i, j = 4 * p + r, 4 * q + r
                f[i], f[j] = c * f[i] - s * f[j], s * f[i] + c * f[j]
            b = BARRIER(b)
        return [*(b[k] for k in PLACES), *f]

    state = jax.lax.fori_loop(0, SWEEPS, sweep, [*b, *f])
    values = jnp.stack([state[PLACES.index((i, i))] for i in range(4)], -1)
    return values, jnp.stack(state[10:], -1).reshape(a.shape)


PLACES = [(i, j) for i in range(4) for j in range(i, 4)]
import os
BARRIER = (lambda x: x) if os.environ.get('NOBAR') else jax.lax.optimization_barrier
