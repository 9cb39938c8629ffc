"""Orientations and axes written as angles: which columns are which, and the unit vectors they mean.

Compass angles (degrees; north, east, down) make axes in space, azimuths axes in the plane, rotations of all kinds unit
quaternions (w, x, y, z) that rotate body vectors into the world. What came in as angles can go out as the same angles.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bingham.errors import InvalidArgumentError

if TYPE_CHECKING:
    from scipy.spatial.transform import Rotation

__all__ = ["ANGLES", "AngleKind", "angle_kind", "from_angles", "recognised", "to_angles"]

FloatArray = NDArray[np.float64]
EULER = re.compile(r"euler[-_ ]?([xyzXYZ]{3})", re.ASCII)


@dataclass(frozen=True, slots=True)
class AngleKind:
    """A way to write axes or rotations as numbers.

    Parameters
    ----------
    name : str
        Its key, as in ``--as trend-plunge``.
    title : str
        What it is, for help and documentation.
    columns : tuple of str
        What its numbers are called, in order.
    vector : tuple of str
        Names of the components of the unit vectors that come out.
    decode, encode : callable
        Numbers (N, k) → unit vectors (N, d), and back.
    spellings : tuple of tuple of str
        Other names of the columns, in the order of `columns`.
    degrees : bool
        Whether the numbers are angles in degrees unless a header says radians.
    """

    name: str
    title: str
    columns: tuple[str, ...]
    vector: tuple[str, ...]
    decode: Callable[[FloatArray], FloatArray]
    encode: Callable[[FloatArray], FloatArray]
    spellings: tuple[tuple[str, ...], ...] = ()
    degrees: bool = True


def _compass(
    name: str, title: str, columns: tuple[str, str], function: str, *spellings: tuple[str, ...], swapped: bool = False
) -> AngleKind:
    """Compass angles: `function` is what `bingham.geology` calls them; `swapped`: the file has the second first."""
    order = (1, 0) if swapped else (0, 1)

    def decode(a: FloatArray) -> FloatArray:
        from bingham.geology import angles

        return getattr(angles, f"from_{function}")(*(a[:, k] for k in order))

    def encode(x: FloatArray) -> FloatArray:
        from bingham.geology import angles

        both = getattr(angles, f"to_{function}")(x)
        return np.stack([both[k] for k in order], axis=-1)

    return AngleKind(name, title, columns, ("n", "e", "d"), decode, encode, spellings)


def _quaternions(rotation: Rotation) -> FloatArray:
    return np.asarray(rotation.as_quat(scalar_first=True), dtype=np.float64)


def _rotation(kind: str, *arguments: Any, **options: Any) -> Rotation:
    """Return SciPy's rotation of some kind, which is not loaded where nobody has angles."""
    from scipy.spatial.transform import Rotation

    return getattr(Rotation, f"from_{kind}")(*arguments, **options)


def _euler(
    name: str,
    title: str,
    columns: tuple[str, ...],
    sequence: str,
    *spellings: tuple[str, ...],
    order: tuple[int, ...] = (0, 1, 2),
    inverse: bool = False,
) -> AngleKind:
    """Euler angles: `order` tells which column is which angle of the sequence; `inverse`: they rotate world to body."""

    def decode(a: FloatArray) -> FloatArray:
        rotation = _rotation("euler", sequence, np.radians(a[:, list(order)]))
        return _quaternions(rotation.inv() if inverse else rotation)

    def encode(q: FloatArray) -> FloatArray:
        rotation = _rotation("quat", q, scalar_first=True)
        angles = np.degrees((rotation.inv() if inverse else rotation).as_euler(sequence, suppress_warnings=True))
        return angles[:, np.argsort(order)]

    return AngleKind(name, title, columns, ("qw", "qx", "qy", "qz"), decode, encode, spellings)


def _azimuth(a: FloatArray) -> FloatArray:
    r = np.radians(a[:, 0])
    return np.stack([np.cos(r), np.sin(r)], axis=-1)


def _matrices(a: FloatArray) -> FloatArray:
    matrices = a.reshape(-1, 3, 3)
    off = np.abs(np.einsum("nji,njk->nik", matrices, matrices) - np.eye(3)).max(axis=(1, 2))
    bad = ~(off <= 1e-3) | ~(np.linalg.det(matrices) > 0.0)
    if bad.any():
        got = f"row {int(np.argmax(bad)) + 1}, which is none"
        raise InvalidArgumentError("angles", "rotation matrices, row by row", got)
    return _quaternions(_rotation("matrix", matrices))


# Names beside which an azimuth is not that of an axis in the plane.
STEEP = frozenset(("dip", "dip_angle", "plunge", "inclination", "incl", "inc", "plg"))
POLES = "; axes are the poles of the planes"
ANGLES: dict[str, AngleKind] = {
    kind.name: kind
    for kind in (
        _compass(
            "trend-plunge",
            "trend and plunge of lines",
            ("trend", "plunge"),
            "trend_plunge",
            ("trd", "plg"),
            ("bearing", "plunge"),
            ("azimuth", "plunge"),
        ),
        _compass(
            "plunge-trend",
            "plunge and trend of lines",
            ("plunge", "trend"),
            "trend_plunge",
            swapped=True,
        ),
        _compass(
            "strike-dip",
            f"strike (right-hand rule) and dip of planes{POLES}",
            ("strike", "dip"),
            "strike_dip",
        ),
        _compass(
            "dip-direction",
            f"dip and dip direction of planes{POLES}",
            ("dip", "dip_direction"),
            "dip_direction",
            ("dip", "dipdir"),
            ("dip", "dip_dir"),
            ("dip", "dip_azimuth"),
            ("dip", "dd"),
            ("dip_angle", "dip_direction"),
        ),
        _compass(
            "declination-inclination",
            "declination and inclination of directions",
            ("declination", "inclination"),
            "declination_inclination",
            ("dec", "inc"),
            ("azimuth", "inclination"),
            ("az", "inc"),
            ("decl", "incl"),
            ("d", "i"),
            *(
                (f"{of}_dec", f"{of}_inc") for of in ("dir", "site", "specimen", "sample", "measurement")
            ),  # MagIC tables
        ),
        AngleKind(
            "azimuth",
            "azimuth of axes in the plane, clockwise from north",
            ("azimuth",),
            ("n", "e"),
            _azimuth,
            lambda x: np.degrees(np.arctan2(x[:, 1:2], x[:, :1])) % 180.0,
            (("strike",), ("heading",), ("angle",), ("theta",)),
        ),
        _euler(
            "bunge",
            "Bunge's Euler angles φ1, Φ, φ2 (z x′ z″) of crystals",
            ("phi1", "Phi", "phi2"),
            "ZXZ",
            ("phi1", "phi", "phi2"),
            ("euler1", "euler2", "euler3"),
            ("euler_1", "euler_2", "euler_3"),
        ),
        _euler(
            "roll-pitch-yaw",
            "roll, pitch, yaw (z y′ x″)",
            ("roll", "pitch", "yaw"),
            "ZYX",
            ("roll", "pitch", "heading"),
            ("euler_x", "euler_y", "euler_z"),
            order=(2, 1, 0),
        ),
        _euler(
            "relion",
            "RELION's rot, tilt, psi (z y′ z″, world to particle)",
            ("rot", "tilt", "psi"),
            "ZYZ",
            ("anglerot", "angletilt", "anglepsi"),
            ("rln_angle_rot", "rln_angle_tilt", "rln_angle_psi"),
            ("angle_rot", "angle_tilt", "angle_psi"),
            inverse=True,
        ),
        AngleKind(
            "rotation-vector",
            "rotation vectors, rad",
            ("rx", "ry", "rz"),
            ("qw", "qx", "qy", "qz"),
            lambda a: _quaternions(_rotation("rotvec", a)),
            lambda q: _rotation("quat", q, scalar_first=True).as_rotvec(),
            (("rotvec_x", "rotvec_y", "rotvec_z"),),
            degrees=False,
        ),
        AngleKind(
            "matrix",
            "rotation matrices, row by row",
            tuple(f"r{i}{j}" for i in (1, 2, 3) for j in (1, 2, 3)),
            ("qw", "qx", "qy", "qz"),
            _matrices,
            lambda q: _rotation("quat", q, scalar_first=True).as_matrix().reshape(-1, 9),
            (
                tuple(f"r{i}{j}" for i in range(3) for j in range(3)),
                tuple(f"m{i}{j}" for i in (1, 2, 3) for j in (1, 2, 3)),
                tuple(f"mat_{i}_{j}" for i in (1, 2, 3) for j in (1, 2, 3)),
            ),
            degrees=False,
        ),
    )
}


def angle_kind(name: str) -> AngleKind:
    """Return a kind by its name; ``euler-ZXZ`` is any sequence, capitals about the body's axes (intrinsic).

    Raises
    ------
    InvalidArgumentError
        If there is none of the name.
    """
    key = name.strip().lower().replace("_", "-").replace("/", "-").replace(" ", "-")
    if key in ANGLES:
        return ANGLES[key]
    found = EULER.fullmatch(name.strip())
    if found and (found[1].isupper() or found[1].islower()):
        a, b, c = found[1].lower()
        if a != b and b != c:
            return _euler(f"euler-{found[1]}", f"Euler angles {found[1]}", ("angle1", "angle2", "angle3"), found[1])
    expected = f"one of {', '.join(ANGLES)}, or euler-ZXZ with any sequence (capitals: about the body's axes)"
    raise InvalidArgumentError("angles", expected, name)


def from_angles(kind: str, angles: ArrayLike) -> FloatArray:
    """Return unit vectors for numbers that `angle_kind` names.

    Parameters
    ----------
    kind : str
        Name of the kind, as "trend-plunge", "bunge", "euler-ZYX".
    angles : (N, k) array_like
        Degrees; rotation vectors in rad; matrices row by row.

    Returns
    -------
    ndarray, shape (N, d)
        Axes in north, east, down (d = 3) or north, east (d = 2), or quaternions (w, x, y, z).

    Examples
    --------
    >>> from_angles("bunge", [[90.0, 0.0, 0.0]]).round(4)
    array([[0.7071, 0.    , 0.    , 0.7071]])
    """
    chosen = angle_kind(kind)
    values = np.asarray(angles, dtype=np.float64)
    if values.ndim != 2 or values.shape[1] != len(chosen.columns):
        raise InvalidArgumentError("angles", f"shape (N, {len(chosen.columns)}): {' '.join(chosen.columns)}", values)
    if not np.isfinite(values).all():
        raise InvalidArgumentError("angles", "finite numbers", values)
    return chosen.decode(values)


def to_angles(kind: str, x: ArrayLike) -> FloatArray:
    """Return the numbers (N, k) of unit vectors (N, d), the inverse of `from_angles` up to the sign of axes.

    Examples
    --------
    >>> to_angles("dip-direction", [[0.0, 0.0, -1.0], [-0.6, 0.0, 0.8]]).round(4) + 0.0
    array([[  0.    , 180.    ],
           [ 36.8699,   0.    ]])
    """
    chosen = angle_kind(kind)
    vectors = np.atleast_2d(np.asarray(x, dtype=np.float64))
    if vectors.ndim != 2 or vectors.shape[1] != len(chosen.vector):
        raise InvalidArgumentError("x", f"shape (N, {len(chosen.vector)})", vectors)
    return chosen.encode(vectors)


def recognised(names: Sequence[str]) -> tuple[AngleKind, list[int], bool] | None:
    """Find columns of angles by their names.

    Returns
    -------
    tuple of AngleKind, list of int and bool, or None
        The kind, its columns in order, and whether they are in radians; None if there are none.
    """
    plain = [_plain(name) for name in names]
    texts = [text for text, _ in plain]
    best: tuple[AngleKind, list[int]] | None = None
    for kind in ANGLES.values():
        for spelling in (kind.columns, *kind.spellings):
            wanted = [name.lower() for name in spelling]
            at = _where(spelling, wanted, names, texts)
            if at is not None and (best is None or len(at) > len(best[1])):
                best = kind, at
    if best is None or (best[0].name == "azimuth" and not STEEP.isdisjoint(texts)):
        return None
    radians = any(unit in ("rad", "radian", "radians") for unit in (plain[k][1] for k in best[1]))
    return *best, radians


def _where(spelling: Sequence[str], wanted: list[str], names: Sequence[str], texts: list[str]) -> list[int] | None:
    if len(set(wanted)) != len(wanted):  # phi1, Phi, phi2 and the like are told apart by their case
        return [list(names).index(s) for s in spelling] if set(spelling) <= set(names) else None
    return [texts.index(w) for w in wanted] if set(wanted) <= set(texts) else None


def _plain(name: str) -> tuple[str, str]:
    """Return a name without its unit, in lower case, and the unit."""
    found = re.fullmatch(r"(.*?)[\s_]*[\[(]?(deg|degrees|°|rad|radian|radians)?[\])]?", name.strip(), re.IGNORECASE)
    text, unit = (found[1], found[2] or "") if found else (name, "")
    text = text.replace("φ", "phi").replace("Φ", "Phi")
    text = re.sub(r"(?<=[a-z])(?=[A-Z])", "_", text.lstrip("_"))
    return re.sub(r"[\s._-]+", "_", text).strip("_").lower(), unit.lower()
