"""The filters of the spinning-ball study, on one flight (Glover & Kaelbling 2013, §6)."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bingham.studies.ball_adapted import PUBLISHED, Noises
from bingham.studies.ball_bingham import around, first_order, mixture, second_order
from bingham.studies.ball_gaussian import ekf_first_order, ekf_second_order
from bingham.studies.ball_joint import ekf_mixture
from bingham.studies.ball_noises import SPIN_PRIOR
from bingham.studies.ball_scores import score
from bingham.studies.study import Arrays

__all__ = ["FILTERS", "run_filters"]

FloatArray = NDArray[np.float64]
FILTERS = (
    "bingham_second_order",
    "bingham_mixture",
    "bingham_mixture_published",
    "bingham_oracle",
    "bingham_bank",
    "bingham_first_order",
    "bingham_first_order_fair",
    "ekf_first_order",
    "ekf_first_order_fair",
    "ekf_second_order",
    "ekf_second_order_fair",
    "ekf_mixture",
)


def run_filters(
    flight: Arrays, kind: int, types: FloatArray, names: Sequence[str], adapted: Noises = PUBLISHED
) -> Arrays:
    """Return the `score` of each filter on one flight, as ``quantity/filter``; the mixture takes the adapted noises."""
    out: Arrays = {}
    for name in names:
        seen = flight["seen"]
        found = mixture(seen, types, *adapted) if name == "bingham_mixture" else RUNNERS[name](seen, kind, types)
        scores = score(found, flight, kind)
        out |= {f"{quantity}/{name}": values for quantity, values in scores.items()}
    return out


RUNNERS: dict[str, Any] = {
    "bingham_second_order": lambda seen, kind, types: second_order(seen, [SPIN_PRIOR], types),
    "bingham_mixture_published": lambda seen, kind, types: mixture(seen, types, *PUBLISHED),
    "bingham_oracle": lambda seen, kind, types: second_order(seen, [around(types)[kind]], types),
    "bingham_bank": lambda seen, kind, types: second_order(seen, around(types), types),
    "bingham_first_order": lambda seen, kind, types: first_order(seen, types, False),
    "bingham_first_order_fair": lambda seen, kind, types: first_order(seen, types, True),
    "ekf_first_order": lambda seen, kind, types: ekf_first_order(seen, types, False),
    "ekf_first_order_fair": lambda seen, kind, types: ekf_first_order(seen, types, True),
    "ekf_second_order": lambda seen, kind, types: ekf_second_order(seen, types, False),
    "ekf_second_order_fair": lambda seen, kind, types: ekf_second_order(seen, types, True),
    "ekf_mixture": lambda seen, kind, types: ekf_mixture(seen, types),
}
