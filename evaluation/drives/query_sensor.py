"""Queries as a turned sensor, or one beside a truck, would have seen them."""

from __future__ import annotations

from dataclasses import dataclass
import math

import numpy as np
from scipy.spatial.transform import Rotation

from cns_drake.base.poses import make_pose


@dataclass(frozen=True, eq=False)
class QuerySensor:
    """A sensor Q that sees a query otherwise than the recorded sensor S.

    Both are at one position.

    Attributes:
        X_SQ: (4, 4) a rotation; None if Q is not turned.
        hidden_from: azimuth in S at which the hidden sector begins [rad].
        hidden: angle of that sector [rad].
    """

    X_SQ: np.ndarray | None = None
    hidden_from: float = 0.0
    hidden: float = 0.0

    @classmethod
    def draw(
        cls,
        seed: int,
        frame: int,
        turns: bool,
        tilt_deg: float,
        hidden_deg: float,
    ) -> QuerySensor:
        """Draws the sensor of a query.

        All drives have the same draw at a frame, so that a query of a drive and
        the same query of its control are turned alike. Each effect has the same
        draw with the others as without.

        Args:
            seed: of the drawing.
            frame: frame of the query.
            turns: whether it has any yaw.
            tilt_deg: greatest roll, and greatest pitch [deg].
            hidden_deg: angle of the hidden sector [deg].
        """
        rng = np.random.default_rng([seed, frame])
        yaw, hidden_from = rng.uniform(0.0, 2.0 * math.pi, 2)
        pitch, roll = rng.uniform(-1.0, 1.0, 2) * math.radians(tilt_deg)
        X_SQ = None
        if turns or tilt_deg > 0.0:
            angles = [yaw if turns else 0.0, pitch, roll]
            R_SQ = Rotation.from_euler("ZYX", angles).as_matrix()
            X_SQ = make_pose(R_SQ, np.zeros(3))
        return cls(X_SQ, float(hidden_from), math.radians(hidden_deg))

    def without_hidden(self, scan: np.ndarray) -> np.ndarray:
        """Returns the points of a scan of S outside the hidden sector."""
        if self.hidden == 0.0:
            return scan
        azimuth = np.arctan2(scan["y"], scan["x"]).astype(np.float64)
        turned = np.mod(azimuth - self.hidden_from, 2.0 * math.pi)
        # A point that is not finite is in no sector.
        return scan[~(turned < self.hidden)]
