from .bingham import Bingham as Bingham
from .matching import matching_covariance as matching_covariance
from .mixture import BinghamMixture as BinghamMixture
from .normalizer import concentrations as concentrations
from .normalizer import log_normalizer as log_normalizer
from .normalizer import moments as moments
from .relations import angular_variance as angular_variance
from .relations import to_gaussian as to_gaussian

__all__: list[str]
