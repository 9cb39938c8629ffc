"""Bingham distributions on unit hyperspheres and the recursive filters built on them.

The public names below are loaded when first used, so that ``import bingham`` stays fast.
"""

from __future__ import annotations

from importlib import import_module
from typing import Any

__version__ = "0.1.0"

# Public name → module that defines it.
_PUBLIC = {
    "AxialKalmanFilter": "filters.axial_kalman",
    "BankState": "filters.bank",
    "Bingham": "distributions.bingham",
    "BinghamError": "errors",
    "BinghamFilter": "filters.first_order",
    "BinghamMixture": "distributions.mixture",
    "ConvergenceError": "errors",
    "Diffusion": "models.motion",
    "FilterBank": "filters.bank",
    "Gate": "filters.gate",
    "Gyroscope": "models.motion",
    "HeadingSensor": "models.sensors",
    "ImuFilter": "filters.imu",
    "ImuRecording": "recording",
    "ImuState": "filters.imu_state",
    "ImuStream": "filters.imu_events",
    "ImuTrack": "filters.imu_track",
    "InertialFilter": "filters.inertial",
    "InvalidArgumentError": "errors",
    "KnownRotation": "models.motion",
    "MixtureFilter": "filters.mixture_filter",
    "NoisyIdentity": "models.motion",
    "OrientationRecording": "recording",
    "OrientationSensor": "models.sensors",
    "PlaneDirections": "surfaces.segmentation",
    "QuaternionEkf": "filters.quaternion_ekf",
    "RandomSampling": "sampling.random",
    "RecordingError": "errors",
    "RiemannianSampling": "sampling.riemannian",
    "SampledFilter": "filters.sampled",
    "SensorNoise": "filters.tune",
    "ScalarKalmanFilter": "filters.scalar_kalman",
    "SecondOrderBinghamFilter": "filters.second_order",
    "SecondOrderQuaternionEkf": "filters.second_order_ekf",
    "SpinState": "filters.second_order",
    "Track": "filters.track",
    "Unscented": "sampling.unscented",
    "UpdateInfo": "filters.protocol",
    "VectorSensor": "models.sensors",
    "WrappedNormalFilter": "filters.wrapped_normal",
    "ambiguous_noise": "filters.mixture_filter",
    "concentrations": "distributions.normalizer",
    "fit_directions": "surfaces.segmentation",
    "log_normalizer": "distributions.normalizer",
    "moments": "distributions.normalizer",
    "smooth_fixed_interval": "filters.smoother",
    "smooth_fixed_lag": "filters.smoother",
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
