"""Fuzz the targets in turn: ``python tests/fuzz/run.py SECONDS [--seed N] [TARGET ...]``.

Each target runs in a process of its own, so that a crash is found too; one input may take 1 GB and 10 s of the
processor (a minute by the clock: others may use the machine). Inputs that break a target are kept in build/fuzz, and it
goes on with what is left of its time. With ``--seed`` every run tries the same inputs: as many as a target's table
says, if the time suffices.
"""

import argparse
import hashlib
import importlib
import os
import pkgutil
import re
import secrets
import sys
import tempfile
import time
from pathlib import Path

HERE = Path(__file__).resolve().parent
sys.path[:0] = [str(HERE), str(HERE.parent)]

LARGEST = 200_000  # bytes of an input; what takes memory is declared, not written
FOUND = Path("build/fuzz")
SLOWEST = 10.0  # s
TRIES = 10  # after so many broken inputs a target is left alone


def load():
    """Import what is fuzzed, the readers so that branches are seen; return the targets."""
    import atheris

    # All of the package is instrumented that is not there yet, and Numba cannot compile what is.
    for name in ("kernels", "distributions", "filters", "sampling", "simulate", "surfaces"):
        package = importlib.import_module(f"bingham.{name}")
        for module in pkgutil.iter_modules(package.__path__):
            importlib.import_module(f"{package.__name__}.{module.name}")
    with atheris.instrument_imports(include=["bingham"]):
        from targets import TARGETS

        import bingham.cli.main
        import bingham.cli.planes
        import bingham.cli.stream  # noqa: F401
    return TARGETS


def fuzz(name, target, corpus, seconds, seed, runs):
    """Fuzz one target in this process, which ends with it."""
    import atheris

    def run(content):
        begun = time.process_time()
        try:
            target.run(content)
            if time.process_time() - begun > SLOWEST:
                raise TimeoutError(f"{time.process_time() - begun:.1f} s")
        except BaseException:
            (FOUND / f"{name}-{hashlib.sha1(content).hexdigest()[:12]}").write_bytes(content)
            raise

    for path in sorted(corpus.iterdir()):  # what compiles does so now, without a limit of time
        target.run(path.read_bytes())
    limits = ["-timeout=60", "-rss_limit_mb=1024", f"-max_total_time={max(1, round(seconds))}", f"-max_len={LARGEST}"]
    same = [f"-seed={seed}", f"-runs={runs}"]
    kept = [f"-artifact_prefix={FOUND}/{name}-", "-print_final_stats=1", str(corpus)]
    atheris.Setup([sys.argv[0], *limits, *same, *kept], run)
    atheris.Fuzz()


def in_process(log, function, *arguments):
    """Call a function in a process of its own, whatever it prints going to a file; return whether it ended well."""
    sys.stdout.flush()
    process = os.fork()
    if not process:
        out = os.open(log, os.O_WRONLY | os.O_CREAT | os.O_TRUNC)
        os.dup2(out, 1)
        os.dup2(out, 2)
        try:
            function(*arguments)
        except BaseException:  # a seed breaks it
            import traceback

            traceback.print_exc()
            os._exit(1)
        os._exit(0)
    return os.waitstatus_to_exitcode(os.waitpid(process, 0)[1]) == 0


def inputs_of(log):
    """Return how many inputs a log tells of."""
    text = log.read_text(errors="replace")
    counted = re.findall(r"number_of_executed_units: (\d+)", text) or re.findall(r"^#(\d+)\t", text, re.MULTILINE)
    return int(counted[-1]) if counted else 0


def explore(name, target, corpus, seconds, seed, runs):
    """Fuzz a target until its time is up; return the number of inputs and of those that broke it."""
    log = FOUND / f"{name}.log"
    count = broken = 0
    end = time.monotonic() + seconds
    while (left := end - time.monotonic()) > 0 or not count:
        sound = in_process(log, fuzz, name, target, corpus, max(left, 1.0), seed + broken, runs)
        count += inputs_of(log)
        if sound:
            break
        broken += 1
        print(log.read_text(errors="replace")[-3000:], flush=True)
        if broken == TRIES or runs > 0:
            break
    return count, broken


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("seconds", type=float)
    parser.add_argument("--seed", type=int, help="try the same inputs every time")
    parser.add_argument("targets", nargs="*")
    given = parser.parse_intermixed_args()
    try:
        import atheris  # noqa: F401
    except ImportError:
        print("Skipped: fuzzing needs the package atheris, which is not installed: pip install atheris")
        return 0
    if given.seed is not None and os.environ.get("PYTHONHASHSEED") != "0":
        os.environ["PYTHONHASHSEED"] = "0"
        os.execv(sys.executable, [sys.executable, *sys.argv])
    targets = load()
    import seeds

    FOUND.mkdir(parents=True, exist_ok=True)
    seed = given.seed or secrets.randbelow(2**31 - TRIES) + 1
    print(f"seed {seed}, {given.seconds:g} s", flush=True)
    names = given.targets or list(targets)
    broken, total = [], 0
    with tempfile.TemporaryDirectory() as place:
        made = seeds.make(Path(place) / "seeds")
        for name in names:
            target = targets[name]
            corpus = Path(place) / name
            corpus.mkdir()
            for kind in target.kinds:
                for path in made.get(kind, []):
                    (corpus / path.name).write_bytes(path.read_bytes())
            runs = target.runs if given.seed is not None else -1
            count, failures = explore(name, target, corpus, given.seconds / len(names), seed, runs)
            total += count
            print(f"{name:10} {count:9} inputs, {f'{failures} broke it' if failures else 'sound'}", flush=True)
            if failures:
                broken.append(name)
    print(f"{total} inputs; " + (f"broken: {', '.join(broken)}, inputs in {FOUND}" if broken else "none broke it"))
    return 1 if broken else 0


if __name__ == "__main__":
    sys.exit(main())
