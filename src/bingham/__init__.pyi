# The names that most users want, two dozen at most. What is not for most users belongs to its subpackage.
from . import baselines as baselines
from . import distributions as distributions
from . import errors as errors
from . import filters as filters
from . import geology as geology
from . import inference as inference
from . import io as io
from . import jax as jax
from . import metrics as metrics
from . import models as models
from . import plot as plot
from . import recording as recording
from . import rotations as rotations
from . import sampling as sampling
from . import simulate as simulate
from . import studies as studies
from . import surfaces as surfaces
from . import torch as torch
from .distributions.bingham import Bingham as Bingham
from .distributions.mixture import BinghamMixture as BinghamMixture
from .distributions.normalizer import concentrations as concentrations
from .distributions.normalizer import log_normalizer as log_normalizer
from .distributions.normalizer import moments as moments
from .errors import BinghamError as BinghamError
from .errors import InvalidArgumentError as InvalidArgumentError
from .filters.constant_spin import fit_constant_spin as fit_constant_spin
from .filters.first_order import BinghamFilter as BinghamFilter
from .filters.gate import Gate as Gate
from .filters.imu import ImuFilter as ImuFilter
from .filters.imu_check import check_recording as check_recording
from .filters.mixture_filter import MixtureFilter as MixtureFilter
from .filters.sampled import SampledFilter as SampledFilter
from .filters.second_order import SecondOrderBinghamFilter as SecondOrderBinghamFilter
from .filters.second_order import SpinState as SpinState
from .filters.tune import tune as tune
from .models.diffusion import Diffusion as Diffusion
from .models.diffusion import Gyroscope as Gyroscope
from .models.sensors import HeadingSensor as HeadingSensor
from .models.sensors import OrientationSensor as OrientationSensor
from .models.sensors import VectorSensor as VectorSensor
from .recording import ImuRecording as ImuRecording
from .recording import OrientationRecording as OrientationRecording

__version__: str
__all__: list[str]
