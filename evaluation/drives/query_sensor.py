"""A sensor for queries, which can be rotated, tilted and partly occluded."""

from __future__ import annotations

from dataclasses import dataclass
import math

import numpy as np
from scipy.spatial.transform import Rotation

from cns_drake.base import poses


@dataclass(frozen=True, eq=False)
class QuerySensor:
    """A rotated sensor Q that replaces the recorded sensor S in a query.

    Q and S are at the same position. A sector of azimuths can be occluded in Q:
    the points in this sector are removed from the scan.

    Attributes:
        X_SQ: (4, 4) a rotation; None if Q is not rotated.
        hidden_from: azimuth in S at which the occluded sector begins [rad].
        hidden_angle: angle of the occluded sector [rad]; 0 for none.
    """

    X_SQ: np.ndarray | None = None
    hidden_from: float = 0.0
    hidden_angle: float = 0.0

    @classmethod
    def draw(
        cls,
        seed: int,
        frame: int,
        turns: bool,
        tilt_deg: float,
        hidden_deg: float,
    ) -> QuerySensor:
        """Returns a query's sensor with random yaw, tilt and occluded sector.

        The result depends on the frame's number but not on the drive, so that
        queries at the same frames of two drives have the same random yaw and
        tilt.

        Args:
            seed: seed of the random numbers.
            frame: frame of the query.
            turns: whether the query gets a random yaw.
            tilt_deg: greatest roll, and greatest pitch [deg].
            hidden_deg: angle of the occluded sector [deg].
        """
        rng = np.random.default_rng([seed, frame])
        yaw, hidden_from = rng.uniform(0.0, 2.0 * math.pi, 2)
        pitch, roll = rng.uniform(-1.0, 1.0, 2) * math.radians(tilt_deg)
        X_SQ = None
        if turns or tilt_deg > 0.0:
            angles = [yaw if turns else 0.0, pitch, roll]
            R_SQ = Rotation.from_euler("ZYX", angles).as_matrix()
            X_SQ = poses.make_pose(R_SQ, np.zeros(3))
        return cls(X_SQ, float(hidden_from), math.radians(hidden_deg))

    def without_hidden(self, scan: np.ndarray) -> np.ndarray:
        """Returns the points of a scan in S outside the occluded sector."""
        if self.hidden_angle == 0.0:
            return scan
        azimuth = np.arctan2(scan["y"], scan["x"]).astype(np.float64)
        turned = np.mod(azimuth - self.hidden_from, 2.0 * math.pi)
        # Points that are not finite are in no sector.
        return scan[~(turned < self.hidden_angle)]
