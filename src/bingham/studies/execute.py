"""Run the chunks of a study: here, in processes of this machine (joblib), or on an existing Dask cluster."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from bingham.errors import InvalidArgumentError
from bingham.studies.store import RunStore
from bingham.studies.study import Arrays, Chunk, Study, StudyResult
from bingham.studies.workers import WorkersLostError, in_processes, on_cluster, run_chunk

__all__ = ["WorkersLostError", "execute", "finished_chunks", "run_study"]


def run_study(
    study: Study,
    *,
    runs: int | None = None,
    seed: int = 1,
    jobs: int = 1,
    scheduler: str | None = None,
    store: Callable[[dict[str, Any]], RunStore] | None = None,
    progress: Callable[[int, int], None] | None = None,
    options: Mapping[str, Any] | None = None,
) -> StudyResult:
    """Run a study and summarise it; the result does not depend on jobs, scheduler or interruptions.

    Parameters
    ----------
    study : Study
        From `load_study`.
    runs : int, optional
        Number of runs; the study's own default, ``study.default_runs``, unless given.
    seed : int
        Of the whole study, not negative.
    jobs : int
        Processes on this machine; 1 with a scheduler.
    scheduler : str, optional
        Address of a Dask scheduler, such as ``tcp://10.0.0.5:8786``; its workers need this package and do the runs.
    store : callable, optional
        identity → `RunStore` for finished chunks; nothing is kept without.
    progress : callable, optional
        Called with (chunks done, chunks in all).
    options : mapping, optional
        What else the study takes, such as a recording: of the names in ``study.options``.

    Raises
    ------
    InvalidArgumentError
        If an argument makes no sense, the study does not take an option, or the scheduler has no workers.
    WorkersLostError
        If worker processes die again and again.
    """
    count = _whole("runs", study.default_runs if runs is None else runs, 1)
    seed, jobs = _whole("seed", seed, 0), _whole("jobs", jobs, 1)
    extra = dict(options or {})
    if strange := [name for name in extra if name not in study.options]:
        taken = ", ".join(study.options) or "none"
        raise InvalidArgumentError("options", f"those that {study.name} takes: {taken}", strange[0], "leave it out")
    chunks = study.chunks(count, seed, extra)
    identity = {"study": study.name, "version": study.version, "seed": seed, "options": extra}
    results = execute(
        chunks, jobs=jobs, scheduler=scheduler, store=store(identity) if store else None, progress=progress
    )
    return study.summarize(count, seed, results)


def finished_chunks(
    chunks: Sequence[Chunk], *, jobs: int = 1, scheduler: str | None = None
) -> Iterator[tuple[str, Any]]:
    """Yield key and result of each chunk as it finishes: here, in processes, or on a cluster."""
    if scheduler is not None:
        return on_cluster(chunks, scheduler)
    if jobs == 1 or len(chunks) < 2:
        return (run_chunk(chunk) for chunk in chunks)
    return in_processes(chunks, jobs)


def execute(
    chunks: Sequence[Chunk],
    *,
    jobs: int = 1,
    scheduler: str | None = None,
    store: RunStore | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> dict[str, Arrays]:
    """Return each chunk's arrays by key, from the store or by running it; finished ones are stored at once."""
    jobs = _whole("jobs", jobs, 1)
    if scheduler is not None and jobs > 1:
        raise InvalidArgumentError(
            "jobs", "1 with a scheduler, whose workers do the runs", jobs, "leave one of them out"
        )
    results: dict[str, Arrays] = {}
    for chunk in chunks:
        stored = store.load(chunk.key) if store else None
        if stored is not None:
            results[chunk.key] = stored
    todo = [chunk for chunk in chunks if chunk.key not in results]
    if progress:
        progress(len(results), len(chunks))
    for key, arrays in finished_chunks(todo, jobs=jobs, scheduler=scheduler):
        results[key] = arrays
        if store:
            store.save(key, arrays)
        if progress:
            progress(len(results), len(chunks))
    return results


def _whole(name: str, value: Any, minimum: int) -> int:
    """Return an integer, of NumPy's too; anything else or less is rejected."""
    if isinstance(value, bool) or not isinstance(value, int | np.integer) or value < minimum:
        raise InvalidArgumentError(name, f"an integer, at least {minimum}", repr(value))
    return int(value)
