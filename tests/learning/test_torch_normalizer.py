"""log F, moments and their inverse in PyTorch: the 40-digit table, derivatives, transformations, compilation."""

import numpy as np
import pytest

torch = pytest.importorskip("torch", reason="PyTorch is not installed")

from torch.autograd import gradcheck, gradgradcheck  # noqa: E402

import bingham  # noqa: E402
from bingham.errors import InvalidArgumentError  # noqa: E402
from bingham.torch import (  # noqa: E402
    concentrations,
    log_normalizer,
    matrix_from_moment,
    matrix_log_normalizer,
    matrix_moment,
    moments,
    negative_log_likelihood,
)
from reference.table import error_of_exp, references, relative_error  # noqa: E402

SPECTRA = {
    "uniform": [0.0, 0.0, 0.0, 0.0],
    "girdle": [-50.0, 0.0, 0.0, 0.0],
    "equal": [-8.0, -8.0, -8.0, 0.0],
    "two groups": [-30.0, -30.0, 0.0, 0.0],
    "spread": [-1e6, -1e3, -5.0, 0.0],
    "concentrated": [-1e6, -1e6, -1e6, 0.0],
    "any order": [-3.0, -1.0, 0.0, -2.0],
    "axes": [-4.0, -4.0, 0.0],
    "dimension 6": [-9.0, -3.0, -3.0, 0.0, -1.0, -2.0],
}


def turned(z, seed=0):
    """Matrices with eigenvalues z (n, d) in random frames."""
    d = z.shape[-1]
    q = np.linalg.qr(np.random.default_rng(seed).normal(size=(*z.shape, d)))[0]
    return (q * np.asarray(z)[..., None, :]) @ np.swapaxes(q, -1, -2)


def unit(*shape, seed=0):
    x = np.random.default_rng(seed).normal(size=shape)
    return x / np.linalg.norm(x, axis=-1, keepdims=True)


@pytest.mark.parametrize("d", [2, 3, 4, 5, 6])
def test_double_precision_against_forty_digits(d):
    rows = references(d)
    z = torch.tensor(np.array([r.z for r in rows]), requires_grad=True)
    value = log_normalizer(z)
    (gradient,) = torch.autograd.grad(value.sum(), z)
    assert max(error_of_exp(v, r.log_normalizer) for v, r in zip(value.tolist(), rows, strict=True)) < 1e-12
    for row, r in zip(gradient.tolist(), rows, strict=True):
        assert max(relative_error(row[i], w) for i, w in r.moments.items()) < 1e-12


@pytest.mark.parametrize("shift", [0.0, 64.0, -4096.0, 2.0**20])
def test_single_precision_against_forty_digits_whatever_is_added(shift):
    # Concentrations that float32 holds with the shift added, so that the error is that of the computation.
    rows = [
        r for r in references(4) if np.all(np.float32(r.z) == r.z) and np.all(np.float32(r.z + shift) - shift == r.z)
    ]
    assert len(rows) > 5
    z = torch.tensor(np.array([r.z for r in rows]) + shift, dtype=torch.float32)
    exact = np.array([float(r.log_normalizer) for r in rows])
    value = log_normalizer(z)
    assert value.dtype == torch.float32
    assert np.all(np.abs(value.double().numpy() - shift - exact) <= 1e-6 * np.maximum(1.0, np.abs(exact + shift)))
    x = torch.tensor(unit(len(rows), 4), dtype=torch.float32)
    exact -= (
        np.einsum("ni,ni,ni->n", np.array([r.z for r in rows]), x.double(), x.double())
        / (x.double() ** 2).sum(-1).numpy()
    )
    loss = negative_log_likelihood(torch.diag_embed(z), x)
    assert np.all(np.abs(loss.double().numpy() - exact) <= 1e-6 * np.maximum(1.0, np.abs(exact)))


def test_a_formula_in_single_precision_would_fail_that():
    # The control: the same loss from float32 parts loses what the shift takes.
    z = torch.tensor([-5.0, -3.0, -1.0, 0.0]) + 2.0**20
    x = torch.tensor(unit(4), dtype=torch.float32)
    naive = log_normalizer(z) - (z * x * x).sum()
    assert abs(float(naive - negative_log_likelihood(torch.diag(z), x))) > 1e-3


@pytest.mark.parametrize("dtype", [torch.float16, torch.bfloat16])
def test_half_precision_is_computed_in_single(dtype):
    z = torch.tensor([-20.0, -3.0, -0.5, 0.0], dtype=dtype)
    value = log_normalizer(z)
    assert value.dtype == torch.float32
    assert abs(float(value) - bingham.log_normalizer(z.double().numpy())) < 1e-6 * abs(float(value))
    a = torch.diag(z).requires_grad_()
    negative_log_likelihood(a, torch.tensor([0.0, 0.0, 0.0, 1.0], dtype=dtype)).backward()
    assert a.grad.dtype == dtype


@pytest.mark.parametrize("z", SPECTRA.values(), ids=SPECTRA)
def test_first_and_second_derivatives_by_concentrations(z):
    z = torch.tensor([z, z], dtype=torch.float64, requires_grad=True)
    assert gradcheck(log_normalizer, (z,), check_forward_ad=True, atol=1e-6)
    assert gradgradcheck(log_normalizer, (z,), check_fwd_over_rev=True, atol=1e-6)


@pytest.mark.parametrize("z", SPECTRA.values(), ids=SPECTRA)
@pytest.mark.parametrize("frame", ["aligned", "turned"])
def test_first_and_second_derivatives_by_matrices(z, frame):
    z = np.array([z])
    large = np.abs(z).max() > 1e5
    a = torch.tensor(turned(z) if frame == "turned" else np.diag(z[0])[None], requires_grad=True)
    x = torch.tensor(unit(1, z.shape[-1]))
    step, tolerance = (1e-2, 1e-4) if large else (1e-6, 1e-6)
    for function in (matrix_log_normalizer, lambda a: negative_log_likelihood(a, x)):
        assert gradcheck(function, (a,), check_forward_ad=True, eps=step, atol=tolerance)
        assert gradgradcheck(function, (a,), check_fwd_over_rev=True, eps=step, atol=tolerance)
    if not large:
        x.requires_grad_()
        assert gradcheck(negative_log_likelihood, (a, x), check_forward_ad=True, atol=1e-6)
        assert gradgradcheck(negative_log_likelihood, (a, x), check_fwd_over_rev=True, atol=1e-6)


def test_differentiating_eigenvectors_would_give_nan_where_this_does_not():
    a = torch.diag(torch.tensor([-5.0, -5.0, -5.0, 0.0], dtype=torch.float64)).requires_grad_()

    def through_eigenvectors(a):
        values, vectors = torch.linalg.eigh(a)
        return ((vectors * moments(values)) @ vectors.T).square().sum()

    (bad,) = torch.autograd.grad(through_eigenvectors(a), a)
    (good,) = torch.autograd.grad(matrix_moment(a).square().sum(), a)
    assert not torch.isfinite(bad).all()
    assert torch.isfinite(good).all()


def test_matrix_and_concentrations_agree_with_numpy():
    z = -(10.0 ** np.random.default_rng(1).uniform(-2, 5, (200, 4)))
    a = turned(z)
    law = bingham.Bingham.from_matrix(a)
    np.testing.assert_allclose(matrix_moment(torch.tensor(a)), law.moment(), atol=1e-13)
    x = unit(200, 4)
    np.testing.assert_allclose(
        -negative_log_likelihood(torch.tensor(a), torch.tensor(x)), law.logpdf(x), rtol=1e-12, atol=1e-9
    )


def test_concentrations_invert_the_moments_and_differentiate_implicitly():
    z = torch.tensor([[-30.0, -3.0, 0.0, -1.0], [-2.0, -7e4, -1.0, 0.0]], dtype=torch.float64)
    w = moments(z).requires_grad_()
    torch.testing.assert_close(concentrations(w), z, rtol=1e-9, atol=1e-9)
    function = lambda w: concentrations(w / w.sum(-1, keepdim=True))  # noqa: E731
    assert gradcheck(function, (w[:1],), check_forward_ad=True, atol=1e-5)
    assert gradgradcheck(function, (w[:1],), atol=1e-4)
    # A round trip is the identity, and so is its derivative, up to the common offset.
    jacobian = torch.func.jacrev(lambda z: concentrations(moments(z)))(z[1])
    torch.testing.assert_close(
        jacobian, torch.eye(4, dtype=z.dtype) - torch.eye(4, dtype=z.dtype)[3], rtol=1e-6, atol=1e-6
    )


def test_matrix_from_moment_inverts_and_differentiates():
    s = matrix_moment(torch.tensor(turned(np.array([[-9.0, -3.0, -1.0, 0.0]])))).requires_grad_()
    torch.testing.assert_close(matrix_moment(matrix_from_moment(s)), s, rtol=1e-12, atol=1e-14)
    assert gradcheck(lambda s: matrix_from_moment(0.5 * (s + s.mT)), (s,), atol=1e-5)


def test_function_transformations():
    z = torch.tensor([[-30.0, -3.0, 0.0, -1.0], [-5.0, -5.0, -5.0, 0.0]], dtype=torch.float64)
    hessian = torch.func.vmap(torch.func.hessian(log_normalizer))(z)
    from bingham.distributions.normalizer import log_normalizer_derivatives

    np.testing.assert_allclose(hessian, log_normalizer_derivatives(z.numpy())[2], atol=1e-14)
    a = torch.tensor(turned(z.numpy()))
    reverse = torch.func.vmap(torch.func.jacrev(torch.func.jacrev(matrix_log_normalizer)))(a)
    forward = torch.func.vmap(torch.func.hessian(matrix_log_normalizer))(a)
    torch.testing.assert_close(reverse, forward, rtol=1e-10, atol=1e-13)
    third = torch.func.jacrev(torch.func.hessian(log_normalizer))(z[0])
    e = 1e-4
    for i in range(4):
        shifted = [log_normalizer_derivatives(z[0].numpy() + s * e * np.eye(4)[i])[2] for s in (1, -1)]
        np.testing.assert_allclose(third[..., i], (shifted[0] - shifted[1]) / (2 * e), atol=1e-8)
    x = torch.tensor(unit(5, 4))
    each = torch.func.vmap(negative_log_likelihood, in_dims=(None, 0))(a[0], x)
    torch.testing.assert_close(each, negative_log_likelihood(a[0].expand(5, 4, 4), x))
    per_sample = torch.func.vmap(torch.func.grad(negative_log_likelihood), in_dims=(0, 0))(a, x[:2])
    assert per_sample.shape == (2, 4, 4)


def test_third_derivatives_by_a_matrix_raise_instead_of_being_wrong():
    a = torch.eye(4, dtype=torch.float64, requires_grad=True)
    (g,) = torch.autograd.grad(matrix_moment(a)[0, 0], a, create_graph=True)
    with pytest.raises(NotImplementedError, match="third"):
        torch.autograd.grad(g.sum(), a)


def test_compiled_whole():
    torch.compiler.reset()
    try:
        compiled = torch.compile(lambda a, x: negative_log_likelihood(a, x).mean(), fullgraph=True)
        a = torch.tensor(turned(np.array([[-9.0, -3.0, -1.0, 0.0]] * 3)), requires_grad=True)
        x = torch.tensor(unit(3, 4))
        value = compiled(a, x)
    except Exception as error:  # a compiler that needs a C++ toolchain
        if "compiler" in str(error).lower():
            pytest.skip(f"torch.compile does not work here: {type(error).__name__}")
        raise
    (gradient,) = torch.autograd.grad(value, a)
    eager = negative_log_likelihood(a, x).mean()
    torch.testing.assert_close(value, eager)
    torch.testing.assert_close(gradient, torch.autograd.grad(eager, a)[0])


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda: log_normalizer(torch.zeros(4, dtype=torch.long)), "floating-point"),
        (lambda: log_normalizer(torch.tensor([np.nan, 0.0])), "finite"),
        (lambda: log_normalizer([0.0, 0.0]), "floating-point tensor"),
        (lambda: matrix_log_normalizer(torch.zeros(4)), r"\(..., d, d\)"),
        (lambda: negative_log_likelihood(torch.zeros(10), torch.zeros(4)), "from_numbers"),
        (lambda: negative_log_likelihood(torch.full((2, 4, 4), np.inf), torch.zeros(2, 4)), "A: expected finite"),
        (lambda: negative_log_likelihood(torch.zeros(2, 4, 4), 2 * torch.tensor(unit(2, 4)).float()), "unit vectors"),
        (lambda: negative_log_likelihood(torch.zeros(2, 4, 4), torch.tensor(unit(3, 4)).float()), "broadcasts"),
        (lambda: negative_log_likelihood(torch.zeros(2, 4, 4), torch.tensor(unit(2, 3)).float()), r"\(..., 4\)"),
        (lambda: concentrations(torch.tensor([0.5, 0.6])), "sum 1"),
        (lambda: concentrations(torch.tensor([0.0, 1.0])), "positive"),
        (lambda: matrix_from_moment(torch.diag(torch.tensor([1.0, 0.0, 0.0]))), "positive definite"),
    ],
)  # fmt: skip
def test_bad_arguments_are_named(call, words):
    with pytest.raises(InvalidArgumentError, match=words):
        call()


def test_empty_batches_pass():
    a = torch.zeros(0, 4, 4, requires_grad=True)
    negative_log_likelihood(a, torch.zeros(0, 4)).sum().backward()
    assert log_normalizer(torch.zeros(0, 3)).shape == (0,)
    assert a.grad.shape == (0, 4, 4)
