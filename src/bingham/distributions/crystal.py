"""Crystal symmetry: point groups of rotations, equivalent orientations, misorientation.

An orientation q carries crystal directions to the sample, v_sample = q ⊗ v_crystal ⊗ q*; q ⊗ g is the same orientation
for every rotation g of the crystal's point group.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial.transform import Rotation

from bingham.errors import InvalidArgumentError
from bingham.rotations import as_quaternion, compose, conjugate, from_rotation_vector, to_rotation_vector
from bingham.validation import as_generator, described, unit_rows

__all__ = ["GROUPS", "Misorientation", "likely_symmetry", "misorientation", "symmetry_group"]

FloatArray = NDArray[np.float64]

# Rotation groups in Hermann and Mauguin's notation → SciPy's (Schoenflies); axis of order > 2 along z, as usual.
GROUPS = {"1": "C1", "2": "C2", "3": "C3", "4": "C4", "6": "C6", "222": "D2", "32": "D3", "422": "D4", "622": "D6",
          "23": "T", "432": "O"}  # fmt: skip
# Laue classes and point groups with improper elements → the rotations they have with inversion taken for identity.
LAUE = {"-1": "1", "2/m": "2", "mmm": "222", "-3": "3", "-3m": "32", "4/m": "4", "4/mmm": "422", "6/m": "6",
        "6/mmm": "622", "m-3": "23", "m-3m": "432", "m": "2", "mm2": "222", "3m": "32", "4mm": "422", "-4": "4",
        "-42m": "422", "-6": "6", "6mm": "622", "-62m": "622", "-43m": "432"}  # fmt: skip
# Misorientations within this of a symmetry count as such when symmetry is looked for, rad.
NEAR = np.radians(10.0)
# Between all rotations of any group about one axis, rad.
SHIFT = np.radians(28.0)
# Orientations whose pairs are looked at.
MOST = 300


class Misorientation(NamedTuple):
    """Smallest rotation between two orientations: its angle (...), rad, and axis (..., 3) in the crystal's frame."""

    angle: Any
    axis: FloatArray


def symmetry_group(group: Any) -> FloatArray:
    """Return the rotations of a group as unit quaternions (G, 4), scalar first, the identity first.

    Parameters
    ----------
    group : str, Rotation, or (G, 4) array_like
        "432" and its like in international notation; Laue classes such as "m-3m" give their rotations. A SciPy
        ``Rotation`` (``Rotation.create_group("O")``), quaternions, scalar first, or orix's ``Symmetry``.

    Examples
    --------
    >>> symmetry_group("432").shape, symmetry_group(Rotation.create_group("D3")).shape
    ((24, 4), (6, 4))
    """
    if isinstance(group, str):
        name = LAUE.get(group, group)
        if name not in GROUPS:
            raise InvalidArgumentError("group", f"one of {', '.join(GROUPS)} or a Laue class", repr(group))
        q = as_quaternion(Rotation.create_group(GROUPS[name]))
    elif isinstance(group, Rotation):
        q = np.atleast_2d(as_quaternion(group))
    else:
        # orix keeps quaternions in .data and marks improper elements.
        improper = getattr(group, "improper", None)
        rows = getattr(group, "data", group) if improper is not None else group
        if isinstance(rows, (type(None), int, float)):
            raise InvalidArgumentError("group", "a name such as '432', a Rotation or quaternions", described(group))
        q = np.atleast_2d(unit_rows(rows, 4, "group"))
        if improper is not None:
            q = q[~np.asarray(improper, dtype=bool)]
    # As axes, each once, the identity first.
    dots = np.abs(q @ q.T) > 1.0 - 1e-9
    q = q[[not dots[k, :k].any() for k in range(len(q))]]
    products = compose(q[:, None], q[None])
    if not np.all((np.abs(products @ q.T) > 1.0 - 1e-6).any(axis=-1)):
        raise InvalidArgumentError("group", "rotations closed under composition", f"{len(q)} that are not")
    return np.ascontiguousarray(q[np.argsort(-np.abs(q[:, 0]), kind="stable")])


def misorientation(p: ArrayLike | Rotation, q: ArrayLike | Rotation, group: Any = "1") -> Misorientation:
    """Return the smallest rotation that carries orientation p (..., 4) to q (..., 4), over all equivalent ones.

    Parameters
    ----------
    p, q : (..., 4) array_like or Rotation
        Unit quaternions, scalar first, crystal to sample; broadcast.
    group : str, Rotation or (G, 4) array_like
        As in `symmetry_group`; the same for both.

    Examples
    --------
    >>> turned = Rotation.from_rotvec([0.0, 0.0, np.radians(100.0)])
    >>> round(float(np.degrees(misorientation(Rotation.identity(), turned, "432").angle)), 9)
    10.0
    """
    g = symmetry_group(group)
    a, b = as_quaternion(p, scalar_first=True), as_quaternion(q, scalar_first=True)
    # p* q g over g; conjugation by another symmetry turns the axis, not the angle.
    rest = compose(compose(conjugate(a), b)[..., None, :], g)
    best = np.argmax(np.abs(rest[..., 0]), axis=-1)
    smallest = np.take_along_axis(rest, best[..., None, None], axis=-2)[..., 0, :]
    smallest = np.where(smallest[..., :1] < 0.0, -smallest, smallest)
    sine = np.linalg.norm(smallest[..., 1:], axis=-1)
    axis = np.divide(
        smallest[..., 1:], sine[..., None], out=np.zeros_like(smallest[..., 1:]), where=sine[..., None] > 0
    )
    return Misorientation((2.0 * np.arctan2(sine, smallest[..., 0]))[()], axis)


def likely_symmetry(x: ArrayLike | Rotation, *, rng: Any = 0) -> str | None:
    """Return the group by whose rotations orientations (n, 4) seem to jump, None if they do not.

    Rotations qᵢ* qⱼ between pairs that lie within 10° of a rotation of the group are counted, and again with other
    rotations in its place: the group turned at random, and its rotations by 28° less about the same axes. A group is
    likely if it has three times as many as those, ten at least, and a larger group than one already found if that holds
    for what it has more. Pairs within 10° of each other say nothing and do not count.
    """
    q = as_quaternion(x, scalar_first=True)
    generator = as_generator(rng)
    if len(q) > MOST:
        q = q[generator.choice(len(q), MOST, replace=False)]
    i, j = np.triu_indices(len(q), 1)
    between = compose(conjugate(q[i]), q[j])
    limit = np.cos(0.5 * NEAR)
    between = between[np.abs(between[:, 0]) < limit]
    turns = as_quaternion(Rotation.random(4, rng=generator))

    def count(rotations: FloatArray) -> int:
        return int(np.sum(np.abs(between @ rotations.T).max(axis=1, initial=0.0) > limit))

    found, hits, chance = None, 0, 0.0
    for name in ("2", "222", "3", "32", "4", "422", "6", "622", "23", "432"):
        g = symmetry_group(name)[1:]
        vectors = to_rotation_vector(g)
        angle = np.linalg.norm(vectors, axis=1, keepdims=True)
        shifted = from_rotation_vector(vectors * (1.0 - SHIFT / angle))
        control = max(count(shifted), np.mean([count(compose(compose(t, g), conjugate(t))) for t in turns]))
        more = count(g) - hits
        if more >= max(10.0, 3.0 * (control - chance)):
            found, hits, chance = name, hits + more, float(control)
    return found
