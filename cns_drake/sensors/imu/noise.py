"""What an IMU measures: its samples, and their errors by their numbers."""

from dataclasses import dataclass
from functools import lru_cache
import math
import sys

import numpy as np

from cns_drake.sensors.noise_draws import check_seed, noise_generator
from evaluation.base import check_fields

# The measurements of an IMU, in the order of the columns of its errors.
MEASUREMENTS = ("specific_force", "angular_velocity")
# Tolerance for the rounding of a sample's time, in periods.
_TOLERANCE = 1e-6
# Purposes of random numbers. They differ from a LiDAR's purposes, since an IMU
# and a LiDAR in a user's diagram may have the same name.
_TURN_ON, _WHITE, _WALK_AT_BLOCK, _WALK_STEPS = range(16, 20)
# Number of samples whose random numbers are made at a time.
_BLOCK = 1024
# Blocks of the random walk until its first node: a century at 1,000 samples a
# second.
_FIRST_NODE = 1 << 32


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


@dataclass(frozen=True)
class ImuNoise:
    """The parameters of an IMU's errors; by default there are no errors.

    The model is Kalibr's: a measurement is the true value plus white noise n
    plus a bias b that is a random walk. For samples dt apart, n has the
    standard deviation density / sqrt(dt), and the standard deviation of b's
    increment is random_walk * sqrt(dt) (Kalibr, "IMU noise model"). The errors
    of a sensor's three axes are independent and equally large.

    Attributes:
        accelerometer_noise_density: density of the white noise
            [m/s^2/sqrt(Hz)].
        accelerometer_random_walk: random walk of the bias [m/s^3/sqrt(Hz)].
        gyroscope_noise_density: density of the white noise [rad/s/sqrt(Hz)].
        gyroscope_random_walk: random walk of the bias [rad/s^2/sqrt(Hz)].
        accelerometer_turn_on_bias: standard deviation of the bias at time
            zero [m/s^2].
        gyroscope_turn_on_bias: standard deviation of the bias at time zero
            [rad/s].
        accelerometer_range: greatest specific force that an axis measures, in
            either direction [m/s^2].
        gyroscope_range: greatest angular velocity that an axis measures, in
            either direction [rad/s].
        seed: seed of all random numbers.
        sensor_name: distinguishes the errors of several IMUs. `add_imu`
            replaces the default by its own `name`.

    Raises:
        TypeError: a value is of another type.
        ValueError: a value is negative or not a number, or a density, random
            walk or bias is infinite.

    Example:
        from cns_drake import ImuNoise

        noise = ImuNoise(gyroscope_noise_density=1e-3, seed=7)
    """

    accelerometer_noise_density: float = 0.0
    accelerometer_random_walk: float = 0.0
    gyroscope_noise_density: float = 0.0
    gyroscope_random_walk: float = 0.0
    accelerometer_turn_on_bias: float = 0.0
    gyroscope_turn_on_bias: float = 0.0
    accelerometer_range: float = np.inf
    gyroscope_range: float = np.inf
    seed: int = 0
    sensor_name: str = "imu"

    def __post_init__(self) -> None:
        check_fields(self)
        check_seed(self.seed)
        for name, value in vars(self).items():
            if name in ("seed", "sensor_name"):
                continue
            most = np.inf if name.endswith("_range") else sys.float_info.max
            if not 0.0 <= value <= most:
                raise ValueError(f"{name}: {value!r} is not a number from 0 on")

    def variances(self, rate: float) -> tuple[float, float]:
        """Returns the variances of the white noise at a sample rate.

        Args:
            rate: samples per second [1/s].

        Returns:
            Variances of the specific force [m^2/s^4] and of the angular
            velocity [rad^2/s^2], for each axis.
        """
        return (
            self.accelerometer_noise_density**2 * rate,
            self.gyroscope_noise_density**2 * rate,
        )


class ImuErrors:
    """The errors of an IMU, which can be computed for any sample at any time.

    The error of a sample depends only on its number, and not on which samples
    were computed before. For this, the random walk of the bias is sampled by
    halving intervals (Levy's construction of Brownian motion).
    """

    def __init__(self, noise: ImuNoise, rate: float):
        """Prepares the errors.

        Args:
            noise: parameters of the errors.
            rate: samples per second.
        """
        self._noise = noise
        pairs = (
            (noise.accelerometer_noise_density, noise.gyroscope_noise_density),
            (noise.accelerometer_random_walk, noise.gyroscope_random_walk),
            (noise.accelerometer_turn_on_bias, noise.gyroscope_turn_on_bias),
            (noise.accelerometer_range, noise.gyroscope_range),
        )
        white, walk, turn_on, self._range = np.repeat(pairs, 3, axis=1)
        self._white = white * np.sqrt(rate)
        self._walk = walk / np.sqrt(rate)
        self._turn_on = turn_on * self._draw_normals(_TURN_ON, 0, 1)[0]
        # Threads may share the errors.
        self._block = lru_cache(maxsize=4)(self._calc_block)

    def measure(self, first: int, exact: np.ndarray) -> np.ndarray:
        """Returns exact samples with the errors of the IMU added.

        Args:
            first: number of the first sample; sample 0 is at time zero.
            exact: (N, 6) specific force [m/s^2] and angular velocity [rad/s] of
                consecutive samples.

        Returns:
            (N, 6) in the same order, limited to the ranges of the sensors.
        """
        measured = exact + self._errors_from(first, len(exact))
        return np.minimum(np.maximum(measured, -self._range), self._range)

    def _errors_from(self, first: int, count: int) -> np.ndarray:
        """Returns the errors (count, 6) of consecutive samples."""
        parts = []
        for number in range(first // _BLOCK, (first + count - 1) // _BLOCK + 1):
            start = first - number * _BLOCK
            parts.append(self._block(number)[max(start, 0) : start + count])
        return np.concatenate(parts)

    def _calc_block(self, number: int) -> np.ndarray:
        """Returns the (1024, 6) errors from sample 1024 * number onwards.

        The columns are specific force [m/s^2] and angular velocity [rad/s].
        """
        errors = np.tile(self._turn_on, (_BLOCK, 1))
        if self._walk.any():
            errors += self._walk * self._walk_in_block(number)
        if self._white.any():
            errors += self._white * self._draw_normals(_WHITE, number, _BLOCK)
        return errors

    def _walk_in_block(self, number: int) -> np.ndarray:
        """Returns a block (1024, 6) of a walk with standard normal steps."""
        start = self._walk_at_block(number)
        end = self._walk_at_block(number + 1)
        steps = self._draw_normals(_WALK_STEPS, number, _BLOCK)
        free = np.vstack([np.zeros(6), np.cumsum(steps, axis=0)])
        # The walk has given values at both ends of the block: a straight line
        # is added to a free walk so that it ends at the right value.
        part = np.arange(_BLOCK)[:, None] / _BLOCK
        return start + free[:-1] + part * (end - start - free[-1])

    def _walk_at_block(self, number: int) -> np.ndarray:
        """Returns the walk (6,) at the start of a block."""
        low, high = 0, _FIRST_NODE if number > 0 else -_FIRST_NODE
        at_low = np.zeros(6)
        at_high = np.sqrt(_BLOCK * _FIRST_NODE) * self._walk_node(high)
        while abs(number) >= abs(high):
            low, at_low = high, at_high
            high *= 2
            spread = np.sqrt(_BLOCK * abs(low))
            at_high = at_low + spread * self._walk_node(high)
        while number != low:
            middle = (low + high) // 2
            spread = 0.5 * np.sqrt(_BLOCK * abs(high - low))
            node = self._walk_node(middle)
            at_middle = (at_low + at_high) / 2 + spread * node
            if abs(number) < abs(middle):
                high, at_high = middle, at_middle
            else:
                low, at_low = middle, at_middle
        return at_low

    def _walk_node(self, block: int) -> np.ndarray:
        """Returns the standard normal numbers (6,) of the start of a block."""
        return self._draw_normals(_WALK_AT_BLOCK, block, 1)[0]

    def _draw_normals(self, purpose: int, index: int, count: int) -> np.ndarray:
        """Returns (count, 6) standard normal numbers."""
        generator = noise_generator(
            self._noise.seed, self._noise.sensor_name, purpose, index
        )
        return generator.standard_normal((count, 6))
