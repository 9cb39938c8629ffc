"""One predict and one update: inside a compiled run, through the objects, and in the peers."""

from __future__ import annotations

from time import perf_counter

import numba
import numpy as np
from bingham import Bingham, BinghamFilter, Gyroscope, HeadingSensor, VectorSensor
from bingham.filters.run import each_step

from timing import Row, best_of, best_once

NOISE = {2: ([-200.0, 0.0], [-50.0, 0.0]), 4: ([-800.0, -600.0, -400.0, 0.0], [-120.0, -80.0, -50.0, 0.0])}
RUN_LIMIT, OBJECT_LIMIT, BATCH_LIMIT = {2: 1e-6, 4: 2.5e-6}, 25e-6, 1.5e-6


def distribution(z: list[float]) -> Bingham:
    """Return the distribution with concentrations z whose mode is the identity."""
    return Bingham(z, np.eye(len(z))[:, ::-1])


def case(d: int, steps: int) -> tuple[BinghamFilter, Bingham, np.ndarray]:
    """Return a filter, a prior and measurements (steps, d) of a slowly turning state."""
    process, sensor = (distribution(z) for z in NOISE[d])
    y = sensor.rvs(steps, rng=3)
    return BinghamFilter(process, sensor), process, np.ascontiguousarray(y)


def measure() -> list[Row]:
    """Return the rows of this topic."""
    numba.set_num_threads(1)
    rows: list[Row] = []
    for d in (4, 2):
        topic = f"predict + update, d = {d}"
        f, prior, y = case(d, 20_000)
        peer = pyrecest(d, y)
        # Asked of d = 4: 2.5 µs, or 1/15 000 of PyRecEst's time in the same run, whichever is looser.
        limit = max(RUN_LIMIT[d], peer / 15_000) if d == 4 else RUN_LIMIT[d]
        in_run = best_of(lambda f=f, prior=prior, y=y: f.run(prior, y), per=len(y))
        rows.append(Row(topic, "bingham, inside `run`", in_run, "step", True, limit))
        rows.append(
            Row(
                topic,
                "bingham, `predict` and `update` from Python",
                objects(f, prior, y[:200]),
                "step",
                limit=OBJECT_LIMIT,
            )
        )
        if d == 4:
            rows.append(Row(topic, "NumPy Kalman filter with checks", numpy_kalman(y[:200]), "step"))
            rows.append(Row(topic, "filterpy, ExtendedKalmanFilter", filterpy_kalman(y[:200]), "step"))
        rows.append(Row(topic, "PyRecEst 2.4.2, BinghamFilter", peer, "step"))
    return rows + sensors() + batches()


def sensors() -> list[Row]:
    """Gyroscope, a known vector and a heading: the compiled list of sensors, and row by row."""
    count, rng = 20_000, np.random.default_rng(0)
    f = BinghamFilter(Gyroscope(0.01), [VectorSensor([0.0, 0.0, 1.0], 1e3), HeadingSensor(100.0)])
    y = np.tile([0.0, 0.0, 1.0, 0.0, 0.4, -0.9], (count, 1)) + 0.03 * rng.standard_normal((count, 6))
    rates, times = 0.1 * rng.standard_normal((count, 3)), np.arange(count) / 100

    def run() -> object:
        return f.run(Bingham.uniform(4), y, controls=rates, times=times)

    def rows(k: int = 300) -> None:
        for _ in each_step(f, Bingham.uniform(4), y[:k], controls=rates[:k], times=times[:k]):
            pass

    topic = "gyroscope, vector and heading"
    return [
        Row(topic, "bingham, inside `run`", best_of(run, per=count), "row", True, 3e-6),
        Row(topic, "bingham, `predict` and `update` from Python", best_of(rows, per=300), "row"),
    ]


def objects(f: BinghamFilter, prior: Bingham, y: np.ndarray) -> float:
    """Seconds of a step through the immutable objects."""

    def loop() -> None:
        state = prior
        for z in y:
            state, _ = f.update(f.predict(state), z)

    return best_of(loop, per=len(y))


def batches() -> list[Row]:
    """Independent filters on one thread and on two."""
    count, steps = 10_000, 20
    topic = "10 000 filters, d = 4"
    f, prior, y = case(4, count * steps)
    many = y.reshape(count, steps, 4)
    seconds: dict[int, float] = {}
    # In turns: a busy moment of the machine then meets both.
    for _ in range(4):
        for threads in (1, min(2, numba.config.NUMBA_NUM_THREADS)):
            numba.set_num_threads(threads)
            took = best_of(lambda: f.run(prior, many, keep="last"), per=count * steps, clock=perf_counter)
            seconds[threads] = min(took, seconds.get(threads, took))
    numba.set_num_threads(1)
    rows = [Row(topic, "bingham, `run`, one thread", seconds[1], "filter-step", True, BATCH_LIMIT)]
    if 2 in seconds:
        speed = seconds[1] / seconds[2]
        rows.append(
            Row(
                topic,
                "bingham, `run`, two threads",
                seconds[2],
                "filter-step",
                limit=seconds[1] / 1.7,
                note=f"{speed:.2f} times faster",
            )
        )
    return rows


def numpy_kalman(y: np.ndarray) -> float:
    """Seconds of a step of the filter in `kalman`."""
    import kalman

    process, sensor = 1e-3 * np.eye(3), 1e-2 * np.eye(3)

    def loop() -> None:
        state = kalman.State(np.array([1.0, 0.0, 0.0, 0.0]), process)
        for z in y:
            state, _ = kalman.update(kalman.predict(state, process), z, sensor)

    return best_of(loop, per=len(y))


def filterpy_kalman(y: np.ndarray) -> float:
    """Seconds of a step of filterpy's extended Kalman filter on the quaternion's four numbers."""
    from filterpy.kalman import ExtendedKalmanFilter

    jacobian = np.eye(4)

    def loop() -> None:
        f = ExtendedKalmanFilter(dim_x=4, dim_z=4)
        f.x = np.array([[1.0], [0.0], [0.0], [0.0]])
        f.Q, f.R = 1e-3 * np.eye(4), 1e-2 * np.eye(4)
        for z in y:
            f.predict()
            z = z[:, None] if z @ f.x[:, 0] > 0.0 else -z[:, None]
            f.update(z, lambda _: jacobian, lambda x: x)
            f.x = f.x / np.linalg.norm(f.x)

    return best_of(loop, per=len(y))


def pyrecest(d: int, y: np.ndarray) -> float:
    """Seconds of a step of PyRecEst's filter; the noises are the same, the state a new one every time."""
    from peers import PyRecEstFilter, pyrecest_distribution

    process, sensor = (pyrecest_distribution(z) for z in NOISE[d])
    f = PyRecEstFilter()
    f.filter_state = pyrecest_distribution(NOISE[d][0])
    rows = iter(y)

    def step() -> None:
        f.predict_identity(process)
        f.update_identity(sensor, next(rows))

    step()
    return best_once(step, repeats=10)
