"""`BinghamMixture.fit`: checks, starts, restarts, and the number of components by Schwarz's criterion."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bingham.distributions.em import EMResult, expectation_maximization
from bingham.distributions.mixture_density import MixtureDensity
from bingham.distributions.sample_consensus import sample_consensus
from bingham.distributions.starts import seed_axes, start_from_axes
from bingham.errors import AccuracyWarning, ConvergenceError, InvalidArgumentError, Setting
from bingham.validation import as_generator, unit_rows

if TYPE_CHECKING:
    from scipy.spatial.transform import Rotation

__all__ = ["fit_mixture"]

FloatArray = NDArray[np.float64]
M = TypeVar("M", bound=MixtureDensity)

# Starts are compared on so many rows at most and after so many steps; the best ones go on.
COMPARED_ROWS = 20_000
COMPARED_STEPS = 20
FINALISTS = 3


def fit_mixture(
    kind: type[M],
    x: ArrayLike | Rotation,
    components: int | Sequence[int],
    *,
    method: str,
    weights: ArrayLike | None,
    background: bool,
    restarts: int,
    max_concentration: float,
    min_points: int | None,
    min_density: float | None,
    tolerance: float,
    rng: Any,
    progress: Callable[[int, M | None], None] | None,
) -> M:
    """Fit a mixture of class ``kind``; contract and defaults are those of `BinghamMixture.fit`."""
    a = np.ascontiguousarray(unit_rows(x, None, "x"))
    if a.ndim != 2 or len(a) < 1 or a.shape[1] < 2:
        raise InvalidArgumentError("x", "samples as rows, shape (n, d) with n >= 1 and d >= 2", a.shape)
    if weights is None:
        counts = np.ones(len(a))
    else:
        counts = np.ascontiguousarray(weights, dtype=np.float64)
        if counts.shape != (len(a),) or not (
            np.all(counts >= 0.0) and np.all(np.isfinite(counts)) and counts.sum() > 0.0
        ):
            raise InvalidArgumentError("weights", f"finite, non-negative, not all zero, shape ({len(a)},)", weights)
    sizes = [components] if isinstance(components, int) else [int(k) for k in components]
    if not sizes or min(sizes) < 1:
        raise InvalidArgumentError("components", "one or more positive numbers", components)
    if not max_concentration > 1.0:
        raise InvalidArgumentError("max_concentration", "a ceiling above 1", max_concentration)
    d = a.shape[1]
    minimum = d * (d + 1) // 2 if min_points is None else min_points
    generator = as_generator(rng)
    if method == "sac":
        found = sample_consensus(kind, a, max(sizes), rng=generator, weights=counts, min_points=max(minimum, 1),
                                 min_density=min_density, max_concentration=max_concentration,
                                 background=background)  # fmt: skip
        if found.size == 0:
            hint = ("lower ", Setting("min_points", minimum))
            raise ConvergenceError(f"sample consensus: no component of {minimum} points found", found, hint)
        return found
    if method != "em":
        raise InvalidArgumentError("method", "'em' or 'sac'", repr(method))
    if counts.sum() < minimum:
        raise InvalidArgumentError("x", ("at least ", Setting("min_points", minimum), " samples"), len(a))
    best: M | None = None
    best_bic = np.inf
    lost: ConvergenceError | None = None
    for size in sorted(set(sizes)):
        fitted: M | None = None
        try:
            fitted = _best_of_restarts(
                kind, a, counts, size, background, restarts, max_concentration, minimum, tolerance, generator
            )
        except ConvergenceError as error:
            lost = error
        else:
            bic = fitted.bic(a, counts) if len(sizes) > 1 else 0.0
            if bic < best_bic:
                best, best_bic = fitted, bic
        if progress is not None:
            progress(size, fitted)
    if best is not None:
        return best
    assert lost is not None
    # Fewer components than the fewest asked for, rather than nothing.
    for size in range(min(sizes) - 1, 0, -1):
        try:
            best = _best_of_restarts(
                kind, a, counts, size, background, restarts, max_concentration, minimum, tolerance, generator
            )
        except ConvergenceError:
            continue
        told = f"{min(sizes)} components are too many for these samples; the best mixture found has {best.size}"
        warnings.warn(told, AccuracyWarning, stacklevel=3)
        return best
    raise lost


def _best_of_restarts(
    kind: type[M],
    x: FloatArray,
    counts: FloatArray,
    size: int,
    background: bool,
    restarts: int,
    max_concentration: float,
    min_points: float,
    tolerance: float,
    rng: np.random.Generator,
) -> M:
    """Return the best of EM runs from a sample-consensus start and k-means++ starts, first compared on few steps."""
    if len(x) > COMPARED_ROWS:
        rows = rng.choice(len(x), COMPARED_ROWS, replace=False)
        few, few_counts = np.ascontiguousarray(x[rows]), counts[rows]
    else:
        few, few_counts = x, counts
    floor = min_points * float(few_counts.sum() / counts.sum())
    runs: list[EMResult[M]] = []
    for trial in range(max(1, restarts)):
        known = None
        if trial == 0:
            peeled = sample_consensus(kind, few, size, rng=rng, weights=few_counts, min_points=max(floor, 1.0),
                                      max_concentration=max_concentration, background=background)  # fmt: skip
            known = peeled.components.mode
            if peeled.size == size and (peeled.background > 0.0) == background:
                runs.append(expectation_maximization(few, peeled, weights=few_counts, max_iterations=COMPARED_STEPS,
                                                     max_concentration=max_concentration,
                                                     min_points=floor))  # fmt: skip
                continue
        start = start_from_axes(
            kind, few, few_counts, seed_axes(few, few_counts, size, rng, known), background=background
        )
        runs.append(expectation_maximization(few, start, weights=few_counts, max_iterations=COMPARED_STEPS,
                                             max_concentration=max_concentration, min_points=floor))  # fmt: skip
    runs.sort(key=lambda run: (run.starved, -run.log_likelihood))
    finals = [
        expectation_maximization(
            x,
            run.mixture,
            weights=counts,
            tolerance=tolerance,
            max_concentration=max_concentration,
            min_points=min_points,
        )
        for run in runs[: FINALISTS if len(x) <= COMPARED_ROWS else 1]
        if not run.starved
    ]
    kept = [run for run in finals if not run.starved]
    if not kept:
        lost = f"mixture: every start for {size} components lost one (fewer than {min_points:g} points)"
        hint = ("ask for fewer components, or lower ", Setting("min_points", min_points))
        raise ConvergenceError(lost, runs[0].mixture, hint)
    return max(kept, key=lambda run: run.log_likelihood).mixture
