"""What a format is: how its files are known, and what reads them. `bingham.io.formats` finds them all."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from bingham.recording import ImuRecording, OrientationRecording

__all__ = ["Format"]


@dataclass(frozen=True, slots=True)
class Format:
    """A format of recordings.

    Parameters
    ----------
    name : str
        Its key: ``read_recording(path, format=name)``.
    title : str
        What people call it.
    expects : str
        What a file holds, in reStructuredText, for help and documentation.
    read : callable
        Path and keyword options → recording.
    functions : tuple of str
        Names in `bingham.io` that read and write it; without, ``read_recording`` does.
    signatures : tuple of bytes
        What a binary file begins with.
    text : callable, optional
        Whether the first lines of a text file, those that are not blank, are of this format.
    folder : callable, optional
        Whether a folder is a recording of this format.
    last : int
        Above 0: compared with a file only after others, because it takes much of what is theirs.
    """

    name: str
    title: str
    expects: str
    read: Callable[..., ImuRecording | OrientationRecording | Any]
    functions: tuple[str, ...] = ()
    signatures: tuple[bytes, ...] = ()
    text: Callable[[list[str]], bool] | None = None
    folder: Callable[[Path], bool] | None = None
    last: int = 0
