"""The line that a vehicle follows, and its speed limits."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cns_drake.base.errors import InputError

# A path must be longer than this for a trajectory to be made of it [m].
_MIN_LENGTH = 20.0
# Longest path: planning takes time and memory for each metre [m].
_MAX_LENGTH = 100_000.0


@dataclass(frozen=True)
class LanePath:
    """The middle of the lanes of a drive, evenly sampled.

    Attributes:
        points: (N, 3) positions in the world, first and last included [m].
        spacing: distance between neighbours along the path [m].
        speed_limits: (N,) the limits there, infinite without one [m/s].
    """

    points: np.ndarray
    spacing: float
    speed_limits: np.ndarray

    @property
    def length(self) -> float:
        """Length along the lanes [m]."""
        return self.spacing * (len(self.points) - 1)


def check_length(length: float, source: object) -> None:
    """Checks the length of a path [m].

    Raises:
        InputError: beginning with `source`, if the path is too short or too
            long.
    """
    if length < _MIN_LENGTH:
        raise InputError(
            f"{source}: {length:.1f} m long; a drive needs at least "
            f"{_MIN_LENGTH:.0f} m"
        )
    if length > _MAX_LENGTH:
        raise InputError(
            f"{source}: {length:.0f} m long; a drive can have at most "
            f"{_MAX_LENGTH:.0f} m"
        )


def sample_lane_path(
    points: np.ndarray, speed_limits: np.ndarray, spacing: float, source: object
) -> LanePath:
    """Returns evenly spaced points along a polyline.

    Args:
        points: (N, 3) its corners [m].
        speed_limits: (N,) limit at each corner; on a segment the lower one
            of its two holds [m/s].
        spacing: the distance of the points, rounded so that it divides the
            length of the polyline [m].
        source: the beginning of an error's message.

    Raises:
        InputError: the polyline is too short or too long for a drive.
    """
    steps = np.linalg.norm(np.diff(points, axis=0), axis=1)
    travelled = np.concatenate([[0.0], np.cumsum(steps)])
    length = float(travelled[-1])
    check_length(length, source)
    count = max(1, round(length / spacing))
    wanted = np.linspace(0.0, length, count + 1)
    xyz = [np.interp(wanted, travelled, axis) for axis in points.T]
    # A limit holds from its first point on; between two points the lower one.
    after = np.searchsorted(travelled, wanted).clip(1, len(points) - 1)
    return LanePath(
        points=np.stack(xyz, axis=1),
        spacing=float(wanted[1] - wanted[0]),
        speed_limits=np.minimum(speed_limits[after - 1], speed_limits[after]),
    )
