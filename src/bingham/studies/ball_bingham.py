"""The Bingham filters of the spinning-ball study, on one flight."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from bingham.distributions.bingham import Bingham
from bingham.filters.bank import BankState, FilterBank
from bingham.filters.first_order import BinghamFilter
from bingham.filters.second_order import SecondOrderBinghamFilter, SpinState, classify_spin
from bingham.filters.second_order_mixture import SecondOrderMixtureFilter, SpinMixture
from bingham.rotations import conjugate
from bingham.studies.ball_noises import BACK, DARK, INFORMED, LOGO, PROCESS, SPIN_PRIOR, turns
from bingham.studies.ball_scores import Found

__all__ = ["around", "first_order", "mixture", "mixture_evidence", "second_order"]

FloatArray = NDArray[np.float64]
# Parts of the prior of the spin in which the mixture starts.
HYPOTHESES = 16


def second_order(seen: FloatArray, priors: Sequence[Bingham], types: FloatArray) -> Found:
    """Run a bank of second-order filters, one for each prior of the spin."""
    bank = FilterBank([SecondOrderBinghamFilter(PROCESS, LOGO, noise_side="right")])
    state = BankState([SpinState(Bingham.uniform(4), prior) for prior in priors])
    kept: list[SpinState] = []
    for z in seen:
        state = bank.predict(state)
        dark = bool(np.isnan(z).any())
        state, _ = bank.update(state, BACK if dark else z, noise=DARK if dark else None)
        kept.append(state.selected)
    return Found([s.orientation for s in kept], [s.spin for s in kept], [classify_spin(s.spin, types)[0] for s in kept])


def _steps(
    seen: FloatArray, process: Bingham, logo: Bingham, dark_noise: Bingham
) -> Iterator[tuple[SpinMixture, float]]:
    """Yield states and log-evidence of the mixture of second-order filters, which starts from the published prior."""
    spin_filter = SecondOrderMixtureFilter(SecondOrderBinghamFilter(process, logo, noise_side="right"))
    state = SpinMixture.spread(SpinState(Bingham.uniform(4), SPIN_PRIOR), HYPOTHESES)
    for z in seen:
        state = spin_filter.predict(state)
        dark = bool(np.isnan(z).any())
        state, info = spin_filter.update(state, BACK if dark else z, noise=dark_noise if dark else None)
        yield state, info.log_evidence


def mixture_evidence(seen: FloatArray, process: Bingham, logo: Bingham, dark_noise: Bingham) -> float:
    """Return the log-evidence of a flight under the mixture's filter."""
    return sum(evidence for _, evidence in _steps(seen, process, logo, dark_noise))


def mixture(seen: FloatArray, types: FloatArray, process: Bingham, logo: Bingham, dark_noise: Bingham) -> Found:
    """Run the mixture of second-order filters."""
    kept = [state for state, _ in _steps(seen, process, logo, dark_noise)]
    chosen = [int(np.argmax(s.spin.logpdf(types))) for s in kept]
    return Found([s.selected.orientation for s in kept], [s.selected.spin for s in kept], chosen)


def around(types: FloatArray) -> list[Bingham]:
    """Return the informed priors of the spin, one about each type (k, 4)."""
    return [INFORMED.rotate(left=s) for s in types]


def first_order(seen: FloatArray, types: FloatArray, fair: bool) -> Found:
    """Track the spin alone by the first-order filter of §4: with the fair noise, F(C(v)) of raw observations."""
    state = SPIN_PRIOR
    spins: list[Bingham] = []
    for observed in turns(seen):
        state = BinghamFilter(PROCESS, LOGO).predict(state)
        if observed is not None:
            between, noise, y = observed
            if fair:
                noise = noise.rotate(left=y, right=conjugate(y))
            spin_filter = BinghamFilter(PROCESS, noise, noise_side="right" if fair else "left")
            updates = (spin_filter.update(state, z) for z in between)
            state, _ = max(updates, key=lambda r: r[1].log_evidence)
        spins.append(state)
    return Found(None, spins, [classify_spin(spin, types)[0] for spin in spins])
