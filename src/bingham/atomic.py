"""Write files and folders so that the old stays until the new is in place: old or new, never neither.

What a block writes goes to a temporary folder on the same disk. When the block has succeeded, renames put it in place,
with signals held back until all of them are done; if one fails, those before it are undone. If the block raises, the
temporary folder goes and nothing else has changed. A process that is killed outright (SIGKILL) leaves every single file
and folder old or new, and a temporary folder that the next `staged` on that folder removes.
"""

from __future__ import annotations

import os
import secrets
import shutil
import signal
import stat
import threading
from collections.abc import Generator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

from bingham.errors import RecordingError

__all__ = ["deferred_signals", "disk_errors", "replaced", "staged", "sweep", "written"]

PREFIX = ".bingham-"
SIGNALS = [getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name)]
# What was put in place by this process, for whoever has to say what an interruption left.
written: list[Path] = []

CREATE = "create the folder first"
CHECK = "check permissions and space"


@contextmanager
def replaced(path: str | Path, *, folder: bool = False) -> Generator[Path]:
    """Give a path of the same name to write at; when the block succeeds, that takes the place of `path`.

    Parameters
    ----------
    path : str or Path
        File to write or replace, in a folder that exists. A symbolic link stays; what it names is replaced.
    folder : bool
        Whether a folder is written, not a file.

    Yields
    ------
    Path
        File or folder to make in the block. If the block raises, it is removed and `path` is as it was.

    Raises
    ------
    RecordingError
        If the folder around does not exist, the other kind is in the way, or the disk does not take it.
    """
    path = Path(path)
    with disk_errors(path):
        target = Path(os.path.realpath(path)) if path.is_symlink() else path
        if not target.parent.is_dir():
            raise RecordingError(path, "", "its folder does not exist", CREATE)
        if target.exists() and target.is_dir() != folder:
            there, wanted = ("a file", "a folder") if folder else ("a folder", "a file")
            raise RecordingError(path, "", f"{there}, where {wanted} is to be written", f"give the path of {wanted}")
        with _workplace(target.parent) as place:
            new = place / target.name
            yield new
            _put([(new, target)], place)


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
    folder = Path(folder)
    with disk_errors(folder):
        nearest = _nearest_folder(folder)
        sweep(nearest)
        with _workplace(nearest) as place:
            yield place
            folder.mkdir(parents=True, exist_ok=True)
            _put([(new, folder / new.name) for new in sorted(place.iterdir())], place)


@contextmanager
def deferred_signals() -> Generator[None]:
    """Hold back interruptions and terminations until the block has ended; in the main thread, which gets them."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    came: list[int] = []
    before: dict[int, Any] = {}
    try:
        for number in SIGNALS:
            if signal.getsignal(number) not in (signal.SIG_IGN, None):
                before[number] = signal.signal(number, lambda number, _: came.append(number))
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
        for number in came[:1]:
            signal.raise_signal(number)


def sweep(folder: Path) -> None:
    """Remove temporary folders in `folder` that processes killed outright have left there."""
    if os.name == "nt":  # no way to ask whether a process lives that does not end it
        return
    with suppress(OSError), os.scandir(folder) as entries:
        for entry in entries:
            owner = entry.name.removeprefix(PREFIX).partition("-")[0]
            if entry.name.startswith(PREFIX) and owner.isdigit() and not _alive(int(owner)):
                shutil.rmtree(entry.path, ignore_errors=True)


def _alive(process: int) -> bool:
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return False
    except (OSError, OverflowError):
        return True
    return True


@contextmanager
def _workplace(parent: Path) -> Generator[Path]:
    """Make a folder that only this process uses and remove it with all that is left in it."""
    place = parent / f"{PREFIX}{os.getpid()}-{secrets.token_hex(4)}"
    try:
        place.mkdir()
        yield place
    finally:
        with deferred_signals():
            shutil.rmtree(place, ignore_errors=True)


@contextmanager
def disk_errors(path: Path) -> Generator[None]:
    """Turn errors of the disk into one that names the output, or the file that it speaks of."""
    try:
        yield
    except OSError as error:
        if isinstance(error, RecordingError):
            raise
        other = error.filename if isinstance(error.filename, (str, bytes)) else None
        inside = other is None or PREFIX in os.fsdecode(other) or os.fsdecode(other).startswith(str(path))
        about = path if inside or other is None else os.fsdecode(other)
        raise RecordingError(about, "", f"cannot be written: {error.strerror or error}", CHECK) from error


def _nearest_folder(folder: Path) -> Path:
    """Return `folder` or the first folder above that exists."""
    for there in (folder, *folder.absolute().parents):
        try:
            mode = there.stat()
        except FileNotFoundError:
            if there.is_symlink():
                raise RecordingError(there, "", "a symbolic link to nothing", "remove the link") from None
            continue
        except NotADirectoryError:
            continue
        if not stat.S_ISDIR(mode.st_mode):
            raise RecordingError(there, "", "a file, where a folder is to be written", "give another name to --output")
        return there
    return Path(folder.anchor or ".")


def _put(moves: Sequence[tuple[Path, Path]], place: Path) -> None:
    """Rename each new file or folder to its target: all of them, or, if one fails, none."""
    begun: list[_Move] = []
    with deferred_signals():
        try:
            for k, (new, target) in enumerate(moves):
                begun.append(_Move(new, target, place / f".before-{k}"))
                begun[-1].do()
            written.extend(target for _, target in moves)
        except BaseException:
            for move in reversed(begun):
                move.undo()
            raise


class _Move:
    """Puts a file or folder in the place of another and, if asked, everything back."""

    def __init__(self, new: Path, target: Path, spare: Path) -> None:
        self._new, self._target, self._spare = new, target, spare
        self._exchanged = False

    def do(self) -> None:
        """Put the new in the place of what is there."""
        new, target, spare = self._new, self._target, self._spare
        if target.is_dir() and not target.is_symlink():
            self._exchanged = new.is_dir() and _exchanged(new, target)
            if self._exchanged:
                return
            os.rename(target, spare)  # without an exchange there is a moment with neither; `undo` ends it
        elif target.exists():
            shutil.copymode(target, new)
            with suppress(OSError):  # a disk without hard links: no way back from this one
                os.link(target, spare, follow_symlinks=False)
        os.replace(new, target)

    def undo(self) -> None:
        """Put back what `do` has taken away, however far it came."""
        new, target, spare = self._new, self._target, self._spare
        if self._exchanged:
            _exchanged(new, target)
        elif spare.is_dir():
            if target.exists():
                os.rename(target, new)
            os.rename(spare, target)
        elif spare.exists():
            os.replace(spare, target)
        elif target.exists() and not new.exists():
            os.rename(target, new)


def _exchanged(one: Path, other: Path) -> bool:
    """Exchange two paths in one system call; False where the system has none (it is Linux's)."""
    import ctypes

    here, exchange = -100, 2  # AT_FDCWD, RENAME_EXCHANGE
    try:
        call = ctypes.CDLL(None, use_errno=True).renameat2
    except (OSError, AttributeError, TypeError):
        return False
    return call(here, os.fsencode(one), here, os.fsencode(other), exchange) == 0
