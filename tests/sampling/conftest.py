import pytest

from bingham.distributions.normalizer import log_normalizer_derivatives


@pytest.fixture
def fourth_moments():
    """E[yᵢ² yⱼ²] (d, d) in the principal axes, exact: the Hessian of log F is Cov(yᵢ², yⱼ²)."""

    def compute(distribution):
        _, w, hessian = log_normalizer_derivatives(distribution.z)
        return hessian + w[:, None] * w

    return compute
