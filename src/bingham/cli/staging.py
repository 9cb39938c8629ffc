"""Results of a command appear together once all of them are complete, or not at all."""

from __future__ import annotations

import tempfile
from collections.abc import Generator
from contextlib import contextmanager
from pathlib import Path

from bingham.errors import RecordingError

__all__ = ["staged"]


@contextmanager
def staged(folder: Path) -> Generator[Path]:
    """Give a temporary folder whose content moves to `folder`, made if need be, when the block succeeds.

    Parameters
    ----------
    folder : Path
        Where the files end up; files and folders of the same names are replaced.

    Yields
    ------
    Path
        Folder on the same disk to write in. If the block raises, all of it vanishes and `folder` is as it was.

    Raises
    ------
    RecordingError
        If `folder` is a file or cannot be written to.
    """
    if folder.exists() and not folder.is_dir():
        raise RecordingError(folder, "", "a file, where a folder is to be written", "give another name to --output")
    nearest = next(parent for parent in (folder, *folder.absolute().parents) if parent.is_dir())
    try:
        with tempfile.TemporaryDirectory(prefix=".bingham-", dir=nearest) as temporary:
            yield Path(temporary)
            folder.mkdir(parents=True, exist_ok=True)
            for k, file in enumerate(sorted(Path(temporary).iterdir())):
                if (target := folder / file.name).is_dir():  # a folder does not replace another
                    target.replace(Path(temporary) / f".before-{k}")
                file.replace(target)
    except OSError as error:
        raise RecordingError(
            folder, "", f"cannot be written: {error.strerror}", "check permissions and space"
        ) from error
