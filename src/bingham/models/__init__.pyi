from .diffusion import Diffusion as Diffusion
from .diffusion import Gyroscope as Gyroscope
from .distribution_sensor import DistributionSensor as DistributionSensor
from .motion import ControlledRotation as ControlledRotation
from .motion import MotionModel as MotionModel
from .motion import RandomWalk as RandomWalk
from .sensors import HeadingSensor as HeadingSensor
from .sensors import Likelihood as Likelihood
from .sensors import OrientationSensor as OrientationSensor
from .sensors import Sensor as Sensor
from .sensors import VectorSensor as VectorSensor

__all__: list[str]
