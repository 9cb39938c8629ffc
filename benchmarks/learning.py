"""Loss of a batch, forward and backward, in PyTorch and JAX, beside BinghamNLL where its sources are at hand.

BinghamNLL (https://github.com/woven-planet/BinghamNLL) calls its package ``bingham`` too: it runs in a process of its
own, in the same minute, from the folder that ``BINGHAM_NLL`` names. What was compared is printed with the ratio.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Callable
from time import perf_counter, process_time
from typing import Any

import numpy as np

from timing import Row, best_of

TOPIC = "negative log-likelihood, forward and backward, 1024 matrices (d = 4)"
BATCH = 1024


def batch() -> tuple[np.ndarray, np.ndarray]:
    """Matrices (1024, 4, 4) with concentrations of 0.1 to 1e4, unit quaternions."""
    rng = np.random.default_rng(0)
    z = -(10.0 ** rng.uniform(-1.0, 4.0, (BATCH, 4)))
    q = np.linalg.qr(rng.normal(size=(BATCH, 4, 4)))[0]
    x = rng.normal(size=(BATCH, 4))
    return (q * z[:, None, :]) @ np.swapaxes(q, 1, 2), x / np.linalg.norm(x, axis=1, keepdims=True)


def torch_loss(dtype: str) -> Callable[[], Any]:
    """Return a call that computes the loss and its gradient."""
    import torch
    from bingham.torch import BinghamNLLLoss

    torch.set_num_threads(1)
    a, x = (torch.tensor(v, dtype=getattr(torch, dtype)) for v in batch())
    a.requires_grad_()
    loss = BinghamNLLLoss()

    def once() -> None:
        a.grad = None
        loss(a, x).backward()

    return once


def jax_loss(of: str) -> tuple[Callable[[], Any], float]:
    """Return a call of the compiled loss with its gradient and the seconds that compiling took."""
    import jax
    from bingham.jax import log_normalizer, negative_log_likelihood

    jax.config.update("jax_enable_x64", True)
    a, x = (jax.numpy.array(v) for v in batch())
    if of == "z":
        arguments: tuple[Any, ...] = (a[:, 0],)
        function = jax.jit(jax.value_and_grad(lambda z: log_normalizer(z).mean()))
    else:
        arguments = (a, x)
        function = jax.jit(jax.value_and_grad(lambda a, x: negative_log_likelihood(a, x).mean()))
    start = process_time()
    jax.block_until_ready(function(*arguments))
    seconds = process_time() - start
    return lambda: jax.block_until_ready(function(*arguments)), seconds


PEER = """
import json, sys, time
import numpy as np, torch
from bingham.losses.nll import BinghamLoss
torch.set_num_threads(1)
data = np.load(sys.argv[1])
row, column = np.triu_indices(4)
v = torch.tensor(data["a"][:, row, column], requires_grad=True)
x = torch.tensor(data["x"])
times = []
for _ in range(4):
    v.grad = None
    start = time.process_time()
    loss = BinghamLoss()(v, x)
    loss.backward()
    times.append(time.process_time() - start)
print(json.dumps([min(times), float(loss)]))
"""


def peer() -> tuple[float, float] | None:
    """Seconds and value of BinghamNLL's loss, or None where it is not at hand."""
    folder = os.environ.get("BINGHAM_NLL")
    if not folder:
        return None
    import tempfile

    a, x = batch()
    with tempfile.TemporaryDirectory() as place:
        np.savez(f"{place}/batch.npz", a=a, x=x)
        environment = {**os.environ, "PYTHONPATH": folder, "OMP_NUM_THREADS": "1"}
        command = [sys.executable, "-c", PEER, f"{place}/batch.npz"]
        done = subprocess.run(command, capture_output=True, text=True, env=environment)
    if done.returncode:
        print(f"BinghamNLL did not run: {done.stderr.strip().splitlines()[-1]}", file=sys.stderr)
        return None
    seconds, loss = json.loads(done.stdout)
    return seconds, loss


def measure() -> list[Row]:
    """Return the rows of this topic."""
    import numba

    numba.set_num_threads(1)
    rows = [
        Row(TOPIC, f"bingham.torch, {t}", best_of(torch_loss(t)), "batch", t == "float64", 0.6e-3)
        for t in ("float64", "float32")
    ]
    found = peer()
    if found is not None:
        from bingham.torch import BinghamNLLLoss
        from torch import tensor

        a, x = batch()
        ours = float(BinghamNLLLoss()(tensor(a), tensor(x)))
        ratio = found[0] / rows[0].seconds
        note = f"{ratio:.0f} times; their loss differs by {abs(found[1] / ours - 1):.1e}"
        rows.append(Row(TOPIC, "BinghamNLL", found[0], "batch", note=note))
    for of, what in (("z", "log F(z)"), ("a", "loss from matrices")):
        call, compiling = jax_loss(of)
        # XLA works on threads of its own: time on the wall.
        seconds = best_of(call, clock=perf_counter)
        rows.append(
            Row(TOPIC, f"bingham.jax, {what}, x64", seconds, "batch", False, 1e-3, f"compiled in {compiling:.1f} s")
        )
    return rows


if __name__ == "__main__":
    from run import table

    print(table(measure()))
