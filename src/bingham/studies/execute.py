"""Run the chunks of a study: here, in processes of this machine (joblib), or on an existing Dask cluster."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any

from bingham.errors import BinghamError, InvalidArgumentError, MissingExtraError
from bingham.studies.store import RunStore
from bingham.studies.study import Arrays, Chunk, Study, StudyResult

__all__ = ["WorkersLostError", "execute", "run_study"]

# How often the pool is started again after a worker died without any chunk finished in between.
RESTARTS = 3


class WorkersLostError(BinghamError, RuntimeError):
    """Worker processes died again and again; what they had finished is stored."""


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
        Number of runs; the published number unless given.
    seed : int
        Of the whole study.
    jobs : int
        Processes on this machine.
    scheduler : str, optional
        Address of a Dask scheduler, such as ``tcp://10.0.0.5:8786``; its workers need this package.
    store : callable, optional
        identity → `RunStore` for finished chunks; nothing is kept without.
    progress : callable, optional
        Called with (chunks done, chunks in all).
    options : mapping, optional
        What else the study takes, such as a recording.
    """
    count = study.default_runs if runs is None else runs
    extra = dict(options or {})
    chunks = study.chunks(count, seed, extra)
    identity = {"study": study.name, "version": study.version, "seed": seed, "options": extra}
    results = execute(
        chunks, jobs=jobs, scheduler=scheduler, store=store(identity) if store else None, progress=progress
    )
    return study.summarize(count, seed, results)


def execute(
    chunks: Sequence[Chunk],
    *,
    jobs: int = 1,
    scheduler: str | None = None,
    store: RunStore | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> dict[str, Arrays]:
    """Return each chunk's arrays by key, from the store or by running it; finished ones are stored at once."""
    if jobs < 1:
        raise InvalidArgumentError("jobs", "at least 1", jobs)
    results: dict[str, Arrays] = {}
    for chunk in chunks:
        stored = store.load(chunk.key) if store else None
        if stored is not None:
            results[chunk.key] = stored
    todo = [chunk for chunk in chunks if chunk.key not in results]
    if progress:
        progress(len(results), len(chunks))
    if scheduler is not None:
        finished = _on_cluster(todo, scheduler)
    elif jobs == 1 or len(todo) < 2:
        finished = (_run(chunk) for chunk in todo)
    else:
        finished = _in_processes(todo, jobs)
    for key, arrays in finished:
        results[key] = arrays
        if store:
            store.save(key, arrays)
        if progress:
            progress(len(results), len(chunks))
    return results


def _run(chunk: Chunk) -> tuple[str, Arrays]:
    return chunk.key, chunk.function(**chunk.arguments)


def _in_processes(chunks: Sequence[Chunk], jobs: int) -> Iterator[tuple[str, Arrays]]:
    try:
        from joblib import Parallel, delayed
        from joblib.externals.loky.process_executor import BrokenProcessPool
    except ImportError as error:
        raise MissingExtraError("joblib", "cli", "running a study in several processes") from error

    todo = {chunk.key: chunk for chunk in chunks}
    lost = 0
    while todo:
        try:
            pool: Any = Parallel(n_jobs=jobs, return_as="generator_unordered")
            for key, arrays in pool(delayed(_run)(chunk) for chunk in list(todo.values())):
                del todo[key]
                lost = 0
                yield key, arrays
        except BrokenProcessPool as error:
            # A worker was killed (out of memory, by hand): the others' results are in, its own chunk runs again.
            lost += 1
            if lost > RESTARTS:
                raise WorkersLostError(f"workers died {lost} times in a row with {len(todo)} chunks left; "
                                       "run again with fewer --jobs to continue") from error  # fmt: skip


def _on_cluster(chunks: Sequence[Chunk], scheduler: str) -> Iterator[tuple[str, Arrays]]:
    try:
        from dask.distributed import Client, as_completed
    except ImportError as error:
        raise MissingExtraError("distributed", "dask", "running a study on a Dask cluster") from error

    if not chunks:
        return
    try:
        client = Client(scheduler, timeout=10)
    except (OSError, ValueError, TypeError) as error:
        remedy = "start one with `dask scheduler`, workers with `dask worker`"
        raise InvalidArgumentError("scheduler", "a running Dask scheduler", repr(scheduler), remedy) from error
    with client:
        # Tasks of a worker that dies are given to others by the scheduler.
        futures = [client.submit(_run, chunk, pure=False, retries=RESTARTS) for chunk in chunks]
        for _, result in as_completed(futures, with_results=True):
            yield result
