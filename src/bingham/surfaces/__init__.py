"""Surfaces seen by depth cameras: normals, plane directions, planes as unit 4-vectors.

The modules need no import of their own: ``bingham.surfaces.plane_factors.plane_factor``.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from bingham.surfaces import extraction, normals, planar_slam, plane_factors, planes, segmentation

__all__ = ["extraction", "normals", "planar_slam", "plane_factors", "planes", "segmentation"]


def __getattr__(name: str) -> Any:
    if name not in __all__:
        raise AttributeError(f"module 'bingham.surfaces' has no attribute {name!r}")
    return import_module(f"bingham.surfaces.{name}")


def __dir__() -> list[str]:
    return __all__
