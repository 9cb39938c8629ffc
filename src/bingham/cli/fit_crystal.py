"""What ``bingham fit`` does with orientations of crystals."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from bingham.distributions.bingham import Bingham
    from bingham.io import Axes

__all__ = ["CrystalFit", "fit_crystals", "is_map", "read_map", "symmetry_hint"]

# Enough for every digit that is printed; a map of a million points is thinned to this many.
MOST = 20_000


class CrystalFit(NamedTuple):
    """One orientation with its scatter: equivalents nearest to it of the points that belong to it, and the rest."""

    distribution: Bingham
    members: NDArray[np.float64]
    row: dict[str, Any]


def is_map(path: Path) -> bool:
    """Whether a file is named as maps of orientations are."""
    return path.suffix.lower() in (".ang", ".ctf")


def read_map(path: Path) -> tuple[Axes, str | None]:
    """Return the orientations of a map as quaternions, and the symmetry that it states if it has one phase."""
    from bingham.io import Axes, read_ebsd
    from bingham.io.checks import note

    found = read_ebsd(path)
    note(
        path,
        "every point of the map counts as a measurement of its own; neighbours share their errors, so that "
        "the mean is less certain than told: mean_rotation(q, group=…, position=…) of a grain's points allows for it",
    )
    groups = {found.symmetry[k] for k in np.unique(found.phase).tolist() if k in found.symmetry}
    axes = Axes(found.name, ("qw", "qx", "qy", "qz"), found.quaternions)
    return axes, groups.pop() if len(groups) == 1 else None


def fit_crystals(q: NDArray[np.float64], group: str) -> CrystalFit:
    """Fit one orientation with the symmetry of a group and a background of outliers to quaternions (n, 4)."""
    from bingham.distributions.symmetric import SymmetricMixture

    step = -(-len(q) // MOST)
    fitted = SymmetricMixture.fit(q[::step], group, rng=0)
    label = fitted.predict(q)
    members = fitted.equivalent(q)[label == 0]
    row = {
        "symmetry": group,
        "outlier_share": fitted.background,
        "outliers": int(np.sum(label < 0)),
        "fitted_every": step,
    }
    return CrystalFit(fitted.components[0], members, row)


def symmetry_hint(q: NDArray[np.float64], stated: str | None) -> str | None:
    """Return what to tell of quaternions (n, 4) fitted without a symmetry, None where nothing hints at one."""
    from bingham.distributions.crystal import likely_symmetry

    if stated is not None and stated != "1":
        return f"the file states the symmetry {stated}; fit with --symmetry {stated}"
    if (group := likely_symmetry(q)) is not None:
        return f"orientations jump by rotations of the group {group}; if they are crystals, fit with --symmetry {group}"
    return None
