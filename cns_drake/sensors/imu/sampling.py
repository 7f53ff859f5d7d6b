"""What an IMU measures, and the numbers of its samples at given times."""

import math

# The measurements of an IMU, in the order of the columns of its errors.
MEASUREMENTS = ("specific_force", "angular_velocity")
# Tolerance for the rounding of a sample's time, in periods.
_TOLERANCE = 1e-6


def last_sample(time: float, rate: float) -> int:
    """Returns the number of the last sample up to a time.

    Sample k is taken at the time k / rate.

    Args:
        time: the time [s].
        rate: samples per second.
    """
    return math.floor(time * rate + _TOLERANCE)


def is_sample_time(time: float, rate: float) -> bool:
    """Returns whether a sample is taken at a time [s], up to rounding."""
    return abs(time * rate - last_sample(time, rate)) <= _TOLERANCE
