"""Surfaces that a scan shows, interpolated between its returns.

A scan samples the surfaces around its sensor. The four returns around a
direction, one in each quadrant, determine where the surface lies in that
direction: in the plane of the three returns nearest to the direction or, at
edges and at grazing incidence, between the least and the greatest range of the
four returns.

A comparison with rays cast in the simulated world shows the error of shares of
shown points: some hundredths for scans up to 30 m apart, and more for scans
farther apart (docs/notes/cities.md).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
import math
from typing import NamedTuple

import numpy as np

from evaluation.base import compiled

# Greatest distance of a shown point from a surface [m].
TOLERANCE = 0.2
# A single return within this angle of a direction is enough [deg], because the
# edges of roofs and of the field of view have returns on one side only.
_NEAR_DEG = 0.75
# If one return around a direction is this many times as far as another, they
# are on two surfaces.
_FARTHEST = 3.0
# Returns are looked for in this many cells below and above a direction.
_REACH_UP = 2
# They are looked for in this many cells to each side.
_REACH_ASIDE = 1
# Number of cells in elevation, each 1 deg wide.
_ROWS = 180
# Number of cells in azimuth, each 1 deg wide.
_COLUMNS = 360
# Factor by which squares may exceed a limit because of rounding.
_MARGIN = 1.0 + 1e-9
_UNKNOWN, _SHOWN, _BEHIND = range(3)


class Shares(NamedTuple):
    """The shares of points that a scan shows, and that a scan occludes.

    The shares are NaN without points. A point can be neither shown nor
    occluded, for example in front of all surfaces.

    Attributes:
        shown: share of points on surfaces that the scan shows.
        hidden: share of occluded points, which the scan's sensor cannot see:
            the returns in neighbouring directions are all nearer than the
            point.
    """

    shown: float
    hidden: float


@dataclass(frozen=True)
class SeenSurfaces:
    """The returns of a scan, by direction.

    Attributes:
        points: (N, 3) in the frame of the sensor [m], sorted by cells of
            directions.
        angles_deg: (N, 2) elevation plus 90 deg, and azimuth counted from the
            back.
        starts: index in `points` at which each cell of directions begins, row
            by row; N at the end.
    """

    points: np.ndarray
    angles_deg: np.ndarray
    starts: np.ndarray

    @classmethod
    def of(cls, points: np.ndarray) -> SeenSurfaces:
        """Returns the surfaces that a scan shows.

        Args:
            points: (N, 3) points of the scan in the sensor's frame [m].
        """
        x, y, z = points.T.astype(np.float64)
        elevation = np.degrees(np.arctan2(z, np.hypot(x, y))) + 90.0
        azimuth = np.degrees(np.arctan2(y, x)) + 180.0
        # The directions straight up and straight back are rounded to the upper
        # limit.
        rows = np.minimum(elevation.astype(np.int64), _ROWS - 1)
        cells = rows * _COLUMNS + azimuth.astype(np.int64) % _COLUMNS
        # NumPy sorts these integers by radix.
        order = np.argsort(cells.astype(np.uint16), kind="stable")
        counts = np.bincount(cells, minlength=_ROWS * _COLUMNS)
        return cls(
            points=points.take(order, axis=0).astype(np.float64, copy=False),
            angles_deg=np.stack(
                [elevation.take(order), azimuth.take(order)], axis=1
            ),
            starts=np.concatenate([[0], np.cumsum(counts)]),
        )

    @cached_property
    def reach(self) -> float:
        """Distance of the farthest return [m]."""
        return float(np.linalg.norm(self.points, axis=1).max(initial=0.0))

    def share_of(self, points: np.ndarray) -> float:
        """Returns the share of points on surfaces that the scan shows.

        The result is NaN without points.

        Args:
            points: (N, 3) points in the frame of the scan's sensor [m].
        """
        return self.shares_of(points).shown

    def shares_of(self, points: np.ndarray) -> Shares:
        """Returns which shares of points this scan shows and occludes.

        Args:
            points: (N, 3) points in the frame of the scan's sensor [m].
        """
        if len(points) == 0:
            return Shares(math.nan, math.nan)
        kinds = self._kinds(points)
        return Shares(
            float(np.mean(kinds == _SHOWN)), float(np.mean(kinds == _BEHIND))
        )

    def clearances(self, points: np.ndarray) -> np.ndarray:
        """Returns how far points lie in front of the seen surface, (N,) [m].

        Distances are negative for points behind the surface. Up to four returns
        in directions near the point's direction show where the surface is:

        - Three or more returns with similar ranges: the distance is
          perpendicular to a plane through three of these returns.
        - Fewer returns, or returns from two surfaces at an edge: the distance
          is along the line of sight. If the point is nearer to the sensor than
          all these returns, the distance is measured to the return with the
          least range; if the point is farther than all of them, to the return
          with the greatest range. For a point between the returns, the distance
          is NaN.
        - No return: the result is infinite.

        Args:
            points: (N, 3) points in the sensor's frame [m].
        """
        clearances = np.full(len(points), math.nan)
        self._compare(_measure_clearances, points, clearances)
        return clearances

    def hides(self, points: np.ndarray) -> np.ndarray:
        """Returns which points (N, 3) are behind a seen surface, (N,) bool."""
        return self._kinds(points) == _BEHIND

    def _kinds(self, points: np.ndarray) -> np.ndarray:
        kinds = np.full(len(points), _UNKNOWN, np.int8)
        self._compare(_classify, points, kinds)
        return kinds

    def _compare(
        self, loop: Callable[..., None], points: np.ndarray, result: np.ndarray
    ) -> None:
        """Compares points with the surfaces, in a compiled loop."""
        points = np.ascontiguousarray(points, dtype=np.float64)
        around = np.empty(4, np.int64), np.empty(4)
        loop(points, self.points, self.angles_deg, self.starts, *around, result)


# Few compiled functions, of numbers: each function takes long to compile, and
# so do new arrays, rows of arrays and named tuples.


@compiled
def _look_towards(
    x: float,
    y: float,
    z: float,
    seen: np.ndarray,
    angles: np.ndarray,
    starts: np.ndarray,
    corners: np.ndarray,
    away: np.ndarray,
) -> tuple[int, float, float, float]:
    """Finds the nearest return in each quadrant around a point's direction.

    Args:
        x, y, z: the point [m].
        seen, angles, starts: see `SeenSurfaces`; `seen` are its points.
        corners: (4,) indices of the returns, -1 for none, an output.
        away: (4,) angular distances of the returns, infinite for none, an
            output [deg].

    Returns:
        The number of returns, from 0 to 4; the least of their ranges, infinite
        without returns [m]; the greatest, 0 without returns [m]; and the least
        difference between the point's range and that of a return very near to
        its direction, infinite without one [m].
    """
    for quadrant in range(4):
        corners[quadrant] = -1
        away[quadrant] = math.inf
    flat = math.hypot(x, y)
    elevation = math.degrees(math.atan2(z, flat)) + 90.0
    azimuth = math.degrees(math.atan2(y, x)) + 180.0
    # A degree of azimuth is a smaller angle at a high elevation.
    shrink = math.sin(math.radians(elevation))
    # Without `int`, `min` and `max`, each of which is compiled.
    row, column = np.int64(elevation), np.int64(azimuth)
    if row >= _ROWS:
        row = np.int64(_ROWS - 1)
    low, high = row - _REACH_UP, row + _REACH_UP + 1
    for r in range(low if low > 0 else 0, high if high < _ROWS else _ROWS):
        for c in range(column - _REACH_ASIDE, column + _REACH_ASIDE + 1):
            # This equals `% _COLUMNS`, which is slow.
            turn = _COLUMNS if c < 0 else -_COLUMNS if c >= _COLUMNS else 0
            cell = r * _COLUMNS + c + turn
            for k in range(starts[cell], starts[cell + 1]):
                up = angles[k, 0] - elevation
                # This equals `% 360.0`, which is slow.
                side = angles[k, 1] - azimuth + 180.0
                if side < 0.0:
                    side += 360.0
                elif side >= 360.0:
                    side -= 360.0
                side -= 180.0
                quadrant = 2 if up >= 0.0 else 0
                quadrant += 1 if side >= 0.0 else 0
                across = side * shrink
                # Squares suffice to exclude returns that are too far; square
                # roots are slow.
                square = up * up + across * across
                if square > away[quadrant] * away[quadrant] * _MARGIN:
                    continue
                distance = math.hypot(up, across)
                if distance < away[quadrant]:
                    away[quadrant] = distance
                    corners[quadrant] = k
    distance = math.sqrt(x * x + y * y + z * z)
    number = 0
    nearest = gap = math.inf
    farthest = 0.0
    for quadrant in range(4):
        k = corners[quadrant]
        if k < 0:
            continue
        a, b, c = seen[k, 0], seen[k, 1], seen[k, 2]
        reach = math.sqrt(a * a + b * b + c * c)
        number += 1
        nearest = reach if reach < nearest else nearest
        farthest = reach if reach > farthest else farthest
        if away[quadrant] <= _NEAR_DEG and abs(reach - distance) < gap:
            gap = abs(reach - distance)
    return number, nearest, farthest, gap


@compiled
def _compare_to_plane(
    x: float,
    y: float,
    z: float,
    seen: np.ndarray,
    corners: np.ndarray,
    away: np.ndarray,
) -> tuple[float, float, float]:
    """Compares a point p with the plane n x = h through three of the returns.

    These are the returns in the nearest directions; there are at least three.
    `corners` and `away` are sorted by these distances. The normal n need not
    have unit length.

    Args:
        x, y, z: the point [m].
        seen: (N, 3) points of the scan [m].
        corners: (4,) index of the return in each quadrant, -1 for none.
        away: (4,) angular distances of these returns [deg].

    Returns:
        n p, h, and the length of n.
    """
    # In place of `np.argsort`, which takes a second to compile.
    for last in range(3, 0, -1):
        for k in range(last):
            if away[k + 1] < away[k]:
                farther, corner = away[k], corners[k]
                away[k], corners[k] = away[k + 1], corners[k + 1]
                away[k + 1], corners[k + 1] = farther, corner
    a, b, c = corners[0], corners[1], corners[2]
    ax, ay, az = seen[a, 0], seen[a, 1], seen[a, 2]
    ux, uy, uz = seen[b, 0] - ax, seen[b, 1] - ay, seen[b, 2] - az
    vx, vy, vz = seen[c, 0] - ax, seen[c, 1] - ay, seen[c, 2] - az
    nx = uy * vz - uz * vy
    ny = uz * vx - ux * vz
    nz = ux * vy - uy * vx
    along = nx * x + ny * y + nz * z
    h = nx * ax + ny * ay + nz * az
    return along, h, math.sqrt(nx * nx + ny * ny + nz * nz)


@compiled
def _classify(
    others: np.ndarray,
    seen: np.ndarray,
    angles: np.ndarray,
    starts: np.ndarray,
    corners: np.ndarray,
    away: np.ndarray,
    kinds: np.ndarray,
) -> None:
    """Finds whether M points are shown, hidden or neither.

    Args:
        others: (M, 3) the points, in the frame of the scan's sensor [m].
        seen, angles, starts: see `SeenSurfaces`.
        corners, away: see `_look_towards`.
        kinds: (M,) int8, all unknown; changed in place.
    """
    for i in range(len(others)):
        x, y, z = others[i, 0], others[i, 1], others[i, 2]
        number, nearest, farthest, gap = _look_towards(
            x, y, z, seen, angles, starts, corners, away
        )
        # Most points of similar scans lie beside a return.
        if gap <= TOLERANCE:
            kinds[i] = _SHOWN
            continue
        distance = math.sqrt(x * x + y * y + z * z)
        if (
            number >= 3
            and farthest <= _FARTHEST * nearest
            and nearest - TOLERANCE <= distance <= farthest + TOLERANCE
        ):
            kinds[i] = _SHOWN
            continue
        along = h = 0.0
        if number >= 3:
            along, h, _ = _compare_to_plane(x, y, z, seen, corners, away)
        # The plane meets the ray at h / along times the point.
        if along != 0.0 and abs(h / along - 1.0) * distance <= TOLERANCE:
            kinds[i] = _SHOWN
        elif number > 0 and distance > farthest + TOLERANCE:
            kinds[i] = _BEHIND


@compiled
def _measure_clearances(
    others: np.ndarray,
    seen: np.ndarray,
    angles: np.ndarray,
    starts: np.ndarray,
    corners: np.ndarray,
    away: np.ndarray,
    clearances: np.ndarray,
) -> None:
    """Finds how far M points are in front of the surface.

    See `SeenSurfaces.clearances`; for the other arguments, see `_classify`.

    Args:
        clearances: (M,) the distances [m], all NaN; changed in place.
    """
    for i in range(len(others)):
        x, y, z = others[i, 0], others[i, 1], others[i, 2]
        number, nearest, farthest, _ = _look_towards(
            x, y, z, seen, angles, starts, corners, away
        )
        distance = math.sqrt(x * x + y * y + z * z)
        if number == 0:
            clearances[i] = math.inf
        elif number >= 3 and farthest <= _FARTHEST * nearest:
            along, h, size = _compare_to_plane(x, y, z, seen, corners, away)
            if along != 0.0 and size != 0.0:
                clearances[i] = math.copysign(1.0, along) * (h - along) / size
        elif distance < nearest:
            clearances[i] = nearest - distance
        elif distance > farthest:
            clearances[i] = farthest - distance
