"""Random initial poses, from which scans are localised."""

from dataclasses import dataclass
import math

import numpy as np

from cns_drake.base.errors import InputError

# Greatest distance of a start [m]; beyond it lies place recognition.
FARTHEST_START = 50.0


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
