"""Random initial poses, from which scans are localised."""

from dataclasses import dataclass
import math
from typing import NamedTuple

import numpy as np
from scipy.spatial.transform import Rotation

from evaluation.base import InputError, poses

# Greatest distance of a start [m]; beyond it lies place recognition.
FARTHEST_START = 50.0


class InitialPose(NamedTuple):
    """An initial pose of the LiDAR, and how it differs from the ground truth.

    Attributes:
        X_WS: (4, 4) the initial pose.
        offset: (3,) vector from the ground-truth to the initial position, in W
            [m].
        turn: (3,) rotation vector from the ground-truth to the initial
            orientation, in S [rad].
    """

    X_WS: np.ndarray
    offset: np.ndarray
    turn: np.ndarray

    @classmethod
    def moved(
        cls, X_WS: np.ndarray, offset: np.ndarray, turn: np.ndarray
    ) -> "InitialPose":
        """Returns the initial pose with a given error.

        Args:
            X_WS: (4, 4) ground-truth pose.
            offset, turn: the error; see `InitialPose`.
        """
        R = Rotation.from_rotvec(turn).as_matrix()
        X = poses.make_pose(X_WS[:3, :3] @ R, X_WS[:3, 3] + offset)
        return cls(X, offset, turn)

    @classmethod
    def compared(cls, X_WS0: np.ndarray, X_WS: np.ndarray) -> "InitialPose":
        """Returns a given initial pose, with its error.

        Args:
            X_WS0: (4, 4) the initial pose.
            X_WS: (4, 4) ground-truth pose.
        """
        R = X_WS[:3, :3].T @ X_WS0[:3, :3]
        turn = Rotation.from_matrix(R).as_rotvec()
        return cls(X_WS0, X_WS0[:3, 3] - X_WS[:3, 3], turn)


@dataclass(frozen=True)
class Starts:
    """How the random initial poses of scans are sampled.

    Attributes:
        radius: distance of each initial position from the ground-truth position
            [m].
        turn_deg: angle between each initial orientation and the ground truth
            [deg].
        seed: seed of the random directions in which initial poses are moved and
            rotated.

    Raises:
        InputError: if a value is out of range.
    """

    radius: float
    turn_deg: float
    seed: int = 0

    def __post_init__(self) -> None:
        if not 0.0 < self.radius <= FARTHEST_START:
            raise InputError(
                f"--start: {self.radius:g} m is not above 0 and up to"
                f" {FARTHEST_START:g}"
            )
        if not 0.0 <= self.turn_deg <= 180.0:
            raise InputError(
                f"--start-turn: {self.turn_deg:g} deg is not from 0 to 180"
            )
        if self.seed < 0:
            raise InputError(f"--seed: {self.seed} is below 0")

    def draw(self, frame: int) -> tuple[np.ndarray, np.ndarray]:
        """Returns the random error of a frame's initial pose.

        Returns:
            (3,) offset of the position in W, in a random direction [m]; (3,)
            rotation about a random axis, as a rotation vector in S [rad].
            Offset and rotation depend only on the seed and the frame.
        """
        rng = np.random.default_rng([self.seed, frame])
        offset, axis = rng.normal(size=(2, 3))
        return (
            self.radius * offset / np.linalg.norm(offset),
            math.radians(self.turn_deg) * axis / np.linalg.norm(axis),
        )
