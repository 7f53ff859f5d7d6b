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

from dataclasses import dataclass
from functools import cached_property
import math
from typing import NamedTuple

import numpy as np

from cns_drake.base import compiled

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
        return _measure_clearances(
            _contiguous(points), self.points, self.angles_deg, self.starts
        )

    def hides(self, points: np.ndarray) -> np.ndarray:
        """Returns which points (N, 3) are behind a seen surface, (N,) bool."""
        return self._kinds(points) == _BEHIND

    def _kinds(self, points: np.ndarray) -> np.ndarray:
        return _classify(
            _contiguous(points), self.points, self.angles_deg, self.starts
        )


def _contiguous(points: np.ndarray) -> np.ndarray:
    return np.ascontiguousarray(points, dtype=np.float64)


@compiled
def _find_nearest_by_quadrant(
    p: np.ndarray,
    angles: np.ndarray,
    starts: np.ndarray,
    corners: np.ndarray,
    away: np.ndarray,
) -> None:
    """Finds the nearest return in each quadrant around a point's direction.

    Fills in (4,) indices of returns, -1 if there is none, and (4,) their
    angular distances [deg].

    Args:
        p: (3,) the point [m].
        angles, starts: see `SeenSurfaces`.
        corners: (4,) indices of the returns, an output.
        away: (4,) angular distances of the returns, infinite for none, an
            output.
    """
    corners[:] = -1
    away[:] = math.inf
    flat = math.hypot(p[0], p[1])
    elevation = math.degrees(math.atan2(p[2], flat)) + 90.0
    azimuth = math.degrees(math.atan2(p[1], p[0])) + 180.0
    # A degree of azimuth is a smaller angle at a high elevation.
    shrink = math.sin(math.radians(elevation))
    row = min(int(elevation), _ROWS - 1)
    column = int(azimuth)
    for r in range(
        max(row - _REACH_UP, 0), min(row + _REACH_UP, _ROWS - 1) + 1
    ):
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
                quadrant = 2 * int(up >= 0.0) + int(side >= 0.0)
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


@compiled
def _fit_plane(
    seen: np.ndarray, corners: np.ndarray, away: np.ndarray
) -> tuple[float, float, float, float]:
    """Returns the plane n p = h through three points of a scan.

    Of the four `corners`, the three with the least distances `away` are used.
    The normal n need not have unit length.

    Returns:
        The three components of n, and h.
    """
    # In place of `np.argsort`, which takes a second to compile.
    order = np.empty(4, np.int64)
    for quadrant in range(4):
        rank = quadrant
        while rank > 0 and away[quadrant] < away[order[rank - 1]]:
            order[rank] = order[rank - 1]
            rank -= 1
        order[rank] = quadrant
    a = seen[corners[order[0]]]
    u = seen[corners[order[1]]] - a
    v = seen[corners[order[2]]] - a
    nx = u[1] * v[2] - u[2] * v[1]
    ny = u[2] * v[0] - u[0] * v[2]
    nz = u[0] * v[1] - u[1] * v[0]
    return nx, ny, nz, nx * a[0] + ny * a[1] + nz * a[2]


@compiled
def _length(p: np.ndarray) -> float:
    return math.sqrt(p[0] ** 2 + p[1] ** 2 + p[2] ** 2)


class _Returns(NamedTuple):
    """The returns in the four quadrants around a direction.

    Attributes:
        number: how many there are, from 0 to 4.
        nearest: the least range [m]; infinite without returns.
        farthest: the greatest range [m]; 0 without returns.
        is_one_surface: whether they are on one surface, to which a plane fits.
    """

    number: int
    nearest: float
    farthest: float
    is_one_surface: bool


@compiled
def _measure_returns(seen: np.ndarray, corners: np.ndarray) -> _Returns:
    """Returns the ranges of the returns around a direction.

    Args:
        seen: (N, 3) points of the scan [m].
        corners: (4,) index of the return in each quadrant, -1 for none.
    """
    number = 0
    nearest = math.inf
    farthest = 0.0
    for corner in corners:
        if corner >= 0:
            reach = _length(seen[corner])
            number += 1
            nearest, farthest = min(nearest, reach), max(farthest, reach)
    is_one_surface = number >= 3 and farthest <= _FARTHEST * nearest
    return _Returns(number, nearest, farthest, is_one_surface)


class _PlaneSide(NamedTuple):
    """Where a point p lies relative to a plane n x = h; all 0 without a plane.

    Attributes:
        along: n p.
        h: the plane's h.
        size: length of the normal n.
    """

    along: float
    h: float
    size: float


@compiled
def _compare_to_plane(
    p: np.ndarray,
    seen: np.ndarray,
    corners: np.ndarray,
    away: np.ndarray,
    around: _Returns,
) -> _PlaneSide:
    """Compares a point with the plane through the returns around it.

    There is no plane with fewer than three returns.

    Args:
        p: (3,) the point [m].
        seen: (N, 3) points of the scan [m].
        corners: (4,) index of the return in each quadrant, -1 for none.
        away: (4,) angular distances of these returns [deg].
        around: the same returns' ranges.
    """
    if around.number < 3:
        return _PlaneSide(0.0, 0.0, 0.0)
    x, y, z, h = _fit_plane(seen, corners, away)
    along = x * p[0] + y * p[1] + z * p[2]
    return _PlaneSide(along, h, math.sqrt(x * x + y * y + z * z))


@compiled
def _is_beside_return(
    p: np.ndarray, seen: np.ndarray, corners: np.ndarray, away: np.ndarray
) -> bool:
    """Returns whether a return near a point's direction has the point's range.

    Args:
        p: (3,) the point [m].
        seen: (N, 3) points of the scan [m].
        corners: (4,) index of the return in each quadrant, -1 for none.
        away: (4,) angular distances of these returns [deg], infinite for none.
    """
    distance = _length(p)
    for quadrant in range(4):
        if away[quadrant] <= _NEAR_DEG:
            reach = _length(seen[corners[quadrant]])
            if abs(reach - distance) <= TOLERANCE:
                return True
    return False


@compiled
def _classify(
    others: np.ndarray, seen: np.ndarray, angles: np.ndarray, starts: np.ndarray
) -> np.ndarray:
    """Returns whether M points are shown, hidden or neither, (M,) int8.

    Args:
        others: (M, 3) the points, in the frame of the scan's sensor [m].
        seen, angles, starts: see `SeenSurfaces`.
    """
    kinds = np.full(len(others), _UNKNOWN, np.int8)
    corners = np.empty(4, np.int64)
    away = np.empty(4)
    for i in range(len(others)):
        p = others[i]
        _find_nearest_by_quadrant(p, angles, starts, corners, away)
        # Most points of similar scans lie beside a return.
        if _is_beside_return(p, seen, corners, away):
            kinds[i] = _SHOWN
            continue
        around = _measure_returns(seen, corners)
        distance = _length(p)
        if around.is_one_surface and (
            around.nearest - TOLERANCE
            <= distance
            <= around.farthest + TOLERANCE
        ):
            kinds[i] = _SHOWN
            continue
        side = _compare_to_plane(p, seen, corners, away, around)
        # The plane meets the ray at h / along times the point.
        if (
            side.along != 0.0
            and abs(side.h / side.along - 1.0) * distance <= TOLERANCE
        ):
            kinds[i] = _SHOWN
        elif around.number > 0 and distance > around.farthest + TOLERANCE:
            kinds[i] = _BEHIND
    return kinds


@compiled
def _measure_clearances(
    others: np.ndarray, seen: np.ndarray, angles: np.ndarray, starts: np.ndarray
) -> np.ndarray:
    """Returns how far M points are in front of the surface, (M,) [m].

    See `SeenSurfaces.clearances`; for the arguments, see `_classify`.
    """
    clearances = np.full(len(others), math.nan)
    corners = np.empty(4, np.int64)
    away = np.empty(4)
    for i in range(len(others)):
        p = others[i]
        _find_nearest_by_quadrant(p, angles, starts, corners, away)
        around = _measure_returns(seen, corners)
        distance = _length(p)
        if around.number == 0:
            clearances[i] = math.inf
        elif around.is_one_surface:
            side = _compare_to_plane(p, seen, corners, away, around)
            if side.along != 0.0 and side.size != 0.0:
                towards = math.copysign(1.0, side.along)
                clearances[i] = towards * (side.h - side.along) / side.size
        elif distance < around.nearest:
            clearances[i] = around.nearest - distance
        elif distance > around.farthest:
            clearances[i] = around.farthest - distance
    return clearances
