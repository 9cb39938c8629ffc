"""All formats, in the order in which a file is compared with them; the widest comes last."""

from __future__ import annotations

from bingham.io import broad, csv, euroc, kitti, npz, opensim, rosbag, tum
from bingham.io.registry import Format

__all__ = ["FORMATS", "supported"]

FORMATS: dict[str, Format] = {
    module.FORMAT.name: module.FORMAT for module in (rosbag, euroc, kitti, opensim, broad, npz, tum, csv)
}


def supported() -> str:
    """Return what is supported, in a line."""
    return f"supported: {', '.join(f.title for f in FORMATS.values())}; see bingham formats"
