"""What a preset is: the names and units of one logger's columns, and how its files are known."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

__all__ = ["AXES", "Preset", "Told"]

# Letter or index from 0 that stands in a name for the component of a quantity.
AXES = {
    "sensor": {"x": "x|0", "y": "y|1", "z": "z|2"},
    "quaternion": {"w": "w|s|0", "x": "x|1", "y": "y|2", "z": "z|3"},
}


class Told(NamedTuple):
    """What a preamble tells: units of quantities, and the sampling rate, Hz."""

    units: Mapping[str, str]
    rate: float | None


@dataclass(frozen=True, slots=True)
class Preset:
    """The text files of one logger.

    Parameters
    ----------
    name : str
        Short name.
    title : str
        What writes such files, and which of its files are meant.
    needs : sequence of str
        Regular expressions, each of the whole name of some column; together they tell the logger.
    columns : mapping of str to sequence of str
        Quantity → regular expressions of its columns, ``{}`` for the component; the first that is complete counts.
        "time" has no component; "counter" counts samples; "sensor" is a quantity that the unit or the name of the file
        tells; "estimate" an orientation that the device made of its sensors, used only where there is no gyroscope.
    units : mapping of str to str
        Units where the columns do not tell them.
    signs : mapping of str to float
        −1 of quantities that stand with the opposite sign.
    mark : str
        Regular expression to be found in the preamble.
    preamble : callable
        What the preamble tells, a list of its lines → ``Told``.
    earth_frame : str
        World axes of its orientations.
    """

    name: str
    title: str
    needs: Sequence[str]
    columns: Mapping[str, Sequence[str]]
    units: Mapping[str, str] = field(default_factory=dict[str, str])
    signs: Mapping[str, float] = field(default_factory=dict[str, float])
    mark: str = ""
    preamble: Callable[[list[str]], Told] | None = None
    earth_frame: str = "ENU"

    def fits(self, names: Sequence[str], preamble: Sequence[str]) -> bool:
        """Whether a file with these columns and preamble is this logger's."""
        if self.mark and not any(re.search(self.mark, line, re.IGNORECASE) for line in preamble):
            return False
        return all(any(re.fullmatch(need, name, re.IGNORECASE) for name in names) for need in self.needs)

    def find(self, names: Sequence[str], quantity: str) -> list[int]:
        """Return the columns of a quantity in order, empty if it is not complete."""
        if quantity in ("time", "counter"):
            axes = {"": ""}
        else:
            axes = AXES["quaternion" if quantity in ("estimate", "orientation") else "sensor"]
        for pattern in self.columns.get(quantity, ()):
            found: list[int] = []
            for letters in axes.values():
                wanted = re.compile(pattern.replace("{}", f"(?:{letters})"), re.IGNORECASE)
                found += [k for k, name in enumerate(names) if wanted.fullmatch(name)][:1]
            if len(found) == len(axes):
                return found
        return []
