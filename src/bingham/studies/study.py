"""What a study is: independent chunks of runs, and a summary of their results as table and curves."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bingham.errors import InvalidArgumentError

__all__ = [
    "Arrays",
    "Chunk",
    "Row",
    "Study",
    "StudyResult",
    "generator",
    "joined",
    "mean_row",
    "range_chunks",
    "wins_row",
]

Arrays = dict[str, NDArray[Any]]


@dataclass(frozen=True, slots=True)
class Row:
    """One figure of a study's table; ``stderr`` and ``paper`` are None where there is none."""

    case: str
    filter: str
    metric: str
    value: float
    stderr: float | None = None
    paper: float | None = None


@dataclass(frozen=True, slots=True)
class Chunk:
    """A part of a study that runs on its own: ``function(**arguments)`` returns a dict of arrays.

    The function must be importable by name (workers receive it pickled) and draw its random numbers from
    `generator`, so that its result does not depend on where or when it runs.
    """

    key: str
    function: Callable[..., Arrays]
    arguments: Mapping[str, Any]


@dataclass(frozen=True)
class StudyResult:
    """What a study found: the table, and curves for its figures.

    Of a long table, cases and metrics with a published value are printed, and all of ``headline``, metrics that a paper
    shows as figures only.
    """

    study: str
    runs: int
    seed: int
    table: Sequence[Row]
    curves: Arrays = field(default_factory=dict)
    headline: tuple[str, ...] = ()

    def as_dict(self) -> dict[str, Any]:
        """Return the part that goes into JSON: study, runs, seed and table."""
        return {"study": self.study, "runs": self.runs, "seed": self.seed, "table": [asdict(row) for row in self.table]}

    def value(self, case: str, filter: str, metric: str) -> float:
        """Return one figure of the table."""
        for row in self.table:
            if (row.case, row.filter, row.metric) == (case, filter, metric):
                return row.value
        raise InvalidArgumentError("case, filter, metric", "a row of the table", (case, filter, metric))


@dataclass(frozen=True)
class Study:
    """A published comparison that can be run again.

    Parameters
    ----------
    name : str
        As given to ``bingham reproduce``.
    title : str
        One line: authors, year, subject.
    default_runs : int
        Number of runs unless the user names one; where it is not the published number, a comment says why.
    chunks : callable
        (runs, seed, options) → the chunks to run.
    summarize : callable
        (runs, seed, results by chunk key) → table and curves.
    version : int
        Raised whenever a chunk's results change, so that stored ones are not mixed with new ones.
    options : tuple of str
        Names of what ``chunks`` takes besides; all others are rejected.
    """

    name: str
    title: str
    default_runs: int
    chunks: Callable[[int, int, Mapping[str, Any]], list[Chunk]]
    summarize: Callable[[int, int, Mapping[str, Arrays]], StudyResult]
    version: int = 1
    options: tuple[str, ...] = ()


def generator(seed: int, *key: int) -> np.random.Generator:
    """Return the generator of one run: its stream depends on the study's seed and the run's own key, nothing else."""
    return np.random.default_rng(np.random.SeedSequence(seed, spawn_key=key))


def range_chunks(prefix: str, function: Callable[..., Arrays], runs: int, size: int, **arguments: Any) -> list[Chunk]:
    """Return chunks ``function(**arguments, first=..., last=...)`` of at most ``size`` runs first … last − 1.

    Their keys begin with the prefix and sort by run, as `joined` wants them.
    """
    spans = [(first, min(first + size, runs)) for first in range(0, runs, size)]
    return [
        Chunk(f"{prefix}{first:07d}-{last:07d}", function, {**arguments, "first": first, "last": last})
        for first, last in spans
    ]


def joined(results: Mapping[str, Arrays], prefix: str, name: str) -> NDArray[Any]:
    """Return the array ``name`` of all chunks whose key starts with ``prefix``, one after the other in key order."""
    return np.concatenate([results[key][name] for key in sorted(results) if key.startswith(prefix)])


def mean_row(case: str, filter: str, metric: str, values: Any, paper: float | None = None) -> Row:
    """Return the row of a mean over runs with its standard error (None for a single run)."""
    x = np.asarray(values, dtype=np.float64)
    stderr = float(x.std(ddof=1) / np.sqrt(x.size)) if x.size > 1 else None
    return Row(case, filter, metric, float(x.mean()), stderr, paper)


def wins_row(case: str, filter: str, won: Any, paper: float | None = None) -> Row:
    """Return the row of the number of runs won (booleans), with its binomial standard error."""
    x = np.asarray(won, dtype=bool)
    share = float(x.mean())
    return Row(case, filter, "wins", float(x.sum()), float(np.sqrt(x.size * share * (1.0 - share))), paper)
