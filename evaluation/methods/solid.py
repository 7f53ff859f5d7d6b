"""SOLiD (Kim, Choi, Sim, Kim, Park: RA-L 2024), for narrow fields of view.

Points are counted over range and elevation, and over azimuth and elevation.
Each elevation has a weight that grows with its number of points. The weighted
counts over range identify a place at any heading; the weighted counts over
azimuth give the heading.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
import math
from typing import Annotated

import numpy as np
from pydantic import Field, PositiveFloat, PositiveInt, model_validator

from evaluation.base import poses
from evaluation.drives import LidarField
from evaluation.maps import Z_ORIGIN, downsample
from evaluation.methods.method import Method, MethodConfig
from evaluation.methods.registry import register

# Field of view of the `cns` preset's LiDAR [S].
_CNS = LidarField(32, -22.5, 22.5)


class SolidConfig(MethodConfig):
    """Settings of SOLiD.

    Letters in brackets name the source of a value: [P] stands for the authors'
    Python program, [C] for their C++ program, [S] for the data sheet of the
    `cns` LiDAR.

    Attributes:
        voxel_size: side of the voxels to which each cloud is first downsampled
            [m]; [P] 1.0. ([C] has 0.4, but only [P] is for LiDARs with a field
            of view like that of `cns`.)
        min_range: smallest range of a point that is used [m]; [P] 3.
        max_range: largest range of a point that is used [m]; [P] 80, for a
            LiDAR with a field of view like that of `cns`.
        ranges: number of bins of equal length in range, from 0 to `max_range`;
            [P], [C] 40.
        azimuths: number of equal cells of azimuth, over 360 deg; [P], [C] 60.
        elevations: number of equal cells of elevation over the field of view;
            [P], [C] the number of beams of the LiDAR. By default that of the
            drive's LiDAR, or 32 if its model is unknown [S].
        lowest_deg: lower limit of the field of view [deg]. By default that of
            the drive's LiDAR, or -22.5 if its model is unknown [S].
        highest_deg: upper limit of the field of view [deg]. By default that of
            the drive's LiDAR, or 22.5 if its model is unknown [S].
    """

    voxel_size: PositiveFloat = 1.0
    min_range: Annotated[float, Field(ge=0.0)] = 3.0
    max_range: PositiveFloat = 80.0
    ranges: PositiveInt = 40
    azimuths: PositiveInt = 60
    elevations: PositiveInt | None = None
    lowest_deg: Annotated[float, Field(ge=-90.0, le=90.0)] | None = None
    highest_deg: Annotated[float, Field(ge=-90.0, le=90.0)] | None = None

    @model_validator(mode="after")
    def _limits_are_in_order(self) -> SolidConfig:
        if self.min_range >= self.max_range:
            raise ValueError("min_range must be below max_range")
        field = self.field()
        if field.lowest_deg >= field.highest_deg:
            raise ValueError("lowest_deg must be below highest_deg")
        return self

    def field(self, lidar: LidarField = _CNS) -> LidarField:
        """Returns the number of rings and the elevation limits [deg] to use.

        These are the LiDAR's own values, except where the settings
        `elevations`, `lowest_deg` and `highest_deg` replace them.

        Args:
            lidar: number of rings of the LiDAR, and lowest and highest
                elevation [deg].
        """
        low, high = self.lowest_deg, self.highest_deg
        return LidarField(
            lidar.rings if self.elevations is None else self.elevations,
            lidar.lowest_deg if low is None else low,
            lidar.highest_deg if high is None else high,
        )


@dataclass(frozen=True)
class Solid:
    """Descriptor of one scan.

    Attributes:
        ranges: (ranges,) weighted counts over range (R-SOLiD).
        azimuths: (azimuths,) weighted counts over azimuth (A-SOLiD).
    """

    ranges: np.ndarray
    azimuths: np.ndarray


@dataclass(frozen=True)
class SolidDatabase:
    """Descriptors of D places.

    Attributes:
        ranges: (D, ranges) range descriptors, scaled to unit length; NaN for a
            place without points.
        azimuths: (D, azimuths) azimuth descriptors.
    """

    ranges: np.ndarray
    azimuths: np.ndarray


@register("solid")
class SolidMethod(Method[Solid, SolidDatabase]):
    """SOLiD; the score of two scans is the cosine of their range descriptors.

    Where this method differs from the authors' programs:

    - An elevation outside the field of view counts in the outermost cell. In
      [P] (the authors' Python program), elevations below the field of view wrap
      around to the top. [C] (their C++ program) reads outside its table if
      elevations are more than one cell too low.
    - Coordinates that are exactly zero stay zero; the programs replace them
      by 1 mm.
    - If all elevations have the same number of points, all weights are 1 (the
      programs divide by zero).
    - A place without points within range is never a candidate, and a query
      without such points has no candidates.
    """

    title = "SOLiD"
    style = ("#CC79A7", ":", "D")
    source = "Kim, Choi, Sim, Kim, Park: RA-L 2024"
    standard = True
    order = 2
    Config = SolidConfig
    skips_places = True
    divides = True
    config: SolidConfig

    def for_lidar(self, field: LidarField | None) -> SolidMethod:
        if field is None:
            return self
        names = "elevations", "lowest_deg", "highest_deg"
        own = dict(zip(names, self.config.field(field), strict=True))
        return type(self)(self.config.model_copy(update=own))

    def assumption(self, field: LidarField | None) -> str | None:
        config = self.config
        given = config.elevations, config.lowest_deg, config.highest_deg
        if field is not None or None not in given:
            return None
        elevations, lowest_deg, highest_deg = config.field()
        return (
            f"solid: the LiDAR is not known; taken for one of {elevations}"
            f" beams from {lowest_deg:g} to {highest_deg:g} deg (--set"
            " elevations=N --set lowest_deg=DEG --set highest_deg=DEG)"
        )

    def describe(self, points: np.ndarray) -> Solid:
        config = self.config
        elevations, lowest_deg, highest_deg = config.field()
        x, y, z = self._downsampled_within_range(points).T
        r = np.hypot(x, y)
        # Rounding can put a value on the limit.
        range_cell = np.minimum(
            (r * (config.ranges / config.max_range)).astype(np.int64),
            config.ranges - 1,
        )
        turns = np.arctan2(y, x) / (2.0 * math.pi) % 1.0
        azimuth_cell = np.minimum(
            (turns * config.azimuths).astype(np.int64), config.azimuths - 1
        )
        field_of_view = highest_deg - lowest_deg
        height = np.rad2deg(np.arctan2(z, r)) - lowest_deg
        elevation_cell = np.clip(
            np.floor(height * (elevations / field_of_view)), 0, elevations - 1
        ).astype(np.int64)
        over_range = _counts_by_cell(
            range_cell, config.ranges, elevation_cell, elevations
        )
        over_azimuth = _counts_by_cell(
            azimuth_cell, config.azimuths, elevation_cell, elevations
        )
        weights = _elevation_weights(over_range.sum(axis=0))
        return Solid(over_range @ weights, over_azimuth @ weights)

    def build_database(self, places: Sequence[Solid]) -> SolidDatabase:
        return SolidDatabase(
            ranges=_unit(np.stack([place.ranges for place in places])),
            azimuths=np.stack([place.azimuths for place in places]),
        )

    def score(
        self, query: Solid, database: SolidDatabase, *, exhaustive: bool = False
    ) -> np.ndarray:
        del exhaustive  # Always true here.
        return (database.ranges * _unit(query.ranges)).sum(axis=1)

    def relative_pose(
        self, query: Solid, database: SolidDatabase, place: int
    ) -> np.ndarray | None:
        """Returns the query's heading relative to a place, as a pose (4, 4).

        The heading is a multiple of a cell of azimuth; the translation is zero.
        The result is None if one of the two scans has no points within range.
        """
        azimuths = database.azimuths[place]
        if not (query.azimuths.any() and azimuths.any()):
            return None
        num_cells = len(azimuths)
        cell = np.arange(num_cells)
        rolled = azimuths[(cell - cell[:, None]) % num_cells]
        shift = int(np.abs(query.azimuths - rolled).sum(axis=1).argmin())
        # What the place sees at azimuth a, the query sees at a + shift.
        return poses.yaw_pose(-2.0 * math.pi * shift / num_cells)

    def _downsampled_within_range(self, points: np.ndarray) -> np.ndarray:
        """Returns the downsampled points within range.

        As in the authors' Python program, the voxels begin half a voxel below
        the least coordinates.
        """
        config = self.config
        # One column at a time: NumPy reduces slowly along a short axis.
        x, y, z = points.T
        distance = np.sqrt(x * x + y * y + z * z)
        within = points.compress(
            (config.min_range < distance) & (distance < config.max_range),
            axis=0,
        )
        if len(within) == 0:
            return within
        least = np.array([column.min() for column in within.T])
        first = least - 0.5 * config.voxel_size
        # The grid of `downsample` goes through the origin in x and y, not in z.
        offset = first - [0.0, 0.0, Z_ORIGIN]
        return downsample(within - offset, config.voxel_size) + offset


def _counts_by_cell(
    rows: np.ndarray, num_rows: int, columns: np.ndarray, num_columns: int
) -> np.ndarray:
    """Returns how many points fall into each cell, (num_rows, num_columns)."""
    return np.bincount(
        rows * num_columns + columns, minlength=num_rows * num_columns
    ).reshape(num_rows, num_columns)


def _elevation_weights(counts: np.ndarray) -> np.ndarray:
    """Returns weights: counts, scaled from 0 (least) to 1 (greatest)."""
    least, most = counts.min(), counts.max()
    if least == most:
        return np.ones(len(counts))
    return (counts - least) / (most - least)


def _unit(vectors: np.ndarray) -> np.ndarray:
    """Returns vectors (..., n) of unit length; NaN for vectors of length 0."""
    norms = np.linalg.norm(vectors, axis=-1, keepdims=True)
    return vectors / np.where(norms > 0.0, norms, np.nan)
