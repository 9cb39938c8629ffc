"""Body-worn loggers: APDM Opal, Shimmer, MbientLab MetaWear, Axivity.

Sources: Shimmer "Consensys user guide" (names ``DEVICE_SENSOR_AXIS_CAL`` above a row of units); MbientLab MetaBase
exports (one file a sensor); digitalinteraction/openmovement, Software/AX3 "file format" of omconvert and cwa-convert.
"""

from bingham.io.presets.preset import Preset

__all__ = ["PRESETS"]

PRESETS = [
    Preset(
        "shimmer",
        "Shimmer Consensys: calibrated data, names above units",
        needs=[r".*_(Timestamp\w*|TimestampSync\w*)_CAL", r".*_(Accel|Gyro|Mag)\w*_CAL"],
        columns={
            "time": [
                r".*_Timestamp(?:Sync)?_Unix_CAL",
                r".*_Timestamp(?:Sync)?_CAL",
                r".*_Timestamp(?:Sync)?_FormattedUnix_CAL",
            ],
            "gyroscope": [r".*_Gyro(?:scope)?_{}_CAL"],
            "accelerometer": [r".*_Accel_LN_{}_CAL", r".*_Accel_WR_{}_CAL", r".*_Accel(?:erometer)?_{}_CAL"],
            "magnetometer": [r".*_Mag(?:netometer)?_{}_CAL"],
            "estimate": [r".*_Quat\w*_{}_CAL"],
        },
        units={"time": "ms", "gyroscope": "deg/s", "accelerometer": "m/s2"},
    ),
    Preset(
        "apdm",
        "APDM Opal: CSV exported by Motion Studio or Mobility Lab",
        needs=[
            r"(?:.*/)?Time(?:stamp)?(?: \(.*\))?",
            r".*(Accelerometer|Acceleration|Gyroscope|Rotational Velocity)[/ ]X.*",
        ],
        mark=r"APDM|Opal|Motion Studio|Mobility Lab",
        columns={
            "time": [r"(?:.*/)?Time(?:stamp)?(?: \(.*\))?"],
            "gyroscope": [r".*(?:Gyroscope|Rotational Velocity)[/ ]{}.*"],
            "accelerometer": [r".*(?:Accelerometer|Acceleration)[/ ]{}.*"],
            "magnetometer": [r".*(?:Magnetometer|Magnetic Field)[/ ]{}.*"],
            "estimate": [r".*(?:Orientation|Quaternion)[/ ]{}.*"],
        },
        units={"gyroscope": "rad/s", "accelerometer": "m/s2"},
    ),
    Preset(
        "metawear",
        "MbientLab MetaWear: MetaBase CSV, one file a sensor",
        needs=[r"epoch? \(ms\)", r"elapsed \(s\)", r"x-axis \(.*\)"],
        columns={"time": [r"epoch? \(ms\)", r"elapsed \(s\)"], "sensor": [r"{}-axis \(.*\)"]},
    ),
    Preset(
        "axivity",
        "Axivity AX3, AX6: CSV of OMGUI, cwa-convert or omconvert",
        needs=[r"Time", r"Accel-X \(g\)"],
        columns={
            "time": ["Time"],
            "gyroscope": [r"Gyro-{} \(.*\)"],
            "accelerometer": [r"Accel-{} \(.*\)"],
            "magnetometer": [r"Mag-{} \(.*\)"],
        },
    ),
]
