"""Signals at every system call that renames, for every command that writes: ``python tests/fuzz/signals.py TRIES``.

Each command runs in a fork of this process with a small library loaded before the C library (rename_shim.c), which
counts the calls that rename or link and sends SIGINT or SIGTERM before or after one of them. What it would replace is
there, or is not. Afterwards every output is as before or as the undisturbed command leaves it, all of a set alike where
the command promises a set, and "nothing written" is said only if that is so.
"""

import csv
import ctypes
import io
import itertools
import json
import os
import shutil
import signal
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np

HERE = Path(__file__).resolve().parent
LIBRARY = "BINGHAM_RENAME_SHIM"


def inputs(folder, seed):
    """Write what the commands read."""
    from bingham import Bingham
    from bingham.io import write_csv, write_npz
    from bingham.recording import OrientationRecording
    from bingham.simulate import simulate_imu, simulate_precession, simulate_tumbling

    folder.mkdir()
    imu = simulate_imu(simulate_precession(3.0, 50.0, rest_s=1.0), rng=seed)
    write_npz(folder / "imu.npz", imu)
    write_npz(folder / "turning.npz", simulate_imu(simulate_tumbling(20.0, 25.0, rng=seed), rng=seed))
    (folder / "many").mkdir()
    for name in ("a", "b"):
        write_npz(folder / "many" / f"{name}.npz", imu)
    rng = np.random.default_rng(seed)
    axes = Bingham([-30.0, -5.0, 0.0], np.eye(3)).rvs(60, rng=rng)
    text = "n,e,d\n" + "".join(",".join(f"{x:.6f}" for x in row) + "\n" for row in axes)
    (folder / "axes.csv").write_text(text)
    u, v = np.meshgrid(np.arange(40.0), np.arange(30.0))
    np.savez(folder / "scene.npz", xyz=np.stack([u / 20, v / 20, 2 + u / 50 + 1e-3 * rng.standard_normal(u.shape)], -1))
    q = np.cumsum(0.02 * rng.standard_normal((60, 3)), axis=0)
    q = np.concatenate([np.ones((60, 1)), q], axis=1)
    q /= np.linalg.norm(q, axis=1, keepdims=True)
    write_csv(folder / "poses.csv", OrientationRecording("poses", np.arange(60) / 20, q))
    lines = [f"gyr {k / 50} 0 0 0.1\nacc {k / 50} 0 {seed / 10} 9.81\n" for k in range(100)]
    (folder / "stream.txt").write_text("".join(lines))
    sys.path.insert(0, str(HERE.parent))
    try:
        from bags import Bag

        with Bag("sqlite", folder, name="walk") as bag:
            for k in range(len(imu.time)):
                stamp = 10**18 + round(1e9 * imu.time[k])
                bag.imu("/imu", stamp, imu.gyroscope[k], imu.accelerometer[k])
    except ImportError:
        pass


# Name → arguments (IN and OUT are folders), and whether what it writes is one set: all old or all new.
COMMANDS = {
    "track": ("track IN/imu.npz --no-figure --tum -o OUT", True),
    "track --report": ("track IN/imu.npz --no-figure --report -o OUT", True),
    "track --bag": ("track IN/walk --no-figure --bag -o OUT", True),
    "track many": ("track IN/many --no-figure -o OUT", False),
    "track --spin": ("track IN/poses.csv --spin -o OUT", True),
    "fit": ("fit IN/axes.csv -o OUT", True),
    "cluster": ("cluster IN/axes.csv --components 1 -o OUT", True),
    "planes": ("planes IN/scene.npz -o OUT", True),
    "tune": ("tune IN/imu.npz -o OUT", True),
    "calibrate": ("calibrate IN/turning.npz -o OUT/magnetometer.json", True),
    "simulate": ("simulate tumbling --seed SEED -o OUT/made.npz", True),
    "stream": ("track - --state OUT/state", True),
    "reproduce": ("reproduce kurz2013 --runs 2 --no-figures --seed SEED -o OUT", False),
}


def arguments(name, place, seed, out):
    command = COMMANDS[name][0].replace("IN", str(place / f"in{seed}")).replace("OUT", str(out))
    return command.replace("SEED", str(seed)).split(" ")


def run(name, place, seed, out, log, *, at=0, after=0, number=0):
    """Run a command in a fork; return its exit code and how many renames it made."""
    read, write = os.pipe()
    process = os.fork()
    if not process:
        os.close(read)
        to = os.open(log, os.O_WRONLY | os.O_CREAT | os.O_TRUNC)
        os.dup2(to, 1)
        os.dup2(to, 2)
        os.dup2(os.open(place / f"in{seed}" / "stream.txt", os.O_RDONLY), 0)
        sys.stdin = io.TextIOWrapper(io.FileIO(0, closefd=False))
        sys.argv = ["bingham", *arguments(name, place, seed, out)]
        from bingham.cli.main import main

        signal.signal(signal.SIGINT, signal.default_int_handler)  # whoever started this may ignore them
        signal.signal(signal.SIGTERM, signal.SIG_DFL)
        shim = ctypes.CDLL(os.environ[LIBRARY])
        shim.shim_arm(at, after, number)
        code = 0
        try:
            main()
        except SystemExit as end:
            code = end.code or 0
        finally:
            sys.stdout.flush()
            os.write(write, str(shim.shim_calls()).encode())
            os._exit(code)
    os.close(write)
    with os.fdopen(read) as pipe:
        calls = int(pipe.read() or -1)
    return os.waitstatus_to_exitcode(os.waitpid(process, 0)[1]), calls


def content(folder):
    """Return the bytes of every file below a folder, by name."""
    return {str(p.relative_to(folder)): p.read_bytes() for p in sorted(folder.rglob("*")) if p.is_file()}


class Tried:
    """A command and what it leaves undisturbed: of other input (old) and of this (new)."""

    def __init__(self, name, place):
        self.name, self.place = name, place
        self.log = place / "log"
        self.old = place / f"old-{name.replace(' ', '')}"
        self.old.mkdir()
        self._undisturbed(1, self.old)
        self.before = content(self.old)
        again, new = place / "again", place / "new"
        self.calls = {}  # of renames, where the old is there and where nothing is
        for there, out in ((True, again), (False, new)):
            shutil.copytree(self.old, out) if there else out.mkdir()
            self.calls[there] = self._undisturbed(2, out)
        self.after = content(new)
        # What differs from run to run, as times do, can only be looked at for being whole.
        self.varies = {n for n, b in content(again).items() if b != self.after.get(n, b)}
        for out in (again, new):
            shutil.rmtree(out)

    def _undisturbed(self, seed, out):
        code, calls = run(self.name, self.place, seed, out, self.log)
        if code or calls < 1:
            raise RuntimeError(f"{self.name}: exit code {code}, {calls} renames\n{self.log.read_text()}")
        return calls

    def strike(self, at, late, number, there):
        """Return what is wrong after a signal, an empty text if nothing is, None if it came to no such rename."""
        out = self.place / "out"
        if there:
            shutil.copytree(self.old, out)
        else:
            out.mkdir()
        code, calls = run(self.name, self.place, 2, out, self.log, at=at, after=late, number=number)
        found, said = content(out), self.log.read_text(errors="replace")
        left = [p.name for p in out.rglob(".bingham-*")]
        shutil.rmtree(out)
        before = self.before if there else {}
        after = before | self.after
        if calls < at:
            return None
        if left:
            return f"temporary folders are left: {left}"
        if code not in ((0, 128 + number) if self.name == "stream" else (128 + number,)):
            return f"exit code {code}: {said}"
        if "Traceback" in said:
            return said
        if strange := found.keys() - after.keys():
            return f"strange files: {strange}"
        state = {n: self._state(n, before.get(n), after[n], found.get(n)) for n in after}
        if "neither" in state.values():
            return f"neither old nor new: {[n for n, s in state.items() if s == 'neither']}"
        if "nothing written" in said and "new" in state.values():
            return f"said that nothing was written: {state}"
        if COMMANDS[self.name][1] and {"old", "new"} <= set(state.values()):
            return f"a set that is partly old: {state}"
        return ""

    def _state(self, name, before, after, found):
        if before == after == found:
            return "same"
        if found == before:
            return "old"
        if found == after or (
            (name in self.varies or name == "summary.csv" or self.name == "stream") and whole(name, found)
        ):
            return "new"
        return "neither"


def whole(name, data):
    """Whether a file whose bytes differ from run to run is a complete one."""
    if data is None:
        return False
    if name.endswith((".json", "state")):
        return isinstance(json.loads(data), dict)
    if name == "summary.csv":  # of those that are finished
        return len({len(row) for row in csv.reader(io.StringIO(data.decode()))}) == 1
    if name.endswith(".npz"):
        with np.load(io.BytesIO(data)) as archive:
            return all(archive[n] is not None for n in archive.files)
    return data.rstrip().endswith(b"</html>") if name.endswith(".html") else len(data) > 0


def control(tried):
    """Whether a writer that renames a set one by one, with signals let through, is found out."""
    from bingham import atomic

    right = atomic._put
    atomic._put = lambda moves, _: [os.replace(new, target) for new, target in moves]
    problem = tried.strike(2, 0, int(signal.SIGTERM), True)
    atomic._put = right
    print(f"control: {problem[:80] or 'not found out'}")
    return "'old'" in problem and "'new'" in problem


def main():
    if LIBRARY not in os.environ:
        place = Path(tempfile.mkdtemp(prefix="bingham-signals-"))
        try:
            library = place / "shim.so"
            subprocess.run(["cc", "-shared", "-fPIC", "-o", library, HERE / "rename_shim.c", "-ldl"], check=True)
            more = {"LD_PRELOAD": str(library), LIBRARY: str(library), "MPLBACKEND": "Agg", "TMPDIR": str(place)}
            return subprocess.run([sys.executable, *sys.argv], env=os.environ | more, check=False).returncode
        finally:
            shutil.rmtree(place)
    place = Path(os.environ["TMPDIR"])
    tries, names = int(sys.argv[1]), sys.argv[2:] or list(COMMANDS)
    for seed in (1, 2):
        inputs(place / f"in{seed}", seed)
    if not (place / "in1" / "walk").exists() and "track --bag" in names:
        print("Without track --bag: the package rosbags is not installed")
        names.remove("track --bag")
    os.environ.pop("LD_PRELOAD")  # this process has it; compilers and workers need not
    total = wrong = 0
    all_tried = [Tried(name, place) for name in names]
    for tried in all_tried:
        print(f"{tried.name:16} {tried.calls[True]:3} renames, {len(tried.after)} files", flush=True)
    each = [
        [
            (at, after, number, there)
            for there, calls in t.calls.items()
            for at, after, number in itertools.product(range(1, calls + 1), (0, 1), (signal.SIGINT, signal.SIGTERM))
        ]
        for t in all_tried
    ]
    rng = np.random.default_rng(1)
    each = [[cases[k] for k in rng.permutation(len(cases))] for cases in each]
    # In turn, so that few tries reach every command; again from the start until there are enough.
    for k in itertools.count():
        for tried, cases in zip(all_tried, each, strict=True):
            if total == tries:
                wrong += not control(all_tried[0])
                print(f"{total} signals, {wrong} wrong")
                return 1 if wrong else 0
            at, after, number, there = cases[k % len(cases)]
            problem = tried.strike(at, after, int(number), there)
            if problem is None:
                continue
            total += 1
            if total % 50 == 0:
                print(f"{total} signals", flush=True)
            if problem:
                wrong += 1
                when = f"{signal.Signals(number).name} {'after' if after else 'before'} rename {at}"
                print(
                    f"{tried.name}, {when}, {'old there' if there else 'nothing there'}: {problem[:1500]}", flush=True
                )
    return 0


if __name__ == "__main__":
    sys.exit(main())
