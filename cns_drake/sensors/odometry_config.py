"""The description of odometry, which is read without Drake."""

from cns_drake.sensors.sensor_config import Section


class OdometrySection(Section):
    """How often the vehicle's ground-truth motion is recorded.

    Attributes:
        rate: messages per second [Hz], such as 100. The rate must be a multiple
            of the fastest LiDAR's rate and at most 1000, and the time between
            two messages must be a whole number of nanoseconds. By default one
            message per scan.
    """

    rate: int | None = None
