"""Finished chunks on disk, so that an interrupted study continues where it stopped."""

from __future__ import annotations

import hashlib
import json
from pathlib import Path
from typing import Any

import numpy as np

from bingham.atomic import disk_errors, replaced
from bingham.studies.study import Arrays

__all__ = ["RunStore"]

CHECKSUM = "checksum"


class RunStore:
    """Results of chunks in one folder, one npz file each, written in one piece or not at all.

    Parameters
    ----------
    folder : Path
        Where studies keep their runs.
    identity : dict
        What makes results comparable (study, version, seed, options). It is part of the folder's name: runs of
        another seed or version are never mixed in.
    """

    def __init__(self, folder: Path, identity: dict[str, Any]) -> None:
        text = json.dumps(identity, sort_keys=True, default=_digest)
        self.folder = Path(folder) / f"{identity['study']}-{hashlib.sha256(text.encode()).hexdigest()[:12]}"

    def _path(self, key: str) -> Path:
        return self.folder / f"{key}.npz"

    def load(self, key: str) -> Arrays | None:
        """Return the stored arrays of a chunk, or None if it has to be run: absent, damaged or another chunk's."""
        try:
            with np.load(self._path(key), allow_pickle=False) as stored:
                arrays = {name: stored[name] for name in stored.files}
        except Exception:  # NumPy and zipfile raise whatever they stumble over in a damaged file
            return None
        checksum = arrays.pop(CHECKSUM, None)
        return arrays if checksum is not None and str(checksum) == _checksum(key, arrays) else None

    def clear(self) -> None:
        """Remove what is stored of this study."""
        for path in self.folder.glob("*.npz"):
            path.unlink()

    def save(self, key: str, arrays: Arrays) -> None:
        """Store a chunk's arrays atomically, with a checksum over their names, types, shapes and bytes."""
        with disk_errors(self.folder):
            self.folder.mkdir(parents=True, exist_ok=True)
        with replaced(self._path(key)) as path, path.open("wb") as file:
            np.savez(file, allow_pickle=False, **arrays, **{CHECKSUM: np.array(_checksum(key, arrays))})


def _checksum(key: str, arrays: Arrays) -> str:
    content = "".join(f"{name}={_digest(value)};" for name, value in sorted(arrays.items()))
    return hashlib.sha256(f"{key}:{content}".encode()).hexdigest()


def _digest(value: Any) -> str:
    """Return a fingerprint of an array."""
    a = np.ascontiguousarray(value)
    return f"{a.dtype}{a.shape}{hashlib.sha256(a.tobytes()).hexdigest()}"
