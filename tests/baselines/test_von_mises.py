"""First moments of von Mises distributions against mpmath, and their inverse."""

import mpmath
import numpy as np
import pytest
from numpy.polynomial import Polynomial

from bingham.baselines.von_mises import CONCENTRATION, DEFICIT, NARROW, log_resultant, von_mises_concentration

# From nothing to σ = 1e-8 rad, on both sides of the switch.
KAPPA = [1e-12, 1e-3, 0.5, 2.0, 20.0, 150.0, np.nextafter(NARROW, 0.0), NARROW, 200.5, 1e3, 1e5, 1e8, 1e13, 1e16]


@pytest.mark.parametrize("kappa", KAPPA)
def test_both_directions_against_mpmath(kappa):
    with mpmath.workdps(60):
        k = mpmath.mpf(kappa)
        exact = mpmath.log(mpmath.besseli(1, k) / mpmath.besseli(0, k))
    # Below the switch 1 − A is a difference of Bessel functions, above it a series to the last bit.
    assert log_resultant(kappa) == pytest.approx(float(exact), rel=5e-14 if kappa < NARROW else 5e-16)
    assert von_mises_concentration(float(exact)) == pytest.approx(kappa, rel=1e-13 if kappa < NARROW else 5e-16)


def test_the_series_solve_the_differential_equation():
    # A' = 1 − A/κ − A² with s = 1/κ and D = 1 − A = Σ aₙ sⁿ: s² dD/ds = 1 − s (1 − D) − (1 − D)².
    a, s = Polynomial([0.0, *DEFICIT]), Polynomial([0.0, 1.0])
    rest = s * s * a.deriv() - 1.0 + s * (1.0 - a) + (1.0 - a) ** 2
    np.testing.assert_allclose(rest.coef[:9], 0.0, atol=1e-13)
    # The same for k(D) = κ D: (D k' − k) ((2 − D) k − 1 + D) = −D k.
    k, deficit = Polynomial(CONCENTRATION), Polynomial([0.0, 1.0])
    rest = (deficit * k.deriv() - k) * ((2.0 - deficit) * k - 1.0 + deficit) + deficit * k
    np.testing.assert_allclose(rest.coef[:8], 0.0, atol=1e-10)


@pytest.mark.parametrize("sigma", np.geomspace(1e-7, 1.0, 15))
def test_the_concentration_of_a_wrapped_normal_distribution(sigma):
    # e^{−σ²/2} = A(κ), solved by mpmath: to first order κ = 1/σ² + 1/2.
    kappa = float(von_mises_concentration(-0.5 * sigma**2))
    with mpmath.workdps(60):

        def excess(k):
            return mpmath.besseli(1, k) / mpmath.besseli(0, k) - mpmath.exp(-(mpmath.mpf(sigma) ** 2) / 2)

        guess = 1.0 / mpmath.mpf(sigma) ** 2
        exact = mpmath.findroot(excess, (0.5 * guess, 2.0 * guess), solver="anderson", tol=1e-90, maxsteps=200)
    assert kappa == pytest.approx(float(exact), rel=1e-13)


def test_the_switch_is_not_seen():
    below, above = np.nextafter(NARROW, 0.0), NARROW
    a, b = log_resultant([below, above])
    assert b - a == pytest.approx(0.0, abs=5e-16)
    near = log_resultant(NARROW) * (1.0 + np.array([-1e-13, 1e-13]))
    np.testing.assert_allclose(von_mises_concentration(near), NARROW, rtol=3e-13)
    # The slopes agree too: 1 − A/κ − A² from both sides.
    step = 1e-3 * NARROW
    left, right = np.diff(log_resultant(NARROW + step * np.array([-2.0, -1.0, 1.0, 2.0])))[[0, 2]] / step
    assert left / right == pytest.approx(1.0 + 6e-3, abs=1e-4)


def test_there_and_back():
    kappa = np.concatenate([[0.0], np.geomspace(1e-9, 1e16, 400)])
    np.testing.assert_allclose(von_mises_concentration(log_resultant(kappa)), kappa, rtol=2e-13)
    assert log_resultant(0.0) == -np.inf
