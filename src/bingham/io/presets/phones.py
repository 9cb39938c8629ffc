"""Telephones: phyphox, Sensor Logger, MATLAB Mobile; mostly one file a sensor.

Sensor Logger's ``TotalAcceleration`` is what an accelerometer measures, its ``Accelerometer`` has gravity taken off, as
phyphox' ``Linear Acceleration``: such are no accelerometers to a filter that looks for the vertical, unless gravity
stands beside them. iOS measures the acceleration of free fall, the opposite of what an accelerometer measures at rest.
"""

from bingham.io.presets.preset import Preset

__all__ = ["PRESETS"]

PRESETS = [
    Preset(
        "phyphox",
        "phyphox: Gyroscope.csv, Accelerometer.csv, Magnetometer.csv",
        needs=[r"Time \(s\)", r"(Gyroscope|Acceleration|Linear Acceleration|Magnetic field) x \(.*\)|[xyz] \(.*\)"],
        columns={
            "time": [r"Time \(s\)"],
            "gyroscope": [r"Gyroscope {} \(.*\)"],
            "accelerometer": [r"Acceleration {} \(.*\)", r"Accelerometer {} \(.*\)"],
            "magnetometer": [r"Magnetic field {} \(.*\)"],
            "sensor": [r"{} \(.*\)"],
        },
    ),
    Preset(
        "sensor-logger",
        "Sensor Logger: Gyroscope.csv, TotalAcceleration.csv, Magnetometer.csv, Orientation.csv",
        needs=["time", "seconds_elapsed", "x|qx|gyroscope_x|rotationRateX"],
        columns={
            "time": ["seconds_elapsed"],
            "gyroscope": ["gyroscope_{}", "rotationRate{}"],
            "accelerometer": ["totalacceleration_{}", "accelerometeruncalibrated_{}"],
            "magnetometer": ["magnetometer_{}"],
            "sensor": ["{}"],
            "estimate": ["q{}"],
        },
        units={"gyroscope": "rad/s", "accelerometer": "m/s2"},
    ),
    Preset(
        "sensorlog",
        "SensorLog (iOS): one file of all sensors",
        needs=[r"loggingTime\(.*\)", r"(accelerometerAcceleration|gyroRotation|motionRotationRate)X\(.*\)"],
        columns={
            "time": [
                r"gyroTimestamp_sinceReboot\(s\)",
                r"motionTimestamp_sinceReboot\(s\)",
                r"loggingTime\(s\)",
                r"loggingTime\(txt\)",
            ],
            "gyroscope": [r"gyroRotation{}\(.*\)", r"motionRotationRate{}\(.*\)"],
            "accelerometer": [r"accelerometerAcceleration{}\(.*\)"],
            "magnetometer": [r"magnetometer{}\(.*\)", r"motionMagneticField{}\(.*\)"],
        },
        signs={"accelerometer": -1.0},
    ),
    Preset(
        "matlab-mobile",
        "MATLAB Mobile: AngularVelocity, Acceleration, MagneticField with Timestamp, X, Y, Z",
        needs=["Timestamp", "X", "Y", "Z"],
        columns={"time": ["Timestamp"], "sensor": ["{}"]},
        units={"gyroscope": "rad/s", "accelerometer": "m/s2"},
    ),
]
