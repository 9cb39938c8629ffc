"""A program that reads HDF5 files for `bingham.io.hdf5`: whatever a damaged file does to h5py, it does it here.

Each line on standard input asks, as JSON, for arrays by name and gives the bytes that they may take. The answer is a
line of JSON for each, its bytes, and an empty line; or a line that says what is wrong. Nothing of the package is
imported, so that it starts at once.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Iterator
from typing import Any, BinaryIO

import numpy as np

__all__ = ["main"]


class Refused(Exception):
    """What is wrong: a dictionary for the caller."""


def main(asked: BinaryIO, answers: BinaryIO) -> None:
    """Answer until the caller is gone."""
    for line in asked:
        question = json.loads(line)
        try:
            for name, array in _arrays(**question):
                _say(answers, {"name": name, "dtype": array.dtype.str, "shape": array.shape})
                answers.write(memoryview(array).cast("B") if array.size else b"")
            answers.write(b"\n")
        except Refused as refused:
            _say(answers, refused.args[0])
        except Exception as error:  # h5py raises whatever its parser stumbles over
            _say(answers, {"damaged": f"{error}" or type(error).__name__})
        answers.flush()


def _say(answers: BinaryIO, what: dict[str, Any]) -> None:
    answers.write(json.dumps(what).encode("ascii") + b"\n")


def _arrays(path: str, names: list[str], limit: float) -> Iterator[tuple[str, Any]]:
    import h5py

    total = 0.0
    with h5py.File(path, "r", locking=False) as file:
        for name in names:
            if name in file.attrs:
                yield name, np.ascontiguousarray(_numbers(name, np.asarray(file.attrs[name])))
            if (link := file.get(name, getlink=True)) is None:
                continue
            if not isinstance(link, h5py.HardLink):
                raise Refused({"field": name, "links": True})
            data: Any = file[name]
            if not isinstance(data, h5py.Dataset):
                raise Refused({"field": name, "group": True})
            if data.external or data.is_virtual:
                raise Refused({"field": name, "elsewhere": True})
            _numbers(name, data)
            total += float(np.prod(data.shape, dtype=np.float64)) * max(8, data.dtype.itemsize)
            if not total <= limit:
                raise Refused({"field": name, "size": total})
            yield name, np.ascontiguousarray(data)


def _numbers(name: str, data: Any) -> Any:
    if data.dtype.kind not in "biuf":
        raise Refused({"field": name, "type": str(data.dtype)[:60]})
    return data


if __name__ == "__main__":
    main(sys.stdin.buffer, sys.stdout.buffer)
