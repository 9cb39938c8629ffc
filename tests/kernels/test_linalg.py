"""Jacobi's eigensolver keeps the relative accuracy of small eigenvalues."""

import numpy as np
import pytest

from bingham.kernels.linalg import diagonalize, diagonalize_4, orthonormalize_4


def frame(eps, seed, d=4):
    return np.linalg.qr(np.eye(d) + eps * np.random.default_rng(seed).normal(size=(d, d)))[0]


@pytest.mark.parametrize("solver", [diagonalize_4, diagonalize, diagonalize_4.py_func, diagonalize.py_func])
@pytest.mark.parametrize(
    "values", [[0.1, 0.2, 0.3, 0.4], [1e-9, 2e-9, 3e-5, 1.0], [-1e9, -30.0, -3.0, 0.0], [0.25] * 4]
)
def test_reconstructs_the_matrix(solver, values):
    for seed in range(10):
        q = frame(5.0, seed)
        b = (q * values) @ q.T
        w, v = np.empty(4), np.eye(4)
        solver(b.copy(), w, v)
        scale = np.abs(values).max()
        np.testing.assert_allclose((v.T * w) @ v, b, atol=5e-15 * scale)
        np.testing.assert_allclose(v @ v.T, np.eye(4), atol=5e-15)
        assert np.all(np.diff(w) >= 0)


def test_small_eigenvalues_keep_their_digits():
    """A graded matrix D B D with well-conditioned B: Jacobi is right to 1e-14 where LAPACK loses half of the digits."""
    import mpmath

    mpmath.mp.dps = 50
    d = np.array([1e-2, 1e-5, 1.0, 1e-4])
    core = np.random.default_rng(0).normal(size=(4, 6))
    b = d[:, None] * (core @ core.T) * d
    exact = np.array(sorted(float(x) for x in mpmath.eigsy(mpmath.matrix(b.tolist()), eigvals_only=True)))
    w, v = np.empty(4), np.eye(4)
    diagonalize_4(b.copy(), w, v)
    np.testing.assert_allclose(w, exact, rtol=2e-14)
    assert np.abs(np.linalg.eigvalsh(b) / exact - 1).max() > 1e-12  # what is avoided


def test_orthonormalisation_removes_drift():
    m = frame(3.0, 1) + 1e-9 * np.random.default_rng(2).normal(size=(4, 4))
    orthonormalize_4(m)
    np.testing.assert_allclose(m @ m.T, np.eye(4), atol=4e-16)
