"""Where the chunks of a study run: processes of this machine (joblib), or an existing Dask cluster."""

from __future__ import annotations

import os
import threading
import time
from collections.abc import Iterator, Sequence
from typing import Any

from bingham.errors import BinghamError, InvalidArgumentError, MissingExtraError
from bingham.studies.study import Arrays, Chunk

__all__ = ["WorkersLostError", "in_processes", "on_cluster", "run_chunk"]

# How often the pool is started again after a worker died without any chunk finished in between.
RESTARTS = 3
# How often a worker looks whether the process that started it still lives, in seconds.
WATCH_EVERY = 0.5
_watching = False
# How long a scheduler may take to answer, in seconds.
CONNECT_WAIT = 10.0
# How long a cluster may be without any worker, in seconds.
WORKER_WAIT = 30.0


class WorkersLostError(BinghamError, RuntimeError):
    """Worker processes died again and again, or all went away; what they had finished is stored."""


def run_chunk(chunk: Chunk) -> tuple[str, Arrays]:
    """Return the key and the arrays of a chunk."""
    return chunk.key, chunk.function(**chunk.arguments)


def _run_below(chunk: Chunk, parent: int) -> tuple[str, Arrays]:
    """Run a chunk in a worker process, which ends when the process that has started it is gone."""
    global _watching
    if not _watching:
        _watching = True
        threading.Thread(target=_end_with, args=(parent,), daemon=True).start()
    return run_chunk(chunk)


def _end_with(parent: int) -> None:
    while os.getppid() == parent:
        time.sleep(WATCH_EVERY)
    os._exit(1)


def in_processes(chunks: Sequence[Chunk], jobs: int) -> Iterator[tuple[str, Arrays]]:
    """Yield key and arrays of each chunk as it finishes in one of so many processes."""
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
            for key, arrays in pool(delayed(_run_below)(chunk, os.getpid()) for chunk in list(todo.values())):
                del todo[key]
                lost = 0
                yield key, arrays
        except BrokenProcessPool as error:
            # A worker was killed (out of memory, by hand): the others' results are in, its own chunk runs again.
            lost += 1
            if lost > RESTARTS:
                raise WorkersLostError(f"workers died {lost} times in a row with {len(todo)} chunks left; "
                                       "run again with fewer --jobs to continue") from error  # fmt: skip


def on_cluster(chunks: Sequence[Chunk], scheduler: str) -> Iterator[tuple[str, Arrays]]:
    """Yield key and arrays of each chunk as it finishes on a worker of the Dask scheduler at this address."""
    try:
        from dask.distributed import Client
    except ImportError as error:
        raise MissingExtraError("distributed", "dask", "running a study on a Dask cluster") from error

    if not chunks:
        return
    try:
        client: Any = Client(scheduler, timeout=CONNECT_WAIT)
    except (OSError, ValueError, TypeError) as error:
        hint = "start one with `dask scheduler`, workers with `dask worker`"
        raise InvalidArgumentError("scheduler", "a running Dask scheduler", repr(scheduler), hint) from error
    with client:
        # Tasks of a worker that dies are given to others by the scheduler. They are there before the first worker is:
        # a cluster that adapts to its load starts workers only for them.
        futures = [client.submit(run_chunk, chunk, pure=False, retries=RESTARTS) for chunk in chunks]
        try:
            client.wait_for_workers(1, timeout=WORKER_WAIT)
        except TimeoutError as error:
            raise InvalidArgumentError(
                "scheduler", "one with workers", f"{scheduler!r}, which has had none for {WORKER_WAIT:g} s",
                f"start some with `dask worker {scheduler}`") from error  # fmt: skip
        yield from _finished(client, futures, scheduler)


def _finished(client: Any, futures: list[Any], scheduler: str) -> Iterator[tuple[str, Arrays]]:
    from dask.distributed import KilledWorker, as_completed

    pending = set(futures)

    def lost(what: str) -> WorkersLostError:
        return WorkersLostError(f"{what} with {len(pending)} chunks left; look at the workers' memory and logs, "
                                f"start some with `dask worker {scheduler}`, and run again to continue")  # fmt: skip

    def ready() -> Any:
        # Results come with the futures: fetching one from a worker that has died would wait without end.
        return as_completed(pending, with_results=True, raise_errors=False, timeout=WORKER_WAIT)

    finished = ready()
    while pending:
        try:
            future, result = next(finished)
        except TimeoutError:
            try:
                client.wait_for_workers(1, timeout=WORKER_WAIT)
            except TimeoutError as error:
                raise lost("all workers are gone") from error
            finished = ready()
            continue
        if future.status == "cancelled":
            raise lost("the scheduler has dropped the runs")
        if future.status == "error":
            if isinstance(result[1], KilledWorker):
                raise lost("the same run lost its worker again and again") from result[1]
            raise result[1]
        pending.discard(future)
        yield result
