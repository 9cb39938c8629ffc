"""Sampling part of the 2019 study: Example III.1 (Figs. 2, 3) and the corrections of Fig. 5."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from bingham.distributions.bingham import Bingham
from bingham.distributions.normalizer import log_normalizer_derivatives
from bingham.sampling.descent import moment_residual, steepest_descent
from bingham.sampling.protocol import WeightedPoints
from bingham.sampling.riemannian import RiemannianSampling
from bingham.sampling.trust_region import trust_region
from bingham.sampling.unscented import Unscented
from bingham.studies.study import Arrays, Row

__all__ = [
    "correction_rows",
    "correction_sets",
    "fourth_moment_error",
    "sampling_rows",
    "sampling_sets",
]

FloatArray = NDArray[np.float64]

# C_B = −diag(…), sample size → the residual E printed in Figs. 2 and 3. The text says a = 30 on S², the figure 40.
EXAMPLES: dict[tuple[tuple[float, ...], int], float | None] = {
    ((1, 5), 10): 2.7e-13, ((1, 5), 30): 4.0e-12, ((1, 5), 50): 1.4e-12,
    ((1, 10), 10): 8.6e-15, ((1, 10), 30): 1.7e-11, ((1, 10), 50): 2.4e-11,
    ((1, 30), 10): 5.7e-13, ((1, 30), 30): 5.8e-12, ((1, 30), 50): 5.7e-12,
    ((1, 5, 5), 50): 4.2e-13, ((1, 5, 5), 200): 1.0e-11, ((1, 5, 5), 500): 6.0e-11,
    ((1, 5, 10), 50): 2.8e-12, ((1, 5, 10), 200): 4.6e-11, ((1, 5, 10), 500): 2.1e-11,
    ((1, 5, 30), 50): None, ((1, 5, 30), 200): None, ((1, 5, 30), 500): None,
    ((1, 5, 40), 50): 1.9e-11, ((1, 5, 40), 200): 3.2e-11, ((1, 5, 40), 500): 4.2e-10,
    ((1, 5, 5, 5), 50): 7.7e-13, ((1, 5, 5, 5), 200): 2.6e-13, ((1, 5, 5, 5), 500): 1.2e-13,
}  # fmt: skip
# Distributions the published scaling does not cover: girdles and the uniform distribution.
SINGULAR: tuple[tuple[tuple[float, ...], int], ...] = (((0, 0, 30), 200), ((0, 0, 0), 200), ((0, 0, 0, 0), 200))
CORRECTED, CORRECTED_SIZE = (1.0, 8.0, 70.0), 150
PENALTY = 1e-4


def distribution_of(diagonal: tuple[float, ...]) -> Bingham:
    """Return the distribution with C_B = −diag(diagonal)."""
    return Bingham(-np.array(diagonal, dtype=np.float64), np.eye(len(diagonal)))


def fourth_moment_error(sample: WeightedPoints, distribution: Bingham) -> float:
    """Return ‖Σ w x⊗x⊗x⊗x − E[x⊗x⊗x⊗x]‖, the Frobenius norm over all entries."""
    y = sample.points @ distribution.M
    tensor = np.einsum("n,ni,nj,nk,nl->ijkl", sample.weights, y, y, y, y, optimize=True)
    _, w, hessian = log_normalizer_derivatives(distribution.z)
    # E[yᵢ² yⱼ²] = Cov(yᵢ², yⱼ²) + ωᵢ ωⱼ in the principal axes; entries with an odd power vanish.
    pairs = hessian + w[:, None] * w
    d = distribution.dim
    for i in range(d):
        for j in range(d):
            for index in {(i, i, j, j), (i, j, i, j), (i, j, j, i)}:
                tensor[index] -= pairs[i, j]
    return float(np.linalg.norm(tensor))


def _case(diagonal: tuple[float, ...], m: int) -> str:
    return f"S{len(diagonal) - 1} C=({','.join(f'{c:g}' for c in diagonal)}) m={m}"


def sampling_sets() -> Arrays:
    """Return points and (residual, fourth-moment error) of every sampler for every example."""
    out: Arrays = {}
    for diagonal, m in [*EXAMPLES, *SINGULAR]:
        distribution = distribution_of(diagonal)
        samplers: dict[str, Any] = {"unscented": Unscented(), "rss": RiemannianSampling(m)}
        if (diagonal, m) in EXAMPLES:
            samplers["rss_gnomonic"] = RiemannianSampling(m, map="gnomonic")
        for name, sampler in samplers.items():
            sample = sampler.sample(distribution)
            x, w = sample
            error = (x.T * w) @ x - distribution.moment()
            figures = [float(np.sum(error * error)), fourth_moment_error(sample, distribution)]
            out[f"figures/{_case(diagonal, m)}/{name}"] = np.array(figures)
            if name != "unscented":
                out[f"points/{_case(diagonal, m)}/{name}"] = x
    return out


def sampling_rows(sets: Arrays) -> list[Row]:
    """Return the table's rows of `sampling_sets`."""
    rows: list[Row] = []
    for diagonal, m in [*EXAMPLES, *SINGULAR]:
        case = _case(diagonal, m)
        for name in ("unscented", "rss", "rss_gnomonic"):
            figures = sets.get(f"figures/{case}/{name}")
            if figures is None:
                continue
            paper = None if name == "unscented" else EXAMPLES.get((diagonal, m))
            rows.append(Row(case, name, "residual", float(figures[0]), None, paper))
            rows.append(Row(case, name, "fourth_moment_error", float(figures[1])))
    return rows


def correction_sets() -> Arrays:
    """Return the points of Fig. 5 before and after each correction."""
    distribution = distribution_of(CORRECTED)
    moment = distribution.moment()
    start = RiemannianSampling(CORRECTED_SIZE, map="gnomonic", correction="none").sample(distribution).points
    sets = {
        "start": start,
        "trust_region": trust_region(start, moment),
        "trust_region_penalised": trust_region(start, moment, PENALTY),
        "steepest_descent": steepest_descent(start, moment).points,
        "newton": RiemannianSampling(CORRECTED_SIZE, map="gnomonic").sample(distribution).points,
    }
    return {f"correction/{name}": x for name, x in sets.items()}


def correction_rows(sets: Arrays) -> list[Row]:
    """Return the table's rows of `correction_sets`: residual E and how far the points moved (RMS, rad)."""
    distribution = distribution_of(CORRECTED)
    case = f"{_case(CORRECTED, CORRECTED_SIZE)} correction"
    start = sets["correction/start"]
    paper = {"trust_region": 2.8e-10, "trust_region_penalised": 1.5e-9, "steepest_descent": 1.6e-10}
    rows: list[Row] = []
    for name in ("start", "trust_region", "trust_region_penalised", "steepest_descent", "newton"):
        x = sets[f"correction/{name}"]
        moved = 2.0 * np.arcsin(np.minimum(0.5 * np.linalg.norm(x - start, axis=1), 1.0))
        sample = WeightedPoints(x, np.full(len(x), 1.0 / len(x)))
        rows.append(Row(case, name, "residual", moment_residual(x, distribution.moment()), None, paper.get(name)))
        rows.append(Row(case, name, "displacement_rad", float(np.sqrt(np.mean(moved**2)))))
        rows.append(Row(case, name, "fourth_moment_error", fourth_moment_error(sample, distribution)))
    return rows
