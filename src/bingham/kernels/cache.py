"""Machine code on disk, keyed by the sources it was made from, and no obstacle where the disk fails.

Numba keys a function by the text of its own file, so that a changed callee in another file goes unnoticed. Here the key
also holds the text of every module of this package that the file imports from, however indirectly. A folder that
cannot be written, a full disk or a damaged file cost a compilation and one warning, never the result.
"""

from __future__ import annotations

import hashlib
import pickle
import re
import warnings
from collections.abc import Callable
from contextlib import suppress
from functools import cache
from pathlib import Path
from typing import Any

from numba.core import caching
from numba.core.serialize import dumps

__all__ = ["kernel_cache", "source_digest"]

IMPORTED = re.compile(r"^\s*from bingham\.kernels(?:\.(\w+))? import (.+)", re.MULTILINE)
PACKAGE = Path(__file__).parent
HINT = "results are the same, the next run compiles again; NUMBA_CACHE_DIR names another folder"

warned: list[str] = []


def _warn(message: str) -> None:
    """Warn of the first failure of a process only: the others have the same cause."""
    if not warned:
        warned.append(message)
        warnings.warn(f"{message} ({HINT})", RuntimeWarning, stacklevel=2)


@cache
def source_digest(path: Path) -> bytes:
    """Return a digest of the file and of all modules of this package that it imports from, directly or not."""
    texts: dict[str, bytes] = {}
    waiting = [path]
    while waiting:
        file = waiting.pop()
        if file.name in texts or not file.exists():
            continue
        texts[file.name] = file.read_bytes()
        for module, names in IMPORTED.findall(texts[file.name].decode("utf-8")):
            waiting += [PACKAGE / f"{stem}.py" for stem in ([module] if module else re.findall(r"\w+", names))]
    return hashlib.sha256(b"\0".join(name.encode() + b"\0" + texts[name] for name in sorted(texts))).digest()


class _BySources:
    """Mixed into Numba's locators: the stamp of a cache is the text of all that its functions are made from."""

    _py_file: str

    def get_source_stamp(self) -> bytes:
        return source_digest(Path(self._py_file))


class _Given(_BySources, caching.UserProvidedCacheLocator):
    """The folder that NUMBA_CACHE_DIR names."""


class _BesideSource(_BySources, caching.InTreeCacheLocator):
    """``__pycache__`` beside the source."""


class _Shipped(_BySources, caching.InTreeCacheLocator):
    """``__pycache__`` beside the source, that can be read and not written: of a package somebody else installed."""

    @classmethod
    def from_function(cls, py_func: Any, py_file: str) -> Any:
        """Return a locator if there is machine code of some function of the file."""
        return cls(py_func, py_file) if Path(py_file).stem in _compiled_beside(Path(py_file).parent) else None


class _OfUser(_BySources, caching.UserWideCacheLocator):
    """The user's cache folder."""


@cache
def _compiled_beside(folder: Path) -> frozenset[str]:
    """Return the modules of a folder that ``__pycache__`` has machine code of."""
    return frozenset(path.name.partition(".")[0] for path in (folder / "__pycache__").glob("*.nbi"))


class _Checked(caching.CompileResultCacheImpl):
    """Machine code behind its checksum: damaged code would be executed."""

    _locator_classes = (_Given, _BesideSource, _OfUser)

    def reduce(self, cres: Any) -> tuple[bytes, bytes]:
        data = dumps(super().reduce(cres))
        return hashlib.sha256(data).digest(), data

    def rebuild(self, target_context: Any, payload: tuple[bytes, bytes]) -> Any:
        digest, data = payload
        if hashlib.sha256(data).digest() != digest:
            raise ValueError("damaged")
        return super().rebuild(target_context, pickle.loads(data))


class _KernelCache(caching.FunctionCache):
    _impl_class = _Checked

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        try:
            return super().load_overload(sig, target_context)
        except Exception as error:  # a damaged pickle raises anything
            _warn(f"compiled code in {self.cache_path} cannot be read: {error!r}")
            with suppress(OSError):
                self.flush()
            return None

    def save_overload(self, sig: Any, data: Any) -> None:
        try:
            super().save_overload(sig, data)
        except Exception as error:  # as above, or a full disk
            _warn(f"compiled code cannot be kept in {self.cache_path}: {error!r}")


class _CheckedShipped(_Checked):
    _locator_classes = (_Shipped,)


class _ShippedCache(_KernelCache):
    """Machine code from a folder that cannot be written, and what it lacks from another cache."""

    _impl_class = _CheckedShipped

    def __init__(self, function: Callable[..., Any], other: Any) -> None:
        super().__init__(function)
        self._other = other

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        found = super().load_overload(sig, target_context)
        return self._other.load_overload(sig, target_context) if found is None else found

    def save_overload(self, sig: Any, data: Any) -> None:
        self._other.save_overload(sig, data)


class _NoCache(caching.NullCache):
    def save_overload(self, sig: Any, cres: Any) -> None:
        _warn("no folder for compiled code can be written, neither the package's nor the user's cache")


def kernel_cache(function: Callable[..., Any]) -> Any:
    """Return the cache of one compiled function, for Numba's dispatcher."""
    own: Any
    try:
        own = _KernelCache(function)
        if not isinstance(own._impl.locator, _OfUser):
            return own
    except (RuntimeError, OSError):  # Numba found no locator
        own = _NoCache()
    try:
        return _ShippedCache(function, own)
    except (RuntimeError, OSError):
        return own
