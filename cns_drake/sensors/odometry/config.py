"""The description of odometry."""

from cns_drake.sensors.sensor_config import Section


class OdometrySection(Section):
    """The rate at which the exact motion of the vehicle is recorded.

    Attributes:
        rate: messages per second, at most 1000: a multiple of the fastest
            LiDAR's rate that divides 1,000,000,000 ns, such as 100; by default
            one message per scan.
    """

    rate: int | None = None
