from .bank import BankInfo as BankInfo
from .bank import BankState as BankState
from .bank import FilterBank as FilterBank
from .first_order import BinghamFilter as BinghamFilter
from .gate import Gate as Gate
from .imu import ImuFilter as ImuFilter
from .imu_events import ImuStream as ImuStream
from .imu_state import ImuState as ImuState
from .imu_track import ImuTrack as ImuTrack
from .inertial import InertialFilter as InertialFilter
from .mixture_filter import MixtureFilter as MixtureFilter
from .mixture_filter import ambiguous_noise as ambiguous_noise
from .protocol import Filter as Filter
from .protocol import UpdateInfo as UpdateInfo
from .run import RecursiveFilter as RecursiveFilter
from .sampled import SampledFilter as SampledFilter
from .second_order import SecondOrderBinghamFilter as SecondOrderBinghamFilter
from .second_order import SpinState as SpinState
from .second_order import classify_spin as classify_spin
from .smoother import smooth_fixed_interval as smooth_fixed_interval
from .smoother import smooth_fixed_lag as smooth_fixed_lag
from .track import BinghamTrack as BinghamTrack
from .track import Track as Track
from .tune import SensorNoise as SensorNoise

__all__: list[str]
