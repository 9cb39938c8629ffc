"""Finished chunks on disk, so that an interrupted study continues where it stopped."""

from __future__ import annotations

import hashlib
import json
import os
import zipfile
from pathlib import Path
from typing import Any

import numpy as np

from bingham.studies.study import Arrays

__all__ = ["RunStore"]


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
        """Return the stored arrays of a chunk, or None if it has to be run."""
        try:
            with np.load(self._path(key), allow_pickle=False) as stored:
                return {name: stored[name] for name in stored.files}
        except (FileNotFoundError, zipfile.BadZipFile, EOFError):
            # A damaged file (full disk, power cut) counts as absent: the chunk is run again.
            return None

    def clear(self) -> None:
        """Remove what is stored of this study."""
        for path in self.folder.glob("*.npz"):
            path.unlink()

    def save(self, key: str, arrays: Arrays) -> None:
        """Store a chunk's arrays atomically."""
        self.folder.mkdir(parents=True, exist_ok=True)
        path = self._path(key)
        partial = path.with_suffix(f".{os.getpid()}.part")
        try:
            with partial.open("wb") as file:
                np.savez(file, allow_pickle=False, **arrays)
            os.replace(partial, path)
        finally:
            partial.unlink(missing_ok=True)


def _digest(value: Any) -> str:
    """Return a fingerprint of an array for `identity`."""
    a = np.ascontiguousarray(value)
    return f"{a.dtype}{a.shape}{hashlib.sha256(a.tobytes()).hexdigest()}"
