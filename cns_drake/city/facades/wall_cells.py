"""The cells of one wall, each with one depth, and the faces between them.

Patches on a wall divide the wall into cells. The depths of the cells determine
the whole surface, with every reveal, sill and ledge. The surface is closed for
any patches. Coordinates are panel coordinates, as in
`cns_drake.city.facades.reliefs`.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
import itertools
import math
from typing import NamedTuple

import numpy as np

from cns_drake.city.facades.reliefs import Arch, Band, Relief

# Patches keep this distance from the ends of a wall [m]: two walls meet there,
# and the corner is closed only if their reliefs are the same.
_END_MARGIN_M = 0.01
# Number of chords of an arch that is not wide.
_NARROW_ARCH_CHORDS = 4
# Number of chords of a wide arch.
_WIDE_ARCH_CHORDS = 6
# An arch wider than this is wide [m].
_WIDE_ARCH_M = 2.0


class Corner(NamedTuple):
    """A corner of a face of a wall: x along the wall, z up, depth inwards [m].

    `row` is the number of the row of cells to which the face belongs.
    """

    x: float
    z: float
    depth: float
    row: int


@dataclass(frozen=True)
class WallCells:
    """The cells of one wall, in R rows and C columns.

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
    ) -> WallCells:
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
        return WallCells(xs, zs, groups, depths, hidden, arches)


# The four corners of each of several faces.
Quads = Iterator[list[Corner]]


def wall_quads(grid: WallCells, glass: tuple[float, ...]) -> Quads:
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


def glass_quads(grid: WallCells, glass: tuple[float, ...]) -> Quads:
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


def _front_quads(grid: WallCells, left_out: np.ndarray) -> Quads:
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
            Corner(xs[j0], zs[i0], d, i0),
            Corner(xs[j1], zs[i0], d, i0),
            Corner(xs[j1], zs[i1], d, i0),
            Corner(xs[j0], zs[i1], d, i0),
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


def _reveal_quads(grid: WallCells) -> Quads:
    """Yields the faces between neighbouring cells of different depths."""
    xs, zs, depths = grid.xs, grid.zs, grid.depths
    num_rows, num_columns = depths.shape
    for j in range(1, num_columns):
        steps = [(depths[i, j - 1], depths[i, j]) for i in range(num_rows)]
        for i0, i1, (left, right) in _step_runs(steps):
            yield [
                Corner(xs[j], zs[i0], left, i0),
                Corner(xs[j], zs[i0], right, i0),
                Corner(xs[j], zs[i1], right, i0),
                Corner(xs[j], zs[i1], left, i0),
            ]
    closed = np.vstack([np.zeros(num_columns), depths, np.zeros(num_columns)])
    for i in range(num_rows + 1):
        steps = [(closed[i, j], closed[i + 1, j]) for j in range(num_columns)]
        for j0, j1, (below, above) in _step_runs(steps):
            yield [
                Corner(xs[j0], zs[i], below, i - 1),
                Corner(xs[j1], zs[i], below, i - 1),
                Corner(xs[j1], zs[i], above, i),
                Corner(xs[j0], zs[i], above, i),
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


def _arch_reveals(arch: Arch) -> Quads:
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


def _arch_back(arch: Arch) -> Quads:
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


def _face(*corners: tuple[tuple[float, float], float]) -> list[Corner]:
    """Returns a face inside a wall, from corners ((x, z), depth)."""
    return [Corner(x, z, depth, 0) for (x, z), depth in corners]
