"""Functions for arrays of other libraries: where a tensor comes in, the function of its own library answers."""

from __future__ import annotations

from collections.abc import Callable
from importlib import import_module
from typing import Any

import numpy as np

from bingham.errors import InvalidArgumentError

__all__ = ["elsewhere"]

CUPY_HINT = "bring it to the processor with cupy.asnumpy, or to PyTorch with torch.from_dlpack for bingham.torch"


def elsewhere(x: Any, function: str) -> Callable[..., Any] | None:
    """Return the function of that name for tensors like x, or None where NumPy serves.

    ``bingham.torch`` answers for PyTorch, ``bingham.jax`` for JAX; CuPy has `log_normalizer` and `moments`. Other
    libraries with ``__array_namespace__`` raise, naming what to do.
    """
    kind = type(x)
    library = kind.__module__.partition(".")[0]
    if library == "torch":
        return getattr(import_module("bingham.torch"), function)
    if library in ("jax", "jaxlib"):
        return getattr(import_module("bingham.jax"), function)
    if library == "cupy":
        return _on_cupy(function, x)
    if hasattr(x, "__array_namespace__") and not isinstance(x, (np.ndarray, np.generic)):
        hint = "convert it with numpy.asarray, or use bingham.torch or bingham.jax"
        raise InvalidArgumentError("array", "an array of NumPy, PyTorch, JAX or CuPy", f"one of {library}", hint)
    return None


def _on_cupy(function: str, x: Any) -> Callable[..., Any]:
    from bingham.kernels.array_rule import derivatives_array

    order = {"log_normalizer": 0, "moments": 1}.get(function)
    if order is None:
        raise InvalidArgumentError("array", f"an array for which there is {function}", "one of cupy", CUPY_HINT)
    xp = x.__array_namespace__()
    return lambda z: derivatives_array(z.astype(xp.float64), xp, order, constant=xp.asarray)[order]
