"""Fuzz every target in turn: ``python tests/fuzz/run.py SECONDS [TARGET ...]``; inputs that break it are kept.

Each target runs in a process of its own, so that a crash is found too; one input may take 10 s and 1 GB.
"""

import re
import subprocess
import sys
import tempfile
from pathlib import Path

HERE = Path(__file__).resolve().parent
sys.path[:0] = [str(HERE), str(HERE.parent)]

LARGEST = 200_000  # bytes of an input; what takes memory is declared, not written
CRASHES = Path("build/fuzz")


def fuzz_one(name, corpus, seconds):
    """Fuzz one target in this process."""
    import atheris

    # Loaded before, as they are: Numba cannot compile what atheris has instrumented.
    import bingham.filters
    import bingham.kernels.decimal
    import bingham.kernels.imu_follow  # noqa: F401
    from bingham.filters import ImuStream  # noqa: F401

    with atheris.instrument_imports(include=["bingham.io", "bingham.cli.stream"]):
        from targets import TARGETS
    for seed in sorted(corpus.iterdir()):  # what compiles does so now, without a limit of time
        TARGETS[name][0](seed.read_bytes())
    limits = ["-timeout=10", "-rss_limit_mb=1024", f"-max_total_time={seconds}", f"-max_len={LARGEST}"]
    arguments = [sys.argv[0], *limits, f"-artifact_prefix={CRASHES}/{name}-", "-print_final_stats=1", str(corpus)]
    atheris.Setup(arguments, lambda content: TARGETS[name][0](content))
    atheris.Fuzz()


def main():
    seconds, names = float(sys.argv[1]), sys.argv[2:]
    try:
        import atheris  # noqa: F401
    except ImportError:
        print("Skipped: fuzzing needs the package atheris, which is not installed: pip install atheris")
        return 0
    import seeds
    from targets import TARGETS

    CRASHES.mkdir(parents=True, exist_ok=True)
    names = names or list(TARGETS)
    broken, total = [], 0
    with tempfile.TemporaryDirectory() as place:
        made = seeds.make(Path(place) / "seeds")
        for name in names:
            corpus = Path(place) / name
            corpus.mkdir()
            for kind in TARGETS[name][1]:
                for path in made.get(kind, []):
                    (corpus / path.name).write_bytes(path.read_bytes())
            share = max(1, round(seconds / len(names)))
            done = subprocess.run(
                [sys.executable, __file__, "--one", name, str(corpus), str(share)],
                capture_output=True, text=True, errors="replace", check=False,
            )  # fmt: skip
            counted = re.search(r"number_of_executed_units: (\d+)", done.stderr)
            count = int(counted[1]) if counted else 0
            total += count
            print(f"{name:10} {count:9} inputs, {'broken' if done.returncode else 'sound'}", flush=True)
            if done.returncode:
                broken.append(name)
                print(done.stderr[-3000:])
    print(f"{total} inputs; " + (f"broken: {', '.join(broken)}, inputs in {CRASHES}" if broken else "none broke it"))
    return 1 if broken else 0


if __name__ == "__main__":
    if sys.argv[1] == "--one":
        fuzz_one(sys.argv[2], Path(sys.argv[3]), int(sys.argv[4]))
    else:
        sys.exit(main())
