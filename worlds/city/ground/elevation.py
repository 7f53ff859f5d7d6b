"""The height of the finished ground: level, or between sloping streets.

Between streets at different heights, the ground is a smooth field that meets
every sidewalk at the height of the sidewalk. Buildings and terraces stand on
level pads in this field.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.linalg import spsolve
import shapely
from shapely.geometry.base import BaseGeometry

from worlds.roads import KerbMap, SurfaceHeights
from worlds.shapes import Structure, snap

# Distance of the nodes between which the field is interpolated [m].
_NODES = 2.0
# Width of the level ground around buildings [m].
_APRON = 0.6
# Nodes within this distance of a pad have its height [m].
_HELD = 1.0
# Within this distance of a street or pad, the field is adjusted to the exact
# height there [m].
_REACH = 4.0
# Decimals of the nodes' heights [m]; rounding hides the last bits of the
# solver, which would otherwise show in files.
_ROUNDING = 6
# Nearer than this counts as touching [m].
_TOUCHING = 1e-6


class Pad(NamedTuple):
    """An area of level ground and its height, both in W [m]."""

    area: BaseGeometry
    height: float


@dataclass(frozen=True)
class LevelGround:
    """The ground of a city whose streets are all at z = 0.

    Attributes:
        height: height of the ground and of the sidewalks in W [m].
        pads: empty, because level ground needs no level areas of its own.
    """

    height: float
    pads: tuple[Pad, ...] = ()
    is_level = True

    def __call__(self, x: np.ndarray, y: np.ndarray) -> np.ndarray:
        """Returns the heights (N,) of the ground at points in W [m]."""
        return np.full(np.shape(x), self.height)


class SlopingGround:
    """The ground of a city with sloping streets: its height at any x and y.

    Sidewalks follow their roads. Between the streets and level pads, the height
    is a harmonic field on a grid: each node has the mean height of its
    neighbours. Nodes on streets and pads have given heights. At the edge of the
    city, the field has no slope perpendicular to the edge.

    Next to a street or pad, up to a distance R, the ground changes gradually
    from the height of the street or pad to the height of the field (Shepard's
    interpolation). At the distance d, the height of the street or pad has the
    weight 1/d - 1/R, and the height of the field has the weight 1/R.

    Attributes:
        pads: level areas outside the streets.
    """

    is_level = False

    def __init__(
        self,
        surface: SurfaceHeights,
        kerb_height: float | KerbMap,
        streets: BaseGeometry,
        bounds: tuple[float, float, float, float],
        pads: Sequence[Pad] = (),
    ):
        """Fits the ground to the streets and pads.

        Args:
            surface: heights of the roads.
            kerb_height: height of sidewalks above the roads [m], as one number
                or by place.
            streets: area of carriageways, sidewalks and medians in W [m].
            bounds: x0, y0, x1, y1 of the city in W [m].
            pads: level areas outside the streets. Where two pads meet, the
                first pad takes precedence.
        """
        self.pads = tuple(pads)
        self._surface = surface
        self._kerb_height = kerb_height
        self._streets = streets
        shapely.prepare(streets)
        self._edges = _segments(streets)
        edges = np.asarray(shapely.linestrings(self._edges))
        self._edge_tree = shapely.STRtree(edges)
        self._pad_tree = shapely.STRtree([pad.area for pad in self.pads])
        self._pad_heights = np.array([pad.height for pad in self.pads])
        x0, y0, x1, y1 = bounds
        self._x, self._y = _nodes(x0, x1), _nodes(y0, y1)
        self._z = self._field()

    def __call__(self, x: np.ndarray, y: np.ndarray) -> np.ndarray:
        """Returns the heights (N,) of the ground at points in W [m]."""
        x, y = np.asarray(x, dtype=float), np.asarray(y, dtype=float)
        z = self._interpolate(x, y)
        inside = shapely.intersects_xy(self._streets, x, y)
        z[inside] = self._sidewalk(x[inside], y[inside])
        outside = np.flatnonzero(~inside)
        z[outside] = self._adjusted_field(x[outside], y[outside], z[outside])
        return z

    def _sidewalk(self, x: np.ndarray, y: np.ndarray) -> np.ndarray:
        xy = np.column_stack([x, y])
        kerb = self._kerb_height
        return self._surface.heights(xy) + (
            kerb(xy) if callable(kerb) else kerb
        )

    def _adjusted_field(
        self, x: np.ndarray, y: np.ndarray, field: np.ndarray
    ) -> np.ndarray:
        """Returns the field, adjusted to the streets and pads nearby."""
        points = np.asarray(shapely.points(x, y))
        weight = np.full(len(x), 1 / _REACH)
        total = field * weight
        near, edge = self._edge_tree.query_nearest(
            points, max_distance=_REACH, all_matches=False
        )
        if len(near):
            p = np.column_stack([x, y])[near]
            foot = _foot_points(p, self._edges[edge])
            gain = _exact_height_weight(np.hypot(*(foot - p).T))
            weight[near] += gain
            total[near] += gain * self._sidewalk(*foot.T)
        if self.pads:
            near, pad = self._pad_tree.query(
                points, predicate="dwithin", distance=_REACH
            )
            areas: np.ndarray = self._pad_tree.geometries[pad]
            gain = _exact_height_weight(shapely.distance(points[near], areas))
            # Of several pads that touch a point, only the first counts.
            order = np.lexsort((pad, near))
            near, pad, gain = near[order], pad[order], gain[order]
            touching = gain > _exact_height_weight(np.array([2 * _TOUCHING]))[0]
            _, first = np.unique(near[touching], return_index=True)
            keep = ~touching
            keep[np.flatnonzero(touching)[first]] = True
            np.add.at(weight, near[keep], gain[keep])
            np.add.at(
                total, near[keep], gain[keep] * self._pad_heights[pad[keep]]
            )
        return total / weight

    def _field(self) -> np.ndarray:
        """Returns the (rows, columns) heights of the nodes [m]."""
        x, y = (a.ravel() for a in np.meshgrid(self._x, self._y))
        z = np.full(len(x), np.nan)
        for pad in reversed(self.pads):
            held = pad.area.buffer(_HELD)
            x0, y0, x1, y1 = held.bounds
            close = np.flatnonzero((x > x0) & (x < x1) & (y > y0) & (y < y1))
            shapely.prepare(held)
            inside = shapely.intersects_xy(held, x[close], y[close])
            z[close[inside]] = pad.height
        inside = shapely.intersects_xy(self._streets, x, y)
        z[inside] = self._sidewalk(x[inside], y[inside])
        shape = len(self._y), len(self._x)
        return np.round(with_gaps_filled(z.reshape(shape)), _ROUNDING)

    def _interpolate(self, x: np.ndarray, y: np.ndarray) -> np.ndarray:
        """Returns the bilinear interpolation of the nodes."""
        column = np.clip((x - self._x[0]) / _NODES, 0, len(self._x) - 1.001)
        row = np.clip((y - self._y[0]) / _NODES, 0, len(self._y) - 1.001)
        i, j = row.astype(int), column.astype(int)
        v, u = row - i, column - j
        z = self._z
        lower = z[i, j] * (1 - u) + z[i, j + 1] * u
        upper = z[i + 1, j] * (1 - u) + z[i + 1, j + 1] * u
        return lower * (1 - v) + upper * v


Ground = LevelGround | SlopingGround


def make_ground(
    surface: SurfaceHeights,
    kerb_height: float | KerbMap,
    streets: BaseGeometry,
    bounds: tuple[float, float, float, float],
    pads: Sequence[Pad] = (),
) -> Ground:
    """Returns the ground of a city: level if all roads and pads are level.

    Args:
        surface, streets, bounds: see `SlopingGround`.
        kerb_height: height of sidewalks above the roads [m]: one number, or a
            function that returns the heights (N,) at places (N, 2).
        pads: level areas outside the streets. Where two pads meet, the first
            pad takes precedence.
    """
    if (
        not callable(kerb_height)
        and surface.is_level
        and all(pad.height == kerb_height for pad in pads)
    ):
        return LevelGround(kerb_height)
    return SlopingGround(surface, kerb_height, streets, bounds, pads)


def aprons(buildings: Iterable[Structure], streets: BaseGeometry) -> list[Pad]:
    """Returns the level ground below and around buildings, in W [m].

    Each building has a pad at the height of the building's floor. The pad
    consists of the footprint and a strip around the footprint. The strip keeps
    a distance from `streets`, the area of the streets in W [m].
    """
    kerbside = streets.buffer(_APRON)
    pads = []
    for building in buildings:
        around = building.footprint_W.buffer(_APRON, join_style="mitre")
        beside = around.difference(kerbside)
        area = snap(beside.union(building.footprint_W))
        pads.append(Pad(area, building.xyz[2]))
    return pads


def with_gaps_filled(z: np.ndarray) -> np.ndarray:
    """Returns a grid of heights [m] whose gaps (NaN) are filled smoothly.

    The height of every gap is the mean height of its two to four neighbours, as
    in a harmonic field. At least one height must be given.
    """
    rows, columns = z.shape
    free = np.isnan(z)
    number = np.cumsum(free.ravel()).reshape(z.shape) - 1
    count = int(free.sum())
    degree, known = np.zeros(count), np.zeros(count)
    entries = []
    for step_row, step_column in ((0, 1), (0, -1), (1, 0), (-1, 0)):
        i, j = np.nonzero(free)
        k, m = i + step_row, j + step_column
        inside = (k >= 0) & (k < rows) & (m >= 0) & (m < columns)
        own = number[i, j][inside]
        k, m = k[inside], m[inside]
        degree[own] += 1
        is_free = free[k, m]
        known[own[~is_free]] += z[k, m][~is_free]
        entries.append((own[is_free], number[k, m][is_free]))
    own = np.concatenate([e[0] for e in entries] + [np.arange(count)])
    other = np.concatenate([e[1] for e in entries] + [np.arange(count)])
    value = np.concatenate([-np.ones(len(own) - count), degree])
    matrix = coo_matrix((value, (own, other)), (count, count)).tocsc()
    result = z.copy()
    result[free] = spsolve(matrix, known)
    return result


def _nodes(start: float, end: float) -> np.ndarray:
    """Returns the coordinates of nodes from `start` to beyond `end` [m]."""
    first = np.floor(start / _NODES)
    return np.arange(first, np.ceil(end / _NODES) + 1) * _NODES


def _segments(area: BaseGeometry) -> np.ndarray:
    """Returns start and end (N, 2, 2) of the edges of an area's outlines."""
    rings = shapely.get_rings(shapely.get_parts(area))
    corners = [np.array(ring.coords)[:, :2] for ring in rings]
    return np.concatenate(
        [np.stack([ring[:-1], ring[1:]], axis=1) for ring in corners]
    )


def _foot_points(p: np.ndarray, segments: np.ndarray) -> np.ndarray:
    """Returns the point (N, 2) of each segment (N, 2, 2) nearest to p."""
    start = segments[:, 0]
    along = segments[:, 1] - segments[:, 0]
    part = ((p - start) * along).sum(axis=1) / (along**2).sum(axis=1)
    return start + np.clip(part, 0.0, 1.0)[:, None] * along


def _exact_height_weight(distance: np.ndarray) -> np.ndarray:
    """Returns the weight of the exact height at a distance, 1/d - 1/R [1/m]."""
    weight = 1 / np.maximum(distance, _TOUCHING) - 1 / _REACH
    return np.maximum(weight, 0.0)
