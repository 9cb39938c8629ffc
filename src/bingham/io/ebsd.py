"""Maps of crystal orientations by electron backscatter diffraction: TSL's .ang and Oxford's .ctf text files."""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bingham.errors import RecordingError
from bingham.io.checks import note
from bingham.io.text import opened_text

__all__ = ["EbsdMap", "read_ebsd"]

# Symmetry numbers of a phase in .ang files (TSL) and Laue groups in .ctf files (HKL) → rotation group.
TSL = {1: "1", 2: "2", 20: "2", 22: "222", 3: "3", 32: "32", 4: "4", 42: "422", 6: "6", 62: "622", 23: "23", 43: "432"}
HKL = {1: "1", 2: "2", 3: "222", 4: "4", 5: "422", 6: "3", 7: "32", 8: "6", 9: "622", 10: "23", 11: "432"}
Points = tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.int64], NDArray[np.bool_], dict[int, str]]
MOST_PHASES = 1000
CTF_COLUMNS = ("Phase", "X", "Y", "Euler1", "Euler2", "Euler3")


class EbsdMap(NamedTuple):
    """Points of a map whose pattern was recognised.

    Parameters
    ----------
    name : str
        Name of the file.
    quaternions : ndarray, shape (N, 4)
        Orientations, scalar first, crystal to sample.
    position : ndarray, shape (N, 2)
        x and y on the sample, in the unit of the file (micrometres).
    phase : ndarray, shape (N,)
        Number of the phase.
    symmetry : dict of int to str
        Rotation group of each phase as the file states it.
    skipped : int
        Points left out, whose pattern was not recognised.
    """

    name: str
    quaternions: NDArray[np.float64]
    position: NDArray[np.float64]
    phase: NDArray[np.int64]
    symmetry: dict[int, str]
    skipped: int


def read_ebsd(path: str | Path) -> EbsdMap:
    """Read an .ang or .ctf file.

    Bunge's Euler angles φ₁, Φ, φ₂ (radians in .ang, degrees in .ctf) rotate the sample's axes onto the crystal's; the
    quaternion of Rz(φ₁) Rx(Φ) Rz(φ₂) carries crystal directions to the sample. Points without a solution are left out:
    negative confidence or angles of 4π in .ang, phase 0 in .ctf.

    Warns
    -----
    RecordingWarning
        If points were left out, with their number.

    Raises
    ------
    RecordingError
        If the file is not as its format promises, naming the line.
    """
    from scipy.spatial.transform import Rotation

    text = opened_text(path)
    lines = text.path.read_text(encoding=text.encoding).splitlines()
    read = _read_ctf if any(line.lower().startswith("phase\tx\ty") for line in lines[:200]) else _read_ang
    angles, position, phase, good, symmetry = read(text.path, lines)
    skipped = int(np.sum(~good))
    if not good.any():
        raise RecordingError(text.path, "", f"none of its {len(good)} points has an orientation", "index it first")
    if skipped:
        note(text.path, f"{skipped} of {len(good)} points have no orientation and were left out")
    rotation = Rotation.from_euler("ZXZ", angles[good])
    quaternions = np.asarray(rotation.as_quat(scalar_first=True), dtype=np.float64)
    return EbsdMap(text.path.stem, quaternions, position[good], phase[good], symmetry, skipped)


def _read_ang(path: Path, lines: list[str]) -> Points:
    symmetry: dict[int, str] = {}
    phase_number = 1
    for line in lines:
        words = line.lstrip("# ").split()
        if not line.startswith("#") or len(words) < 2:
            continue
        if words[0] == "Phase" and words[1].isdecimal():
            phase_number = int(words[1])
        elif words[0] == "Symmetry" and words[1].isdecimal() and int(words[1]) in TSL:
            symmetry[phase_number] = TSL[int(words[1])]
    rows = _numbers(path, [(k, line) for k, line in enumerate(lines, 1) if line.strip() and line[0] != "#"], 8, 7)
    # Columns: φ₁ Φ φ₂ x y, image quality, confidence, phase.
    good = (rows[:, 6] >= 0.0) & (np.abs(rows[:, 0]) < 4.0 * np.pi - 1e-3)
    phase = rows[:, 7].astype(np.int64)
    if symmetry and set(np.unique(phase[good])) == {0}:
        phase += min(symmetry)  # maps of one phase number it 0
    return rows[:, :3], rows[:, 3:5], phase, good, symmetry


def _read_ctf(path: Path, lines: list[str]) -> Points:
    head = next(k for k, line in enumerate(lines) if line.lower().startswith("phase\tx\ty"))
    names = [name.strip().lower() for name in lines[head].split("\t")]
    if missing := [c for c in CTF_COLUMNS if c.lower() not in names]:
        raise RecordingError(path, f"line {head + 1}", f"no column {' '.join(missing)}", "export it again")
    symmetry: dict[int, str] = {}
    first = next((k for k, line in enumerate(lines[:head]) if line.lower().startswith("phases")), head)
    for number, line in enumerate(lines[first + 1 : head], 1):
        cells = line.split("\t")
        # Lattice lengths, angles, name, Laue group, space group.
        if len(cells) >= 4 and cells[3].strip().isdecimal() and int(cells[3]) in HKL:
            symmetry[number] = HKL[int(cells[3])]
    body = [(k, line.replace(",", ".")) for k, line in enumerate(lines[head + 1 :], head + 2) if line.strip()]
    column = [names.index(c.lower()) for c in CTF_COLUMNS]
    rows = _numbers(path, body, len(names), column[0])
    phase = rows[:, column[0]].astype(np.int64)
    return np.radians(rows[:, column[3:]]), rows[:, column[1:3]], phase, phase > 0, symmetry


def _numbers(path: Path, body: list[tuple[int, str]], width: int, phase: int) -> NDArray[np.float64]:
    """Return the first `width` numbers of each line (N, width); that of column `phase` is a phase's."""
    if not body:
        raise RecordingError(path, "", "no points below its header", "export it again")
    rows = np.empty((len(body), width))
    for row, (k, line) in zip(rows, body, strict=True):
        cells = line.split()[:width]
        try:
            if len(cells) < width or not all(cell.isascii() and "_" not in cell for cell in cells):
                raise ValueError
            row[:] = [float(cell) for cell in cells]
        except ValueError:
            problem = f"not {width} numbers: {line.strip()[:60]!r}"
            raise RecordingError(path, f"line {k}", problem, "is it an .ang or .ctf file?") from None
    bad = ~np.isfinite(rows).all(axis=1)
    if bad.any():
        raise RecordingError(path, f"line {body[int(np.argmax(bad))][0]}", "not finite", "remove the point")
    bad = (np.abs(rows[:, phase]) > MOST_PHASES) | (rows[:, phase] % 1.0 != 0.0)
    if bad.any():
        first = int(np.argmax(bad))
        raise RecordingError(
            path, f"line {body[first][0]}", f"phase {rows[first, phase]:g}", "phases are numbered 0, 1, …"
        )
    return rows
