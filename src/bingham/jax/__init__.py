"""The Bingham distribution for JAX: exact normaliser under jit, grad, vmap and hessian, in x64 and x32.

Plain XLA operations, for 4×4 matrices on the CPU the compiled kernel of the package, with derivatives by
``custom_jvp``. Inputs in single precision give results in single precision, computed in double inside, whatever
``jax_enable_x64`` says. Needs ``pip install 'bingham[jax]'``.
`Bingham`, a distribution for NumPyro, needs NumPyro too and loads when first used.
"""

from __future__ import annotations

from typing import Any

from bingham.errors import MissingExtraError

try:
    import jax as _jax  # noqa: F401  # pyright: ignore[reportUnusedImport]
except ModuleNotFoundError as error:
    raise MissingExtraError("jax", "jax", "bingham.jax") from error

from bingham.jax.matrices import logpdf, matrix_log_normalizer, matrix_moment, negative_log_likelihood, pdf
from bingham.jax.normalizer import concentrations, log_normalizer, moments

__all__ = [
    "Bingham",  # pyright: ignore[reportUnsupportedDunderAll]
    "concentrations",
    "log_normalizer",
    "logpdf",
    "matrix_log_normalizer",
    "matrix_moment",
    "moments",
    "negative_log_likelihood",
    "pdf",
]


def __getattr__(name: str) -> Any:
    if name != "Bingham":
        raise AttributeError(f"module 'bingham.jax' has no attribute {name!r}")
    try:
        from bingham.jax.distribution import Bingham
    except ModuleNotFoundError as error:
        if error.name != "numpyro":
            raise
        raise MissingExtraError("numpyro", "jax", "bingham.jax.Bingham") from error
    return Bingham
