"""Figures of the studies: one module a study, each with a function ``draw(result)``."""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING

from bingham.studies.study import StudyResult

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["draw"]


def draw(result: StudyResult) -> dict[str, Figure]:
    """Return a study's figures by short name; save them with ``figure.savefig``."""
    module = import_module(f"bingham.plot.studies.{result.study.replace('-', '_')}")
    return module.draw(result)
