"""The code for devices without compiled kernels: by tensor operations on the CPU, by Triton's interpreter, on CUDA."""

import os
import subprocess
import sys

import numpy as np
import pytest

torch = pytest.importorskip("torch", reason="PyTorch is not installed")

from bingham.torch import matrix_log_normalizer, negative_log_likelihood, numeric, on_device  # noqa: E402
from learning.test_torch_normalizer import turned, unit  # noqa: E402

CASES = {
    4: [[0.0] * 4, [-8.0, -8.0, -8.0, 0.0], [-50.0, 0.0, 0.0, 0.0], [-1e6, -1e3, -5.0, 0.0], [-3.0, -1.0, 0.0, -2.0]],
    3: [[-4.0, -4.0, 0.0], [-1e5, -3.0, 0.0]],
    7: [[-9.0, -3.0, -3.0, 0.0, -1.0, -2.0, -1e4]],
}


@pytest.mark.parametrize("d", CASES)
def test_tensor_operations_agree_with_the_compiled_kernels(d):
    z = torch.tensor(CASES[d], dtype=torch.float64)
    a, x = torch.tensor(turned(z.numpy())), torch.tensor(unit(len(z), d))
    v = torch.tensor(turned(z.numpy(), seed=1))
    v = v / (1.0 + v.abs().amax((-2, -1), keepdim=True))
    for found, expected in (
        (on_device.derivatives(z, 2), numeric.derivatives(z)),
        (on_device.moment(a), numeric.moment(a)),
        (on_device.likelihood(a, x), numeric.likelihood(a, x, 1e-6)),
        ((on_device.curvature(a, v),), (numeric.curvature(a, v),)),
    ):
        for f, e in zip(found, expected, strict=True):
            torch.testing.assert_close(f, e, rtol=1e-9, atol=1e-11)
    w = numeric.derivatives(z)[1]
    torch.testing.assert_close(on_device.concentrations(w), numeric.concentrations(w), rtol=1e-8, atol=1e-8)


INTERPRETED = """
import numpy as np, torch
from learning.test_torch_normalizer import turned, unit
from bingham.torch import numeric, on_cuda
z = np.array({cases} * 20)
a, x = torch.tensor(turned(z)), torch.tensor(unit(len(z), 4))
a[:5] += 1e3 * torch.eye(4)
for given, expected in ((x, numeric.likelihood(a, x, 1e-6)), (None, numeric.moment(a))):
    for f, e in zip(on_cuda.fused(a, given), expected, strict=True):
        torch.testing.assert_close(f, e, rtol=1e-12, atol=1e-9)
print("agrees")
"""


def test_the_fused_kernel_in_tritons_interpreter():
    pytest.importorskip("triton", reason="Triton is not installed")
    environment = {**os.environ, "TRITON_INTERPRET": "1"}
    environment["PYTHONPATH"] = os.pathsep.join([*sys.path])
    code = INTERPRETED.format(cases=CASES[4])
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, env=environment)
    assert done.stdout.strip() == "agrees", done.stderr[-2000:]


@pytest.mark.skipif(not torch.cuda.is_available(), reason="no CUDA device")
@pytest.mark.parametrize("dtype", [torch.float64, torch.float32])
@pytest.mark.parametrize("d", CASES)
def test_cuda_agrees_with_the_cpu(d, dtype):
    z = np.array(CASES[d])
    a = torch.tensor(turned(z), dtype=dtype, requires_grad=True)
    x = torch.tensor(unit(len(z), d), dtype=dtype)
    b = a.detach().cuda().requires_grad_()
    tolerance = 1e-9 if dtype == torch.float64 else 1e-5
    for here, there in (
        (negative_log_likelihood(a, x), negative_log_likelihood(b, x.cuda())),
        (matrix_log_normalizer(a), matrix_log_normalizer(b)),
    ):
        assert there.is_cuda
        torch.testing.assert_close(there.cpu(), here, rtol=tolerance, atol=tolerance)
        (g,), (h,) = torch.autograd.grad(here.sum(), a), torch.autograd.grad(there.sum(), b)
        torch.testing.assert_close(h.cpu(), g, rtol=tolerance, atol=tolerance)


@pytest.mark.skipif(not torch.cuda.is_available(), reason="no CUDA device")
def test_cuda_derivatives():
    z = torch.tensor(CASES[4][:3], dtype=torch.float64, device="cuda")
    a = torch.diag_embed(z).requires_grad_()
    assert torch.autograd.gradcheck(matrix_log_normalizer, (a,))
    assert torch.autograd.gradgradcheck(matrix_log_normalizer, (a,), atol=1e-6)
