"""Columns of a table that hold angles, decoded row by row to unit vectors with the line of what is wrong."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bingham.errors import InvalidArgumentError, RecordingError, Setting
from bingham.io.angles import AngleKind, recognised
from bingham.io.table import Table

__all__ = ["Written", "decoded", "rotation_angles"]


class Written(NamedTuple):
    """Angles in a table: their kind, their columns in order, and whether they are in radians."""

    kind: AngleKind
    columns: list[int]
    radians: bool


def rotation_angles(names: Sequence[str], kind: AngleKind | None) -> Written | None:
    """Return the columns that hold rotations, or azimuths in the plane, as angles; None if there are none.

    A kind that the caller names is looked for by the names of its columns; without, what the names tell.
    """
    found = recognised(names)
    if found is not None and (kind is None or found[0].name == kind.name):
        return Written(*found) if len(found[0].vector) in (2, 4) and (kind or len(found[1]) > 1) else None
    if kind is not None and set(kind.columns) <= set(names):
        return Written(kind, [list(names).index(name) for name in kind.columns], False)
    return None


def decoded(table: Table, written: Written) -> NDArray[np.float64]:
    """Return the unit vectors (N, d) of angles.

    Raises
    ------
    RecordingError
        If a row is not finite or has no meaning, naming its line.
    """
    kind, columns = written.kind, written.columns
    rows = table.matrix(columns, [1.0] * len(columns))
    path = table.text.path
    finite = np.isfinite(rows).all(axis=1)
    if not finite.all():
        place = table.place(columns, int(np.argmin(finite)))
        raise RecordingError(path, place, "not finite", "remove the row or complete it")
    if written.radians and kind.degrees:
        rows = np.degrees(rows)
    try:
        return kind.decode(rows)
    except InvalidArgumentError:
        for k in range(len(rows)):
            try:
                kind.decode(rows[k : k + 1])
            except InvalidArgumentError as error:
                problem = f"no {' '.join(kind.columns)}: {error}"
                hint = ("correct the row, or name the kind by ", Setting("angles"))
                raise RecordingError(path, table.place(columns, k), problem, hint) from None
        raise
