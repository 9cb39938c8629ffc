"""Where controls and noises act in the baselines, and their evidence, against formulas written out with `compose`."""

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.stats import multivariate_normal, norm, vonmises

from bingham.baselines.axial_kalman import AxialKalmanFilter
from bingham.baselines.gaussian import GaussianState
from bingham.baselines.quaternion_ekf import QuaternionEkf
from bingham.baselines.scalar_kalman import AngleState, ScalarKalmanFilter
from bingham.baselines.second_order_ekf import SecondOrderQuaternionEkf, SpinningGaussian
from bingham.baselines.wrapped_normal import DoubledAngleState, WrappedNormalFilter
from bingham.metrics import geodesic_error
from bingham.rotations import compose

SIDES = ("left", "right")


def axis(angle):
    return np.array([np.cos(angle), np.sin(angle)])


def unit(rng, d):
    x = rng.normal(size=d)
    return x / np.linalg.norm(x)


def covariance(rng, d, scale=0.01):
    a = rng.normal(size=(d, d))
    return scale * (a @ a.T + np.eye(d))


def matrix(function, d):
    """Return the matrix (d, d) of a linear function, column by column."""
    return np.stack([function(e) for e in np.eye(d)], axis=-1)


def rotated(noise, x, side):
    """Return the covariance of v ⊗ x or x ⊗ v for that of v."""
    t = matrix((lambda v: compose(v, x)) if side == "left" else (lambda v: compose(x, v)), 4)
    return t @ noise @ t.T


def ekf(side, rotate=True, scale=0.01):
    rng = np.random.default_rng(100)
    w, v = covariance(rng, 4, 0.1 * scale), covariance(rng, 4, scale)
    return QuaternionEkf(w, v, noise_side=side, rotate_noise=rotate), w, v


# Name → filter, side on which the control acts, state of a unit vector and how sure it is.
CASES = {
    "scalar_kalman": (
        ScalarKalmanFilter(0.01, 0.05),
        "right",
        2,
        lambda x: AngleState(np.arctan2(x[1], x[0]), np.array(0.1)),
    ),
    "wrapped_normal": (
        WrappedNormalFilter(0.01, 0.05),
        "right",
        2,
        lambda x: DoubledAngleState(2.0 * np.arctan2(x[1], x[0]), np.array(2.0)),
    ),
    "axial_kalman_2": (
        AxialKalmanFilter(np.eye(2) * 0.01, np.eye(2) * 0.05),
        "right",
        2,
        lambda x: GaussianState(x, np.eye(2) * 0.1),
    ),
    "axial_kalman_4": (
        AxialKalmanFilter(np.eye(4) * 0.01, np.eye(4) * 0.05),
        "right",
        4,
        lambda x: GaussianState(x, np.eye(4) * 0.1),
    ),
    "ekf_left": (ekf("left")[0], "left", 4, lambda x: GaussianState(x, np.eye(4) * 0.1)),
    "ekf_right": (ekf("right")[0], "right", 4, lambda x: GaussianState(x, np.eye(4) * 0.1)),
}


@pytest.fixture(params=CASES, ids=list(CASES))
def case(request):
    return CASES[request.param]


def test_a_control_moves_the_mode_where_compose_says(case):
    f, side, d, state = case
    rng = np.random.default_rng(0)
    x, u = unit(rng, d), unit(rng, d)
    expected = compose(u, x) if side == "left" else compose(x, u)
    assert geodesic_error(f.predict(state(x), u).mode, expected) < 1e-12
    # A known turn is an error of the estimate without it.
    assert geodesic_error(f.predict(state(x)).mode, expected) > 0.1


def test_turning_everything_turns_the_result(case):
    f, side, d, state = case
    rng = np.random.default_rng(1)
    x, g = unit(rng, d), unit(rng, d)
    u = rng.normal(size=(10, d)) * 0.3 + np.eye(d)[0]
    u /= np.linalg.norm(u, axis=1, keepdims=True)
    z = rng.normal(size=(10, d)) * 0.3 + x
    z /= np.linalg.norm(z, axis=1, keepdims=True)

    def moved(q):
        return compose(q, g) if side == "left" else compose(g, q)

    here, there = f.run(state(x), z, controls=u), f.run(state(moved(x)), moved(z), controls=u)
    assert geodesic_error(there.modes, moved(here.modes)).max() < 1e-10
    np.testing.assert_allclose(there.log_evidence, here.log_evidence, atol=1e-9)


@pytest.mark.parametrize("d", [2, 4])
def test_axial_kalman_turns_its_covariance_with_the_control(d):
    rng = np.random.default_rng(2)
    w, P, x, u = covariance(rng, d), covariance(rng, d), unit(rng, d), unit(rng, d)
    after = AxialKalmanFilter(w, np.eye(d)).predict(GaussianState(x, P), u)
    t = matrix(lambda e: compose(e, u), d)
    np.testing.assert_allclose(after.mean, compose(x, u), atol=1e-14)
    np.testing.assert_allclose(after.covariance, t @ P @ t.T + w, atol=1e-14)


@pytest.mark.parametrize("side", SIDES)
@pytest.mark.parametrize("rotate", [True, False])
def test_the_ekf_turns_its_covariance_with_the_control(side, rotate):
    rng = np.random.default_rng(3)
    f, w, _ = ekf(side, rotate)
    P, x, u = covariance(rng, 4), unit(rng, 4), unit(rng, 4)
    after = f.predict(GaussianState(x, P), u)
    t = matrix((lambda e: compose(u, e)) if side == "left" else (lambda e: compose(e, u)), 4)
    noise = rotated(w, t @ x, side) if rotate else w
    np.testing.assert_allclose(after.covariance, t @ P @ t.T + noise, atol=1e-14)


@pytest.mark.parametrize("rotate", [True, False])
def test_the_second_order_ekf_predicts_orientation_and_spin(rotate):
    # (x, v) → (v ⊗ x, u ⊗ v) is bilinear: central differences give its Jacobian exactly.
    rng = np.random.default_rng(4)
    w, P, mean, u = covariance(rng, 4), covariance(rng, 8), np.concatenate([unit(rng, 4), unit(rng, 4)]), unit(rng, 4)
    f = SecondOrderQuaternionEkf(w, np.eye(4), rotate_noise=rotate)

    def step(m, push):
        return np.concatenate([compose(m[4:], m[:4]), compose(push, m[4:])])

    for push, control in ((u, u), (np.eye(4)[0], None)):
        after = f.predict(SpinningGaussian(mean, P), control)
        jacobian = matrix(lambda e, push=push: 0.5 * (step(mean + e, push) - step(mean - e, push)), 8)
        expected = jacobian @ P @ jacobian.T
        expected[4:, 4:] += rotated(w, step(mean, push)[4:], "left") if rotate else w
        np.testing.assert_allclose(after.mean, step(mean, push), atol=1e-14)
        np.testing.assert_allclose(after.covariance, expected, atol=1e-14)


def test_scalar_evidence_is_a_normal_density():
    f = ScalarKalmanFilter(0.3, 0.5)
    state = f.predict(AngleState(np.array(0.4), np.array(0.2)))
    for angle in (0.4, 0.9, -0.3):
        _, info = f.update(state, axis(angle))
        assert info.log_evidence == pytest.approx(norm(0.4, np.sqrt(0.2 + 0.3 + 0.5)).logpdf(angle), abs=1e-12)


@pytest.mark.parametrize("d", [2, 4])
def test_axial_evidence_is_a_normal_density(d):
    rng = np.random.default_rng(5)
    P, R, x = covariance(rng, d, 0.05), covariance(rng, d, 0.2), unit(rng, d)
    z = unit(rng, d)
    z *= np.sign(z @ x)
    _, info = AxialKalmanFilter(np.zeros((d, d)), R).update(GaussianState(x, P), z)
    assert info.log_evidence == pytest.approx(multivariate_normal(x, P + R).logpdf(z), abs=1e-11)


@pytest.mark.parametrize("side", SIDES)
@pytest.mark.parametrize("rotate", [True, False])
@pytest.mark.parametrize("second_order", [False, True])
def test_ekf_evidence_is_a_normal_density(side, rotate, second_order):
    # z about x/|x| with covariance H P Hᵀ + R, R that of v ⊗ x or x ⊗ v; H is differentiated numerically here.
    rng = np.random.default_rng(6)
    P, v, x = covariance(rng, 8), covariance(rng, 4, 0.2), unit(rng, 4)
    z = unit(rng, 4)
    z *= np.sign(z @ x)
    if second_order:
        f = SecondOrderQuaternionEkf(np.eye(4), v, noise_side=side, rotate_noise=rotate)
        _, info = f.update(SpinningGaussian(np.concatenate([1.1 * x, unit(rng, 4)]), P), z)
    else:
        f = QuaternionEkf(np.eye(4), v, noise_side=side, rotate_noise=rotate)
        _, info = f.update(GaussianState(1.1 * x, P[:4, :4]), z)

    def projected(q):
        return q / np.linalg.norm(q)

    jacobian = matrix(lambda e: (projected(1.1 * x + 1e-6 * e) - projected(1.1 * x - 1e-6 * e)) / 2e-6, 4)
    total = jacobian @ P[:4, :4] @ jacobian.T + (rotated(v, x, side) if rotate else v)
    assert info.log_evidence == pytest.approx(multivariate_normal(x, total).logpdf(z), abs=1e-8)


def test_wrapped_normal_evidence_is_the_integral_of_its_densities():
    f = WrappedNormalFilter(0.1, 0.3)
    state = DoubledAngleState(np.array(1.1), np.array(4.0))
    kappa_z = f.update(DoubledAngleState(np.array(0.0), np.array(0.0)), [1.0, 0.0])[0].kappa
    for angle in (0.5, 1.5, -0.8):
        _, info = f.update(state, axis(angle))

        def joint(phi, phi_z=2.0 * angle):
            return vonmises.pdf(phi, 4.0, 1.1) * vonmises.pdf(phi_z - phi, kappa_z)

        density, _ = quad(joint, 0.0, 2.0 * np.pi)
        assert info.log_evidence == pytest.approx(np.log(density), abs=1e-9)


@pytest.mark.parametrize("sigma", [1e-4, 1e-7])
def test_wrapped_normal_evidence_of_narrow_laws_is_a_normal_density(sigma):
    f = WrappedNormalFilter(0.0, sigma**2)
    state = DoubledAngleState(np.array(0.0), np.array(0.25 / sigma**2))
    _, info = f.update(state, axis(1.7 * sigma))
    expected = norm(0.0, np.sqrt(8.0) * sigma).logpdf(3.4 * sigma)
    assert info.log_evidence == pytest.approx(expected, abs=10.0 * sigma**2 + 1e-9)
    assert info.nis == pytest.approx(3.4**2 / 8.0, abs=10.0 * sigma**2 + 1e-9)
