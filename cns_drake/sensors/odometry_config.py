"""The description of odometry, which is read without Drake."""

from evaluation.base import Section


class OdometrySection(Section):
    """How often the vehicle's ground-truth motion is recorded.

    Attributes:
        rate: messages per second [Hz]: a multiple of the fastest LiDAR's rate,
            at most 1000, and a whole number of nanoseconds apart. By default
            one per scan.
    """

    rate: int | None = None
