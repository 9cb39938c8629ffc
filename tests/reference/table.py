"""Read `normalizer.json` and compare with it, digits beyond double precision included."""

from __future__ import annotations

import json
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np
from mpmath import mp, mpf
from numpy.typing import NDArray

DIMENSIONS = (2, 3, 4, 5, 6, 10, 20, 50)


@dataclass(frozen=True)
class Reference:
    """One spectrum z (d,) with log F, selected moments {i: ω_i} and Hessian entries {(i, j): ∂ω_i/∂z_j}."""

    family: str
    z: NDArray[np.float64]
    log_normalizer: mpf
    moments: dict[int, mpf]
    hessian: dict[tuple[int, int], mpf]


@cache
def references(d: int) -> tuple[Reference, ...]:
    """Return every spectrum of dimension d in the table."""
    rows = json.loads(Path(__file__).with_name("normalizer.json").read_text())["rows"]
    with mp.workdps(30):
        return tuple(
            Reference(
                row["family"],
                np.array(row["z"]),
                mpf(row["log_normalizer"]),
                {i: mpf(v) for i, v in row["moments"]},
                {(i, j): mpf(v) for i, j, v in row["hessian"]},
            )
            for row in rows
            if len(row["z"]) == d
        )


def error_of_exp(value: float, reference: mpf) -> float:
    """Relative error of exp(value) against exp(reference)."""
    with mp.workdps(30):
        return float(abs(mp.expm1(mpf(float(value)) - reference)))


def relative_error(value: float, reference: mpf) -> float:
    """|value/reference − 1|."""
    with mp.workdps(30):
        return float(abs(mpf(float(value)) / reference - 1))
