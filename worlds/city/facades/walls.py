"""Walls around an outline, with their windows, ledges and pilasters.

Walls are mitred at the corners of the outline, so that a ledge runs around
these corners.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
import itertools
import math
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from evaluation.base import dot
from worlds.city.facades.reliefs import Arch, Band, Relief, lifted
from worlds.shapes import Mesh

Layout = Callable[[int, float], Sequence[Relief]]
# Patches keep this distance from the ends of a wall [m]: two walls meet there,
# and the corner is closed only if their reliefs are the same.
_END_MARGIN_M = 0.01
# Number of chords of an arch that is not wide.
_NARROW_ARCH_CHORDS = 4
# Number of chords of a wide arch.
_WIDE_ARCH_CHORDS = 6
# An arch wider than this is wide [m].
_WIDE_ARCH_M = 2.0


def no_relief(edge: int, length: float) -> Sequence[Relief]:
    """A layout for walls without openings: it returns no reliefs."""
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
    layout: Layout = no_relief
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
    return _quads_mesh(points, facade, z0, _wall_quads)


def glass_mesh(points: ArrayLike, facade: Facade, z0: float = 0.0) -> Mesh:
    """Returns the panes for the windows that `facade_mesh` leaves open.

    The arguments are the same as those of `facade_mesh`.
    """
    return _quads_mesh(points, facade, z0, _glass_quads)


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
    grid = _WallCells.from_reliefs(length, zs, rows, (), reliefs)
    left_out = tuple(itertools.chain(*fronts))
    found = [_wall_quads(grid, left_out)]
    found += [_glass_quads(grid, tuple(depths)) for depths in fronts]
    meshes = []
    for quads in found:
        corners = [(x, -depth, z) for quad in quads for x, z, depth, _ in quad]
        # Panel coordinates are left-handed.
        faces = np.arange(len(corners)).reshape(-1, 4)[:, ::-1].tolist()
        vertices = np.array(corners).reshape(-1, 3)
        meshes.append(_welded(vertices, list(map(tuple, faces))))
    return meshes


class _Corner(NamedTuple):
    """A corner of a face of a wall: x along the wall, z up, depth inwards [m].

    `row` is the number of the row of cells to which the face belongs.
    """

    x: float
    z: float
    depth: float
    row: int


@dataclass(frozen=True)
class _WallCells:
    """The cells of one wall, in R rows and C columns.

    The patches on a wall divide it into cells. The depths of the cells
    determine the whole surface, with every reveal, sill and ledge; it is closed
    for any patches. Coordinates are panel coordinates, as in
    `worlds.city.facades.reliefs`.

    Attributes:
        xs: boundaries of the columns along the wall, increasing [m].
        zs: boundaries of the rows, increasing [m].
        groups: (R,) number of the group of each row. A face can span several
            rows only if they are in the same group.
        depths: (R, C) depth of each cell [m].
        hidden: (R, C) whether an arch covers the cell. An arch has faces of its
            own.
        arches: the arches of the wall.
    """

    xs: list[float]
    zs: list[float]
    groups: np.ndarray
    depths: np.ndarray
    hidden: np.ndarray
    arches: tuple[Arch, ...]

    @staticmethod
    def from_reliefs(
        length: float,
        zs: list[float],
        groups: np.ndarray,
        bands: Sequence[Band],
        reliefs: Sequence[Relief],
    ) -> _WallCells:
        """Divides a wall into cells of one depth each.

        Args:
            length: length of the wall [m].
            zs: increasing heights that divide the wall into R rows [m].
            groups: (R,) number of the group of each row. Faces of the wall's
                mesh can span several rows of one group, but not rows of
                different groups.
            bands: strips along the whole wall, each with its depth.
            reliefs: rectangles and arches on the wall, each with its depth;
                later reliefs cover earlier reliefs.

        Raises:
            ValueError: a relief extends beyond the wall, or an arch lies on
                cells whose depth is not 0.
        """
        for relief in reliefs:
            if (
                relief.x0 < _END_MARGIN_M
                or relief.x1 > length - _END_MARGIN_M
                or relief.z0 < -1e-6
                or relief.z1 > zs[-1] + 1e-6
            ):
                raise ValueError(f"{relief} leaves a wall of {length:.2f} m")
        xs = breaks(length, [v for r in reliefs for v in (r.x0, r.x1)])
        depths = np.zeros((len(zs) - 1, len(xs) - 1))
        hidden = np.zeros(depths.shape, dtype=bool)
        for band in bands:
            depths[_span(zs, band.z0, band.z1), :] = band.depth
        for relief in reliefs:
            cells = (
                _span(zs, relief.z0, relief.z1),
                _span(xs, relief.x0, relief.x1),
            )
            if isinstance(relief, Arch):
                hidden[cells] = True
            else:
                depths[cells] = relief.depth
        if depths[hidden].any():
            raise ValueError("an arch needs wall of depth 0 around it")
        arches = tuple(r for r in reliefs if isinstance(r, Arch))
        return _WallCells(xs, zs, groups, depths, hidden, arches)


# The four corners of each of several faces.
_Quads = Iterator[list[_Corner]]


def _wall_quads(grid: _WallCells, glass: tuple[float, ...]) -> _Quads:
    """Yields the four corners of each face of a wall, without its panes.

    The corners are counter-clockwise as seen from outside. Panes are the faces
    at the depths `glass` [m].
    """
    for arch in grid.arches:
        yield from _arch_reveals(arch)
        if arch.depth not in glass:
            yield from _arch_back(arch)
    left_out = grid.hidden | np.isin(grid.depths, glass)
    yield from _front_quads(grid, left_out)
    yield from _reveal_quads(grid)


def _glass_quads(grid: _WallCells, glass: tuple[float, ...]) -> _Quads:
    """Yields the four corners of each pane of a wall.

    The corners are counter-clockwise as seen from outside. Panes are the faces
    at the depths `glass` [m].
    """
    for arch in grid.arches:
        if arch.depth in glass:
            yield from _arch_back(arch)
    left_out = grid.hidden | ~np.isin(grid.depths, glass)
    yield from _front_quads(grid, left_out)


def breaks(end: float, values: Sequence[float]) -> list[float]:
    """Returns the boundaries of a wall's cells along one axis, sorted [m].

    The boundaries are 0, `end`, and all `values` between 0 and `end`, each only
    once and rounded to millimetres.
    """
    inner = {round(float(v), 3) for v in values}
    return [0.0, *sorted(v for v in inner if 1e-4 < v < end - 1e-4), end]


def _span(breaks: list[float], low: float, high: float) -> slice:
    array = np.array(breaks)
    first, last = np.searchsorted(array, [low - 6e-4, high - 6e-4])
    return slice(int(first), int(last))


def _front_quads(grid: _WallCells, left_out: np.ndarray) -> _Quads:
    """Yields the fronts of cells; cells of one depth are merged greedily."""
    xs, zs, depths = grid.xs, grid.zs, grid.depths
    groups = np.broadcast_to(grid.groups[:, None], depths.shape)
    keys = np.stack([depths, groups])
    wide = _merged_cells(keys, left_out)
    tall = [
        (i0, i1, j0, j1)
        for j0, j1, i0, i1 in _merged_cells(keys.transpose(0, 2, 1), left_out.T)
    ]
    for i0, i1, j0, j1 in min(wide, tall, key=len):
        d = depths[i0, j0]
        yield [
            _Corner(xs[j0], zs[i0], d, i0),
            _Corner(xs[j1], zs[i0], d, i0),
            _Corner(xs[j1], zs[i1], d, i0),
            _Corner(xs[j0], zs[i1], d, i0),
        ]


def _merged_cells(
    keys: np.ndarray, left_out: np.ndarray
) -> list[tuple[int, int, int, int]]:
    """Returns blocks (row0, row1, column0, column1) of cells with equal keys.

    Together they cover all cells that are not left out.
    """
    todo = ~left_out
    blocks = []
    num_rows, num_columns = todo.shape
    for i in range(num_rows):
        for j in range(num_columns):
            if not todo[i, j]:
                continue
            same = todo & (keys == keys[:, i, j, None, None]).all(axis=0)
            j1 = j + 1
            while j1 < num_columns and same[i, j1]:
                j1 += 1
            i1 = i + 1
            while i1 < num_rows and same[i1, j:j1].all():
                i1 += 1
            todo[i:i1, j:j1] = False
            blocks.append((i, i1, j, j1))
    return blocks


def _reveal_quads(grid: _WallCells) -> _Quads:
    """Yields the faces between neighbouring cells of different depths."""
    xs, zs, depths = grid.xs, grid.zs, grid.depths
    num_rows, num_columns = depths.shape
    for j in range(1, num_columns):
        steps = [(depths[i, j - 1], depths[i, j]) for i in range(num_rows)]
        for i0, i1, (left, right) in _step_runs(steps):
            yield [
                _Corner(xs[j], zs[i0], left, i0),
                _Corner(xs[j], zs[i0], right, i0),
                _Corner(xs[j], zs[i1], right, i0),
                _Corner(xs[j], zs[i1], left, i0),
            ]
    closed = np.vstack([np.zeros(num_columns), depths, np.zeros(num_columns)])
    for i in range(num_rows + 1):
        steps = [(closed[i, j], closed[i + 1, j]) for j in range(num_columns)]
        for j0, j1, (below, above) in _step_runs(steps):
            yield [
                _Corner(xs[j0], zs[i], below, i - 1),
                _Corner(xs[j1], zs[i], below, i - 1),
                _Corner(xs[j1], zs[i], above, i),
                _Corner(xs[j0], zs[i], above, i),
            ]


def _step_runs(
    steps: list[tuple[float, float]],
) -> Iterator[tuple[int, int, tuple[float, float]]]:
    """Yields start, end and step of each run of equal steps.

    A step is the pair of depths on its two sides. Runs in which the two depths
    are equal are left out.
    """
    start = 0
    for k in range(1, len(steps) + 1):
        if k == len(steps) or steps[k] != steps[start]:
            if steps[start][0] != steps[start][1]:
                yield start, k, steps[start]
            start = k


def _arch_outline(arch: Arch) -> tuple[list[float], list[float]]:
    """Returns x and z of the points on an arch's head, left to right."""
    middle, half = (arch.x0 + arch.x1) / 2, (arch.x1 - arch.x0) / 2
    rise = arch.z1 - arch.z_spring
    count = (
        _WIDE_ARCH_CHORDS if 2 * half > _WIDE_ARCH_M else _NARROW_ARCH_CHORDS
    )
    angles = np.linspace(math.pi, 0.0, count + 1)
    x = [middle + half * math.cos(a) for a in angles]
    z = [arch.z_spring + rise * math.sin(a) for a in angles]
    # The exact value, so that jambs and spandrels meet.
    x[0], x[-1] = arch.x0, arch.x1
    z[0] = z[-1] = arch.z_spring
    return x, z


def _arch_reveals(arch: Arch) -> _Quads:
    """Yields the faces of an arch between the wall and its back."""
    x, z = _arch_outline(arch)
    d = arch.depth
    head = list(zip(x, z, strict=True))
    for a, b in itertools.pairwise(head):
        over_a, over_b = (a[0], arch.z1), (b[0], arch.z1)
        yield _face((a, 0.0), (b, 0.0), (over_b, 0.0), (over_a, 0.0))
        yield _face((a, d), (b, d), (b, 0.0), (a, 0.0))
    left, right, low, spring = arch.x0, arch.x1, arch.z0, arch.z_spring
    rest = [(left, spring), (left, low), (right, low), (right, spring)]
    for a, b in itertools.pairwise(rest):
        yield _face((a, 0.0), (b, 0.0), (b, d), (a, d))


def _arch_back(arch: Arch) -> _Quads:
    """Yields the back wall of an arch, in horizontal slices."""
    x, z = _arch_outline(arch)
    d = arch.depth
    n = len(x) - 1
    slices = [((x[0], arch.z0), (x[n], arch.z0), (x[n], z[n]), (x[0], z[0]))]
    for k in range(n // 2):
        low = (x[k], z[k]), (x[n - k], z[k])
        high = (x[n - k - 1], z[k + 1]), (x[k + 1], z[k + 1])
        slices.append((*low, *high))
    for corners in slices:
        yield _face(*((corner, d) for corner in corners))


def _face(*corners: tuple[tuple[float, float], float]) -> list[_Corner]:
    """Returns a face inside a wall, from corners ((x, z), depth)."""
    return [_Corner(x, z, depth, 0) for (x, z), depth in corners]


def _quads_mesh(
    points: ArrayLike,
    facade: Facade,
    z0: float,
    quads_of: Callable[[_WallCells, tuple[float, ...]], _Quads],
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
) -> tuple[_WallCells, Callable[[Sequence[_Corner]], np.ndarray]]:
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
    grid = _WallCells.from_reliefs(length, zs, rows, bands, reliefs)

    def place(corners: Sequence[_Corner]) -> np.ndarray:
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
    cosine, sine = float(dot(a, b)), float(a[0] * b[1] - a[1] * b[0])
    return 0.0 if abs(sine) < 1e-6 else (other - depth * cosine) / sine
