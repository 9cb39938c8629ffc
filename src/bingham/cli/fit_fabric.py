"""What ``bingham fit`` says of axes in north, east, down: the report of a structural geologist."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

__all__ = ["describe_fabric", "fabric_lines", "opening"]


def describe_fabric(x: NDArray[np.float64]) -> dict[str, Any]:
    """Return eigenvalues, shape, plane, confidence regions and tests of axes (n, 3), n > 3, angles in degrees."""
    from bingham.geology import fabric
    from bingham.inference import cluster_girdle_test, symmetry_test, uniformity_test

    result = fabric(x)
    uniformity, symmetry, shape = uniformity_test(x), symmetry_test(x), cluster_girdle_test(x)
    return {
        "eigenvalues": result.eigenvalues.tolist(),
        "eigenvalue_errors": result.eigenvalue_errors.tolist(),
        "woodcock_K": float(result.K),
        "woodcock_C": float(result.C),
        "vollmer_P": float(result.P),
        "vollmer_G": float(result.G),
        "vollmer_R": float(result.R),
        "mean_axis_trend_plunge_deg": [float(a) for a in result.mean_axis],
        "mean_axis_semi_axes_95_deg": opening(result.mean_ellipse.semi_axes),
        "best_plane_strike_dip_deg": [float(a) for a in result.best_plane],
        "fold_axis_trend_plunge_deg": [float(a) for a in result.fold_axis],
        "fold_axis_semi_axes_95_deg": opening(result.pole_ellipse.semi_axes),
        "tests": {
            "uniformity": {"statistic": float(uniformity.statistic), "pvalue": float(uniformity.pvalue)},
            "rotational_symmetry": {"statistic": float(symmetry.statistic), "pvalue": float(symmetry.pvalue)},
            "cluster_against_girdle": {"statistic": float(shape.statistic), "pvalue": float(shape.pvalue)},
        },
    }


def fabric_lines(row: dict[str, Any]) -> Iterator[tuple[str, str]]:
    """Yield name and text of each line of a report."""
    values = zip(row["eigenvalues"], row["eigenvalue_errors"], strict=True)
    yield "eigenvalues S1, S2, S3", ", ".join(f"{value:.4f} ± {error:.4f}" for value, error in values)
    kind = "cluster" if row["woodcock_K"] > 1.0 else "girdle"
    yield "Woodcock K, C", f"{row['woodcock_K']:.3f} ({kind}), {row['woodcock_C']:.3f}"
    yield "Vollmer P, G, R", ", ".join(f"{row[f'vollmer_{letter}']:.3f}" for letter in "PGR")
    for name, key in (("mean axis (trend/plunge)", "mean_axis"), ("fold axis (trend/plunge)", "fold_axis")):
        trend, plunge = row[f"{key}_trend_plunge_deg"]
        region = " × ".join("open" if angle is None else f"{angle:.2f}°" for angle in row[f"{key}_semi_axes_95_deg"])
        yield name, f"{trend:05.1f}/{plunge:04.1f}, 95 % region {region}"
    strike, dip = row["best_plane_strike_dip_deg"]
    yield "best-fit plane", f"{strike:05.1f}/{dip:04.1f} (strike/dip, right-hand rule)"
    for name, key in (("uniformity test", "uniformity"), ("symmetry test", "rotational_symmetry"),
                      ("cluster against girdle", "cluster_against_girdle")):  # fmt: skip
        test = row["tests"][key]
        yield name, f"{test['statistic']:.3f}, p = {test['pvalue']:.3g}"


def opening(semi_axes: Iterable[float]) -> list[float | None]:
    """Return semi-axes in degrees, None where the region reaches all around."""
    return [None if angle >= 0.4999 * np.pi else float(np.degrees(angle)) for angle in semi_axes]
