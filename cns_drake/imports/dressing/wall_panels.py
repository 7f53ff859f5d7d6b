"""Plane walls of imported buildings, and openings and boxes on them.

Walls are found in the triangles of a file.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
import shapely
from shapely.geometry import Polygon, box
from shapely.geometry.base import BaseGeometry

from cns_drake.city.geometry.polygons import triangulate
from cns_drake.city.geometry.upper_sides import long_normals, unit_normals

# A face is upright if the z of its unit normal is below this.
_UPRIGHT = 0.02
# Triangles of one wall have normals whose product is at least this (1 deg).
_SAME_PLANE = float(np.cos(np.radians(1.0)))
# A wall that bends is divided where normals differ by more (0.02 deg).
_STRAIGHT = float(np.cos(np.radians(0.02)))
_MM = 1000.0
# A wall is a rectangle if at most this much of its area is missing [m^2].
_NO_AREA = 0.01
# A wall that is farther from its plane bends, and so does a piece of one, which
# must leave no gap to the next piece [m].
_BENT, _PIECE_BENT = 0.05, 0.01


@dataclass(frozen=True)
class Panel:
    """A plane, upright wall or a piece of one, seen from outside.

    Attributes:
        building: number of its building.
        origin: (3,) where x = z = 0 [m].
        along: (2,) unit vector to the right, seen from outside.
        length, height: those of its bounding rectangle [m].
        outline: polygon in x and z [m]; None if it fills the rectangle.
        triangles: (M, 3, 3) its original triangles [m].
        is_plane: whether these are in one plane.
    """

    building: int
    origin: np.ndarray
    along: np.ndarray
    length: float
    height: float
    outline: BaseGeometry | None
    triangles: np.ndarray
    is_plane: bool

    @property
    def outward(self) -> np.ndarray:
        """The (2,) unit normal."""
        return np.array([self.along[1], -self.along[0]])

    def place(
        self, x: np.ndarray, z: np.ndarray, out: np.ndarray | float = 0.0
    ) -> np.ndarray:
        """Returns places (..., 3) of the panel's coordinates [m].

        Args:
            x, z: along the panel and up, from its origin [m].
            out: distance outwards [m].
        """
        places = np.empty((*np.shape(x), 3))
        for k in range(2):
            places[..., k] = (
                self.origin[k] + x * self.along[k] + out * self.outward[k]
            )
        places[..., 2] = self.origin[2] + z
        return places

    def whole(self) -> BaseGeometry:
        """Returns the panel's outline in x and z [m]."""
        if self.outline is not None:
            return self.outline
        return box(0.0, 0.0, self.length, self.height)


def joined(some: Iterable[np.ndarray]) -> np.ndarray:
    """Returns all triangles (M, 3, 3) of any number of arrays."""
    return np.concatenate([np.zeros((0, 3, 3)), *some])


def is_upright(triangles: np.ndarray) -> np.ndarray:
    """Returns which of the triangles (M, 3, 3) are walls."""
    normals = unit_normals(triangles)
    return normals.any(axis=1) & (np.abs(normals[:, 2]) < _UPRIGHT)


def find_panels(
    walls: Sequence[np.ndarray],
    is_wanted: Callable[[np.ndarray], np.ndarray] | None = None,
) -> list[Panel]:
    """Returns the panels of the walls of buildings.

    Args:
        walls: walls of each building, upright triangles (M, 3, 3) that look
            outwards [m].
        is_wanted: maps the least and greatest x and y of N panels, (N, 2, 2)
            [m], to which (N,) are wanted; all if None.
    """
    triangles = joined(walls)
    building = np.repeat(np.arange(len(walls)), [len(w) for w in walls])
    if not len(triangles):
        return []
    units = unit_normals(triangles)
    component = _connected(triangles, units, building, _SAME_PLANE)
    order = np.argsort(component, kind="stable")
    begins = np.flatnonzero(np.diff(component[order], prepend=-1))
    groups = np.split(order, begins[1:])
    if is_wanted is not None:
        xy = triangles[order, :, :2]
        limits = np.stack(
            [
                np.minimum.reduceat(xy.min(axis=1), begins),
                np.maximum.reduceat(xy.max(axis=1), begins),
            ],
            axis=1,
        )
        wanted = is_wanted(limits)
        groups = [some for k, some in enumerate(groups) if wanted[k]]
    normals = long_normals(triangles) / 2.0
    areas = np.linalg.norm(normals, axis=1)
    found = []
    for some in groups:
        number = int(building[some[0]])
        wall = triangles[some], normals[some], areas[some]
        panel = _panel(number, *wall)
        if panel.is_plane:
            found.append(panel)
        else:
            facets = _connected(wall[0], units[some], building[some], _STRAIGHT)
            found += _plane_pieces(panel, facets, *wall)
    return found


def _plane_pieces(
    wall: Panel,
    facets: np.ndarray,
    triangles: np.ndarray,
    normals: np.ndarray,
    areas: np.ndarray,
) -> list[Panel]:
    """Divides a wall that bends into pieces, each as long as it is plane.

    Args:
        wall: the whole wall.
        facets: (M,) number of the plane piece of each triangle.
        triangles, normals, areas: see `_panel`.
    """
    x = (triangles[..., :2] - wall.origin[:2]).mean(axis=1) @ wall.along
    starts = [x[facets == number].min() for number in range(facets.max() + 1)]

    def of(members: Sequence[int]) -> Panel:
        here = np.isin(facets, members)
        one = triangles[here], normals[here], areas[here]
        return _panel(wall.building, *one, _PIECE_BENT)

    found: list[Panel] = []
    members: list[int] = []
    for number in np.argsort(starts, kind="stable").tolist():
        if members and (longer := of([*members, number])).is_plane:
            members.append(number)
            found[-1] = longer
        else:
            members = [number]
            found.append(of(members))
    return found


def _connected(
    triangles: np.ndarray,
    normals: np.ndarray,
    building: np.ndarray,
    least: float,
) -> np.ndarray:
    """Returns the number (M,) of each triangle's panel.

    Args:
        triangles: (M, 3, 3) [m].
        normals: (M, 3), of unit length.
        building: (M,) number of its building.
        least: product of the normals of neighbours in one panel.
    """
    corners = np.rint(triangles * _MM).astype(np.int64).reshape(-1, 3)
    keyed = np.column_stack([np.repeat(building, 3), corners])
    _, vertex = np.unique(keyed, axis=0, return_inverse=True)
    vertex = vertex.reshape(-1, 3)
    edges = np.stack([vertex, np.roll(vertex, -1, axis=1)], axis=2)
    edges = np.sort(edges.reshape(-1, 2), axis=1)
    _, edge = np.unique(edges, axis=0, return_inverse=True)
    order = np.argsort(edge.reshape(-1), kind="stable")
    one, other = order[:-1] // 3, order[1:] // 3
    shared = edge.reshape(-1)[order[:-1]] == edge.reshape(-1)[order[1:]]
    same = np.einsum("ij,ij->i", normals[one], normals[other]) >= least
    one, other = one[shared & same], other[shared & same]
    count = len(triangles)
    links = coo_array((np.ones(len(one)), (one, other)), (count, count))
    _, component = connected_components(links, directed=False)
    return np.asarray(component)


def _panel(
    building: int,
    triangles: np.ndarray,
    normals: np.ndarray,
    areas: np.ndarray,
    bent: float = _BENT,
) -> Panel:
    """Returns the panel of connected triangles.

    Args:
        building: its number.
        triangles: (M, 3, 3) [m].
        normals, areas: (M, 3) as long as the areas, and these (M,) [m^2].
        bent: how far the triangles of a plane may lie apart across it [m].
    """
    corners = triangles.reshape(-1, 3)
    # The mean over areas: small triangles have imprecise normals.
    outward = normals.sum(axis=0)[:2]
    outward /= np.hypot(*outward)
    along = np.array([-outward[1], outward[0]])
    x = (corners[:, :2] - corners[0, :2]) @ along
    start = corners[0, :2] + x.min() * along
    # The plane is in the middle of triangles that are not quite plane.
    aside = (corners[:, :2] - start) @ outward
    start = start + outward * float(aside.mean())
    origin = np.array([*start, corners[:, 2].min()])
    length, height = float(np.ptp(x)), float(np.ptp(corners[:, 2]))
    outline: BaseGeometry | None = None
    if length * height - areas.sum() > _NO_AREA:
        flat = np.column_stack([x - x.min(), corners[:, 2] - origin[2]])
        outline = shapely.union_all(
            [Polygon(one) for one in np.round(flat, 3).reshape(-1, 3, 2)],
            grid_size=1.0 / _MM,
        )
    is_plane = bool(np.ptp(aside) <= bent)
    return Panel(
        building, origin, along, length, height, outline, triangles, is_plane
    )


# Distance of openings from the edge of a panel that is no rectangle, and width
# of a frame [m].
_BESIDE = 0.1
_FRAME = 0.09
# Distance in front of a panel of parts that are not cut into it [m].
_ON_WALL = 0.02
_EXACT = 1e-3
_LEAST_AREA = 1e-4
# The faces of a box on a panel: the limits (left, right, bottom, top, out and
# the panel's plane) of x, z and out (3, F, 4) of their corners.
_FACES = (
    ("lbo", "rbo", "rto", "lto"),
    ("lbp", "lbo", "lto", "ltp"),
    ("rbo", "rbp", "rtp", "rto"),
    ("lbp", "rbp", "rbo", "lbo"),
    ("lto", "rto", "rtp", "ltp"),
)
_BOX = np.moveaxis(
    np.array([[list(map("lrbtop".index, c)) for c in f] for f in _FACES]), 2, 0
)


class Openings(NamedTuple):
    """Rectangles of N openings in a panel.

    Attributes:
        row: (N,) number of its row; rows do not overlap one another.
        x0, x1, z0, z1: (N,) limits in the panel's coordinates [m].
        depth: (N,) [m].
        is_door: (N,) whether it is closed by a door, and not by glass.
    """

    row: np.ndarray
    x0: np.ndarray
    x1: np.ndarray
    z0: np.ndarray
    z1: np.ndarray
    depth: np.ndarray
    is_door: np.ndarray

    def chosen(self, which: np.ndarray) -> Openings:
        """Returns the openings of a mask or an index array (N,)."""
        return Openings(*(values[which] for values in self))

    def joined(self, others: Openings) -> Openings:
        """Returns these openings and others."""
        return Openings(*map(np.concatenate, zip(self, others, strict=True)))


class OpenedWall(NamedTuple):
    """A panel with openings.

    Attributes:
        quads: (K, 4, 3) fronts and reveals of the wall [m].
        triangles: (M, 3, 3) the other faces of the wall [m].
        backs: (N, 4, 3) panes and doors [m].
        openings: (N,) the openings that were cut.
    """

    quads: np.ndarray
    triangles: np.ndarray
    backs: np.ndarray
    openings: Openings


def fronts(
    panel: Panel,
    x0: np.ndarray,
    x1: np.ndarray,
    z0: np.ndarray,
    z1: np.ndarray,
    out: np.ndarray | float = 0.0,
) -> np.ndarray:
    """Returns rectangles (N, 4, 3) parallel to a panel [m].

    Args:
        panel: the wall.
        x0, x1, z0, z1: (N,) limits in its coordinates [m].
        out: (N,) distance from it outwards [m].
    """
    return _quads(panel, _BOX[:, :1], x0, x1, z0, z1, out)


def sides(
    panel: Panel,
    x0: np.ndarray,
    x1: np.ndarray,
    z0: np.ndarray,
    z1: np.ndarray,
    out: np.ndarray,
) -> np.ndarray:
    """Returns the faces (4 N, 4, 3) between rectangles and a panel [m].

    They are seen from within a recess (out < 0) or from beside a box.
    """
    return _quads(panel, _BOX[:, 1:], x0, x1, z0, z1, out)


def boxes_on(
    panel: Panel,
    x0: np.ndarray | float,
    x1: np.ndarray | float,
    z0: np.ndarray | float,
    z1: np.ndarray | float,
    reach: np.ndarray | float,
) -> np.ndarray:
    """Returns boxes without backs on a panel, (5 N, 4, 3) [m]."""
    return _quads(panel, _BOX, x0, x1, z0, z1, reach)


def _quads(
    panel: Panel, faces: np.ndarray, *limits: np.ndarray | float
) -> np.ndarray:
    """Returns the faces (F N, 4, 3) of N boxes, face by face [m].

    Args:
        panel: the wall.
        faces: (3, F, 4) index of the limit at each corner.
        limits: x0, x1, z0, z1 and the distance outwards, (N,) or one [m].
    """
    values = np.stack(
        [some.reshape(-1) for some in np.broadcast_arrays(*limits, 0.0)]
    ).astype(float)
    x, z, out = values[faces].transpose(0, 1, 3, 2).reshape(3, -1, 4)
    return panel.place(x, z, out)


def open_wall(
    panel: Panel, openings: Openings, has_recesses: bool = True
) -> OpenedWall | None:
    """Returns a panel with windows and doors; None where none fits.

    Args:
        panel: the wall.
        openings: within its bounding rectangle; rows that leave the outline
            of a panel which is no rectangle are left out, from the top down.
        has_recesses: whether they are cut into the panel; if not, panes and
            doors lie on it, which takes far fewer triangles.
    """
    area = (0.0, panel.length, 0.0, panel.height)
    rest = np.zeros((0, 3, 3))
    if panel.outline is not None:
        fitting = _fitting(panel, openings)
        if fitting is None:
            return None
        openings, area = fitting
        rest = _around(panel, area)
    if not len(openings.row):
        return None
    openings = openings.chosen(np.lexsort([openings.x0, openings.row]))
    _, x0, x1, z0, z1, depth, _ = openings
    if not has_recesses:
        backs = fronts(panel, x0, x1, z0, z1, _ON_WALL)
        empty = np.zeros((0, 4, 3))
        return OpenedWall(empty, panel.triangles, backs, openings)
    quads = fronts(panel, *_wall_between(openings, area))
    if depth.any():
        reveals = sides(panel, x0, x1, z0, z1, -depth)
        quads = np.concatenate([quads, reveals])
    return OpenedWall(
        quads, rest, fronts(panel, x0, x1, z0, z1, -depth), openings
    )


def framed(panel: Panel, openings: Openings) -> tuple[np.ndarray, np.ndarray]:
    """Returns the frames (4 N, 4, 3) and panes (N, 4, 3) of windows [m].

    Args:
        panel: the wall.
        openings: wider and higher than two frames.
    """
    _, x0, x1, z0, z1, depth, _ = openings
    a, b, c, d = x0 + _FRAME, x1 - _FRAME, z0 + _FRAME, z1 - _FRAME
    frames = [
        fronts(panel, x0, a, z0, z1, -depth),
        fronts(panel, b, x1, z0, z1, -depth),
        fronts(panel, a, b, z0, c, -depth),
        fronts(panel, a, b, d, z1, -depth),
    ]
    return np.concatenate(frames), fronts(panel, a, b, c, d, -depth)


def _wall_between(
    openings: Openings, area: tuple[float, float, float, float]
) -> np.ndarray:
    """Returns limits (4, K) of the rectangles between openings.

    Args:
        openings: sorted by row, then from left to right.
        area: x0, x1, z0, z1 that is filled [m].
    """
    left, right, bottom, top = area
    row, x0, x1, z0, z1 = openings[:5]
    rows, first, index = np.unique(row, return_index=True, return_inverse=True)
    low = np.minimum.reduceat(z0, first)
    high = np.maximum.reduceat(z1, first)
    last = np.append(first[1:], len(row)) - 1
    is_first = np.zeros(len(row), dtype=bool)
    is_first[first] = True
    before = np.where(is_first, left, np.roll(x1, 1))
    strips = np.array(
        [
            np.full(len(rows) + 1, left),
            np.full(len(rows) + 1, right),
            np.append(bottom, high),
            np.append(low, top),
        ]
    )
    found = np.concatenate(
        [
            strips,
            [before, x0, low[index], high[index]],
            [x1[last], np.full(len(rows), right), low, high],
            [x0, x1, low[index], z0],
            [x0, x1, z1, high[index]],
        ],
        axis=1,
    )
    is_there = (found[1] - found[0] > _EXACT) & (found[3] - found[2] > _EXACT)
    return np.asarray(found[:, is_there])


def _fitting(
    panel: Panel, openings: Openings
) -> tuple[Openings, tuple[float, float, float, float]] | None:
    """Returns openings in a panel, with their bounding rectangles."""
    outline = shapely.buffer(panel.whole(), _EXACT, join_style="mitre")
    while len(openings.row):
        found = (
            max(0.0, float(openings.x0.min()) - _BESIDE),
            min(panel.length, float(openings.x1.max()) + _BESIDE),
            max(0.0, float(openings.z0.min()) - _BESIDE),
            min(panel.height, float(openings.z1.max()) + _BESIDE),
        )
        x0, x1, z0, z1 = (round(value, 3) for value in found)
        area = x0, x1, z0, z1
        if outline.contains(_rectangle(area)):
            return openings, area
        openings = openings.chosen(openings.row < openings.row.max())
    return None


def _rectangle(area: tuple[float, float, float, float]) -> Polygon:
    x0, x1, z0, z1 = area
    return box(x0, z0, x1, z1)


def _around(
    panel: Panel, area: tuple[float, float, float, float]
) -> np.ndarray:
    """Returns a panel without an area, as triangles (M, 3, 3) [m]."""
    rest = shapely.difference(panel.whole(), _rectangle(area), grid_size=_EXACT)
    flat = [np.zeros((0, 3, 2))]
    for part in shapely.get_parts(rest):
        if isinstance(part, Polygon) and part.area > _LEAST_AREA:
            flat.append(triangulate(part))
    xz = np.concatenate(flat)
    return panel.place(xz[..., 0], xz[..., 1])
