from .axial_kalman import AxialKalmanFilter as AxialKalmanFilter
from .gaussian import GaussianState as GaussianState
from .gaussian import KalmanFilter as KalmanFilter
from .gaussian import KalmanInfo as KalmanInfo
from .quaternion_ekf import QuaternionEkf as QuaternionEkf
from .scalar_kalman import AngleState as AngleState
from .scalar_kalman import ScalarKalmanFilter as ScalarKalmanFilter
from .second_order_ekf import SecondOrderQuaternionEkf as SecondOrderQuaternionEkf
from .second_order_ekf import SpinningGaussian as SpinningGaussian
from .wrapped_normal import DoubledAngleState as DoubledAngleState
from .wrapped_normal import WrappedNormalFilter as WrappedNormalFilter

__all__: list[str]
