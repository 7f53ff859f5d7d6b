"""Walls around an outline, with their windows, ledges and pilasters.

Walls are mitred at the corners of the outline, so that a ledge runs around
these corners.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
import itertools

import numpy as np
from numpy.typing import ArrayLike

from cns_drake.city.facades.reliefs import Band, Relief, lifted
from cns_drake.city.facades.wall_cells import (
    Corner,
    Quads,
    WallCells,
    breaks,
    glass_quads,
    wall_quads,
)
from cns_drake.city.geometry.mesh import Mesh

Layout = Callable[[int, float], Sequence[Relief]]


def _no_relief(edge: int, length: float) -> Sequence[Relief]:
    return ()


@dataclass(frozen=True)
class Facade:
    """The walls of one or several storeys, for any polygon.

    Attributes:
        height: height of the walls [m].
        bands: strips around the building; a later strip covers an earlier
            strip. All other parts of the wall have depth 0.
        layout: function that takes the number and the length [m] of an edge,
            and returns the reliefs of its wall. A later relief covers an
            earlier relief.
        glass: depths of reliefs whose fronts are glass [m]. `facade_mesh`
            leaves these fronts open, and `glass_mesh` returns their panes.
        plain: numbers of the edges whose walls have no relief, such as walls
            against a neighbour. Bands of other walls end flush with such a
            wall.
    """

    height: float
    bands: tuple[Band, ...] = ()
    layout: Layout = _no_relief
    glass: tuple[float, ...] = ()
    plain: frozenset[int] = frozenset()

    def stacked(self, count: int) -> Facade:
        """Returns a facade that repeats this one `count` times upwards."""
        bands = tuple(lifted(b, k * self.height) for k in range(count)
                      for b in self.bands)  # fmt: skip

        def layout(edge: int, length: float) -> Sequence[Relief]:
            return tuple(
                lifted(relief, k * self.height)
                for relief in self.layout(edge, length)
                for k in range(count)
            )

        height = count * self.height
        return Facade(height, bands, layout, self.glass, self.plain)


def facade_mesh(points: ArrayLike, facade: Facade, z0: float = 0.0) -> Mesh:
    """Returns the walls around an outline, without their glass.

    The walls are open at the bottom and the top. Walls stacked on the same
    outline join without gaps.

    Args:
        points: (N, 2) corners of the outline, counter-clockwise [m].
        facade: description of the walls.
        z0: height of the foot of the walls [m].

    Raises:
        ValueError: a window, door or other relief extends beyond its wall.
    """
    return _quads_mesh(points, facade, z0, wall_quads)


def glass_mesh(points: ArrayLike, facade: Facade, z0: float = 0.0) -> Mesh:
    """Returns the panes for the windows that `facade_mesh` leaves open.

    The arguments are the same as those of `facade_mesh`.
    """
    return _quads_mesh(points, facade, z0, glass_quads)


def single_wall(
    length: float,
    height: float,
    reliefs: Sequence[Relief],
    fronts: Sequence[Iterable[float]],
) -> list[Mesh]:
    """Returns a wall that touches no other wall, and its panes.

    The first mesh is the wall, without panes. Then follows one mesh of panes
    for each entry of `fronts`. All meshes are in wall coordinates.

    Args:
        length: length of the wall [m].
        height: height of the wall [m].
        reliefs: reliefs; later reliefs cover earlier reliefs. Reliefs must not
            touch the ends of the wall.
        fronts: for each mesh of panes, the depths of the reliefs with these
            panes [m].

    Raises:
        ValueError: a relief extends beyond the wall.
    """
    zs = breaks(height, [v for r in reliefs for v in (r.z0, r.z1)])
    rows = np.zeros(len(zs) - 1, dtype=int)
    grid = WallCells.from_reliefs(length, zs, rows, (), reliefs)
    left_out = tuple(itertools.chain(*fronts))
    found = [wall_quads(grid, left_out)]
    found += [glass_quads(grid, tuple(depths)) for depths in fronts]
    meshes = []
    for quads in found:
        corners = [(x, -depth, z) for quad in quads for x, z, depth, _ in quad]
        # Panel coordinates are left-handed.
        faces = np.arange(len(corners)).reshape(-1, 4)[:, ::-1].tolist()
        vertices = np.array(corners).reshape(-1, 3)
        meshes.append(_welded(vertices, list(map(tuple, faces))))
    return meshes


def _quads_mesh(
    points: ArrayLike,
    facade: Facade,
    z0: float,
    quads_of: Callable[[WallCells, tuple[float, ...]], Quads],
) -> Mesh:
    points = np.asarray(points, dtype=float)
    parts = [np.zeros((0, 3))]
    for edge in range(len(points)):
        grid, place = _panel(points, edge, facade)
        corners = list(itertools.chain(*quads_of(grid, facade.glass)))
        if corners:
            z = [z0 + corner.z for corner in corners]
            parts.append(np.column_stack([place(corners), z]))
    vertices = np.concatenate(parts)
    return _welded(vertices, np.arange(len(vertices)).reshape(-1, 4).tolist())


def _welded(vertices: np.ndarray, faces: Sequence[Sequence[int]]) -> Mesh:
    """Returns the mesh with vertices merged that coincide within 1 um."""
    keys = np.round(vertices, 6)
    unique, inverse = np.unique(keys, axis=0, return_inverse=True)
    inverse = inverse.reshape(-1)
    return Mesh(unique, tuple(tuple(int(inverse[i]) for i in f) for f in faces))


def _panel(
    points: np.ndarray, edge: int, facade: Facade
) -> tuple[WallCells, Callable[[Sequence[Corner]], np.ndarray]]:
    """Returns the cells of one wall, and a function that places their corners.

    The function takes N corners and returns their positions (N, 2).

    At the ends of the wall, corners of its faces meet corners of the faces of
    the neighbouring walls.
    """
    count = len(points)
    before, after = (edge - 1) % count, (edge + 1) % count
    directions = []
    for k in (before, edge, after):
        side = points[(k + 1) % count] - points[k]
        directions.append(side / np.hypot(*side))
    along = directions[1]
    inward = np.array([-along[1], along[0]])
    length = float(np.hypot(*(points[after] - points[edge])))
    is_plain = edge in facade.plain
    reliefs = () if is_plain else facade.layout(edge, length)
    bounds = [v for r in (*reliefs, *facade.bands) for v in (r.z0, r.z1)]
    zs = breaks(facade.height, bounds)
    ends = _neighbour_depths(facade, zs, (before, after))
    rows = np.zeros(len(zs) - 1, dtype=int)
    if {before, edge, after} & facade.plain:
        steps = (np.diff(ends[:, 1:-1], axis=1) != 0).any(axis=0)
        rows[1:] = np.cumsum(steps)
    bands = () if is_plain else facade.bands
    grid = WallCells.from_reliefs(length, zs, rows, bands, reliefs)

    def place(corners: Sequence[Corner]) -> np.ndarray:
        x, _, depth, row = np.array(corners).T
        start, end = ends[:, row.astype(int) + 1]
        first = _corner_shift(directions[0], along, depth, start)
        last = x - _corner_shift(along, directions[2], depth, end)
        x = np.where(x == 0.0, first, np.where(x == grid.xs[-1], last, x))
        return points[edge] + np.outer(x, along) + np.outer(depth, inward)

    return grid, place


def _neighbour_depths(
    facade: Facade, zs: list[float], neighbours: tuple[int, int]
) -> np.ndarray:
    """Returns the depths of the two neighbouring walls, row by row [m].

    The result (2, R + 2) contains the depths in the R rows between the heights
    `zs`. The first and the last depth of each wall are 0, because all cells are
    closed back to depth 0 below and above a wall.
    """
    depths = np.zeros((2, len(zs) + 1))
    for row, z in enumerate((np.array(zs[1:]) + zs[:-1]) / 2, start=1):
        inside = [band for band in facade.bands if band.z0 < z < band.z1]
        for end, neighbour in enumerate(neighbours):
            if inside and neighbour not in facade.plain:
                depths[end, row] = inside[-1].depth
    return depths


def _corner_shift(
    a: np.ndarray, b: np.ndarray, depth: np.ndarray, other: np.ndarray
) -> np.ndarray | float:
    """Returns how much a wall at `depth` is shortened at a corner [m].

    `a` and `b` are the directions of the two walls, and t is the angle by which
    the outline turns at the corner. If the first wall's line is moved inwards
    by `depth` and the other wall's line by `other`, the lines meet at the
    distance (other - depth cos t) / sin t from the corner, measured along the
    first wall. For equal depths, this distance is depth tan(t / 2).
    """
    cosine, sine = float(a @ b), float(a[0] * b[1] - a[1] * b[0])
    return 0.0 if abs(sine) < 1e-6 else (other - depth * cosine) / sine
