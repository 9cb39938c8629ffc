"""Write a file whole or not at all."""

from __future__ import annotations

import secrets
from collections.abc import Generator
from contextlib import contextmanager
from pathlib import Path

from bingham.errors import RecordingError

__all__ = ["replaced"]


@contextmanager
def replaced(path: str | Path) -> Generator[Path]:
    """Give the path of a temporary sibling that takes the place of `path` if the block succeeds.

    Parameters
    ----------
    path : str or Path
        File to write or replace; its folder must exist.

    Yields
    ------
    Path
        File to write in the block. If the block raises, it is removed and `path` is as it was.

    Raises
    ------
    RecordingError
        If the folder does not exist or the file cannot be written.
    """
    path = Path(path)
    if not path.parent.is_dir():
        raise RecordingError(path, "", "its folder does not exist", "create the folder first")
    if path.is_dir():
        raise RecordingError(path, "", "a folder, where a file is to be written", "give the path of a file")
    temporary = path.with_name(f".{path.stem}.{secrets.token_hex(4)}{path.suffix}")
    try:
        yield temporary
        temporary.replace(path)
    except OSError as error:
        raise RecordingError(path, "", f"cannot be written: {error.strerror}", "check permissions and space") from error
    finally:
        temporary.unlink(missing_ok=True)
