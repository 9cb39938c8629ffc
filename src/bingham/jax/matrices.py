"""log F(A), E[xxᵀ] and log-likelihoods from symmetric matrices, differentiable twice without eigenvector derivatives.

See `bingham.torch.matrices`: d log F = ⟨E[xxᵀ], dA⟩, and the derivative of E[xxᵀ] off the diagonal of the eigenframe is
a fourth moment, so that repeated eigenvalues are nothing special.
"""

from __future__ import annotations

from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from bingham.errors import InvalidArgumentError
from bingham.jax import on_cpu
from bingham.jax.normalizer import derivatives, in_double

__all__ = ["eigenframe", "logpdf", "matrix_log_normalizer", "matrix_moment", "negative_log_likelihood", "pdf"]

# As in `kernels.eigen_lanes`: squares of what one more sweep removes, by its quadratic convergence.
MAX_SWEEPS, QUADRATIC, NEGLIGIBLE = 30, 1e-9**2, 1e-17**2


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
    >>> round(float(negative_log_likelihood(jnp.zeros((4, 4)), jnp.array([1.0, 0.0, 0.0, 0.0]))), 4)  # log 2π²
    2.9826
    """
    a, x = _checked(A), jnp.asarray(x)
    if x.ndim == 0 or x.shape[-1] != a.shape[-1]:
        raise InvalidArgumentError("x", f"an array (..., {a.shape[-1]})", x.shape)
    return _likelihood(a, x)[0]


def logpdf(matrix: Any, x: Any) -> Any:
    """Return log f(x) (...) of the distribution with this constant matrix (..., d, d), an array of NumPy."""
    matrix = np.asarray(matrix)
    matrix = matrix - np.linalg.eigvalsh(matrix)[..., -1:, None] * np.eye(matrix.shape[-1])
    return -negative_log_likelihood(jnp.asarray(matrix, dtype=jnp.result_type(x, jnp.float32)), x)


def pdf(matrix: Any, x: Any) -> Any:
    """Return f(x) (...); see `logpdf`."""
    return jnp.exp(logpdf(matrix, x))


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
    """Return log F(A) and E[yyᵀ] in double precision: on the CPU by the compiled kernels, elsewhere in XLA."""
    if a.shape[-1] != 4 or not on_cpu.registered():
        return _values_in_xla(a)
    return jax.lax.platform_dependent(a, cpu=on_cpu.moment, default=_values_in_xla)


def _values_in_xla(a: Any) -> Any:
    values, frames = eigenframe(a)
    log_f, w = derivatives(jnp.moveaxis(values, 0, -1), 1)
    moment = sum(w[..., k] * frames[k][:, None] * frames[k][None, :] for k in range(len(values)))
    return log_f, jnp.moveaxis(moment, (0, 1), (-2, -1))


def _curvature(a: Any, v: Any) -> Any:
    """Return the derivative of E[yyᵀ] along V; see `kernels.frames.curvature_rows`."""

    def compute(a: Any, v: Any) -> Any:
        values, frames = eigenframe(a)
        _, w, hessian = derivatives(jnp.moveaxis(values, 0, -1), 2)
        frames = jnp.moveaxis(frames, (0, 1), (-2, -1))
        inner = frames @ (0.5 * (v + jnp.swapaxes(v, -1, -2))) @ jnp.swapaxes(frames, -1, -2)
        on = (hessian * jnp.diagonal(inner, axis1=-2, axis2=-1)[..., None, :]).sum(-1)
        eye = jnp.eye(a.shape[-1])
        off = 2.0 * inner * (hessian + w[..., :, None] * w[..., None, :]) * (1.0 - eye)
        return jnp.swapaxes(frames, -1, -2) @ (off + on[..., None] * eye) @ frames

    return in_double(compute)(a, v)


def eigenframe(a: Any) -> Any:
    """Return eigenvalues (d, ...), in no order, and eigenvectors by rows (d, d, ...) of symmetric parts (..., d, d)."""
    a = jax.lax.stop_gradient(0.5 * (a + jnp.swapaxes(a, -1, -2)))
    if a.shape[-1] == 4:
        return _jacobi_4(jnp.moveaxis(a, (-2, -1), (0, 1)))
    values, columns = jnp.linalg.eigh(a)
    return jnp.moveaxis(values, -1, 0), jnp.moveaxis(columns, (-1, -2), (0, 1))


def _jacobi_4(b: Any) -> Any:
    """Jacobi's method for b (4, 4, ...), elementwise over the batch, two disjoint rotations a round.

    Three rounds meet every pair of axes once: the first axis stays, the others move up one place after each round.
    """

    def turn(c: Any, s: Any, rows: Any) -> Any:
        """Rotate rows (4, ...) in pairs (0, 1), (2, 3) and move the last three up."""
        r0, r1 = c[0] * rows[0] - s[0] * rows[1], s[0] * rows[0] + c[0] * rows[1]
        r2, r3 = c[1] * rows[2] - s[1] * rows[3], s[1] * rows[2] + c[1] * rows[3]
        return jnp.stack([r0, r2, r3, r1])

    def round_of_two(_: Any, state: Any) -> Any:
        b, f, busy = state
        x = jnp.stack([b[0, 1], b[2, 3]])
        gap = jnp.stack([b[1, 1] - b[0, 0], b[3, 3] - b[2, 2]])
        xx = x * x
        root = jnp.sqrt(gap * gap + 4.0 * xx)
        h = gap + jnp.where(gap < 0.0, -root, root)
        h = jnp.where(h == 0.0, 1.0, h)
        n = 1.0 / jnp.sqrt(h * h + 4.0 * xx)
        c, s = jax.lax.optimization_barrier((jnp.abs(h) * n, jnp.where(h < 0.0, -2.0 * n, 2.0 * n) * x))
        busy = busy | jnp.any((xx > QUADRATIC * gap * gap) & (xx > NEGLIGIBLE * size))
        b = turn(c, s, turn(c, s, b).swapaxes(0, 1))
        return b, turn(c, s, f), busy

    def sweep(state: Any) -> Any:
        b, f, _, count = state
        return *jax.lax.fori_loop(0, 3, round_of_two, (b, f, idle)), count + 1

    size = (b * b).sum((0, 1))
    eye = jnp.eye(4).reshape((4, 4) + (1,) * (b.ndim - 2))
    idle = jnp.any(size < 0.0)  # false, and of the kind that shard_map wants of a value that depends on b
    start = (b, jnp.zeros_like(b) + eye, ~idle, 0)
    b, f, _, _ = jax.lax.while_loop(lambda state: state[2] & (state[3] < MAX_SWEEPS), sweep, start)
    return jnp.stack([b[i, i] for i in range(4)]), f
