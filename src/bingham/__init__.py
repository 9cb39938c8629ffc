"""Bingham distributions on unit hyperspheres and the recursive filters built on them.

The public names below are loaded when first used, so that ``import bingham`` stays fast.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:  # what the table below loads, for editors and type checkers
    from bingham.distributions.bingham import Bingham as Bingham
    from bingham.distributions.mixture import BinghamMixture as BinghamMixture
    from bingham.distributions.normalizer import concentrations as concentrations
    from bingham.distributions.normalizer import log_normalizer as log_normalizer
    from bingham.distributions.normalizer import moments as moments
    from bingham.distributions.relations import angular_variance as angular_variance
    from bingham.distributions.relations import to_gaussian as to_gaussian
    from bingham.errors import BinghamError as BinghamError
    from bingham.errors import ConvergenceError as ConvergenceError
    from bingham.errors import InvalidArgumentError as InvalidArgumentError
    from bingham.errors import RecordingError as RecordingError
    from bingham.filters.axial_kalman import AxialKalmanFilter as AxialKalmanFilter
    from bingham.filters.bank import BankState as BankState
    from bingham.filters.bank import FilterBank as FilterBank
    from bingham.filters.first_order import BinghamFilter as BinghamFilter
    from bingham.filters.gate import Gate as Gate
    from bingham.filters.gaussian import GaussianState as GaussianState
    from bingham.filters.gaussian import KalmanTrack as KalmanTrack
    from bingham.filters.imu import ImuFilter as ImuFilter
    from bingham.filters.imu_events import ImuStream as ImuStream
    from bingham.filters.imu_state import ImuState as ImuState
    from bingham.filters.imu_track import ImuTrack as ImuTrack
    from bingham.filters.inertial import InertialFilter as InertialFilter
    from bingham.filters.mixture_filter import MixtureFilter as MixtureFilter
    from bingham.filters.mixture_filter import ambiguous_noise as ambiguous_noise
    from bingham.filters.protocol import UpdateInfo as UpdateInfo
    from bingham.filters.quaternion_ekf import QuaternionEkf as QuaternionEkf
    from bingham.filters.sampled import SampledFilter as SampledFilter
    from bingham.filters.scalar_kalman import AngleState as AngleState
    from bingham.filters.scalar_kalman import ScalarKalmanFilter as ScalarKalmanFilter
    from bingham.filters.second_order import SecondOrderBinghamFilter as SecondOrderBinghamFilter
    from bingham.filters.second_order import SpinState as SpinState
    from bingham.filters.second_order import classify_spin as classify_spin
    from bingham.filters.second_order_ekf import SecondOrderQuaternionEkf as SecondOrderQuaternionEkf
    from bingham.filters.second_order_ekf import SpinningGaussian as SpinningGaussian
    from bingham.filters.smoother import smooth_fixed_interval as smooth_fixed_interval
    from bingham.filters.smoother import smooth_fixed_lag as smooth_fixed_lag
    from bingham.filters.track import Track as Track
    from bingham.filters.tune import SensorNoise as SensorNoise
    from bingham.filters.tune import tune as tune
    from bingham.filters.wrapped_normal import DoubledAngleState as DoubledAngleState
    from bingham.filters.wrapped_normal import WrappedNormalFilter as WrappedNormalFilter
    from bingham.models.motion import ControlledRotation as ControlledRotation
    from bingham.models.motion import Diffusion as Diffusion
    from bingham.models.motion import Gyroscope as Gyroscope
    from bingham.models.motion import RandomWalk as RandomWalk
    from bingham.models.sensors import HeadingSensor as HeadingSensor
    from bingham.models.sensors import OrientationSensor as OrientationSensor
    from bingham.models.sensors import VectorSensor as VectorSensor
    from bingham.recording import ImuRecording as ImuRecording
    from bingham.recording import OrientationRecording as OrientationRecording
    from bingham.sampling.random import RandomSampling as RandomSampling
    from bingham.sampling.riemannian import RiemannianSampling as RiemannianSampling
    from bingham.sampling.unscented import Unscented as Unscented
    from bingham.surfaces.segmentation import PlaneDirections as PlaneDirections
    from bingham.surfaces.segmentation import fit_directions as fit_directions

__version__ = "0.1.0"

# Public name → module that defines it.
_PUBLIC = {
    "AngleState": "filters.scalar_kalman",
    "AxialKalmanFilter": "filters.axial_kalman",
    "BankState": "filters.bank",
    "Bingham": "distributions.bingham",
    "BinghamError": "errors",
    "BinghamFilter": "filters.first_order",
    "BinghamMixture": "distributions.mixture",
    "ConvergenceError": "errors",
    "Diffusion": "models.motion",
    "DoubledAngleState": "filters.wrapped_normal",
    "FilterBank": "filters.bank",
    "Gate": "filters.gate",
    "GaussianState": "filters.gaussian",
    "Gyroscope": "models.motion",
    "HeadingSensor": "models.sensors",
    "ImuFilter": "filters.imu",
    "ImuRecording": "recording",
    "ImuState": "filters.imu_state",
    "ImuStream": "filters.imu_events",
    "ImuTrack": "filters.imu_track",
    "InertialFilter": "filters.inertial",
    "InvalidArgumentError": "errors",
    "KalmanTrack": "filters.gaussian",
    "ControlledRotation": "models.motion",
    "MixtureFilter": "filters.mixture_filter",
    "RandomWalk": "models.motion",
    "OrientationRecording": "recording",
    "OrientationSensor": "models.sensors",
    "PlaneDirections": "surfaces.segmentation",
    "QuaternionEkf": "filters.quaternion_ekf",
    "RandomSampling": "sampling.random",
    "RecordingError": "errors",
    "RiemannianSampling": "sampling.riemannian",
    "SampledFilter": "filters.sampled",
    "ScalarKalmanFilter": "filters.scalar_kalman",
    "SecondOrderBinghamFilter": "filters.second_order",
    "SecondOrderQuaternionEkf": "filters.second_order_ekf",
    "SensorNoise": "filters.tune",
    "SpinState": "filters.second_order",
    "SpinningGaussian": "filters.second_order_ekf",
    "Track": "filters.track",
    "Unscented": "sampling.unscented",
    "UpdateInfo": "filters.protocol",
    "VectorSensor": "models.sensors",
    "WrappedNormalFilter": "filters.wrapped_normal",
    "ambiguous_noise": "filters.mixture_filter",
    "angular_variance": "distributions.relations",
    "classify_spin": "filters.second_order",
    "concentrations": "distributions.normalizer",
    "fit_directions": "surfaces.segmentation",
    "log_normalizer": "distributions.normalizer",
    "moments": "distributions.normalizer",
    "smooth_fixed_interval": "filters.smoother",
    "smooth_fixed_lag": "filters.smoother",
    "to_gaussian": "distributions.relations",
    "tune": "filters.tune",
}

# Subpackages and modules that need no import of their own: ``bingham.sampling.Unscented()``.
_MODULES = frozenset({"distributions", "errors", "filters", "io", "metrics", "models", "plot", "recording", "rotations",
                      "sampling", "simulate", "studies", "surfaces"})  # fmt: skip

__all__ = sorted([*_PUBLIC, "__version__"])  # pyright: ignore[reportUnsupportedDunderAll]


def __getattr__(name: str) -> Any:
    if name in _MODULES:
        return import_module(f"bingham.{name}")
    if name not in _PUBLIC:
        raise AttributeError(f"module 'bingham' has no attribute {name!r}")
    value = getattr(import_module(f"bingham.{_PUBLIC[name]}"), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted([*__all__, *_MODULES])
