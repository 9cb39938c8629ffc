import multiprocessing
import os
import signal
import threading
import time

import numpy as np
import pytest

from bingham.errors import InvalidArgumentError
from bingham.studies import STUDIES, load_study, workers
from bingham.studies.execute import WorkersLostError, execute, run_study
from bingham.studies.store import RunStore
from bingham.studies.study import Chunk, Study, StudyResult, generator


def draw(seed, run):
    return {"x": generator(seed, run).standard_normal(5)}


def draw_or_die(seed, run, flag):
    """Kill the worker process the first time that run 2 is tried."""
    if run == 2 and multiprocessing.parent_process() is not None and not os.path.exists(flag):
        open(flag, "w").close()
        time.sleep(0.3)
        os.kill(os.getpid(), signal.SIGKILL)
    return draw(seed, run)


def die(seed, run):
    """Kill any worker process, never the one that the tests run in."""
    if multiprocessing.parent_process() is not None:
        os.kill(os.getpid(), signal.SIGKILL)
    return draw(seed, run)


def fail(seed, run):
    raise InvalidArgumentError("run", "a run that can be made", 0)


def draw_slowly(seed, run):
    time.sleep(0.2)
    return draw(seed, run)


def chunks(function=draw, count=6, **more):
    return [Chunk(f"run-{i}", function, {"seed": 3, "run": i, **more}) for i in range(count)]


def same(a, b):
    return a.keys() == b.keys() and all(np.array_equal(a[k]["x"], b[k]["x"]) for k in a)


def test_results_do_not_depend_on_the_number_of_jobs():
    assert same(execute(chunks(), jobs=1), execute(chunks(), jobs=2))


def test_a_killed_worker_loses_nothing(tmp_path):
    store = RunStore(tmp_path, {"study": "demo"})
    found = execute(chunks(draw_or_die, flag=str(tmp_path / "flag")), jobs=2, store=store)
    assert (tmp_path / "flag").exists()
    assert same(found, execute(chunks()))
    assert same({f"run-{i}": store.load(f"run-{i}") for i in range(6)}, found)


def test_an_interrupted_study_continues(tmp_path):
    store = RunStore(tmp_path, {"study": "demo"})

    def interrupt(done, total):
        if done == 3:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        execute(chunks(), store=store, progress=interrupt)
    seen = []
    found = execute(chunks(), store=store, progress=lambda done, total: seen.append((done, total)))
    assert seen[0] == (3, 6)
    assert same(found, execute(chunks()))


def test_stored_runs_of_another_seed_are_not_used(tmp_path):
    first, second = RunStore(tmp_path, {"study": "demo", "seed": 1}), RunStore(tmp_path, {"study": "demo", "seed": 2})
    first.save("run-0", {"x": np.ones(3)})
    assert second.load("run-0") is None
    np.testing.assert_array_equal(first.load("run-0")["x"], np.ones(3))


def test_a_damaged_file_is_run_again(tmp_path):
    store = RunStore(tmp_path, {"study": "demo"})
    store.save("run-0", {"x": np.ones(3)})
    path = store.folder / "run-0.npz"
    path.write_bytes(path.read_bytes()[:50])
    assert store.load("run-0") is None
    store.save("run-0", {"x": np.ones(3)})
    assert np.array_equal(store.load("run-0")["x"], np.ones(3))
    for change in ({"x": np.zeros(3)}, {"x": np.ones(2)}, {"y": np.ones(3)}, {"x": np.ones(3, dtype=np.float32)}):
        with np.load(path) as stored:
            checksum = stored["checksum"]
        np.savez(path, **change, checksum=checksum)
        assert store.load("run-0") is None
    store.save("run-1", {"x": np.ones(3)})
    (store.folder / "run-1.npz").replace(path)  # another chunk's
    assert store.load("run-0") is None
    assert [p.name for p in store.folder.iterdir()] == ["run-0.npz"]


@pytest.fixture(scope="module")
def cluster():
    """Two worker processes on loopback; the scheduler gives a dead worker's tasks to others at once."""
    distributed = pytest.importorskip("dask.distributed", reason="extra 'dask' not installed")
    with distributed.LocalCluster(
        n_workers=2, threads_per_worker=1, processes=True, host="127.0.0.1", dashboard_address=None
    ) as running:
        yield running


def test_a_cluster_gives_the_same_results(cluster):
    study = load_study("kurz2013")
    there = run_study(study, runs=120, seed=4, scheduler=cluster.scheduler_address)
    here = run_study(study, runs=120, seed=4)
    kept = [[row for row in r.table if row.metric != "us_per_step"] for r in (there, here)]
    assert kept[0] == kept[1]


def test_a_killed_dask_worker_loses_nothing(cluster, tmp_path):
    store = RunStore(tmp_path, {"study": "demo"})
    killed, found = [], {}

    def kill_one(done, total):
        # Both workers have tasks under way then.
        if done == 2:
            killed.append(next(iter(cluster.workers.values())).pid)
            os.kill(killed[0], signal.SIGKILL)

    def run():
        address = cluster.scheduler_address
        found.update(execute(chunks(draw_slowly, count=12), scheduler=address, store=store, progress=kill_one))

    thread = threading.Thread(target=run, daemon=True)
    thread.start()
    thread.join(timeout=40.0)
    assert not thread.is_alive(), "the run hangs after a worker was killed"
    assert killed and killed[0] not in {nanny.pid for nanny in cluster.workers.values()}
    assert same(found, execute(chunks(count=12)))
    assert same({key: store.load(key) for key in found}, found)


def test_a_run_that_kills_every_dask_worker_ends_in_words(cluster):
    before, cluster.scheduler.allowed_failures = cluster.scheduler.allowed_failures, 0
    try:
        with pytest.raises(WorkersLostError, match="lost its worker again and again with 1 chunks left"):
            execute(chunks(die, count=1), scheduler=cluster.scheduler_address)
    finally:
        cluster.scheduler.allowed_failures = before


def test_an_error_on_a_dask_worker_arrives_as_it_is(cluster):
    with pytest.raises(InvalidArgumentError, match="a run that can be made"):
        execute(chunks(fail, count=1), scheduler=cluster.scheduler_address)


def test_an_error_in_a_process_arrives_as_it_is():
    with pytest.raises(InvalidArgumentError, match="a run that can be made, got 0") as caught:
        execute(chunks(fail, count=2), jobs=2)
    assert (caught.value.argument, caught.value.got) == ("run", 0)


def test_a_run_that_kills_every_process_ends_in_words():
    with pytest.raises(WorkersLostError, match="workers died 4 times in a row with 2 chunks left"):
        execute(chunks(die, count=2), jobs=2)


@pytest.fixture
def lone_scheduler(monkeypatch):
    """A scheduler whose workers a test brings, and little patience with it."""
    distributed = pytest.importorskip("dask.distributed", reason="extra 'dask' not installed")
    monkeypatch.setattr(workers, "WORKER_WAIT", 0.5)
    with distributed.LocalCluster(
        n_workers=0, threads_per_worker=1, host="127.0.0.1", dashboard_address="127.0.0.1:0"
    ) as running:
        yield running


def test_a_scheduler_without_workers_ends_in_words(lone_scheduler):
    address = lone_scheduler.scheduler_address
    with pytest.raises(InvalidArgumentError, match=f"scheduler: expected one with workers.*`dask worker {address}`"):
        execute(chunks(), scheduler=address)


def test_a_cluster_that_loses_all_its_workers_ends_in_words(lone_scheduler, tmp_path):
    lone_scheduler.scale(1)
    lone_scheduler.wait_for_workers(1, timeout=30.0)
    store = RunStore(tmp_path, {"study": "demo"})

    def dismiss(done, total):
        if done == 1:
            lone_scheduler.scale(0)

    with pytest.raises(WorkersLostError, match="all workers are gone"):
        execute(chunks(draw_slowly, count=50), scheduler=lone_scheduler.scheduler_address, store=store,
                progress=dismiss)  # fmt: skip
    assert list(store.folder.glob("*.npz"))


NOTHING = Study("demo", "none", 5, lambda runs, seed, options: [],
                lambda runs, seed, results: StudyResult("demo", runs, seed, []), options=("recording",))  # fmt: skip


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ({"runs": 0}, "runs: expected an integer, at least 1, got 0"),
        ({"runs": 2.5}, "runs: expected an integer, at least 1, got 2.5"),
        ({"runs": True}, "runs: expected an integer"),
        ({"seed": -1}, "seed: expected an integer, at least 0, got -1"),
        ({"seed": "1"}, "seed: expected an integer, at least 0, got '1'"),
        ({"jobs": 0}, "jobs: expected an integer, at least 1, got 0"),
        ({"jobs": 2, "scheduler": "tcp://10.0.0.5:8786"}, "jobs: expected 1 with a scheduler"),
        ({"options": {"recorded": 1}}, "options: expected those that demo takes: recording, got recorded"),
    ],
)
def test_run_study_rejects(arguments, words):
    with pytest.raises(InvalidArgumentError, match=words):
        run_study(NOTHING, **arguments)


def test_run_study_passes_on_what_it_is_given():
    assert run_study(NOTHING, options={"recording": 1}).runs == 5
    result = run_study(NOTHING, runs=np.int64(7), seed=np.int64(0))
    assert (result.runs, result.seed) == (7, 0)
    assert type(result.runs) is int, "JSON has no place for NumPy's"


def test_no_study_takes_an_option_that_it_does_not_name():
    for name in STUDIES:
        if not load_study(name).options:
            with pytest.raises(InvalidArgumentError, match=f"{name} takes: none, got orientation"):
                run_study(load_study(name), runs=1, options={"orientation": np.eye(4)})


def test_refusals():
    with pytest.raises(InvalidArgumentError, match="one of kurz2013"):
        load_study("kurz1813")
    with pytest.raises(InvalidArgumentError, match="jobs"):
        execute([], jobs=0)


def test_every_study_is_named_as_it_is_called():
    for name in STUDIES:
        assert load_study(name).name == name
