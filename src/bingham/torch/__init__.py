"""The Bingham distribution for PyTorch: exact normaliser with derivatives, a distribution, losses, parameterisations.

Everything is differentiable twice, works under ``torch.func`` (vmap, jacrev, jacfwd, hessian) and ``torch.compile``, in
float64 and float32 (computed in double precision inside; half precision gives float32), on the CPU through the compiled
kernels of the package and on CUDA through Triton or plain tensor operations. Needs ``pip install 'bingham[torch]'``.
"""

from __future__ import annotations

from bingham.errors import MissingExtraError

try:
    import torch as _torch  # noqa: F401  # pyright: ignore[reportUnusedImport]
except ModuleNotFoundError as error:
    raise MissingExtraError("torch", "torch", "bingham.torch") from error

from bingham.torch.distribution import Bingham, UnitVector
from bingham.torch.evidence import compose, isotropic_noise, sequence_log_evidence
from bingham.torch.loss import BinghamMixtureNLLLoss, BinghamNLLLoss
from bingham.torch.matrices import (
    logpdf,
    matrix_from_moment,
    matrix_log_normalizer,
    matrix_moment,
    negative_log_likelihood,
    pdf,
)
from bingham.torch.matrix_fisher import MatrixFisher
from bingham.torch.normalizer import concentrations, log_normalizer, moments
from bingham.torch.parameters import from_cholesky, from_eigen, from_numbers

__all__ = [
    "Bingham",
    "BinghamMixtureNLLLoss",
    "BinghamNLLLoss",
    "MatrixFisher",
    "UnitVector",
    "compose",
    "concentrations",
    "from_cholesky",
    "from_eigen",
    "from_numbers",
    "isotropic_noise",
    "log_normalizer",
    "logpdf",
    "matrix_from_moment",
    "matrix_log_normalizer",
    "matrix_moment",
    "moments",
    "negative_log_likelihood",
    "pdf",
    "sequence_log_evidence",
]
