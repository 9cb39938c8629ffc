"""log F(A) and its gradient E[yyᵀ] over many matrices, in blocks that stay in the nearest cache."""

from __future__ import annotations

import math

import numpy as np

from bingham.kernels.compile import compiled
from bingham.kernels.eigen_lanes import diagonalize_lanes_4
from bingham.kernels.frames import combine_rows_4
from bingham.kernels.numpy_rule import LARGEST
from bingham.kernels.rows import LANES, derivatives_lanes

__all__ = ["moment_rows_4"]

BLOCK = 4 * LANES


@compiled(inner=True)
def moment_rows_4(matrices, log_f, moments):
    """Write log F(A) (n,) and E[yyᵀ] (n, 4, 4) for the symmetric parts A of matrices (n, 4, 4).

    NaN for a matrix that is not finite or whose eigenvalues span more than `LARGEST`.
    """
    values, w = np.empty((BLOCK, 4)), np.empty((BLOCK, 4))
    frames, hessian, usable = np.empty((BLOCK, 4, 4)), np.empty((BLOCK, 4, 4)), np.empty(BLOCK, dtype=np.bool_)
    for start in range(0, matrices.shape[0], BLOCK):
        stop = min(start + BLOCK, matrices.shape[0])
        n = stop - start
        z, f = values[:n], frames[:n]
        diagonalize_lanes_4(matrices[start:stop], z, f)
        for i in range(n):
            low, top = (
                min(min(z[i, 0], z[i, 1]), min(z[i, 2], z[i, 3])),
                max(max(z[i, 0], z[i, 1]), max(z[i, 2], z[i, 3])),
            )
            total = z[i, 0] + z[i, 1] + z[i, 2] + z[i, 3]
            usable[i] = not math.isnan(total) and top - low <= LARGEST
            if not usable[i]:
                z[i] = 0.0
        derivatives_lanes(z, log_f[start:stop], w[:n], hessian[:n])
        combine_rows_4(w[:n], f, moments[start:stop])
        for i in range(n):
            if not usable[i]:
                log_f[start + i] = math.nan
                moments[start + i] = math.nan
