"""The line along which a vehicle drives, with the speed limits of the roads."""

from dataclasses import dataclass

import numpy as np

from evaluation.base import InputError, distances_along, power

# A path must be longer than this to become a trajectory [m].
_MIN_LENGTH = 20.0
# Length of the longest path [m]: planning takes time and memory for each metre.
_MAX_LENGTH = 100_000.0
# Distance between control points along the path [m]. The curvature then changes
# over about 10 m, as when a driver turns the wheel. In the tightest bends of a
# town, the path deviates from the middle of the lane by less than 10 cm.
POINT_SPACING = 2.0
# Distance between the points from which a path is interpolated [m].
DENSE_SPACING = 0.25


@dataclass(frozen=True)
class LanePath:
    """The path of a drive along lanes or waypoints, evenly sampled.

    Attributes:
        points: (N, 3) positions in W, from end to end of the path [m].
        spacing: distance between neighbouring points along the path [m].
        speed_limits: (N,) speed limits at the points; infinite where there is
            none [m/s].
        beside: (N, 2) distances to the middles of the left and the right
            neighbouring lane [m]; 0 where there is no such lane, or it has the
            opposite direction. None for a path along waypoints.
    """

    points: np.ndarray
    spacing: float
    speed_limits: np.ndarray
    beside: np.ndarray | None = None

    @property
    def length(self) -> float:
        """Length of the path [m]."""
        return self.spacing * (len(self.points) - 1)


def check_length(length: float, source: object) -> None:
    """Raises an error if a path is too short or too long for a drive.

    Args:
        length: length of the path [m].
        source: text with which the error message begins.

    Raises:
        InputError: the path is too short or too long.
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
    points: np.ndarray,
    speed_limits: np.ndarray,
    spacing: float,
    source: object,
    beside: np.ndarray | None = None,
) -> LanePath:
    """Returns the path along a polyline, with evenly spaced points.

    Args:
        points: (N, 3) corners of the polyline [m].
        speed_limits: (N,) limit at each corner [m/s]. On a segment, the lower
            of the limits at the two corners holds.
        spacing: distance between the points, rounded so that it divides the
            length of the polyline [m].
        source: text with which error messages begin.
        beside: (N, 2) distances to the neighbouring lanes on the left and right
            of each corner [m]; see `worlds.shapes.paths.lane_path.LanePath`.

    Raises:
        InputError: the polyline is too short or too long for a drive.
    """
    travelled = distances_along(points)
    length = float(travelled[-1])
    check_length(length, source)
    count = max(1, round(length / spacing))
    wanted = np.linspace(0.0, length, count + 1)
    xyz = [np.interp(wanted, travelled, axis) for axis in points.T]
    # Index of the corner at which the segment of each point ends.
    after = np.searchsorted(travelled, wanted).clip(1, len(points) - 1)
    if beside is not None:
        beside = np.minimum(beside[after - 1], beside[after])
    return LanePath(
        points=np.stack(xyz, axis=1),
        spacing=float(wanted[1] - wanted[0]),
        speed_limits=np.minimum(speed_limits[after - 1], speed_limits[after]),
        beside=beside,
    )


def smooth_step(u: np.ndarray) -> np.ndarray:
    """Returns the value at u of a quintic polynomial: 0 at u = 0, 1 at u = 1.

    The first and second derivatives of the quintic are zero at both ends.
    """
    return power(u, 3) * (10 - 15 * u + 6 * u**2)
