"""log F, moments, their inverse, likelihoods and the distribution in JAX, in both precisions."""

import subprocess
import sys

import numpy as np
import pytest

jax = pytest.importorskip("jax", reason="JAX is not installed")

import jax.numpy as jnp  # noqa: E402

import bingham  # noqa: E402
from bingham.distributions.normalizer import log_normalizer_derivatives  # noqa: E402
from bingham.errors import InvalidArgumentError  # noqa: E402
from bingham.jax import (  # noqa: E402
    concentrations,
    log_normalizer,
    matrix_log_normalizer,
    matrix_moment,
    moments,
    negative_log_likelihood,
    on_cpu,
)
from reference.table import error_of_exp, references, relative_error  # noqa: E402

SPECTRA = np.array(
    [[0.0] * 4, [-50.0, 0, 0, 0], [-8.0, -8, -8, 0], [-30.0, -30, 0, 0], [-1e6, -1e3, -5, 0], [-3.0, -1, 0, -2]]
)


def turned(z, seed=0):
    q = np.linalg.qr(np.random.default_rng(seed).normal(size=(*z.shape, z.shape[-1])))[0]
    return (q * z[..., None, :]) @ np.swapaxes(q, -1, -2)


def unit(*shape):
    x = np.random.default_rng(0).normal(size=shape)
    return x / np.linalg.norm(x, axis=-1, keepdims=True)


@pytest.fixture(params=[True, False], ids=["x64", "x32"])
def double(request):
    with jax.enable_x64(request.param):
        yield request.param


@pytest.mark.parametrize("d", [3, 4, 6])
def test_double_precision_against_forty_digits(d):
    rows = references(d)
    with jax.enable_x64(True):
        value, gradient = jax.jit(jax.vmap(jax.value_and_grad(log_normalizer)))(jnp.array([r.z for r in rows]))
    assert max(error_of_exp(float(v), r.log_normalizer) for v, r in zip(value, rows, strict=True)) < 1e-12
    for row, r in zip(np.asarray(gradient), rows, strict=True):
        assert max(relative_error(row[i], w) for i, w in r.moments.items()) < 1e-12


@pytest.mark.parametrize("shift", [0.0, -4096.0, 2.0**20])
def test_single_precision_against_forty_digits_whatever_is_added(shift):
    rows = [r for r in references(4) if np.all(np.float32(r.z + shift).astype(float) - shift == r.z)]
    assert len(rows) > 5
    z = jnp.array(np.array([r.z for r in rows]) + shift, dtype=jnp.float32)
    exact = np.array([float(r.log_normalizer) for r in rows])
    value = jax.jit(log_normalizer)(z)
    assert value.dtype == jnp.float32
    assert np.all(np.abs(np.float64(value) - shift - exact) <= 1e-6 * np.maximum(1.0, np.abs(exact + shift)))
    x = jnp.array(unit(len(rows), 4), dtype=jnp.float32)
    u = np.float64(x) / np.linalg.norm(np.float64(x), axis=-1, keepdims=True)
    exact -= (np.array([r.z for r in rows]) * u**2).sum(-1)
    loss = negative_log_likelihood(jnp.eye(4, dtype=jnp.float32) * z[:, None, :], x)
    assert np.all(np.abs(np.float64(loss) - exact) <= 1e-6 * np.maximum(1.0, np.abs(exact)))


def test_transformations_agree_with_numpy(double):
    tolerance = 1e-11 if double else 1e-5
    z = jnp.array(SPECTRA)
    value, gradient, hessian = log_normalizer_derivatives(np.float64(z))
    np.testing.assert_allclose(jax.jit(log_normalizer)(z), value, rtol=tolerance)
    np.testing.assert_allclose(jax.vmap(jax.grad(log_normalizer))(z), gradient, atol=tolerance)
    np.testing.assert_allclose(jax.jit(jax.vmap(jax.hessian(log_normalizer)))(z), hessian, atol=tolerance)
    a = turned(SPECTRA)
    x = unit(len(a), 4)
    law = bingham.Bingham.from_matrix(np.float64(jnp.array(a)))
    expected = -law.logpdf(np.float64(jnp.array(x)) / np.linalg.norm(np.float64(jnp.array(x)), axis=-1, keepdims=True))
    found, (by_a, by_x) = jax.vmap(jax.value_and_grad(negative_log_likelihood, (0, 1)))(jnp.array(a), jnp.array(x))
    np.testing.assert_allclose(found, expected, rtol=1e-9 if double else 1e-4)
    np.testing.assert_allclose(by_a, law.moment() - x[:, :, None] * x[:, None, :], atol=1e-9 if double else 1e-4)
    np.testing.assert_allclose((by_x * x).sum(-1), 0.0, atol=1e-6 * (1.0 if double else 1e6))
    second = jax.jit(jax.vmap(jax.hessian(matrix_log_normalizer)))(jnp.array(a))
    assert np.all(np.isfinite(second))


def likelihood(a, x):
    """Value and gradient as XLA compiles them now."""
    return jax.jit(jax.value_and_grad(lambda a: negative_log_likelihood(a, x).sum()))(a)


def test_operations_of_xla_serve_where_it_refuses_the_compiled_kernel(monkeypatch):
    def refuse(*_, **__):
        raise RuntimeError("version 1")

    rows = references(4)
    z = np.array([r.z for r in rows])
    with jax.enable_x64(True):
        a, x = jnp.concatenate([jnp.eye(4) * z[:, None, :], jnp.array(turned(SPECTRA))]), jnp.array(unit(len(z) + 6, 4))
        compiled = likelihood(a, x)
        monkeypatch.setattr(jax.ffi, "register_ffi_target", refuse)
        on_cpu.registered.cache_clear()
        with pytest.warns(RuntimeWarning, match="slower: version 1"):
            in_xla = likelihood(a, x)
        on_cpu.registered.cache_clear()
        np.testing.assert_allclose(compiled[0], in_xla[0], rtol=1e-12)
        np.testing.assert_allclose(compiled[1], in_xla[1], atol=1e-9)
        for value, gradient in (compiled, in_xla):
            exact = sum(float(r.log_normalizer) for r in rows) - (z * np.asarray(x[: len(z)]) ** 2).sum()
            exact -= bingham.Bingham.from_matrix(np.asarray(a[len(z) :])).logpdf(np.asarray(x[len(z) :])).sum()
            np.testing.assert_allclose(value, exact, rtol=1e-11)
            w = np.diagonal(gradient[: len(z)], axis1=1, axis2=2) + np.asarray(x[: len(z)]) ** 2
            assert max(abs(w[i, j] - float(m)) for i, r in enumerate(rows) for j, m in r.moments.items()) < 1e-12


def test_compiled_kernel_serves_the_cpu_alone():
    lowered = jax.jit(jax.vmap(matrix_moment)).trace(jnp.zeros((2, 4, 4)))
    for platform, calls in (("cpu", 1), ("cuda", 0), ("tpu", 0)):
        assert lowered.lower(lowering_platforms=(platform,)).as_text().count(on_cpu.TARGET) == calls


def test_entries_that_are_not_finite_give_nan_in_their_row_only():
    with jax.enable_x64(True):
        a = jnp.array(turned(np.repeat(SPECTRA, 12, axis=0)))
        bad = a.at[3, 1, 2].set(jnp.nan).at[40, 0, 0].set(jnp.inf).at[71].set(-jnp.inf)
        good = np.delete(np.arange(72), [3, 40, 71])
        for function in (matrix_log_normalizer, matrix_moment):
            found = np.asarray(function(bad)).reshape(72, -1)
            assert np.isnan(found[[3, 40, 71]]).all()
            np.testing.assert_allclose(found[good], np.asarray(function(a)).reshape(72, -1)[good], rtol=1e-12)
        assert matrix_moment(jnp.zeros((0, 4, 4))).shape == (0, 4, 4)


def test_calls_that_wait_in_line_do_not_wait_for_each_other():
    with jax.enable_x64(True):
        a = jnp.array(np.tile(turned(SPECTRA), (1000, 1, 1)))
        step = jax.jit(lambda a, _: (0.5 * a + matrix_moment(a), matrix_log_normalizer(a).sum()))
        run = jax.jit(lambda a: jax.lax.scan(step, a, None, length=5)[1])
        found = [run(a - float(k) * jnp.eye(4)) for k in range(8)]
        np.testing.assert_allclose(found[7], np.array(found[0]) - 7.0 * len(a) * 0.5 ** np.arange(5), rtol=1e-9)


def differentiated_twice(function, a, v):
    """Second derivative along v forward over reverse and reverse over reverse, and by differences of the first."""
    first = jax.jit(jax.grad(lambda a: function(a).sum()))
    forward = jax.jit(lambda a, v: jax.jvp(first, (a,), (v,))[1])(a, v)
    reverse = jax.jit(jax.grad(lambda a: (first(a) * v).sum()))(a)
    e = 1e-5
    return forward, reverse, (first(a + e * v) - first(a - e * v)) / (2 * e)


def test_derivatives_by_matrices_with_repeated_eigenvalues():
    with jax.enable_x64(True):
        rng = np.random.default_rng(0)
        a, x = jnp.array(turned(SPECTRA[[0, 1, 2, 3, 5]])), jnp.array(unit(5, 4))
        a = jnp.concatenate([a, jnp.diag(jnp.array([-5.0, -5.0, -5.0, 0.0]))[None]])
        x = jnp.concatenate([x, x[:1]])
        v = jnp.array(rng.normal(size=a.shape))
        forward, reverse, numeric = differentiated_twice(lambda a: negative_log_likelihood(a, x), a, v)
        np.testing.assert_allclose(forward, numeric, atol=1e-8)
        np.testing.assert_allclose(reverse, forward, atol=1e-12)
        w = jnp.array(rng.normal(size=x.shape))
        forward, reverse, numeric = differentiated_twice(lambda x: negative_log_likelihood(a, x), x, w)
        np.testing.assert_allclose(forward, numeric, atol=1e-5)
        np.testing.assert_allclose(reverse, forward, atol=1e-10)
        np.testing.assert_allclose(jax.grad(matrix_log_normalizer)(a[0]), matrix_moment(a[0]), atol=1e-14)


def test_concentrations_invert_the_moments(double):
    z = jnp.array(SPECTRA[[1, 2, 4, 5]])
    w = moments(z)
    found = jax.jit(concentrations)(w)
    if double:
        np.testing.assert_allclose(found, z, rtol=1e-8, atol=1e-8)
    np.testing.assert_allclose(moments(found), w, atol=1e-12 if double else 1e-6)
    jacobian = jax.jit(jax.jacrev(lambda z: concentrations(moments(z))))(jnp.array([-3.0, -20.0, 0.0, -1.0]))
    np.testing.assert_allclose(jacobian, np.eye(4) - np.eye(4)[2], atol=1e-8 if double else 1e-3)
    assert np.isnan(concentrations(jnp.array([0.5, 0.7, -0.2, 0.0]))).all()


def test_arguments_are_checked_where_shapes_tell():
    for call in (lambda: log_normalizer(1.0), lambda: matrix_log_normalizer(jnp.zeros((3, 4)))):
        with pytest.raises(InvalidArgumentError, match="d >= 2"):
            call()
    with pytest.raises(InvalidArgumentError, match="x"):
        negative_log_likelihood(jnp.zeros((4, 4)), jnp.zeros(3))


def test_numpyro_distribution():
    pytest.importorskip("numpyro", reason="NumPyro is not installed")
    from bingham.jax import Bingham

    a = turned(SPECTRA[[1, 2, 5]])
    law = bingham.Bingham.from_matrix(a)
    p = Bingham(jnp.array(a))
    n = 20_000
    x = np.asarray(jax.jit(lambda key: p.sample(key, (n,)))(jax.random.PRNGKey(0)))
    assert x.shape == (n, 3, 4)
    moment = np.einsum("n...i,n...j->...ij", x, x) / n
    assert np.abs(moment - law.moment()).max() < 5 * 0.5 / np.sqrt(n)
    assert np.abs(moment - np.roll(law.moment(), 1, 0)).max() > 5 * 0.5 / np.sqrt(n)
    np.testing.assert_allclose(p.entropy(), law.entropy(), rtol=1e-5)
    np.testing.assert_allclose(
        p.log_prob(jnp.array(x[:5])),
        law.logpdf(x[:5] / np.linalg.norm(x[:5], axis=-1, keepdims=True)),
        rtol=1e-3,
        atol=1e-3,
    )


def test_importing_bingham_loads_neither():
    code = "import sys, bingham; bingham.moments([0.0, 0.0]); print([m for m in ('torch', 'jax') if m in sys.modules])"
    out = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout
    assert out.strip() == "[]"
