"""Arrays of a point cloud or depth image: PCD, PLY, npz, npy, PNG of 16 bits, or rows of numbers."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bingham.errors import RecordingError
from bingham.io.bounds import check_size
from bingham.io.checks import damaged, existing
from bingham.io.layout import find_layout
from bingham.io.npz import Archive, load_array
from bingham.io.point_files import read_pcd, read_ply
from bingham.io.table import read_table
from bingham.io.text import opened_text
from bingham.io.units import bracketed

__all__ = ["read_points"]

PNG_SIGNATURE = b"\x89PNG\r\n\x1a\n"
CLOUDS = {".pcd": read_pcd, ".ply": read_ply}
OTHER = (".las", ".laz", ".e57", ".obj", ".stl", ".off", ".glb", ".tif", ".tiff", ".exr")
MOST_COLUMNS = 12


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
    if kind in CLOUDS:
        return {"xyz": CLOUDS[kind](path)}
    if kind in OTHER:
        raise RecordingError(path, "", f"{kind} is not read", "save the points as PLY, PCD or npz with xyz")
    if kind == ".npz":
        return Archive(path)
    if kind == ".png":
        return {"depth": _png(path)}
    if kind == ".npy":
        values = load_array(path)
        if values.ndim == 2 and 3 <= values.shape[1] <= MOST_COLUMNS:
            values = values[:, :3]
    else:
        values = _rows(path)
    return {"xyz" if values.ndim and values.shape[-1] == 3 else "depth": values}


def _png(path: Path) -> NDArray[Any]:
    from matplotlib import image

    with path.open("rb") as file:
        start = file.read(26)
    if not start.startswith(PNG_SIGNATURE) or len(start) < 26:
        raise RecordingError(path, "", "not a PNG file", "save the depth as PNG of 16 bits")
    bits, colour = start[24:26]
    if bits != 16 or colour != 0:
        raise RecordingError(
            path, "", f"{bits} bits, {'a colour image' if colour else 'grey'}", "a depth image is grey, of 16 bits"
        )
    width, height = (int.from_bytes(start[k : k + 4], "big") for k in (16, 20))
    check_size(path, "image", 24.0 * width * height)
    try:
        raw = np.asarray(image.imread(path), dtype=np.float64)
    except Exception as error:  # Pillow raises whatever it stumbles over
        raise damaged(path, "PNG file", error) from error
    depth = np.round(raw * 65535.0).astype(np.int64)
    return np.where(depth == 65535, 0, depth)  # the largest number says that nothing was measured


def _rows(path: Path) -> NDArray[np.float64]:
    """Return a table of numbers; of one with columns named x, y and z these, of a narrow one the first three."""
    text = opened_text(path)
    layout = find_layout(text)
    names = [bracketed(name)[0].strip("#/ ").lower() for name in layout.names]
    if all(a in names for a in "xyz"):
        at = [names.index(a) for a in "xyz"]
    else:  # points come with colours, normals, intensities; an image is wider
        at = list(range(3 if 3 <= layout.width <= MOST_COLUMNS else layout.width))
    return read_table(text, layout, at).matrix(at, [1.0] * len(at))
