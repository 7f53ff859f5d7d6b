"""Exact overlap of the scans of two simulated drives.

For simulated drives, rays cast in the world decide which points of a query's
scan the place's sensor sees (see `evaluation.recognition.overlap_truth`). A
point is seen if

- it is within the ranges of the LiDAR and of the protocol, - the place's beams
cover its direction, - nothing hides it, and a surface lies within `TOLERANCE`
of it on the line of sight.

The place's sensor sees the world of its own drive, with that drive's stage and
traffic.
"""

from dataclasses import dataclass
import math

import numpy as np
from pydrake.math import RigidTransform

from cns_drake.base.progress import Track, silent
from cns_drake.ray_casting.ray_casting_scene import RayCastingScene
from cns_drake.sensors.lidar.patterns import BeamCoverage, BeamPattern
from cns_drake.simulation.simulated_drive import SimulatedDrive
from evaluation.drives import Drive, check_same_world
from evaluation.drives.sampling import within_range
from evaluation.recognition.overlap_truth import overlap_matrix
from evaluation.recognition.protocol import RetrievalProtocol
from evaluation.recognition.seen_surfaces import TOLERANCE


@dataclass(frozen=True)
class VisibleSurfaces:
    """The surfaces that a LiDAR sees from a place of a simulated drive.

    Points with a coordinate beyond `max_range` [m] in its frame are left out.
    """

    scene: RayCastingScene
    X_WS: RigidTransform
    pattern: BeamPattern
    coverage: BeamCoverage
    max_range: float

    @property
    def reach(self) -> float:
        """Distance of the farthest visible surface [m]."""
        return min(self.pattern.max_range, math.sqrt(3.0) * self.max_range)

    def share_of(self, points: np.ndarray) -> float:
        """Returns which share of points (N, 3) is visible.

        Points are in the sensor's frame [m].
        """
        if len(points) == 0:
            return math.nan
        kept = points[within_range(points, self.max_range)]
        distances = np.linalg.norm(kept, axis=1)
        reached = (distances >= self.pattern.min_range) & (
            distances <= self.pattern.max_range
        )
        kept, distances = kept[reached], distances[reached]
        d_Sset = kept / distances[:, None]
        covered = self.coverage.covers(d_Sset)
        hits = self.scene.cast_rays(
            self.X_WS.translation(),
            d_Sset[covered],
            self.pattern.max_range,
            R_WSset=self.X_WS.rotation().matrix(),
        )
        is_seen = np.abs(hits.ranges - distances[covered]) <= TOLERANCE
        return float(is_seen.sum() / len(points))


def exact_overlaps(
    database: SimulatedDrive,
    query: Drive,
    protocol: RetrievalProtocol,
    track: Track = silent,
) -> np.ndarray:
    """Returns the exact overlap of every query with every place, (Q, D).

    NaN for a query without a point.

    Raises:
        InputError: the two are of different maps.
    """
    check_same_world(database, query)
    pattern = database.pattern
    first = BeamCoverage(pattern.beams(0).d_Sset)

    def see(frame: int) -> VisibleSurfaces:
        coverage = first
        if not pattern.repeats:
            coverage = BeamCoverage(pattern.beams(frame).d_Sset)
        return VisibleSurfaces(
            *database.look(frame), pattern, coverage, protocol.max_range
        )

    return overlap_matrix(database, query, protocol, track, see)
