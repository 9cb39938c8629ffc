"""What `bingham track` was told to do with every recording."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

if TYPE_CHECKING:
    from bingham.cli.filtering import FilterOptions
    from bingham.cli.fusion import Beside
    from bingham.cli.output import Outputs

__all__ = ["Settings"]


class Settings(NamedTuple):
    """What to do with every recording."""

    format: str | None
    reading: dict[str, Any]
    filtering: FilterOptions
    outputs: Outputs
    orientation_topic: str | None = None
    calibration: Path | None = None
    beside: Beside | None = None
