"""The Bingham distribution for NumPyro."""

from __future__ import annotations

from typing import Any

import jax
import jax.numpy as jnp
import numpyro.distributions as dist
from numpyro.distributions import constraints
from numpyro.distributions.util import validate_sample

from bingham.errors import InvalidArgumentError
from bingham.jax.matrices import matrix_log_normalizer, matrix_moment, negative_log_likelihood

__all__ = ["Bingham"]


class Bingham(dist.Distribution):
    """Distribution of an axis or rotation ±x on S^{d−1}: f(x) = exp(xᵀAx)/F(A), a density by surface area.

    Parameters
    ----------
    concentration_matrix : (..., d, d) array
        Symmetric A; A + c I is the same distribution.

    Examples
    --------
    >>> import jax
    >>> p = Bingham(jax.numpy.diag(jax.numpy.array([0.0, -30.0, -30.0, -30.0])))
    >>> p.sample(jax.random.PRNGKey(0), (5,)).shape
    (5, 4)
    """

    arg_constraints: Any = {"concentration_matrix": constraints.real_matrix}  # noqa: RUF012
    support: Any = constraints.sphere
    pytree_data_fields = ("concentration_matrix",)

    def __init__(self, concentration_matrix: Any, *, validate_args: bool | None = None) -> None:
        a = jnp.asarray(concentration_matrix)
        if a.ndim < 2 or a.shape[-1] != a.shape[-2] or a.shape[-1] < 2:
            raise InvalidArgumentError("concentration_matrix", "an array (..., d, d) with d >= 2", a.shape)
        self.concentration_matrix = a
        super().__init__(a.shape[:-2], a.shape[-1:], validate_args=validate_args)

    @validate_sample
    def log_prob(self, value: Any, intermediates: Any = None) -> Any:
        """Return log f(value) (...), nats relative to surface area, for unit vectors (..., d)."""
        return -negative_log_likelihood(self.concentration_matrix, value)

    def sample(self, key: Any, sample_shape: tuple[int, ...] = ()) -> Any:
        """Return exact samples ``(*sample_shape, *batch_shape, d)``: rejection from an angular Gaussian envelope.

        A loop runs until the last sample is accepted, about once for every two tries in each (Kent, Ganeiber & Mardia
        2013).
        """
        a = self.concentration_matrix
        values, vectors = jnp.linalg.eigh(0.5 * (a + jnp.swapaxes(a, -1, -2)))
        spread = values[..., -1:] - values
        d = spread.shape[-1]
        low, high = jnp.zeros_like(spread[..., :1]), jnp.full_like(spread[..., :1], d)

        def halve(_: Any, bounds: Any) -> Any:  # Σ 1/(b + 2λ) = 1
            low, high = bounds
            b = 0.5 * (low + high)
            above = (1.0 / (b + 2.0 * spread)).sum(-1, keepdims=True) > 1.0
            return jnp.where(above, b, low), jnp.where(above, high, b)

        b = jax.lax.fori_loop(0, 50, halve, (low, high))[1]
        precision = 1.0 + 2.0 * spread / b
        bound = (0.5 * (d - b) - 0.5 * d * jnp.log(d / b))[..., 0]
        shape = (*sample_shape, *self.batch_shape, d)

        def attempt(state: Any) -> Any:
            key, x, done = state
            key, one, two = jax.random.split(key, 3)
            y = jax.random.normal(one, shape, spread.dtype) / jnp.sqrt(precision)
            square = y * y / (y * y).sum(-1, keepdims=True)
            ratio = -(spread * square).sum(-1) + 0.5 * d * jnp.log((precision * square).sum(-1)) + bound
            accepted = jnp.log(jax.random.uniform(two, shape[:-1], spread.dtype)) < ratio
            new = y / jnp.sqrt((y * y).sum(-1, keepdims=True))
            return key, jnp.where(done[..., None], x, new), done | accepted

        start = (key, jnp.zeros(shape, spread.dtype), jnp.zeros(shape[:-1], bool))
        x = jax.lax.while_loop(lambda state: ~jnp.all(state[2]), attempt, start)[1]
        return (vectors @ x[..., None])[..., 0]

    @property
    def mean(self) -> Any:
        """E[x] = 0: x and −x are one axis."""
        return jnp.zeros(self.batch_shape + self.event_shape)

    @property
    def variance(self) -> Any:
        """E[xᵢ²] (..., d)."""
        return jnp.diagonal(matrix_moment(self.concentration_matrix), axis1=-2, axis2=-1)

    def entropy(self) -> Any:
        """Return −E[log f(x)] (...), nats."""
        a = self.concentration_matrix
        a = a - jnp.max(jnp.diagonal(a, axis1=-2, axis2=-1), -1)[..., None, None] * jnp.eye(a.shape[-1])
        return matrix_log_normalizer(a) - (a * matrix_moment(a)).sum((-2, -1))
