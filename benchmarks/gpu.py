"""Throughput and accuracy on a CUDA device: python benchmarks/gpu.py. Says so and stops where there is none."""

from __future__ import annotations

import sys
from collections.abc import Callable
from typing import Any

import numpy as np

BATCH = 1_000_000
REPEATS = 10


def seconds(function: Callable[[], Any]) -> float:
    """Best time of a call on the device, s."""
    import torch

    function()
    best = float("inf")
    for _ in range(REPEATS):
        start, end = torch.cuda.Event(enable_timing=True), torch.cuda.Event(enable_timing=True)
        start.record()
        function()
        end.record()
        torch.cuda.synchronize()
        best = min(best, 1e-3 * start.elapsed_time(end))
    return best


def main() -> int:
    """Print one line for each task and precision."""
    try:
        import torch
    except ModuleNotFoundError:
        print("PyTorch is not installed", file=sys.stderr)
        return 1
    if not torch.cuda.is_available():
        print("no CUDA device here", file=sys.stderr)
        return 1
    from bingham.torch import BinghamNLLLoss, log_normalizer, matrix_log_normalizer, negative_log_likelihood, on_device

    rng = np.random.default_rng(0)
    z = -(10.0 ** rng.uniform(-1.0, 4.0, (BATCH, 4)))
    a = rng.normal(size=(BATCH, 4, 4)) * 10.0 ** rng.uniform(-1.0, 3.0, (BATCH, 1, 1))
    a = 0.5 * (a + np.swapaxes(a, 1, 2))
    x = rng.normal(size=(BATCH, 4))
    x /= np.linalg.norm(x, axis=1, keepdims=True)
    print(f"{torch.cuda.get_device_name()}, PyTorch {torch.__version__}, batch {BATCH:,}, ", end="")
    print("Triton's fused kernel" if on_device.has_triton() else "tensor operations (Triton is not installed)")
    loss = BinghamNLLLoss()
    for dtype in (torch.float64, torch.float32):
        zt, at, xt = (torch.tensor(v, dtype=dtype, device="cuda") for v in (z, a, x))
        part = slice(0, 2000)
        exact = negative_log_likelihood(at[part].cpu().double(), xt[part].cpu().double())
        found = negative_log_likelihood(at[part], xt[part]).cpu().double()
        error = float(((found - exact).abs() / exact.abs().clamp(min=1.0)).max())
        exact_z = log_normalizer(zt[part].cpu().double())
        error_z = float((log_normalizer(zt[part]).cpu().double() - exact_z).abs().max() / exact_z.abs().max())
        at.requires_grad_()

        def step(at: Any = at, xt: Any = xt) -> None:
            at.grad = None
            loss(at, xt).backward()

        tasks = {
            "log F(z)": (lambda zt=zt: log_normalizer(zt), error_z),
            "log F(A)": (lambda at=at: matrix_log_normalizer(at.detach()), None),
            "loss and gradient": (step, error),
        }
        for name, (task, difference) in tasks.items():
            took = seconds(task)
            far = "" if difference is None else f", differs from the CPU in float64 by {difference:.1e}"
            print(f"{str(dtype)[6:]:8s} {name:18s} {1e3 * took:8.2f} ms, {BATCH / took / 1e6:8.1f} million/s{far}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
