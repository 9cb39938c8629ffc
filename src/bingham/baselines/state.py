"""What states made of arrays with leading batch axes share: rows of a track as one state, parts of it, a short repr."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import fields
from typing import Any, Self

import numpy as np

from bingham.validation import unchecked

__all__ = ["ArrayState"]


class ArrayState:
    """Base of frozen dataclasses whose fields are arrays (..., …) with the same leading axes as ``mode`` (..., d)."""

    __slots__ = ()

    @property
    def mode(self) -> Any:
        """Unit vectors (..., d)."""
        raise NotImplementedError

    @classmethod
    def stacked(cls, states: Sequence[Self], axis: int) -> Self:
        """Return one state of several, with them on a new axis."""
        columns = {f.name: np.stack([getattr(s, f.name) for s in states], axis=axis) for f in fields(cls)}  # type: ignore[arg-type]
        return unchecked(cls, **columns)

    def __getitem__(self, index: Any) -> Self:
        """Return part of a batch."""
        return unchecked(type(self), **{f.name: getattr(self, f.name)[index] for f in fields(self)})  # type: ignore[arg-type]

    def __repr__(self) -> str:
        batch = self.mode.shape[:-1]
        if batch:
            return f"<{type(self).__name__}, batch {batch}, d = {self.mode.shape[-1]}>"
        parts = (f"{f.name}={np.array2string(np.asarray(getattr(self, f.name)), precision=4, separator=', ')}"
                 for f in fields(self) if np.ndim(getattr(self, f.name)) < 2)  # type: ignore[arg-type]  # fmt: skip
        spread = getattr(self, "covariance", None)
        std = () if spread is None else (f"std={np.array2string(np.sqrt(np.diagonal(spread)), precision=3)}",)
        return f"{type(self).__name__}({', '.join([*parts, *std])})".replace("\n", "")
