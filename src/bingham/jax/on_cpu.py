"""log F(A) and E[yyᵀ] on the CPU by the compiled kernels of the package, as an operator of XLA.

XLA calls a C function with a frame of buffers: its foreign function interface, ``xla/ffi/api/c_api.h``, whose binary
layout is stable within a major version. Numba compiles that function, so that no Python runs in it: a call that is
still under way when the interpreter ends does no harm, and none can wait for an array that its own thread is to make,
as calls by ``jax.pure_callback`` can.
"""

from __future__ import annotations

import functools
import warnings
from typing import Any

import jax
import numpy as np
from numba import carray, njit, types  # pyright: ignore[reportPrivateImportUsage]
from numba.core import cgutils
from numba.core.ccallback import CFunc
from numba.extending import intrinsic

from bingham.kernels.brisk import brisk_compilation
from bingham.kernels.cache import kernel_cache
from bingham.kernels.moment_rows import moment_rows_4

__all__ = ["moment", "registered"]

TARGET = "bingham_matrix_log_normalizer"
METADATA, MAJOR = 1, 0


def moment(a: Any) -> tuple[Any, Any]:
    """Return log F(A) (...) and E[yyᵀ] (..., 4, 4) for A (..., 4, 4) in double precision, on the CPU.

    Matrices with entries that are not finite give NaN. Call it where `registered` says that XLA knows the function.
    """
    shapes = jax.eval_shape(lambda a: (a[..., 0, 0], a), a)
    log_f, s = jax.ffi.ffi_call(TARGET, shapes, vmap_method="broadcast_all")(a)
    return log_f, s


@functools.cache
def _compiled() -> Any:
    function: Any = CFunc(_handler, ((types.intp,), types.intp), locals={}, options={"error_model": "numpy"})
    function._cache = kernel_cache(_handler)
    with brisk_compilation():
        function.compile()
    return function


@functools.cache
def registered() -> bool:
    """Register the function with XLA at the first call; False, with a warning, if XLA refuses its version."""
    try:
        jax.ffi.register_ffi_target(TARGET, jax.ffi.pycapsule(_compiled().ctypes), platform="cpu")
    except Exception as error:
        message = f"JAX {jax.__version__} does not take compiled kernels, results are the same but slower: {error}"
        warnings.warn(message, RuntimeWarning, stacklevel=2)
        return False
    return True


def _to_pointer(_: Any, address: Any) -> Any:
    """Return an integer as a pointer."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        return builder.inttoptr(arguments[0], cgutils.voidptr_t)

    return types.voidptr(types.intp), generate


_pointer: Any = intrinsic(_to_pointer)


@njit(inline="always")
def _words(address: Any, count: int) -> Any:
    return carray(_pointer(address), (count,), np.intp)


def _handler(frame: Any) -> int:
    """Serve one call of XLA and return no error (0).

    Structures are read as words of 8 bytes. XLA_FFI_CallFrame: 1 extension_start, 2 api, 5–9 arguments, 10–14 results,
    each of those with its array of buffers in the last. XLA_FFI_Buffer: 3 data, 4 rank, 5 dims.
    """
    call = _words(frame, 15)
    if call[1] != 0:
        extension = _words(call[1], 4)
        if extension[1] & 0xFFFFFFFF == METADATA:
            # Registration asks for a version: ours, major in the lower half of a word, with the minor one of XLA, since
            # minor versions only add fields.
            _words(extension[3], 4)[3] = (_words(call[2], 5)[4] >> 32 << 32) | MAJOR
            return 0
    argument = _words(_words(call[9], 1)[0], 6)
    results = _words(call[14], 2)
    n = 1
    for size in _words(argument[5], argument[4])[: argument[4] - 2]:
        n *= size
    if n > 0:
        a = carray(_pointer(argument[3]), (n, 4, 4), np.float64)
        log_f = carray(_pointer(_words(results[0], 4)[3]), (n,), np.float64)
        s = carray(_pointer(_words(results[1], 4)[3]), (n, 4, 4), np.float64)
        moment_rows_4(a, log_f, s)
    return 0
