"""Arrays of a point cloud or depth image: npz, npy, PNG of 16 bits, or rows of numbers."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bingham.errors import RecordingError
from bingham.io.bounds import check_size
from bingham.io.checks import damaged, existing
from bingham.io.npz import Archive, load_array

__all__ = ["read_points"]

PNG_SIGNATURE = b"\x89PNG\r\n\x1a\n"


def read_points(path: str | Path) -> Mapping[str, NDArray[Any]]:
    """Return the arrays of a file under their names; those of npy, PNG and text are called xyz or depth by their shape.

    Integers stay what they are.

    Raises
    ------
    RecordingError
        If the file cannot be read or unfolds to more than its size makes plausible.
    """
    path = existing(path)
    kind = path.suffix.lower()
    if kind == ".npz":
        return Archive(path)
    if kind == ".png":
        return {"depth": _png(path)}
    values = load_array(path) if kind == ".npy" else _rows(path)
    return {"xyz" if values.ndim and values.shape[-1] == 3 else "depth": values}


def _png(path: Path) -> NDArray[Any]:
    from matplotlib import image

    with path.open("rb") as file:
        start = file.read(24)
    if not start.startswith(PNG_SIGNATURE) or len(start) < 24:
        raise RecordingError(path, "", "not a PNG file", "save the depth as PNG of 16 bits")
    width, height = (int.from_bytes(start[k : k + 4], "big") for k in (16, 20))
    check_size(path, "image", 24.0 * width * height)
    try:
        raw = np.asarray(image.imread(path), dtype=np.float64)
    except Exception as error:  # Pillow raises whatever it stumbles over
        raise damaged(path, "PNG file", error) from error
    return np.round(raw * 65535.0).astype(np.int64)


def _rows(path: Path) -> NDArray[np.float64]:
    try:
        return np.loadtxt(path, comments="#", delimiter="," if path.suffix == ".csv" else None, ndmin=2)
    except Exception as error:  # of coding too
        raise damaged(path, "table of numbers", error, "x y z in each row") from error
