"""Files that lie, are damaged, or were made to harm: an error in a line, no crash, no memory that they declare."""

import io
import struct
import tracemalloc
import warnings
import zipfile
import zlib

import numpy as np
import pytest

from bags import Bag
from bingham.errors import BinghamError, InvalidArgumentError, RecordingError
from bingham.io import read_axes, read_recording
from bingham.io.mat5 import read_mat5

N = 6
FIELDS = {
    "imu_gyr": np.random.default_rng(0).normal(0, 1, (N, 3)),
    "imu_acc": np.tile([0, 0, 9.8], (N, 1)),
    "imu_mag": np.tile([0, 20.0, -40.0], (N, 1)),
    "opt_quat": np.tile([1.0, 0, 0, 0], (N, 1)),
    "movement": np.ones(N),
    "sampling_rate": 100.0,
}


def rejected(file, match, **options):
    with pytest.raises(RecordingError, match=match) as caught, warnings.catch_warnings():
        warnings.simplefilter("ignore")
        read_recording(file, **options)
    message = str(caught.value)
    assert message.startswith(f"{file}")
    assert len(message.splitlines()) <= 3
    assert len(message) < 1000


def within(limit, call):
    """Call, and return the result; its peak of memory must stay within the limit."""
    tracemalloc.start()
    try:
        return call()
    finally:
        peak = tracemalloc.get_traced_memory()[1]
        tracemalloc.stop()
        assert peak < limit, f"{peak / 1e6:.0f} MB"


def mat(tmp_path, content, name="x.mat", **options):
    from scipy.io import savemat

    savemat(tmp_path / name, content, **options)
    return tmp_path / name


@pytest.mark.parametrize("compressed", [False, True])
def test_own_matlab_reader_agrees_with_scipy(tmp_path, compressed):
    rng = np.random.default_rng(1)
    content = {
        "double": rng.standard_normal((4, 3)),
        "single": rng.standard_normal((2, 5)).astype(np.float32),
        "int16": rng.integers(-9, 9, (3, 3)).astype(np.int16),
        "whole": np.array([[1.0, 2.0, 300.0]]),  # MATLAB may store these as integers
        "flags": np.array([[True, False]]),
        "empty": np.zeros((0, 3)),
        "one": 2.5,
    }
    others = {"text": "words", "cell": np.array([1, "a"], dtype=object), "struct": {"a": 1.0}}
    file = mat(tmp_path, content | others, do_compression=compressed)
    found = read_mat5(file, tuple(content))
    from scipy.io import loadmat

    for name, expected in loadmat(file, variable_names=list(content)).items():
        if not name.startswith("_"):
            np.testing.assert_array_equal(found[name], expected)
    assert set(found) == set(content)
    for name in others:
        with pytest.raises(RecordingError, match=f"field {name}: holds no array of numbers"):
            read_mat5(file, (name,))


def test_complex_and_text_are_no_numbers(tmp_path):
    for value in (FIELDS["imu_gyr"] + 1j, "text"):
        file = mat(tmp_path, FIELDS | {"imu_gyr": value})
        rejected(file, "field imu_gyr: (of complex numbers|holds no array)")
        np.savez(tmp_path / "x.npz", t=np.arange(N) / 100, gyr=value)
        rejected(tmp_path / "x.npz", "field gyr: of type")


@pytest.mark.parametrize("compressed", [False, True])
def test_mutated_matlab_files_never_crash(tmp_path, compressed):
    whole = bytearray(mat(tmp_path, FIELDS, do_compression=compressed).read_bytes())
    rng = np.random.default_rng(2)
    file = tmp_path / "y.mat"
    fine = 0
    for _ in range(400):
        changed = bytearray(whole)
        for _ in range(rng.integers(1, 4)):
            at = int(rng.integers(124, len(changed)))
            if rng.random() < 0.5:
                changed[at] = int(rng.integers(256))
            else:
                struct.pack_into("<I", changed, min(at & ~3, len(changed) - 4), int(rng.integers(2**32)))
        file.write_bytes(changed[: int(rng.integers(130, len(changed) + 1))] if rng.random() < 0.2 else changed)
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")
                read_recording(file, format="broad")
            fine += 1
        except BinghamError:
            pass
    assert (compressed or fine > 0) and fine < 400


def test_what_matlab_files_declare_is_compared_first(tmp_path):
    whole = mat(tmp_path, {"imu_gyr": np.zeros((400, 3))}).read_bytes()
    at = whole.index(struct.pack("<ii", 400, 3))
    file = tmp_path / "x.mat"
    for shape in ((2**30, 3), (-400, -3), (2**31 - 1, 2**31 - 1), (400, 4)):
        file.write_bytes(whole[:at] + struct.pack("<ii", *shape) + whole[at + 8 :])
        within(20e6, lambda: rejected(file, "not a readable MATLAB file"))
    bomb = zlib.compress(bytes(300_000_000), 9)
    file.write_bytes(whole[:128] + struct.pack("<II", 15, len(bomb)) + bomb)
    assert file.stat().st_size < 400_000
    within(300e6, lambda: rejected(file, "compressed data: 1.* of memory.*max_size="))


def npz(file, **arrays):
    np.savez_compressed(file, **arrays)
    return file


def test_archives_that_unfold_are_rejected_and_can_be_allowed(tmp_path):
    file = npz(tmp_path / "x.npz", t=np.arange(3) / 100, gyr=np.zeros((3, 3)), acc=np.zeros((20_000_000, 3), np.int8))
    assert file.stat().st_size < 1e6
    within(60e6, lambda: rejected(file, "field acc: 480 MB of memory.*max_size="))
    rejected(file, "field acc: 20000000 rows beside 3 times", max_size=1e9)
    with pytest.raises(InvalidArgumentError, match="max_size"):
        read_recording(file, max_size=-1)
    buffer = io.BytesIO()
    np.lib.format.write_array_header_1_0(buffer, {"descr": "<f8", "fortran_order": False, "shape": (10**12, 3)})
    with zipfile.ZipFile(file, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("gyr.npy", b"\x93NUMPY\x01\x00" + buffer.getvalue().removeprefix(b"\x93NUMPY\x01\x00"))
        archive.writestr("t.npy", b"\x93NUMPY\x01\x00" + buffer.getvalue().removeprefix(b"\x93NUMPY\x01\x00"))
    within(20e6, lambda: rejected(file, "of memory|not a readable npz"))


def test_arrays_that_nothing_needs_are_not_read(tmp_path):
    good = {"t": np.arange(N) / 100, "gyr": FIELDS["imu_gyr"], "acc": FIELDS["imu_acc"]}
    file = npz(tmp_path / "x.npz", **good, other=np.zeros(30_000_000))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        assert within(20e6, lambda: read_recording(file)).size == N


def test_damaged_text_in_archives(tmp_path):
    for name, value in (
        ("format", np.array("\ud800")),
        ("format", np.array(b"\xff\xfe")),
        ("format", np.array(["a", "b"])),
        ("name", np.array("x" * 100_000)),
    ):
        content = {"format": "bingham-imu-1", "name": "a", "time": np.arange(N) / 100, "gyroscope": FIELDS["imu_gyr"]}
        np.savez(tmp_path / "x.npz", **(content | {"earth_frame": "ENU", name: value}))
        rejected(tmp_path / "x.npz", f"field {name}")


def hdf5(tmp_path, change):
    h5py = pytest.importorskip("h5py")
    file = tmp_path / "x.hdf5"
    with h5py.File(file, "w") as archive:
        for name, value in FIELDS.items():
            if np.ndim(value):
                archive[name] = value
            else:
                archive.attrs[name] = value
        change(archive, h5py)
    return file


def test_hdf5_that_leads_elsewhere(tmp_path):
    secret = tmp_path / "secret.bin"
    secret.write_bytes(FIELDS["imu_acc"].tobytes())

    def stored(archive, h5py):
        del archive["imu_acc"]
        archive.create_dataset("imu_acc", (N, 3), "f8", external=[(str(secret), 0, h5py.h5f.UNLIMITED)])

    def linked(archive, h5py):
        del archive["imu_acc"]
        archive["imu_acc"] = h5py.ExternalLink("other.hdf5", "imu_acc")

    def soft(archive, h5py):
        del archive["imu_acc"]
        archive["imu_acc"] = h5py.SoftLink("/imu_gyr")

    def virtual(archive, h5py):
        del archive["imu_acc"]
        layout = h5py.VirtualLayout((N, 3), "f8")
        layout[:] = h5py.VirtualSource("other.hdf5", "imu_acc", (N, 3))
        archive.create_virtual_dataset("imu_acc", layout)

    for change in (stored, linked, soft, virtual):
        rejected(hdf5(tmp_path, change), "field imu_acc: (keeps its numbers in another file|links elsewhere)")


def test_hdf5_that_declares_much(tmp_path):
    def unused(archive, h5py):
        archive.create_dataset("other", (400_000_000,), "f8", fillvalue=1.0, chunks=(1_000_000,))

    def needed(archive, h5py):
        del archive["imu_acc"]
        archive.create_dataset("imu_acc", (100_000_000, 3), "f8", chunks=(1_000_000, 3))

    file = hdf5(tmp_path, unused)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        assert within(20e6, lambda: read_recording(file)).size == N
    file = hdf5(tmp_path, needed)
    within(20e6, lambda: rejected(file, "field imu_acc: 2.4 GB of memory"))


def ros2(tmp_path, kind="sqlite"):
    with Bag(kind, tmp_path) as bag:
        for k in range(N):
            bag.imu("/imu", 10**18 + k * 10**7, FIELDS["imu_gyr"][k], FIELDS["imu_acc"][k])
    return bag.path


@pytest.mark.parametrize("name", ["/etc/passwd", "../secret.db3", "link.db3"])
def test_bags_that_name_files_outside(tmp_path, name):
    path = ros2(tmp_path)
    secret = tmp_path / "secret.db3"
    secret.write_bytes((path / "x.db3").read_bytes())
    (path / "link.db3").symlink_to(secret)
    metadata = path / "metadata.yaml"
    metadata.write_text(metadata.read_text().replace("x.db3", name))
    with pytest.raises(RecordingError, match="which is outside the bag"):
        read_recording(path)


def test_metadata_that_multiplies_itself(tmp_path):
    path = ros2(tmp_path)
    metadata = path / "metadata.yaml"
    metadata.write_text("a: &a [x,x,x,x]\nb: &b [*a,*a,*a]\n" + metadata.read_text())
    with pytest.raises(RecordingError, match="refers to itself by anchors"):
        read_recording(path)


@pytest.mark.parametrize("kind", ["bag+bz2", "bag+lz4", "mcap+storage", "sqlite+file", "sqlite+message"])
def test_compressed_bags_are_bounded(tmp_path, kind):
    path = ros2(tmp_path, kind)
    assert read_recording(path).size == N
    with pytest.raises(RecordingError, match=r"of memory.*max_size="):
        read_recording(path, max_size=100.0)


@pytest.mark.parametrize("name", ["gx\x1b[31m", "[/red]gx", "$\\foo$", "gx\u202egy", "\x07"])
def test_names_with_signs_of_control_stay_in_their_line(tmp_path, name):
    file = tmp_path / "x.csv"
    file.write_text(f"t,{name},gy,gz\n0,1,2,3\n0.1,1,2,3\n", encoding="utf-8")
    rejected(file, "no column gx for the gyroscope")
    axes = tmp_path / "y.csv"
    axes.write_text(f"{name},b,c\n1,0,0\n0,1,0\n0,0,1\n", encoding="utf-8")
    assert read_axes(axes, columns=(name, "b", "c")).values.shape == (3, 3)


@pytest.mark.parametrize("seed", range(3))
def test_mutated_text_never_ends_in_another_error(tmp_path, seed):
    rng = np.random.default_rng(seed)
    seeds = [
        "t,gx,gy,gz,ax,ay,az,qw,qx,qy,qz\n0.0,1,2,3,0,0,9.8,1,0,0,0\n0.1,1,2,3,0,0,9.8,1,0,0,0\n",
        "# a comment\n0.0 1 2 3 0 0 0 1\n0.1 1 2 3 0 0 0 1\n",
        "Timestamp,X,Y,Z\n01-Mar-2024 10:00:00.000,1,2,3\n01-Mar-2024 10:00:00.010,1,2,3\n",
        "GYROFLOW IMU LOG\nversion,1.3\ntscale,0.001\ngscale,0.1\nt,gx,gy,gz\n0,1,2,3\n1,1,2,3\n",
        "sep=;\nt;roll;pitch;yaw\n0,5;1;2;3\n1,5;1;2;3\n",
        "trend,plunge\n10,20\n30,40\n",
        "endheader\ntime\ta_imu\n0\t1,0,0,0\n1\t1,0,0,0\n",
        "1 0 0 0 0 1 0 0 0 0 1 0\n1 0 0 0 0 1 0 0 0 0 1 1\n",
    ]
    parts = [b",", b";", b"\n", b'"', b"\xff", b"\x00", b"1e400", b"nan", b"-", b"_", b"[0]", b"(", b"#",
             b"\x1b[31m", b"9" * 400, "١".encode(), b"2024-02-30", b"t", b"=", b" ", b"\t", b"\r"]  # fmt: skip
    file = tmp_path / "x.csv"
    for _ in range(150):
        data = bytearray(seeds[rng.integers(len(seeds))].encode())
        for _ in range(rng.integers(1, 6)):
            at = int(rng.integers(len(data) + 1))
            drop = int(rng.integers(0, 4)) if rng.random() < 0.5 else 0
            data[at : at + drop] = parts[rng.integers(len(parts))]
        file.write_bytes(data)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            warnings.simplefilter("error", RuntimeWarning)
            for read in (read_recording, read_axes):
                try:
                    read(file)
                except BinghamError as error:
                    assert len(str(error)) < 3000


@pytest.mark.parametrize(
    ("program", "words"),
    [
        ("import os, signal; input(); os.kill(os.getpid(), signal.SIGSEGV)", "ended the reader, code -11"),
        ("import time; input(); time.sleep(60)", "does not end"),
        ('print(\'{"name": "imu_gyr", "dtype": "<f8", "shape": [9]}\')', "ended the reader"),
    ],
    ids=["crash", "circle", "cut off"],
)
def test_a_file_that_ends_its_reader_is_one_error_and_the_next_one_is_read(tmp_path, monkeypatch, program, words):
    from bingham.io import hdf5 as reader
    from bingham.io import read_broad

    file = hdf5(tmp_path, lambda *_: None)
    monkeypatch.setattr(reader, "_reader", reader._Reader())
    (tmp_path / "program.py").write_text(program)
    with monkeypatch.context() as patch:
        patch.setattr(reader, "PROGRAM", tmp_path / "program.py")
        patch.setattr(reader, "PATIENCE", 2.0)
        with pytest.raises(RecordingError, match=words) as caught:
            read_broad(file)
        assert "\n" not in str(caught.value)
    assert len(read_broad(file).gyroscope) == N
    assert reader._reader.stop() == 0
