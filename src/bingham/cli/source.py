"""Where the pieces of a recording come from: its file, read bit by bit, or the whole of it in memory."""

from __future__ import annotations

import warnings
from collections.abc import Iterator
from dataclasses import dataclass, field
from itertools import chain
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from bingham.cli import filtering
from bingham.io.checks import HEAD

if TYPE_CHECKING:
    from bingham.cli.filtering import FilterOptions
    from bingham.cli.settings import Settings

__all__ = ["Source", "opened", "opened_whole"]

# Bytes of text above which a recording is not read as a whole where that is not needed.
LONG = 8_000_000


@dataclass(frozen=True)
class Source:
    """A recording to track: its beginning, what comes after in pieces, and all of it if it is in memory.

    `said` is what there is to say about orientations beside it.
    """

    first: Any
    pieces: Iterator[Any]
    whole: Any
    said: dict[str, Any] = field(default_factory=dict)

    @property
    def usual_step(self) -> float:
        """Usual time between samples, s; NaN of a lone one."""
        time = self.first.time[:HEAD]
        return float(np.median(np.diff(time))) if len(time) > 1 else np.nan


def opened_whole(path: Path, name: str, settings: Settings) -> Source:
    """Read a recording."""
    from bingham.cli.reading import read

    whole = filtering.renamed(read(path, settings.format, settings.reading), name)
    said: dict[str, Any] = {}
    if settings.beside is not None:
        from bingham.cli.fusion import fused

        whole, said = fused(whole, settings.beside)
    return Source(whole, iter(()), whole, said)


def in_pieces(source: Source, options: FilterOptions) -> Iterator[Any]:
    """Yield the recording piece by piece."""
    return source.pieces if source.whole is None else filtering.pieces_of(source.whole, options)


def opened(path: Path, name: str, settings: Settings) -> Source:
    """Begin to read a recording, if its length asks for it and what is to be done with it allows it in pieces.

    Raises
    ------
    WholeNeededError
        From here or from its pieces, if it turns out to need a look at all of it at once.
    """
    from bingham.cli.reading import read_pieces

    if not _suits(path, settings):
        return opened_whole(path, name, settings)
    pieces = read_pieces(path, settings.reading, filtering.PIECE)
    first = filtering.renamed(next(pieces), name)
    return Source(first, chain([first], (filtering.renamed(piece, name) for piece in pieces)), None)


def _suits(path: Path, settings: Settings) -> bool:
    from bingham.errors import BinghamError
    from bingham.io import detect_format

    outputs, options = settings.outputs, settings.filtering
    if outputs.tum or outputs.bag or outputs.report or outputs.rerun or options.plain or options.smooth:
        return False
    if settings.beside is not None or settings.reading.keys() - {"columns", "units", "rate", "max_size", "beside"}:
        return False
    if str(path) in settings.reading.get("beside", {}):
        return False
    if not path.is_file() or path.stat().st_size < LONG:
        return False
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            return (settings.format or detect_format(path)) == "csv"
    except BinghamError:
        return False  # reading it says why
