"""Walls with relief: windows, ledges and pilasters as a grid of depths.

A wall is described in its own panel coordinates: x along the wall seen from
outside (left to right), z up, depth inwards (negative: sticks out). Patches
painted on the panel give each rectangle a depth; the surface between them,
with every reveal, sill and ledge, follows from the depths alone and is closed
for any patches. Walls around a polygon are mitred at its corners, so that a
ledge runs around them.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import NamedTuple, TypeVar

import numpy as np
from numpy.typing import ArrayLike

from cns_drake.city.buildings.parts.wall_cells import (
    Arch,
    Band,
    Corner,
    Patch,
    Quads,
    Relief,
    WallCells,
    breaks,
    glass_quads,
    wall_quads,
)
from cns_drake.city.geometry.mesh import Mesh

__all__ = [
    "Arch",
    "Band",
    "Facade",
    "Layout",
    "Patch",
    "Relief",
    "facade_mesh",
    "glass_mesh",
]


Layout = Callable[[int, float], Sequence[Relief]]


_Strip = TypeVar("_Strip", Band, Relief)


def _no_relief(edge: int, length: float) -> Sequence[Relief]:
    return ()


@dataclass(frozen=True)
class Facade:
    """The walls of one or several storeys, for any polygon.

    Attributes:
        height: [m].
        bands: strips around the building, painted in order; else depth 0.
        layout: (edge index, edge length [m]) -> patches, painted in order.
        glass: depths whose fronts are glass; `facade_mesh` leaves them open
            for `glass_mesh` or a pane behind all windows to close.
        plain: edges without any relief, where bands end flush: walls
            against a neighbour. They meet the others at real corners.
    """

    height: float
    bands: tuple[Band, ...] = ()
    layout: Layout = _no_relief
    glass: tuple[float, ...] = ()
    plain: frozenset[int] = frozenset()

    def stacked(self, count: int) -> Facade:
        """Returns `count` copies of these storeys on top of one another."""
        bands = tuple(_lifted(b, k * self.height) for k in range(count)
                      for b in self.bands)  # fmt: skip

        def layout(edge: int, length: float) -> Sequence[Relief]:
            return tuple(
                _lifted(relief, k * self.height)
                for relief in self.layout(edge, length)
                for k in range(count)
            )

        height = count * self.height
        return Facade(height, bands, layout, self.glass, self.plain)


def _lifted(item: _Strip, dz: float) -> _Strip:
    moved = {
        name: getattr(item, name) + dz
        for name in item._fields
        if name.startswith("z")
    }
    return item._replace(**moved)


def facade_mesh(points: ArrayLike, facade: Facade, z0: float = 0.0) -> Mesh:
    """Returns the walls around a polygon, without their glass.

    Args:
        points: (N, 2) corners of the zero-depth outline, counter-clockwise.
        facade: what the walls look like.
        z0: height of the bottom of the walls [m].

    Returns:
        Walls open at bottom and top: at both ends every cell is closed back
        to depth 0, so walls stacked on the same outline join without gaps.

    Raises:
        ValueError: a patch leaves its wall.
    """
    return _quads_mesh(points, facade, z0, wall_quads)


def glass_mesh(points: ArrayLike, facade: Facade, z0: float = 0.0) -> Mesh:
    """Returns the glass that `facade_mesh` leaves out."""
    return _quads_mesh(points, facade, z0, glass_quads)


def _quads_mesh(
    points: ArrayLike,
    facade: Facade,
    z0: float,
    quads_of: Callable[[WallCells, tuple[float, ...]], Quads],
) -> Mesh:
    points = np.asarray(points, dtype=float)
    vertices: list[np.ndarray] = []
    faces: list[tuple[int, ...]] = []
    for edge in range(len(points)):
        panel = _Panel(points, edge, facade, z0)
        for quad in quads_of(panel.grid, facade.glass):
            faces.append(tuple(range(len(vertices), len(vertices) + 4)))
            vertices.extend(panel.place(corner) for corner in quad)
    return _welded(np.array(vertices).reshape(-1, 3), faces)


def _welded(vertices: np.ndarray, faces: list[tuple[int, ...]]) -> Mesh:
    """Returns the mesh with coinciding vertices (to 1 um) merged."""
    keys = np.round(vertices, 6)
    unique, inverse = np.unique(keys, axis=0, return_inverse=True)
    inverse = inverse.reshape(-1)
    return Mesh(unique, tuple(tuple(int(inverse[i]) for i in f) for f in faces))


class _Panel:
    """One wall: its cells, and how they meet those of its neighbours."""

    def __init__(
        self, points: np.ndarray, edge: int, facade: Facade, z0: float
    ) -> None:
        count = len(points)
        before, after = (edge - 1) % count, (edge + 1) % count
        directions = []
        for k in (before, edge, after):
            side = points[(k + 1) % count] - points[k]
            directions.append(side / np.hypot(*side))
        self._start, self._z0 = points[edge], z0
        self._along = directions[1]
        self._inward = np.array([-self._along[1], self._along[0]])
        self._turns = [
            _Turn.between(*directions[:2]),
            _Turn.between(*directions[1:]),
        ]
        length = float(np.hypot(*(points[after] - points[edge])))
        is_plain = edge in facade.plain
        reliefs = () if is_plain else facade.layout(edge, length)
        zs = _levels(facade, reliefs)
        middles = (np.array(zs[1:]) + zs[:-1]) / 2
        # The depths at the ends of the neighbouring walls, row by row. Above
        # and below the wall every cell closes back to depth 0.
        ends = np.zeros((2, len(zs) + 1))
        for end, neighbour in enumerate((before, after)):
            if neighbour not in facade.plain:
                ends[end, 1:-1] = [_band_depth(facade, z) for z in middles]
        self._ends = ends
        rows = np.zeros(len(zs) - 1, dtype=int)
        if {before, edge, after} & facade.plain:
            steps = (np.diff(ends[:, 1:-1], axis=1) != 0).any(axis=0)
            rows[1:] = np.cumsum(steps)
        bands = () if is_plain else facade.bands
        self.grid = WallCells.painted(length, zs, rows, bands, reliefs)

    def place(self, corner: Corner) -> np.ndarray:
        """Returns the position of a corner in the building's frame."""
        x, z, depth, row = corner
        if x == 0.0:
            x = self._turns[0].shift(depth, self._ends[0, row + 1])
        elif x == self.grid.xs[-1]:
            x -= self._turns[1].shift(depth, self._ends[1, row + 1])
        p = self._start + x * self._along + depth * self._inward
        return np.array([p[0], p[1], self._z0 + z])


class _Turn(NamedTuple):
    """The angle at a corner of the outline."""

    cosine: float
    sine: float

    @staticmethod
    def between(a: np.ndarray, b: np.ndarray) -> _Turn:
        return _Turn(float(a @ b), float(a[0] * b[1] - a[1] * b[0]))

    def shift(self, depth: float, other: float) -> float:
        """Returns by how much a wall at `depth` shortens at this corner.

        Two lines that leave the corner at the turn t, moved inwards by
        `depth` and `other`, meet (other - depth cos t) / sin t along the
        first one; for equal depths this is depth tan(t / 2).
        """
        if abs(self.sine) < 1e-6:
            return 0.0
        return (other - depth * self.cosine) / self.sine


def _levels(facade: Facade, reliefs: Sequence[Relief]) -> list[float]:
    bounds = [v for r in (*reliefs, *facade.bands) for v in (r.z0, r.z1)]
    return breaks(facade.height, bounds)


def _band_depth(facade: Facade, z: float) -> float:
    depth = 0.0
    for band in facade.bands:
        if band.z0 < z < band.z1:
            depth = band.depth
    return depth
