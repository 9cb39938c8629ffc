"""Losses: the negative log-likelihood of one Bingham distribution and of a mixture of them."""

from __future__ import annotations

from typing import Literal

import torch
from torch import Tensor, nn

from bingham.errors import InvalidArgumentError
from bingham.torch.matrices import negative_log_likelihood

__all__ = ["BinghamMixtureNLLLoss", "BinghamNLLLoss"]

Reduction = Literal["mean", "sum", "none"]


class BinghamNLLLoss(nn.Module):
    """Mean of −log f(x) over a batch, f Bingham with matrix A: the loss of a network that predicts A.

    Parameters
    ----------
    reduction : {"mean", "sum", "none"}
        What to do with the losses of the batch.

    Examples
    --------
    >>> import torch
    >>> from bingham.torch import from_numbers
    >>> A = from_numbers(torch.zeros(8, 10)).requires_grad_()
    >>> target = torch.nn.functional.normalize(torch.randn(8, 4), dim=-1)
    >>> loss = BinghamNLLLoss()(A, target)
    >>> loss.backward()
    >>> round(float(loss), 4)
    2.9826
    """

    def __init__(self, reduction: Reduction = "mean") -> None:
        super().__init__()
        self.reduction: Reduction = _checked(reduction)

    def forward(self, A: Tensor, x: Tensor) -> Tensor:
        """Return the loss of predictions A (..., d, d) for targets x (..., d), unit vectors of either sign.

        Nats relative to surface area: log 2π² = 2.98 for the uniform distribution of rotations. float64 if A or x
        is, else float32, whatever a common offset of A's eigenvalues.
        """
        return _reduced(negative_log_likelihood(A, x), self.reduction)


class BinghamMixtureNLLLoss(nn.Module):
    """Mean of −log Σₖ πₖ fₖ(x), π = softmax(logits): for targets with several answers, as of symmetric objects.

    Parameters
    ----------
    reduction : {"mean", "sum", "none"}
        What to do with the losses of the batch.

    Notes
    -----
    Start the components apart (different biases of the last layer): equal ones get equal gradients and stay equal. A
    component can shrink onto one sample; weight decay or an upper limit of the concentrations prevents it.
    """

    def __init__(self, reduction: Reduction = "mean") -> None:
        super().__init__()
        self.reduction: Reduction = _checked(reduction)

    def forward(self, logits: Tensor, A: Tensor, x: Tensor) -> Tensor:
        """Return the loss of logits (..., K) and matrices A (..., K, d, d) for targets x (..., d)."""
        if logits.shape != A.shape[:-2]:
            raise InvalidArgumentError("logits", f"shape {tuple(A.shape[:-2])}, as the batch of A", tuple(logits.shape))
        parts = torch.log_softmax(logits.to(A.dtype), -1) - negative_log_likelihood(A, x[..., None, :])
        return _reduced(-torch.logsumexp(parts, -1), self.reduction)


def _checked(reduction: Reduction) -> Reduction:
    if reduction not in ("mean", "sum", "none"):
        raise InvalidArgumentError("reduction", "'mean', 'sum' or 'none'", reduction)
    return reduction


def _reduced(losses: Tensor, reduction: Reduction) -> Tensor:
    return losses if reduction == "none" else losses.mean() if reduction == "mean" else losses.sum()
