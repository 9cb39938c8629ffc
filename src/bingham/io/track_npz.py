"""Tracks as npz archives: every bit to go on from, without what follows from it."""

from __future__ import annotations

import os
import shutil
import zipfile
import zlib
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
from numpy.typing import NDArray

__all__ = ["NpzArchive", "expanded", "reduced"]

# A member is compressed if that makes this much of its middle smaller than this share.
SAMPLE, WORTHWHILE = 1 << 16, 0.6
LEVEL = 1  # six takes five times as long for 5 % less
UPPER = tuple(zip(*np.triu_indices(3), strict=True))


def reduced(content: Mapping[str, Any], *, single: bool = False) -> dict[str, Any]:
    """Return what has to be stored: covariances follow from rotation covariances, matrices from z and M."""
    stored = {name: value for name, value in content.items() if value is not None}
    if "rotation_covariance" in stored:
        c = np.asarray(stored.pop("rotation_covariance"))
        stored["rotation_covariance_upper"] = np.stack([c[:, i, j] for i, j in UPPER], axis=1)
        stored.pop("covariance", None)
    elif {"frames", "concentrations"} <= stored.keys():
        stored.pop("covariance", None)
        stored.pop("matrices", None)
    if single:
        for name, value in stored.items():
            if name != "time" and getattr(value, "dtype", None) == np.float64 and np.ndim(value):
                stored[name] = value.astype(np.float32)
    return stored


def expanded(content: dict[str, Any]) -> dict[str, Any]:
    """Return what `reduced` left, with what follows from it."""
    from bingham.io.track_fields import covariance_of

    if "rotation_covariance_upper" in content:
        upper = content.pop("rotation_covariance_upper")
        c = np.empty((len(upper), 3, 3))
        for k, (i, j) in enumerate(UPPER):
            c[:, i, j] = c[:, j, i] = upper[:, k]
        content["rotation_covariance"] = c
    elif {"frames", "concentrations"} <= content.keys():
        z, m = content["concentrations"], content["frames"]
        content["matrices"] = np.einsum("tik,tk,tjk->tij", m, z, m)
    else:
        return content
    frame = str(content.get("covariance_frame", "world"))
    if (covariance := covariance_of(content, frame)) is not None:
        content |= {"covariance": covariance, "covariance_frame": frame}
    return content


class NpzArchive:
    """An npz archive whose arrays grow by rows; what has been given lies on disk, not in memory.

    Parameters
    ----------
    path : Path
        Archive to write when it is closed; until then files of the same name with an array's name after it.
    """

    def __init__(self, path: Path) -> None:
        self._path = path
        self._parts: dict[str, tuple[BinaryIO, NDArray[Any]]] = {}
        self._rows = 0

    def append(self, rows: Mapping[str, NDArray[Any]]) -> None:
        """Add rows to arrays; the same ones every time."""
        for name, values in rows.items():
            if name not in self._parts:
                file = (self._path.parent / f"{self._path.name}.{name}").open("w+b")
                self._parts[name] = (file, values[:0])
            self._parts[name][0].write(np.ascontiguousarray(values).data)
        self._rows += len(next(iter(rows.values())))

    def discard(self) -> None:
        """Let go of what was given and not written."""
        for part, _ in self._parts.values():
            with suppress(OSError):
                part.close()
        self._parts.clear()

    def close(self, whole: Mapping[str, Any]) -> None:
        """Write the archive, with further arrays and texts that are there as a whole."""
        with zipfile.ZipFile(self._path, "w", allowZip64=True) as archive:
            for name, value in whole.items():
                with archive.open(_member(name, zipfile.ZIP_STORED), "w") as file:
                    np.lib.format.write_array(file, np.asarray(value), allow_pickle=False)  # type: ignore[arg-type]
            for name, (part, like) in self._parts.items():
                member = _member(name, _method(part))
                part.seek(0)
                with archive.open(member, "w", force_zip64=True) as file:
                    shape = (self._rows, *like.shape[1:])
                    header = {"descr": np.lib.format.dtype_to_descr(like.dtype), "fortran_order": False, "shape": shape}
                    np.lib.format.write_array_header_1_0(file, header)  # type: ignore[arg-type]
                    shutil.copyfileobj(part, file, 1 << 20)
                part.close()
                os.unlink(part.name)
        self._parts.clear()


def _member(name: str, method: int) -> zipfile.ZipInfo:
    info = zipfile.ZipInfo(f"{name}.npy")  # always of the same date: equal tracks make equal files
    info.compress_type = method
    info._compresslevel = LEVEL  # type: ignore[attr-defined]  # public under this name from Python 3.13 on
    return info


def _method(part: BinaryIO) -> int:
    """Return how to store: numbers full of noise take long to compress and stay as long as they are."""
    size = part.seek(0, os.SEEK_END)
    part.seek(max(0, (size - SAMPLE) // 2) // 8 * 8)
    sample = part.read(SAMPLE)
    return zipfile.ZIP_DEFLATED if len(zlib.compress(sample, LEVEL)) < WORTHWHILE * len(sample) else zipfile.ZIP_STORED
