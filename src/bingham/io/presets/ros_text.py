"""ROS messages as text: ``rostopic echo -p``, PlotJuggler's export. SI units; ns since 1970 or s."""

from bingham.io.presets.preset import Preset

__all__ = ["PRESETS"]

PRESETS = [
    Preset(
        "rostopic",
        "rostopic echo -p, rosbag as CSV: sensor_msgs/Imu, PoseStamped, Odometry",
        needs=["%?time", r"field\.(angular_velocity|(?:pose\.)*orientation|magnetic_field)\.x"],
        columns={
            "time": [r"field\.header\.stamp", "%?time"],
            "gyroscope": [r"field\.angular_velocity\.{}"],
            "accelerometer": [r"field\.linear_acceleration\.{}"],
            "magnetometer": [r"field\.magnetic_field\.{}"],
            "estimate": [r"field\.(?:pose\.)*orientation\.{}"],
            "position": [r"field\.(?:pose\.)+position\.{}"],
        },
        units={"time": "ns", "gyroscope": "rad/s", "accelerometer": "m/s2"},
    ),
    Preset(
        "plotjuggler",
        "PlotJuggler: data exported as CSV",
        needs=["__time", r".*/(angular_velocity|orientation)/x"],
        columns={
            "time": ["__time"],
            "gyroscope": [r".*/angular_velocity/{}"],
            "accelerometer": [r".*/linear_acceleration/{}"],
            "magnetometer": [r".*/magnetic_field/{}"],
            "estimate": [r".*/orientation/{}"],
            "position": [r".*/position/{}"],
        },
        units={"time": "s", "gyroscope": "rad/s", "accelerometer": "m/s2"},
    ),
]
