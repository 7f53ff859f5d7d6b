"""Measurement errors of ideal returns: noise, losses, rounding."""

from dataclasses import dataclass
from enum import Enum
import sys
from typing import NamedTuple

import numpy as np

from cns_drake.sensors.noise_draws import check_seed, noise_generator
from evaluation.base import check_fields, exp32

# Intensity falls with distance as in CARLA's ray-cast LiDAR with its default
# atmosphere: exp(-a d), a = 0.004 / m (docs/ref_sensors of CARLA).
_ATTENUATION_PER_M = 0.004
# Step of the intensities of a LiDAR with finite resolution: 12 bits.
_INTENSITY_STEP = 2.0**-12
# Beams reach this many standard deviations beyond the maximum range, since
# noise can bring a surface there into range. A million frames of noise contain
# no larger deviation.
_FARTHEST_NOISE = 8.0
# Purposes of random numbers. Each purpose has its own stream, so that switching
# one option does not change the draws of the others.
_RANGE_NOISE, _DROPOUT = range(2)


class Echoes(str, Enum):
    """Which echoes of a beam a LiDAR reports.

    `DUAL` stands for the strongest and the last echo.
    """

    FIRST = "first"
    STRONGEST = "strongest"
    LAST = "last"
    DUAL = "dual"


class Returns(NamedTuple):
    """The N returns of a scan, in the order in which their beams fired.

    Attributes:
        beams: (N,) int index of the beam of each return.
        ranges: (N,) float32 measured ranges [m].
        intensity: (N,) float32, at most 1.
    """

    beams: np.ndarray
    ranges: np.ndarray
    intensity: np.ndarray


@dataclass(frozen=True)
class MeasurementModel:
    """The noise, losses and rounding of a LiDAR; by default there are none.

    Random numbers depend only on `seed`, `sensor_name` and the number of the
    frame. Random numbers are sampled for every beam, whether the beam hits a
    surface or not. The noise of a beam therefore does not depend on earlier
    computations, or on the geometry that other beams hit.

    Attributes:
        resolution: step of the rounded coordinates [m]; intensities are rounded
            to 12 bits. With 0, neither is rounded. With a step that is a power
            of two, coordinates are exact in float32 and compress well.
        range_noise: standard deviation of the Gaussian error of a range,
            along the beam and before rounding [m].
        dropout: probability that a return is lost.
        faint_dropout: additional probability that a return of intensity 0 is
            lost. The probability falls linearly with intensity, to 0 for a
            return of intensity 1.
        seed: seed of the noise.
        sensor_name: distinguishes the noise of several LiDARs.

    Example:
        from cns_drake import MeasurementModel

        noisy = MeasurementModel(range_noise=0.02, dropout=0.01, seed=7)
    """

    resolution: float = 0.0
    range_noise: float = 0.0
    dropout: float = 0.0
    faint_dropout: float = 0.0
    seed: int = 0
    sensor_name: str = ""

    def __post_init__(self) -> None:
        """Checks the values.

        Raises:
            TypeError: a value is of another type.
            ValueError: a value is out of range.
        """
        check_fields(self)
        for name, most, kind in (
            ("resolution", sys.float_info.max, "length"),
            ("range_noise", sys.float_info.max, "length"),
            ("dropout", 1.0, "probability"),
            ("faint_dropout", 1.0, "probability"),
        ):
            value = getattr(self, name)
            if not 0.0 <= value <= most:
                raise ValueError(f"{name}: {value!r} is not a {kind}")
        check_seed(self.seed)

    @property
    def is_random(self) -> bool:
        """Whether two scans of the same geometry from one pose can differ."""
        return max(self.range_noise, self.dropout, self.faint_dropout) > 0.0

    def reach(self, max_range: float) -> float:
        """Returns how far rays must be cast [m], given the maximum range [m].

        The result exceeds the maximum range even without noise, so that the
        exact limit is applied by `measure` and does not depend on the ray
        caster's rounding.
        """
        return max_range * (1.0 + 1e-5) + _FARTHEST_NOISE * self.range_noise

    def measure(
        self,
        true_ranges: np.ndarray,
        min_range: float,
        max_range: float,
        frame: int,
    ) -> Returns:
        """Returns the returns that the LiDAR reports, given exact ranges.

        Args:
            true_ranges: (num_beams,) float32 distance to the nearest surface
                along each beam in firing order [m], inf if there is none.
            min_range: least measured range of a return [m].
            max_range: greatest measured range of a return [m].
            frame: number of the frame, on which the random numbers depend.
        """
        ranges = true_ranges
        num_beams = len(true_ranges)
        if self.range_noise > 0.0:
            error = self._make_generator(_RANGE_NOISE, frame).standard_normal(
                num_beams, np.float32
            )
            ranges = ranges + np.float32(self.range_noise) * error
        beams = np.flatnonzero((ranges >= min_range) & (ranges <= max_range))
        measured = ranges.take(beams)
        # The brightness of a surface depends on its true distance.
        distance = measured
        if ranges is not true_ranges:
            distance = true_ranges.take(beams)
        intensity = exp32(-_ATTENUATION_PER_M * distance)
        if self.dropout > 0.0 or self.faint_dropout > 0.0:
            draw = self._make_generator(_DROPOUT, frame).random(num_beams)[
                beams
            ]
            survival = (1.0 - self.dropout) * (
                1.0 - self.faint_dropout * (1.0 - intensity.astype(float))
            )
            kept = draw < survival
            beams, measured = beams[kept], measured[kept]
            intensity = intensity[kept]
        if self.resolution > 0.0:
            step = np.float32(_INTENSITY_STEP)
            intensity = np.rint(intensity / step) * step
        return Returns(beams, measured, intensity)

    def _make_generator(self, purpose: int, frame: int) -> np.random.Generator:
        return noise_generator(self.seed, self.sensor_name, purpose, frame)


# An ideal LiDAR measures exactly.
IDEAL = MeasurementModel()
