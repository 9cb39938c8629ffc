"""log F(z), its gradient and the inverse of the gradient, under every transformation of JAX."""

from __future__ import annotations

import functools
from collections.abc import Callable
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from bingham.errors import InvalidArgumentError
from bingham.kernels.array_rule import derivatives_array

__all__ = ["concentrations", "derivatives", "in_double", "log_normalizer", "moments"]

EVALUATIONS, TOLERANCE = 20, 1e-6


def in_double(function: Callable[..., Any]) -> Callable[..., Any]:
    """Let a function of arrays compute in double precision and return what its first argument is in."""

    @functools.wraps(function)
    def wrapped(*arrays: Any) -> Any:
        kind = jnp.result_type(arrays[0])
        kind = kind if kind in (jnp.float32, jnp.float64) else jnp.float32
        with jax.enable_x64(True):
            out = function(*(jnp.asarray(a).astype(jnp.float64) for a in arrays))
            return jax.tree.map(lambda a: a.astype(kind), out)

    return wrapped


def _checked(z: Any, name: str) -> Any:
    try:
        a = jnp.asarray(z)
    except TypeError:
        raise InvalidArgumentError(name, "an array (..., d) with d >= 2", f"a {type(z).__name__}") from None
    if a.ndim == 0 or a.shape[-1] < 2:
        raise InvalidArgumentError(name, "shape (..., d) with d >= 2", a.shape)
    return a if jnp.issubdtype(a.dtype, jnp.floating) else a.astype(float)


def derivatives(z: Any, order: int) -> tuple[Any, ...]:
    """Return log F, ω and the Hessian at z (..., d) in double precision, as far as `order` says."""

    def loop(count: int, body: Callable[[Any], Any], start: Any) -> Any:
        return jax.lax.fori_loop(0, count, lambda _, carry: body(carry), start)

    return derivatives_array(z, jnp, order, constant=jnp.asarray, freeze=jax.lax.stop_gradient, loop=loop)


def log_normalizer(z: Any) -> Any:
    """Return log F(z), F(z) = ∫ exp(Σ zᵢ xᵢ²) dx over S^{d−1}; the gradient is `moments`.

    Parameters
    ----------
    z : (..., d) array
        Concentrations in any order; a common offset c adds c. Entries that are not finite give NaN.

    Returns
    -------
    (...) array
        In the precision of z; half precision gives float32.

    Examples
    --------
    >>> import jax
    >>> z = jax.numpy.array([-8.0, -2.0, 0.0])
    >>> bool(jax.numpy.allclose(jax.grad(log_normalizer)(z), moments(z)))
    True
    """
    return _log_normalizer(_checked(z, "z"))


def moments(z: Any) -> Any:
    """Return ω (..., d), ωᵢ = E[xᵢ²] for x with density exp(Σ zᵢ xᵢ²)/F(z); Σω = 1.

    Examples
    --------
    >>> moments([0.0, 0.0]).tolist()
    [0.5, 0.5]
    """
    return _moments(_checked(z, "z"))


def concentrations(w: Any) -> Any:
    """Return the z (..., d) with moments(z) = w and max z = 0; its derivative is implicit, dz = H(z)⁻¹ dw.

    Parameters
    ----------
    w : (..., d) array
        Positive second moments in any order, divided by their sum here; others give NaN.

    Notes
    -----
    Where two largest moments are equal, max z = 0 has a kink: the derivative is one of the two one-sided ones.
    """
    w = _checked(w, "w")
    return _concentrations(w / w.sum(-1, keepdims=True))


@jax.custom_jvp
def _log_normalizer(z: Any) -> Any:
    return in_double(lambda z: derivatives(z, 0)[0])(z)


@_log_normalizer.defjvp
def _(primals: Any, tangents: Any) -> Any:
    (z,), (dz,) = primals, tangents
    value, w = _with_moments(z)
    return value, (w * dz).sum(-1)


@jax.custom_jvp
def _with_moments(z: Any) -> Any:
    return in_double(lambda z: derivatives(z, 1))(z)


@_with_moments.defjvp
def _(primals: Any, tangents: Any) -> Any:
    (z,), (dz,) = primals, tangents
    value, w, hessian = in_double(lambda z: derivatives(z, 2))(z)
    return (value, w), ((w * dz).sum(-1), (hessian * dz[..., None, :]).sum(-1))


def _moments(z: Any) -> Any:
    return _with_moments(z)[1]


@jax.custom_jvp
def _concentrations(w: Any) -> Any:
    return in_double(_newton)(w)


@_concentrations.defjvp
def _(primals: Any, tangents: Any) -> Any:
    z = _concentrations(*primals)

    def inverse(z: Any) -> Any:
        # H⁻¹ on the entries whose z is not the largest, 0 on that one, which stays 0.
        top = _first_largest(jax.lax.stop_gradient(z))
        either = top[..., :, None] | top[..., None, :]
        eye = jnp.eye(z.shape[-1])
        hessian = jnp.where(either, eye, derivatives(z, 2)[2])
        return jnp.where(either, 0.0, _solve(hessian, eye))

    return z, (in_double(inverse)(z) * tangents[0][..., None, :]).sum(-1)


def _first_largest(z: Any) -> Any:
    """Return a mask (..., d), true at the first largest entry; elementwise, which every precision mode lowers."""
    parts = [z[..., i] for i in range(z.shape[-1])]
    largest = functools.reduce(jnp.maximum, parts)
    first, found = [], largest != largest
    for p in parts:
        first.append((p == largest) & ~found)
        found = found | (p == largest)
    return jnp.stack(first, -1)


def _with_zero(a: Any) -> Any:
    return jnp.concatenate([a, jnp.zeros_like(a[..., :1])], -1)


def _solve(h: Any, v: Any) -> Any:
    """Solve h x = v, v (..., d, k), rows and columns scaled by √hᵢᵢ: h spans the square of what ω spans."""
    scale = jnp.sqrt(jax.lax.stop_gradient(jnp.diagonal(h, axis1=-2, axis2=-1)))
    scaled = h / (scale[..., :, None] * scale[..., None, :])
    return jnp.linalg.solve(scaled, v / scale[..., :, None]) / scale[..., :, None]


def _newton(w: Any) -> Any:
    """The iteration of `kernels.newton` until the last row has converged; NaN for rows that are no moments."""
    order = jnp.argsort(w, -1)
    w = jnp.take_along_axis(w, order, -1)
    s2, s3 = (w**2).sum(-1, keepdims=True), (w**3).sum(-1, keepdims=True)
    v = w / (1.0 + 2.0 * (w * s3 / s2**2 - w**2 / s2))
    v = v / v.sum(-1, keepdims=True)
    top = 0.5 / v[..., -1:]

    def step(state: Any) -> Any:
        count, u, _, _ = state
        z = _with_zero(top - 0.5 / u)
        _, g, hessian = derivatives(z, 2)
        residual = (w - g)[..., :-1]
        change = _solve(hessian[..., :-1, :-1], residual[..., None])[..., 0]
        done = jnp.all(jnp.abs(residual) < TOLERANCE * w[..., :-1], -1)
        move = 2.0 * u * u * change
        return count + 1, jnp.where(move > -0.9 * u, u + move, 0.1 * u), z[..., :-1] + change, done

    start = (0, v[..., :-1], v[..., :-1], jnp.zeros(w.shape[:-1], bool))
    _, _, z, done = jax.lax.while_loop(lambda s: (s[0] < EVALUATIONS) & ~jnp.all(s[3]), step, start)
    z = jnp.where(done[..., None], _with_zero(z), np.nan)
    return jnp.take_along_axis(z, jnp.argsort(order, -1), -1)
