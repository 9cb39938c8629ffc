"""Truths of the precession study: a body disturbed in its orientation, or in its spin, and noisy measurements of it."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from bingham.distributions.bingham import Bingham
from bingham.rotations import compose, conjugate
from bingham.simulate import simulate_precession
from bingham.studies.study import Arrays

__all__ = ["NOISE", "PRIOR", "RATE_HZ", "SPIN_CHANGE", "disturbed_orientation", "disturbed_spin", "isotropic"]

FloatArray = NDArray[np.float64]


def isotropic(z: float) -> Bingham:
    """Return the distribution of concentration z about the identity, the same in all directions."""
    return Bingham([z, z, z, 0.0], np.eye(4)[::-1])


# The report's distributions: prior and "system noise", modes at the identity.
PRIOR, NOISE = isotropic(-1.0), isotropic(-5e4)
# The rotation of one step, disturbed by w, after that of the step before, by w': they differ by w' ⊗ w*.
SPIN_CHANGE = NOISE.compose(NOISE.inverse())
# Not in the report: its figures show some turns of a body that spins ten times faster than it precesses.
RATE_HZ, DURATION_S, SPIN, PRECESSION, TILT = 50.0, 20.0, 3.0, 0.3, 0.6


def disturbed_orientation(rng: np.random.Generator) -> Arrays:
    """Return a precession disturbed in every step, x' = x ⊗ u ⊗ w, measured as z = x ⊗ v; w, v ~ NOISE.

    Arrays, for T steps: truth (T, 4), spin (T, 4), the rotation to the orientation after it, measured (T, 4), and
    controls u (T, 4).
    """
    nominal = _nominal()
    controls = compose(conjugate(nominal[:-1]), nominal[1:])
    disturbed = compose(controls, NOISE.rvs(len(controls), rng=rng))
    orientation = nominal.copy()
    for t, turn in enumerate(disturbed):
        orientation[t + 1] = _unit(compose(orientation[t], turn))
    return _measured(orientation, rng) | {"controls": controls[:-1]}


def disturbed_spin(distribution: Bingham, rng: np.random.Generator) -> Arrays:
    """Return the second-order process of Glover & Kaelbling (2013, §3): x' = v ⊗ x, v' = w ⊗ u ⊗ v; z = x ⊗ NOISE.

    Arrays as for `disturbed_orientation`; the controls are accelerations, those of the undisturbed precession.
    """
    nominal = _nominal()
    spins = compose(nominal[1:], conjugate(nominal[:-1]))
    controls = compose(spins[1:], conjugate(spins[:-1]))
    disturbed = compose(distribution.rvs(len(controls), rng=rng), controls)
    orientation = nominal.copy()
    spin = spins[0]
    for t, turn in enumerate(disturbed):
        orientation[t + 1] = _unit(compose(spin, orientation[t]))
        spin = _unit(compose(turn, spin))
    orientation[-1] = _unit(compose(spin, orientation[-2]))
    return _measured(orientation, rng) | {"controls": controls}


def _nominal() -> FloatArray:
    # One step more than is measured, which ends the last spin.
    return simulate_precession(
        DURATION_S + 1.0 / RATE_HZ, RATE_HZ, spin=SPIN, precession=PRECESSION, tilt_rad=TILT
    ).orientation


def _unit(x: FloatArray) -> FloatArray:
    return x / np.linalg.norm(x)


def _measured(orientation: FloatArray, rng: np.random.Generator) -> Arrays:
    truth = orientation[1:-1]
    return {
        "truth": truth,
        "spin": compose(orientation[2:], conjugate(truth)),
        "measured": compose(truth, NOISE.rvs(len(truth), rng=rng)),
    }
