"""x-io Technologies: x-IMU, NGIMU and x-IMU3. Units stand in their headers; the x-IMU counts packets."""

from bingham.io.presets.preset import Preset

__all__ = ["PRESETS"]

SENSORS = {
    "gyroscope": [r"Gyroscope {} \(.*\)"],
    "accelerometer": [r"Accelerometer {} \(.*\)"],
    "magnetometer": [r"Magnetometer {} \(.*\)"],
    "estimate": [r"(?:Quaternion )?{}", r"Element {}"],
}

PRESETS = [
    Preset(
        "x-imu",
        "x-io x-IMU: CalInertialAndMag.csv (give --rate)",
        needs=["Packet number", r"(Gyroscope|Accelerometer|Magnetometer) X \(.*\)"],
        columns={"counter": ["Packet number"], **SENSORS},
    ),
    Preset(
        "ngimu",
        "x-io NGIMU: sensors.csv, quaternion.csv",
        needs=[r"Time \(s\)", r"(Gyroscope|Accelerometer|Magnetometer) X \(.*\)", r"Barometer \(.*\)"],
        columns={"time": [r"Time \(s\)"], **SENSORS},
    ),
    Preset(
        "x-imu3",
        "x-io x-IMU3: Inertial.csv, Magnetometer.csv, Quaternion.csv",
        needs=[r"Timestamp \(us\)", r"(Gyroscope|Accelerometer|Magnetometer|Quaternion)?\s?X(?: \(.*\))?"],
        columns={"time": [r"Timestamp \(us\)"], **SENSORS},
    ),
]
