"""The motion of a group of geometry during a cast."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.spatial.transform import Rotation

# Largest rotation in a step: Embree takes the shorter way between orientations.
_LARGEST_STEP_RAD = 2.0
# The most time steps that Embree supports.
_MOST_STEPS = 129


class Motion(NamedTuple):
    """A frame F that keeps its velocities for a turn, in the frame O.

    Attributes:
        w: angular velocity [rad/s].
        v: velocity of F's origin [m/s].
        duration: of the turn [s].
    """

    w: np.ndarray
    v: np.ndarray
    duration: float

    @property
    def num_steps(self) -> int:
        """Number of poses, at even times, that Embree needs.

        Raises:
            ValueError: F turns too fast.
        """
        angle = float(np.linalg.norm(self.w)) * self.duration
        steps = 1 + max(1, int(np.ceil(angle / _LARGEST_STEP_RAD)))
        if steps > _MOST_STEPS:
            raise ValueError(
                f"a body turns {angle:.0f} rad while the LiDAR does once"
            )
        return steps

    def at(self, times: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Returns the motion of F since the start of the turn.

        Args:
            times: (N,) parts of the turn, from 0 to 1.

        Returns:
            (N, 3, 3) rotations, and (N, 3) displacements of F's origin.
        """
        t = (self.duration * np.asarray(times, float))[:, None]
        return Rotation.from_rotvec(t * self.w).as_matrix(), t * self.v
