"""``bingham doctor``: what is installed and where things are kept, to be pasted into a question."""

from __future__ import annotations

import os
import sys
from pathlib import Path
from typing import Any

import typer

__all__ = ["register"]

# Extra → packages it brings.
PACKAGES = {
    "always": ("numpy", "scipy", "numba"),
    "cli": ("typer", "rich", "joblib"),
    "plot": ("matplotlib",),
    "io": ("pandas", "pyarrow", "h5py", "rosbags"),
    "dask": ("dask", "distributed"),
    "torch": ("torch",),
    "jax": ("jax",),
    "slam": ("gtsam",),
}


def register(app: typer.Typer) -> None:
    """Add the command to the application."""
    app.command()(doctor)


def doctor(as_json: bool = typer.Option(False, "--json", help="Print one JSON object on standard output.")) -> None:
    """Show versions, caches, threads and optional packages, and what is wrong with them."""
    from bingham.cli.terminal import print_json, say

    found = examine()
    if as_json:
        print_json(found)
        return
    for name in ("bingham", "python", "platform"):
        say(f"{name:<16}{found[name]}")
    for extra, packages in found["packages"].items():
        listed = ", ".join(f"{name} {number or '(absent)'}" for name, number in packages.items())
        say(f"{extra:<16}{listed}")
    for name, place in found["caches"].items():
        say(f"{name:<16}{place['folder']} ({'can be written' if place['writable'] else 'CANNOT BE WRITTEN'})")
    say(f"{'threads':<16}{found['processors']} processors, Numba uses {found['numba_threads']}")
    for problem in found["problems"]:
        say(f"{'problem':<16}{problem}")


def examine() -> dict[str, Any]:
    """Return what `bingham doctor` shows."""
    import platform

    import numba

    import bingham
    from bingham.sampling.cache import cache_folder

    packages = {extra: {name: _version(name) for name in names} for extra, names in PACKAGES.items()}
    caches = {
        "kernel cache": _place(_kernel_cache()),
        "point sets": _place(cache_folder()),
    }
    problems = [
        f"{name}: {place['folder']} cannot be written; set {variable} to a folder that can"
        for (name, place), variable in zip(caches.items(), ("NUMBA_CACHE_DIR", "BINGHAM_CACHE"), strict=True)
        if not place["writable"]
    ]
    problems += [
        f"{name} is absent; pip install 'bingham[{extra}]'"
        for extra in ("cli", "plot", "io")
        for name, number in packages[extra].items()
        if number is None
    ]
    return {
        "bingham": bingham.__version__,
        "python": f"{platform.python_version()} ({sys.executable})",
        "platform": platform.platform(),
        "packages": packages,
        "caches": caches,
        "processors": os.cpu_count(),
        "numba_threads": numba.get_num_threads(),
        "problems": problems,
    }


def _version(package: str) -> str | None:
    from importlib.metadata import PackageNotFoundError, version

    try:
        return version(package)
    except PackageNotFoundError:
        return None


def _kernel_cache() -> Path:
    """Return where Numba keeps the machine code of the kernels."""
    import bingham.kernels.rule as some

    for value in vars(some).values():
        if (path := getattr(getattr(value, "_cache", None), "_cache_path", None)) is not None:
            return Path(path)
    return Path(some.__file__).parent / "__pycache__"


def _place(folder: Path) -> dict[str, Any]:
    there = next((p for p in (folder, *folder.absolute().parents) if os.path.isdir(p)), folder)
    return {"folder": str(folder), "writable": os.access(there, os.W_OK | os.X_OK)}
