"""Finds the plane walls of imported buildings among their triangles."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
import itertools
import math

import numpy as np
from numpy.typing import ArrayLike
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
import shapely
from shapely.geometry import Polygon
from shapely.geometry.base import BaseGeometry

from evaluation.base import dot
from worlds.city import WallFrame
from worlds.imports.faces import joined_triangles
from worlds.shapes import long_normals, unit_normals

# A face is vertical if the absolute z of its unit normal is below this.
_UPRIGHT = 0.02
# Triangles of one wall have unit normals whose dot product is at least this (1
# deg).
_SAME_PLANE = math.cos(math.radians(1.0))
# A wall that bends is divided where normals differ by more than this (0.02
# deg).
_STRAIGHT = math.cos(math.radians(0.02))
# Millimetres in a metre: corners that are equal in whole millimetres are one.
_MM = 1000.0
# A wall is a rectangle if at most this much of the rectangle's area is missing
# [m^2].
_NO_AREA = 0.01
# Greatest deviation of a wall from its plane [m].
_MOST_BENT = 0.05
# Greatest deviation of a piece of a bent wall from its plane, so that there is
# no gap between the piece and the next one [m].
_MOST_PIECE_BENT = 0.01


@dataclass(frozen=True)
class Panel:
    """A vertical wall, or a piece of a wall, as seen from outside.

    In panel coordinates, x runs to the right and z upwards [m].

    Attributes:
        building: number of the building.
        origin: (3,) point x = z = 0 in W [m].
        along: (2,) unit vector to the right.
        length: length along x [m].
        height: height along z [m].
        outline: polygon in x and z; None if the wall is a rectangle.
        triangles: (M, 3, 3) triangles of the wall in the file [m].
        is_plane: whether the wall is plane; otherwise the wall bends.
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
        """Unit normal (2,) that points outwards."""
        return np.array([self.along[1], -self.along[0]])

    @property
    def frame(self) -> WallFrame:
        """Frame of the wall, with which details of the facade are placed."""
        start = self.origin[:2]
        return WallFrame([start, start + self.length * self.along], 0)

    def place(
        self, x: ArrayLike, z: ArrayLike, out: ArrayLike = 0.0
    ) -> np.ndarray:
        """Converts panel coordinates to places (..., 3) in W [m].

        Args:
            x: distance along the panel from its origin [m].
            z: height above the panel's origin [m].
            out: distance outwards from the panel's plane [m].
        """
        x, z, out = (np.asarray(one, dtype=float) for one in (x, z, out))
        places = np.empty((*x.shape, 3))
        for k in range(2):
            places[..., k] = (
                self.origin[k] + x * self.along[k] + out * self.outward[k]
            )
        places[..., 2] = self.origin[2] + z
        return places


def is_upright(triangles: np.ndarray) -> np.ndarray:
    """Returns (M,) bool: whether triangles (M, 3, 3) are vertical."""
    normals = unit_normals(triangles)
    return normals.any(axis=1) & (np.abs(normals[:, 2]) < _UPRIGHT)


def find_panels(
    walls: Sequence[np.ndarray], is_wanted: Callable[[np.ndarray], np.ndarray]
) -> list[Panel]:
    """Returns the walls of buildings as panels, several for a bent wall.

    Args:
        walls: for each building, its vertical triangles (M, 3, 3), which face
            outwards [m].
        is_wanted: function that selects walls. The function takes the least and
            the greatest x and y of N walls, (N, 2, 2) [m], and returns (N,)
            bool.
    """
    triangles = joined_triangles(walls)
    building = np.repeat(np.arange(len(walls)), [len(w) for w in walls])
    if not len(triangles):
        return []
    units = unit_normals(triangles)
    component = _panel_numbers(triangles, units, building, _SAME_PLANE)
    order = np.argsort(component, kind="stable")
    begins = np.flatnonzero(np.diff(component[order], prepend=-1))
    groups = np.split(order, begins[1:])
    xy = triangles[order, :, :2]
    limits = np.stack(
        [
            np.minimum.reduceat(xy.min(axis=1), begins),
            np.maximum.reduceat(xy.max(axis=1), begins),
        ],
        axis=1,
    )
    groups = list(itertools.compress(groups, is_wanted(limits)))
    normals = long_normals(triangles) / 2.0
    areas = np.linalg.norm(normals, axis=1)
    panels = []
    for members in groups:
        number = int(building[members[0]])
        wall = triangles[members], normals[members], areas[members]
        panel = _make_panel(number, *wall)
        if panel.is_plane:
            panels.append(panel)
        else:
            facets = _panel_numbers(
                wall[0], units[members], building[members], _STRAIGHT
            )
            panels += _plane_pieces(panel, facets, *wall)
    return panels


def _plane_pieces(
    wall: Panel,
    facets: np.ndarray,
    triangles: np.ndarray,
    normals: np.ndarray,
    areas: np.ndarray,
) -> list[Panel]:
    """Divides a wall that bends into plane pieces, each as long as possible.

    `facets` (M,) are the numbers of the plane facets to which triangles belong.
    The other arguments are as in `_make_panel`.
    """
    x = dot((triangles[..., :2] - wall.origin[:2]).mean(axis=1), wall.along)
    starts = [x[facets == number].min() for number in range(facets.max() + 1)]

    def piece_of(members: Sequence[int]) -> Panel:
        here = np.isin(facets, members)
        piece = triangles[here], normals[here], areas[here]
        return _make_panel(wall.building, *piece, _MOST_PIECE_BENT)

    pieces: list[Panel] = []
    members: list[int] = []
    for number in np.argsort(starts, kind="stable").tolist():
        if members and (longer := piece_of([*members, number])).is_plane:
            members.append(number)
            pieces[-1] = longer
        else:
            members = [number]
            pieces.append(piece_of(members))
    return pieces


def _panel_numbers(
    triangles: np.ndarray,
    normals: np.ndarray,
    building: np.ndarray,
    least: float,
) -> np.ndarray:
    """Returns the number (M,) of the panel of each triangle (M, 3, 3) [m].

    Two triangles that share an edge are in one panel if they belong to the same
    building, numbered (M,), and if the dot product of their unit normals (M, 3)
    is at least `least`.
    """
    corners = np.rint(triangles * _MM).astype(np.int64).reshape(-1, 3)
    keyed = np.column_stack([np.repeat(building, 3), corners])
    _, vertex = np.unique(keyed, axis=0, return_inverse=True)
    vertex = vertex.reshape(-1, 3)
    edges = np.stack([vertex, np.roll(vertex, -1, axis=1)], axis=2)
    edges = np.sort(edges.reshape(-1, 2), axis=1)
    _, edge = np.unique(edges, axis=0, return_inverse=True)
    order = np.argsort(edge.reshape(-1), kind="stable")
    # Edges that are the same follow each other in this order.
    first, second = order[:-1] // 3, order[1:] // 3
    share_edge = edge.reshape(-1)[order[:-1]] == edge.reshape(-1)[order[1:]]
    cosines = np.einsum("ij,ij->i", normals[first], normals[second])
    joined = share_edge & (cosines >= least)
    first, second = first[joined], second[joined]
    count = len(triangles)
    links = coo_array((np.ones(len(first)), (first, second)), (count, count))
    _, component = connected_components(links, directed=False)
    return np.asarray(component)


def _make_panel(
    building: int,
    triangles: np.ndarray,
    normals: np.ndarray,
    areas: np.ndarray,
    bent: float = _MOST_BENT,
) -> Panel:
    """Returns the panel of connected triangles (M, 3, 3) of a building [m].

    The lengths of the normals (M, 3) are the areas (M,) [m^2]. The panel is
    plane if all corners lie between two planes `bent` apart [m].
    """
    corners = triangles.reshape(-1, 3)
    # Weighted by area, since the normals of small triangles are imprecise.
    outward = normals.sum(axis=0)[:2]
    outward /= np.hypot(*outward)
    along = np.array([-outward[1], outward[0]])
    x = dot(corners[:, :2] - corners[0, :2], along)
    start = corners[0, :2] + x.min() * along
    # The plane is in the middle, since triangles may not be quite plane.
    aside = dot(corners[:, :2] - start, outward)
    start = start + outward * float(aside.mean())
    origin = np.array([*start, corners[:, 2].min()])
    length, height = float(np.ptp(x)), float(np.ptp(corners[:, 2]))
    outline: BaseGeometry | None = None
    if length * height - areas.sum() > _NO_AREA:
        flat = np.column_stack([x - x.min(), corners[:, 2] - origin[2]])
        outline = shapely.union_all(
            [
                Polygon(triangle)
                for triangle in np.round(flat, 3).reshape(-1, 3, 2)
            ],
            grid_size=1.0 / _MM,
        )
    is_plane = bool(np.ptp(aside) <= bent)
    return Panel(
        building, origin, along, length, height, outline, triangles, is_plane
    )
