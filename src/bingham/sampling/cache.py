"""Arrays kept on disk between runs: computed once, read ever after."""

from __future__ import annotations

import os
import sys
import warnings
from collections.abc import Callable
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from bingham.atomic import replaced
from bingham.errors import RecordingError

__all__ = ["cache_folder", "cached_array"]


def cache_folder() -> Path:
    """Return the folder for computed point sets: ``$BINGHAM_CACHE``, or the platform's folder for user caches."""
    chosen = os.environ.get("BINGHAM_CACHE")
    if chosen:
        return Path(chosen)
    if sys.platform == "win32":
        base = os.environ.get("LOCALAPPDATA") or str(Path.home() / "AppData" / "Local")
    elif sys.platform == "darwin":
        base = str(Path.home() / "Library" / "Caches")
    else:
        base = os.environ.get("XDG_CACHE_HOME") or str(Path.home() / ".cache")
    return Path(base) / "bingham"


def cached_array(name: str, compute: Callable[[], NDArray[np.float64]],
                 valid: Callable[[NDArray[np.float64]], bool]) -> NDArray[np.float64]:  # fmt: skip
    """Return the array kept as `name`, or compute it and keep it.

    A file that cannot be read or is not `valid` is computed anew. Writing replaces the file in one move, so that
    processes may share the folder.

    Warns
    -----
    UserWarning
        If the array cannot be written; it is returned all the same.
    """
    path = cache_folder() / f"{name}.npy"
    try:
        array = np.load(path, allow_pickle=False)
        if array.dtype == np.float64 and valid(array):
            return array
    except (OSError, ValueError, EOFError):
        pass  # absent or damaged: both are fixed by computing it
    array = compute()
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with replaced(path) as temporary:
            np.save(temporary, array)
    except (OSError, RecordingError) as problem:
        warnings.warn(f"cannot keep {path}: {problem}; the array is computed again in every process; "
                      "set BINGHAM_CACHE to a folder that can be written", UserWarning, stacklevel=2)  # fmt: skip
    return array
