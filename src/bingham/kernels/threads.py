"""Rows of arrays shared out among threads; the compiled kernels release Python's lock."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from itertools import pairwise
from typing import Any

from numpy.typing import NDArray

__all__ = ["by_rows"]

# Less work is done before a second thread has started.
WORTH_THREADS_US = 400.0
# Parts for each thread: whichever is free takes the next, so that a core that is slowed down holds nobody up.
PARTS = 4


def by_rows(kernel: Callable[..., Any], *arrays: NDArray[Any], row_us: float) -> list[tuple[int, Any]]:
    """Call ``kernel(*parts)`` for parts of consecutive rows of the arrays; return (first row, result) of each part.

    row_us is about what a row takes, µs: little work stays on one thread. As many threads as
    ``numba.get_num_threads()`` says, which ``NUMBA_NUM_THREADS`` and ``numba.set_num_threads`` set.
    """
    n = len(arrays[0])
    if n * row_us < WORTH_THREADS_US:
        return [(0, kernel(*arrays))]
    import numba

    threads = min(numba.get_num_threads(), n)
    if threads <= 1:
        return [(0, kernel(*arrays))]
    count = min(PARTS * threads, n)
    starts = [n * i // count for i in range(count + 1)]
    parts = [slice(a, b) for a, b in pairwise(starts)]
    with ThreadPoolExecutor(threads) as pool:
        results = pool.map(lambda rows: kernel(*(a[rows] for a in arrays)), parts)
        return list(zip(starts[:-1], results, strict=True))
