"""The functions of the main package on arrays of other libraries."""

import numpy as np
import pytest

import bingham
from bingham.errors import InvalidArgumentError

Z = np.array([[-900.0, -500.0, -3.0, 0.0], [0.0, 0.0, 0.0, 0.0], [-1.0, -2.0, -3.0, -4.0]])


def tensors(library):
    if library == "torch":
        torch = pytest.importorskip("torch", reason="PyTorch is not installed")
        return torch.tensor
    jax = pytest.importorskip("jax", reason="JAX is not installed")
    return lambda x: jax.numpy.array(np.float32(x))


@pytest.mark.parametrize("library", ["torch", "jax"])
def test_tensors_give_tensors_of_their_library(library):
    make = tensors(library)
    z = make(Z)
    tolerance = {"rtol": 1e-12 if library == "torch" else 1e-6, "atol": 1e-12 if library == "torch" else 1e-6}
    for function in (bingham.log_normalizer, bingham.moments):
        found = function(z)
        assert type(found) is type(z)
        np.testing.assert_allclose(np.asarray(found), function(Z), **tolerance)
    w = bingham.moments(Z)
    np.testing.assert_allclose(
        np.asarray(bingham.concentrations(make(w)))[1:], bingham.concentrations(w)[1:], atol=1e-4
    )
    law = bingham.Bingham(Z[0], np.linalg.qr(np.random.default_rng(0).normal(size=(4, 4)))[0])
    x = np.float32(law.rvs(5, rng=0)).astype(float)
    x /= np.linalg.norm(x, axis=-1, keepdims=True)
    for method in (law.logpdf, law.pdf):
        assert type(method(make(x))) is type(z)
        np.testing.assert_allclose(np.asarray(method(make(x))), method(x), rtol=1e-3)


@pytest.mark.parametrize("library", ["torch", "jax"])
def test_what_numpy_cannot_take_names_the_module_to_use(library):
    if library == "torch":
        torch = pytest.importorskip("torch", reason="PyTorch is not installed")
        with pytest.raises(InvalidArgumentError, match=r"use bingham\.torch"):
            bingham.Bingham.from_matrix(torch.zeros(4, 4, requires_grad=True))
        return
    jax = pytest.importorskip("jax", reason="JAX is not installed")
    with pytest.raises(InvalidArgumentError, match=r"use bingham\.jax"):
        jax.jit(lambda a: bingham.Bingham.from_matrix(a).z)(jax.numpy.zeros((4, 4)))


class Foreign:
    """An array of a library that nobody knows here."""

    def __array_namespace__(self):
        raise NotImplementedError


def test_other_libraries_raise_and_say_what_to_do():
    for function in (bingham.log_normalizer, bingham.moments, bingham.concentrations):
        with pytest.raises(InvalidArgumentError, match=r"numpy\.asarray"):
            function(Foreign())


def test_cupy_arrays():
    cupy = pytest.importorskip("cupy", reason="CuPy is not installed")
    z = cupy.asarray(Z)
    np.testing.assert_allclose(cupy.asnumpy(bingham.log_normalizer(z)), bingham.log_normalizer(Z), rtol=1e-12)
    np.testing.assert_allclose(cupy.asnumpy(bingham.moments(z)), bingham.moments(Z), rtol=1e-9, atol=1e-13)
    with pytest.raises(InvalidArgumentError, match="torch"):
        bingham.concentrations(z)


def test_the_namespace_code_agrees_with_the_kernels():
    # What serves CuPy, on NumPy's own namespace.
    from bingham.distributions.normalizer import log_normalizer_derivatives
    from bingham.kernels.array_rule import derivatives_array

    for d in (2, 3, 4, 5, 9):
        z = -(10.0 ** np.random.default_rng(d).uniform(-3, 6, (50, d)))
        for found, expected in zip(
            derivatives_array(z, np, 2, constant=np.asarray), log_normalizer_derivatives(z), strict=True
        ):
            np.testing.assert_allclose(found, expected, rtol=1e-9, atol=1e-12)
