"""The sign under which axes are printed: they have none themselves, and every command shall print the same."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from numpy.typing import NDArray

__all__ = ["GEOGRAPHIC", "printed"]

GEOGRAPHIC = ("n", "e", "d")


def printed(axes: NDArray[Any], columns: Sequence[str]) -> list[Any]:
    """Return ±x for each row (..., d): lower end for columns n, e, d, otherwise the first non-zero entry positive.

    Parameters
    ----------
    axes : ndarray, shape (..., d)
        Unit vectors.
    columns : sequence of str
        Names of the components; (w, x, y, z) so get w ≥ 0.
    """
    from bingham.rotations import canonical

    if tuple(name.lower() for name in columns) == GEOGRAPHIC:
        return canonical(axes[..., ::-1])[..., ::-1].tolist()
    return canonical(axes).tolist()
