"""Point clouds and depth images as files: PCD, PLY, text, PNG."""

import json
import struct

import numpy as np
import pytest
from typer.testing import CliRunner

from bingham.cli.main import app
from bingham.errors import RecordingError
from bingham.io.points import read_points

POINTS = np.random.default_rng(0).uniform(0.5, 2.0, (4, 5, 3)).astype(np.float32)
POINTS[1, 2] = np.nan


def packed(data):
    """LZF: literals, and a repetition wherever bytes are those of eight before."""
    out, at = bytearray(), 0
    while at < len(data):
        length = 0
        while at >= 8 and at + length < len(data) and length < 264 and data[at + length] == data[at + length - 8]:
            length += 1
        if length >= 3:
            code = length - 2
            out += bytes([min(code, 7) << 5]) + (bytes([code - 7]) if code >= 7 else b"") + bytes([7])
            at += length
        else:
            some = data[at : at + 8]
            out += bytes([len(some) - 1]) + some
            at += len(some)
    return bytes(out)


def pcd(kind, points=POINTS, height=4):
    """A cloud with a colour before and two numbers in a field behind the coordinates."""
    flat = points.reshape(-1, 3)
    rows = np.zeros(len(flat), dtype=[("rgb", "<u4"), ("x", "<f4"), ("y", "<f4"), ("z", "<f4"), ("more", "<f8", 2)])
    rows["x"], rows["y"], rows["z"], rows["more"] = *flat.T, 7.0
    header = (
        "# .PCD v0.7\nVERSION 0.7\nFIELDS rgb x y z more\nSIZE 4 4 4 4 8\nTYPE U F F F F\nCOUNT 1 1 1 1 2\n"
        f"WIDTH {len(flat) // height}\nHEIGHT {height}\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS {len(flat)}\nDATA {kind}\n"
    ).encode()
    if kind == "ascii":
        return header + "".join(f"0 {x!s} {y!s} {z!s} 7 7\n" for x, y, z in flat).encode()
    if kind == "binary":
        return header + rows.tobytes()
    data = b"".join(rows[name].tobytes() for name in rows.dtype.names)
    small = packed(data)
    assert len(small) < len(data)
    return header + struct.pack("<II", len(small), len(data)) + small


def ply(form, points=POINTS):
    flat = points.reshape(-1, 3)
    header = (
        f"ply\nformat {form} 1.0\ncomment a camera before, faces behind\nelement camera 1\nproperty double f\n"
        f"element vertex {len(flat)}\nproperty float nx\nproperty float x\nproperty float y\nproperty double z\n"
        "property uchar red\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n"
    ).encode()
    if form == "ascii":
        return header + b"525\n" + "".join(f"0 {x!s} {y!s} {z!s} 9\n" for x, y, z in flat).encode() + b"3 0 1 2\n"
    order = "<" if "little" in form else ">"
    data = b"".join(struct.pack(f"{order}fffdB", 0.0, x, y, z, 9) for x, y, z in flat.tolist())
    return header + struct.pack(f"{order}d", 525.0) + data + struct.pack(f"{order}Biii", 3, 0, 1, 2)


@pytest.mark.parametrize("kind", ["ascii", "binary", "binary_compressed"])
def test_pcd(tmp_path, kind):
    path = tmp_path / "cloud.pcd"
    path.write_bytes(pcd(kind))
    np.testing.assert_allclose(read_points(path)["xyz"], POINTS.astype(float), rtol=1e-7)
    path.write_bytes(pcd(kind, height=1))
    assert read_points(path)["xyz"].shape == (20, 3)


@pytest.mark.parametrize("form", ["ascii", "binary_little_endian", "binary_big_endian"])
def test_ply(tmp_path, form):
    path = tmp_path / "cloud.ply"
    path.write_bytes(ply(form))
    np.testing.assert_allclose(read_points(path)["xyz"], POINTS.reshape(-1, 3).astype(float), rtol=1e-7)


@pytest.mark.parametrize(
    "text",
    [
        "# x y z\n1 2 3\n4 5 6\n",
        "//X,Y,Z,R,G,B\n1,2,3,9,9,9\n4,5,6,9,9,9\n",
        "2\n1 2 3 -100 9 9 9\n4 5 6 -100 9 9 9\n",
        "intensity;x;y;z\n7;1;2;3\n7;4;5;6\n",
        "﻿x\ty\tz\n1\t2\t3\n4\t5\t6\n",
        "\n\nX [m],Y [m],Z (m)\n1,2,3\n4,5,6\n",
    ],
    ids=["comment", "cloudcompare", "pts", "semicolons", "mark", "units"],
)
def test_text_with_names_colours_or_a_count(tmp_path, text):
    path = tmp_path / "cloud.txt"
    path.write_text(text, encoding="utf-8")
    np.testing.assert_array_equal(read_points(path)["xyz"], [[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]])


@pytest.mark.parametrize(
    ("name", "content", "said"),
    [
        ("a.pcd", pcd("binary")[:-1], "cut off"),
        ("a.pcd", pcd("ascii").rsplit(b"\n", 3)[0] + b"\n", "18 rows; 20 by its header"),
        ("a.pcd", pcd("binary_compressed")[:-1], "cut off"),
        ("a.pcd", pcd("binary").replace(b"rgb x", b"rgb w"), "no x, y, z among rgb w y z more"),
        ("a.pcd", pcd("binary").replace(b"DATA binary", b"DATA zip"), "DATA zip"),
        ("a.pcd", pcd("binary").replace(b"WIDTH 5", b"WIDTH 4"), "POINTS 20, WIDTH 4, HEIGHT 4"),
        ("a.ply", ply("ascii").replace(b"property uchar red", b"property list uchar int red"), "vertices with a list"),
        ("a.ply", ply("ascii").replace(b"vertex 20", b"vertex -2"), "line 6"),
        ("a.pcd", pcd("binary").replace(b"SIZE 4", b"SIZE"), "do not go together"),
        ("a.pcd", pcd("binary").replace(b"WIDTH 5", b"WIDTH 5000000000").replace(b"POINTS 20\n", b""), "GB of memory"),
        ("a.ply", ply("binary_little_endian")[:-60], "cut off"),
        ("a.ply", ply("ascii").replace(b"vertex 20", b"vertex x"), "line 6"),
        ("a.ply", b"solid\n", "not a PLY file"),
        ("a.las", b"LASF", ".las is not read"),
        ("a.png", b"\x89PNG\r\n\x1a\n" + bytes(16) + b"\x08\x00", "8 bits"),
    ],
)
def test_what_is_wrong_is_named(tmp_path, name, content, said):
    path = tmp_path / name
    path.write_bytes(content)
    with pytest.raises(RecordingError, match=said):
        read_points(path)


def test_damaged_compression_is_an_error(tmp_path):
    content = bytearray(pcd("binary_compressed"))
    content[content.index(b"compressed\n") + 19] = 0xFF  # a repetition of what never came
    path = tmp_path / "a.pcd"
    path.write_bytes(content)
    with pytest.raises(RecordingError, match="damaged"):
        read_points(path)


def test_older_headers_and_capitals_and_arrays_with_intensities(tmp_path):
    (tmp_path / "a.pcd").write_bytes(pcd("binary").replace(b"WIDTH 5\nHEIGHT 4\n", b"").replace(b"FIELDS", b"COLUMNS"))
    assert read_points(tmp_path / "a.pcd")["xyz"].shape == (20, 3)
    (tmp_path / "a.ply").write_bytes(ply("ascii").replace(b"float x", b"float X"))
    assert read_points(tmp_path / "a.ply")["xyz"].shape == (20, 3)
    np.save(tmp_path / "a.npy", np.ones((60, 4)))
    assert read_points(tmp_path / "a.npy")["xyz"].shape == (60, 3)


def planes_of(path, *options):
    result = CliRunner().invoke(app, ["planes", str(path), "--json", *options])
    assert result.exit_code == 0, result.output
    return json.loads(result.stdout), result.stderr


def test_a_cloud_gives_the_same_planes_from_every_format(tmp_path):
    rng = np.random.default_rng(1)
    wall = np.column_stack([rng.uniform(-1, 1, (600, 2)), np.full(600, 2.0)])
    floor = np.column_stack([rng.uniform(-1, 1, 400), np.full(400, 1.0), rng.uniform(1.0, 2.0, 400)])
    points = (np.concatenate([wall, floor]) + rng.normal(0.0, 0.003, (1000, 3))).astype(np.float32)
    for name, content in {"a.pcd": pcd("binary", points, 1), "a.ply": ply("binary_little_endian", points)}.items():
        (tmp_path / name).write_bytes(content)
    np.savez(tmp_path / "a.npz", xyz_mm=1e3 * points.astype(float))
    (tmp_path / "a.csv").write_text("x,y,z\n" + "".join(f"{x},{y},{z}\n" for x, y, z in 1e3 * points.astype(float)))
    found = [planes_of(tmp_path / f"a.{kind}")[0] for kind in ("pcd", "ply", "npz")]
    found.append(planes_of(tmp_path / "a.csv", "--scale", "0.001")[0])
    distances = [sorted(abs(plane["distance_m"]) for plane in row["planes"][:2]) for row in found]
    np.testing.assert_allclose(distances[0], [1.0, 2.0], atol=5e-3)
    np.testing.assert_allclose(distances, [distances[0]] * 4, rtol=1e-6)


def scan(beams=24, height=1.2):
    """Rings of a rotating scanner in a room of 8 × 6 × 3 m, dense along a ring, sparse across, noise 1 cm."""
    azimuth, elevation = np.meshgrid(np.radians(np.arange(0, 360, 0.5)), np.radians(np.linspace(-45, 45, beams)))
    ray = np.stack([np.cos(elevation) * np.cos(azimuth), np.cos(elevation) * np.sin(azimuth), np.sin(elevation)], -1)
    with np.errstate(divide="ignore"):
        reach = np.stack([4.0 / np.abs(ray[..., 0]), 3.0 / np.abs(ray[..., 1]),
                          np.where(ray[..., 2] > 0, 3.0 - height, height) / np.abs(ray[..., 2])])  # fmt: skip
    distance = reach.min(axis=0) + np.random.default_rng(2).normal(0.0, 0.01, azimuth.shape)
    return ray * distance[..., None]


def test_a_rotating_scanner_sees_floor_and_ceiling_too(tmp_path):
    points = scan()
    points[3, 5:60] = np.nan
    np.savez(tmp_path / "scan.npz", points=points)
    row, said = planes_of(tmp_path / "scan.npz", "-o", str(tmp_path / "out"))
    assert "taken as a loose cloud" in said
    found = sorted([*(np.round(p["normal"]) + 0.0).tolist(), round(abs(p["distance_m"]), 1)] for p in row["planes"])
    assert found == [[-1, 0, 0, 4.0], [0, -1, 0, 3.0], [0, 0, -1, 1.8], [0, 0, 1, 1.2], [0, 1, 0, 3.0], [1, 0, 0, 4.0]]
    label = np.load(tmp_path / "out" / "scan.planes.npy")
    assert label.shape == points.shape[:2] and (label[3, 5:60] == -1).all()
    assert np.mean(label[np.isfinite(points[..., 0])] >= 0) > 0.9


def test_points_of_a_map_in_which_the_floor_is_zero_and_of_one_in_millimetres(tmp_path):
    rng = np.random.default_rng(3)
    room = np.concatenate([np.insert(rng.uniform(0.0, 4.0, (1500, 2)), k, 0.0, axis=1) for k in range(3)])
    room += rng.normal(0.0, 0.003, room.shape)
    np.save(tmp_path / "map.npy", np.concatenate([room, room[:500]]))  # some twice
    row, _ = planes_of(tmp_path / "map.npy")
    assert len(row["planes"]) == 3
    np.testing.assert_allclose([p["distance_m"] for p in row["planes"]], 0.0, atol=1e-3)
    np.save(tmp_path / "mm.npy", 1e3 * room + 2000.0)
    assert "millimetres --scale 0.001" in planes_of(tmp_path / "mm.npy")[1]
