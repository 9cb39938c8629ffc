"""The same bits: compiled afresh, loaded from disk, and resumed at any row."""

import os
import subprocess
import sys

import numpy as np
import pytest

from bingham import Bingham, BinghamFilter

SCRIPT = """
import hashlib
import numpy as np
from bingham import Bingham, BinghamFilter
rng = np.random.default_rng(5)
for d in (2, 4):
    law = lambda low, high: Bingham(-(10.0 ** rng.uniform(low, high, d)), np.linalg.qr(rng.normal(size=(d, d)))[0])
    y = rng.normal(size=(200, d))
    track = BinghamFilter(law(1, 4), law(0, 3)).run(law(-3, 6), y / np.linalg.norm(y, axis=1, keepdims=True))
    print(hashlib.sha256(b"".join(a.tobytes() for a in (track.modes, track.log_evidence, track.nis))).hexdigest())
"""


def test_compiled_afresh_and_loaded_from_disk(tmp_path):
    environment = os.environ | {"NUMBA_CACHE_DIR": str(tmp_path), "PYTHONPATH": os.pathsep.join(sys.path)}
    command = [sys.executable, "-c", SCRIPT]
    runs = [subprocess.run(command, capture_output=True, text=True, env=environment, check=True) for _ in "123"]
    assert len(runs[0].stdout.split()) == 2
    assert {run.stdout for run in runs} == {runs[0].stdout}


@pytest.mark.parametrize("d", [2, 4])
def test_resumed_at_any_row(d):
    rng = np.random.default_rng(d)
    for trial in range(40):
        parts = [Bingham(-(10.0 ** rng.uniform(-6, 8, d)), np.linalg.qr(rng.normal(size=(d, d)))[0]) for _ in range(3)]
        y = rng.normal(size=(12, d))
        y /= np.linalg.norm(y, axis=1, keepdims=True)
        y[rng.random(12) < 0.2] = np.nan
        f = BinghamFilter(parts[0], parts[1])
        whole = f.run(parts[2], y)
        cut = 1 + trial % 11
        first = f.run(parts[2], y[:cut])
        again = Bingham(first.final.z, first.final.M)
        for state in (first.final, again):
            rest = f.run(state, y[cut:])
            np.testing.assert_array_equal(rest.modes, whole.modes[cut:])
            np.testing.assert_array_equal(rest.log_evidence, whole.log_evidence[cut:])
            np.testing.assert_array_equal(rest.nis, whole.nis[cut:])
