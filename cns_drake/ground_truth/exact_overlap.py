"""Exact overlap of the scans of two simulated drives.

For simulated drives, rays cast in the world decide which points of a query's
scan the place's sensor sees (see `evaluation.recognition.overlap_truth`). A
point is seen if

- the point is within the ranges of the LiDAR and of the protocol,
- the place's beams cover its direction,
- nothing occludes the point, and a surface lies within `TOLERANCE` of the point
  on the line of sight.

The place's sensor sees the world of its own drive, with the stage and the
traffic of this drive.
"""

from collections.abc import Callable
from dataclasses import dataclass
import functools
import math
from pathlib import Path

import numpy as np
from pydrake.math import RigidTransform

from cns_drake.export import claim_folder
from cns_drake.ray_casting import RayCastingScene
from cns_drake.scenarios import Scenario
from cns_drake.sensors import BeamCoverage, BeamPattern
from cns_drake.simulation import SimulatedDrive, SimulationSource
from evaluation.drives import Drive, check_same_world, within_cube
from evaluation.recognition import (
    TOLERANCE,
    RetrievalProtocol,
    compared_frames,
    overlap_matrix,
    write_overlaps,
)


@dataclass(frozen=True)
class Sight:
    """A LiDAR at a place of a simulated drive, and the world around it.

    Attributes:
        scene: the world, on which rays can be cast.
        X_WS: pose of the LiDAR.
        pattern: directions and ranges of its beams.
        coverage: directions that the beams cover.
    """

    scene: RayCastingScene
    X_WS: RigidTransform
    pattern: BeamPattern
    coverage: BeamCoverage

    def reached(
        self, p_S: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Returns the points that the beams of the LiDAR can reach.

        These points are within the LiDAR's ranges and in its field of view.
        Surfaces that occlude them are not considered.

        Args:
            p_S: (N, 3) points in the LiDAR's frame S [m].

        Returns:
            (K,) row numbers of these points; (K, 3) unit directions to them in
            S; and (K,) their distances [m].
        """
        distances = np.linalg.norm(p_S, axis=1)
        rows = np.flatnonzero(
            (distances >= self.pattern.min_range)
            & (distances <= self.pattern.max_range)
        )
        d_Sset = p_S[rows] / distances[rows, None]
        covered = self.coverage.covers(d_Sset)
        rows = rows[covered]
        return rows, d_Sset[covered], distances[rows]


def sights_of(drive: SimulatedDrive) -> Callable[[int], Sight]:
    """Returns a function that returns the `Sight` at a frame of a drive.

    The argument of the returned function is the number of the frame. A `Sight`
    is valid until the next call of the function.

    Args:
        drive: the drive.
    """

    @functools.lru_cache(maxsize=1)
    def coverage(turn: int) -> BeamCoverage:
        return BeamCoverage(drive.pattern.beams(turn).d_Sset)

    return lambda frame: Sight(
        *drive.look(frame),
        drive.pattern,
        coverage(0 if drive.pattern.repeats else frame),
    )


@dataclass(frozen=True)
class VisibleSurfaces:
    """The surfaces that a LiDAR sees from a place.

    Points with a coordinate beyond `half_extent` [m] in the LiDAR's frame do
    not count as seen.
    """

    sight: Sight
    half_extent: float

    @property
    def reach(self) -> float:
        """Distance of the farthest visible surface [m]."""
        farthest = self.sight.pattern.max_range
        return min(farthest, math.sqrt(3.0) * self.half_extent)

    def share_of(self, points: np.ndarray) -> float:
        """Returns the share of points that the LiDAR sees; NaN without points.

        Args:
            points: (N, 3) points in the LiDAR's frame [m].
        """
        if len(points) == 0:
            return math.nan
        kept = points[within_cube(points, self.half_extent)]
        _, d_Sset, distances = self.sight.reached(kept)
        X_WS = self.sight.X_WS
        hits = self.sight.scene.cast_rays(
            X_WS.translation(),
            d_Sset,
            self.sight.pattern.max_range,
            R_WSset=X_WS.rotation().matrix(),
        )
        is_seen = np.abs(hits.ranges - distances) <= TOLERANCE
        return float(is_seen.sum() / len(points))


def exact_overlaps(
    database: SimulatedDrive,
    query: Drive,
    protocol: RetrievalProtocol,
) -> np.ndarray:
    """Returns the exact overlap of Q queries with D places, (Q, D).

    The overlap is the share of a query's points that the LiDAR at the place
    sees. The overlap is NaN for a query without points.

    Args:
        database: the drive of the places, in whose world rays are cast.
        query: the drive of the queries, through the same map.
        protocol: protocol that determines queries, places and range.

    Raises:
        InputError: the drives are through different maps.
    """
    check_same_world(database, query)
    look = sights_of(database)
    return overlap_matrix(
        database,
        query,
        protocol,
        lambda frame: VisibleSurfaces(look(frame), protocol.half_extent),
    )


def write_overlap_table(
    database: Scenario,
    query: Scenario,
    output: Path,
    protocol: RetrievalProtocol,
) -> Path:
    """Writes the exact overlap of each query with each place, as CSV.

    The overlap is the share of a query's points that the LiDAR at the place
    sees. The file is `<output>/overlaps.csv`.

    Args:
        database: the drive of the places, in whose city rays are cast.
        query: the drive of the queries.
        output: the folder, which is created if it does not exist.
        protocol: protocol that determines queries, places and range.

    Raises:
        InputError: the drives are through different maps or cannot be
            simulated, or the folder contains anything but an earlier table, or
            cannot be written.
    """
    content = {"overlaps.csv": "overlap of each query with each place"}
    claim_folder(output, "overlap-table", content)
    places, queries = (SimulationSource(one)() for one in (database, query))
    found = exact_overlaps(places, queries, protocol)
    path = output / "overlaps.csv"
    frames = compared_frames(places, queries, protocol)
    write_overlaps(path, *frames, found)
    return path
