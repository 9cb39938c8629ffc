"""What fuzzing starts from: small files of every format, made anew so that no binary files lie in the project."""

import io
import json
import zipfile
from pathlib import Path

import numpy as np

from bingham import ImuFilter
from bingham.filters import ImuStream
from bingham.io import write_csv, write_npz, write_track_csv, write_track_npz, write_tum
from bingham.recording import OrientationRecording
from bingham.simulate import simulate_imu, simulate_precession

__all__ = ["SUFFIXES", "make"]

# What a target's inputs are called: some readers look at endings.
SUFFIXES = {
    kind: f".{kind}" for kind in ("mat", "hdf5", "npz", "npy", "bag", "mcap", "db3", "ang", "pcd", "ply")
}  # fmt: skip

HEADERS = [
    "time_ms;gx_deg_s;gy_deg_s;gz_deg_s;ax_g;ay_g;az_g",
    "Timestamp,Gyroscope X (deg/s),Gyroscope Y (deg/s),Gyroscope Z (deg/s),Accel X (g),Accel Y (g),Accel Z (g)",
    "timestamp,gyro_rad[0],gyro_rad[1],gyro_rad[2],accelerometer_m_s2[0],accelerometer_m_s2[1],accelerometer_m_s2[2]",
    "time (s)\tx\ty\tz\tX\tY\tZ",
]


def make(folder: Path) -> dict[str, list[Path]]:
    """Write seeds into a folder; return them by kind."""
    folder.mkdir(parents=True, exist_ok=True)
    found: dict[str, list[Path]] = {}
    imu = simulate_imu(simulate_precession(0.6, 50.0, rest_s=0.1), rng=1)

    def add(kind, name, content=None):
        path = folder / f"{kind}-{name}{SUFFIXES.get(kind, '.txt')}"
        if content is not None:
            path.write_bytes(content if isinstance(content, bytes) else content.encode())
        found.setdefault(kind, []).append(path)
        return path

    write_csv(add("text", "imu"), imu)
    poses = OrientationRecording("p", imu.time, imu.reference)
    write_csv(add("text", "poses"), poses)
    write_tum(add("text", "tum"), time=imu.time, orientation=imu.reference)
    track = ImuFilter().run(imu)
    write_track_csv(add("text", "track"), track)
    rows = "\n".join(",".join(f"{x:.4f}" for x in row) for row in np.column_stack(
        [imu.time, imu.gyroscope, imu.accelerometer])[:12])  # fmt: skip
    for k, header in enumerate(HEADERS):
        separator = next(s for s in ";\t," if s in header)
        add("text", f"header{k}", f"# a preamble\n\n{header}\n{rows.replace(',', separator)}\n")
    add("text", "comma", rows.replace(".", "§").replace(",", ";").replace("§", ",") + "\n")
    add("text", "angles", "dip,dip_direction\n10,200\n80,20\n45.5,359\n30,90\n")
    add("text", "euler", "phi1 Phi phi2\n10 45 20\n11 44 19\n12 46 21\n9 45 20\n10 44 22\n")
    add("text", "euroc", "#timestamp [ns],w_RS_S_x,w_RS_S_y,w_RS_S_z,a_RS_S_x,a_RS_S_y,a_RS_S_z\n"
        + "\n".join(f"{10**18 + 5_000_000 * k},0.01,0,0,0,0,9.81" for k in range(12)) + "\n")  # fmt: skip
    add("text", "kitti", "\n".join("1 0 0 0 0 1 0 0 0 0 1 0" for _ in range(6)) + "\n")
    add("text", "opensim", "DataRate=50\nDataType=Quaternion\nendheader\ntime\ttorso_imu\n"
        + "\n".join(f"{k / 50}\t1,0,0,{k / 1e5}" for k in range(8)) + "\n")  # fmt: skip
    add("ebsd", "ang", "# Phase 1\n# Symmetry 43\n" + "\n".join(
        f" 1.{k} 0.5 2.1 {k}.0 0.0 120.5 0.8 1 1 1.2" for k in range(6)) + "\n")  # fmt: skip
    add("ebsd", "ctf", "Channel Text File\nPhases\t1\n3.5;3.5;3.5\t90;90;90\tNickel\t11\t225\n"
        "Phase\tX\tY\tBands\tError\tEuler1\tEuler2\tEuler3\tMAD\tBC\tBS\n"
        + "\n".join(f"1\t{k}\t0\t8\t0\t{k}.5\t20\t30\t0.4\t90\t200" for k in range(6)) + "\n")  # fmt: skip
    add("together", "phone", "@@@".join(
        "time,seconds_elapsed,z,y,x\n" + "".join(f"{10**18 + 10**7 * k},{k / 100},{z},0.1,0.2\n" for k in range(12))
        for z in (0.1, 9.81, 30.0)))  # fmt: skip
    write_npz(add("npz", "imu"), imu)
    write_npz(add("npz", "poses"), poses)
    write_track_npz(add("npz", "track"), track)
    plain = io.BytesIO()
    np.savez(plain, t=imu.time, gyr=imu.gyroscope, acc=imu.accelerometer)
    add("npz", "plain", plain.getvalue())
    points = np.stack([*np.meshgrid(np.arange(6.0), np.arange(5.0)), np.full((5, 6), 2.0)], axis=-1)
    for kind, save in (("npz", lambda out: np.savez(out, xyz=points)), ("npy", lambda out: np.save(out, points))):
        content = io.BytesIO()
        save(content)
        add(kind, "points", content.getvalue())
    _clouds(add, points.reshape(-1, 3)[:8])
    for path in list(found["npz"]):
        with zipfile.ZipFile(path) as archive:
            parts = [name.removesuffix(".npy").encode() + b"\0" + archive.read(name) for name in archive.namelist()]
        add("arrays", path.stem, b"@@@".join(parts))
    _matlab(add, imu)
    _bags(folder, found, imu)
    _commands(add, found)
    lines = [f"{name} {t!r} {v[0]!r} {v[1]!r} {v[2]!r}" for t, *vectors in zip(
        imu.time.tolist(), imu.gyroscope.tolist(), imu.accelerometer.tolist(), imu.magnetometer.tolist(), strict=True)
        for name, v in zip(("gyr", "acc", "mag"), vectors, strict=True)]  # fmt: skip
    add("stream", "all", "\n".join(lines[:60]) + "\n")
    add("stream", "odd", "# x\n\nacc,0,0,0,9.81\ngyr 1e3 0 0 0\ngyr 1e3 nan 0 0\nmag 2 1 2\n")
    stream = ImuStream()
    stream.gyroscope(0.0, [0.0, 0.0, 0.0])
    stream.accelerometer(0.0, [0.0, 0.0, 9.81])
    add("state", "begun", stream.state.to_json())
    add("state", "blank", ImuStream().state.to_json())
    add("state", "other", json.dumps({"values": [], "covariance": [[]], "last": None}))
    return found


def _clouds(add, points):
    """PCD, PLY and text, a byte for the ending before each."""
    flat = points.astype("<f4")
    text = "".join(f"{x} {y} {z}\n" for x, y, z in flat.tolist()).encode()
    pcd = f"FIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH {len(flat)}\nHEIGHT 1\nDATA "
    literal = b"".join(bytes([31]) + part for part in (flat.T.tobytes()[k : k + 32] for k in range(0, flat.nbytes, 32)))
    sizes = np.array([len(literal), flat.nbytes], "<u4").tobytes()
    for kind, data in {"ascii": text, "binary": flat.tobytes(), "binary_compressed": sizes + literal}.items():
        add("points", f"pcd-{kind}", b"\0" + f"{pcd}{kind}\n".encode() + data)
    ply = f"element vertex {len(flat)}\n" + "".join(f"property float {a}\n" for a in "xyz") + "end_header\n"
    for form, data in {"ascii": text, "binary_big_endian": flat.astype(">f4").tobytes()}.items():
        add("points", f"ply-{form}", b"\1" + f"ply\nformat {form} 1.0\n{ply}".encode() + data)
    add("points", "text", b"\2x,y,z\n" + text.replace(b" ", b","))


def _commands(add, found):
    """Inputs of the command line: a byte for the command and its file."""
    from targets import COMMANDS

    for k, (_, kind, *_) in enumerate(COMMANDS):
        files = found["ebsd" if kind == "ang" else kind]
        for path in files[k % min(5, len(files)) :: 5]:
            add("command", f"{k}-{path.stem}", bytes([k]) + path.read_bytes())


def _matlab(add, imu):
    from scipy.io import savemat

    arrays = {"imu_gyr": imu.gyroscope, "imu_acc": imu.accelerometer, "imu_mag": imu.magnetometer,
              "opt_quat": imu.reference, "sampling_rate": 50.0}  # fmt: skip
    for compressed in (False, True):
        content = io.BytesIO()
        savemat(content, arrays, do_compression=compressed)
        add("mat", f"compressed{compressed}", content.getvalue())
    try:
        import h5py
    except ImportError:
        return
    forms = {
        "plain": {}, "zip": {"compression": "gzip", "shuffle": True}, "chunks": {"chunks": (4, 2), "fletcher32": True},
        "grows": {"chunks": (4, 2), "maxshape": (None, None)},
    }  # fmt: skip
    for form, options in forms.items():
        for library in ("earliest", "latest"):
            with h5py.File(add("hdf5", f"{form}-{library}"), "w", libver=library) as file:
                file.attrs["sampling_rate"] = 50.0
                file["movement"] = np.ones(12)
                for name, value in arrays.items():
                    if np.ndim(value):
                        file.create_dataset(name, data=value[:12], **options)


def _bags(folder, found, imu):
    try:
        from bags import Bag
    except ImportError:
        return
    try:
        for kind in ("bag", "sqlite", "mcap"):
            place = folder / f"bag-{kind}"
            place.mkdir(exist_ok=True)
            with Bag(kind, place) as bag:
                for k, t in enumerate(imu.time[:12]):
                    bag.imu("/imu", 10**18 + round(1e9 * t), imu.gyroscope[k], imu.accelerometer[k])
            files = [bag.path] if bag.path.is_file() else sorted(bag.path.glob("*.[dm]*"))
            for file in files:
                if file.suffix in (".bag", ".db3", ".mcap"):
                    found.setdefault(file.suffix[1:], []).append(file)
    except ImportError:
        return
