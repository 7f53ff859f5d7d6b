"""The cells of one wall and the faces between them.

Cells are the rectangles that the edges of all patches cut a wall into, each
with one depth. Faces are found from the depths alone: fronts, and reveals
wherever two neighbouring cells differ.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
import itertools
import math
from typing import NamedTuple

import numpy as np

# Patches keep this distance from the ends of a wall: two walls meet there, and
# close only if their relief is the same [m].
END_MARGIN_M = 0.01

# Chords of an arch, for narrow windows and for anything wider than 2 m.
_NARROW_ARCH, _WIDE_ARCH, _WIDE_ARCH_M = 4, 6, 2.0


class Band(NamedTuple):
    """A strip of wall that runs around the building at one depth [m]."""

    z0: float
    z1: float
    depth: float


class Patch(NamedTuple):
    """A rectangle of the wall pushed inwards (or out, depth < 0) [m]."""

    x0: float
    x1: float
    z0: float
    z1: float
    depth: float


class Arch(NamedTuple):
    """A round-headed recess; the head is half an ellipse above z_spring.

    It must lie on wall of depth 0, and nothing may be painted over it.
    """

    x0: float
    x1: float
    z0: float
    z_spring: float
    z1: float
    depth: float


Relief = Patch | Arch


class Corner(NamedTuple):
    """A corner of a face of a wall; `row` is the row of cells it bounds."""

    x: float
    z: float
    depth: float
    row: int


@dataclass(frozen=True)
class WallCells:
    """The cells of one wall: their breaks, their depths, and its arches.

    Only rows of the same group may share a face, because the others end
    at different places.
    """

    xs: list[float]
    zs: list[float]
    groups: np.ndarray
    depths: np.ndarray
    hidden: np.ndarray  # True where an arch brings its own faces.
    arches: tuple[Arch, ...]

    @staticmethod
    def painted(
        length: float,
        zs: list[float],
        groups: np.ndarray,
        bands: Sequence[Band],
        reliefs: Sequence[Relief],
    ) -> WallCells:
        """Paints bands, then reliefs, on a wall that `zs` cuts into rows.

        Raises:
            ValueError: a relief leaves the wall, or an arch lies on cells
                of another depth than 0.
        """
        for relief in reliefs:
            if (
                relief.x0 < END_MARGIN_M
                or relief.x1 > length - END_MARGIN_M
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


Quads = Iterator[list[Corner]]


def wall_quads(grid: WallCells, glass: tuple[float, ...]) -> Quads:
    """Yields quads of `Corner`, counter-clockwise seen from outside."""
    for arch in grid.arches:
        yield from _arch_reveals(arch)
        if arch.depth not in glass:
            yield from _arch_back(arch)
    left_out = grid.hidden | np.isin(grid.depths, glass)
    yield from _front_quads(grid, left_out)
    yield from _reveal_quads(grid)


def glass_quads(grid: WallCells, glass: tuple[float, ...]) -> Quads:
    """Yields the fronts at the depths of glass, which the wall leaves out."""
    for arch in grid.arches:
        if arch.depth in glass:
            yield from _arch_back(arch)
    left_out = grid.hidden | ~np.isin(grid.depths, glass)
    yield from _front_quads(grid, left_out)


def breaks(end: float, values: Sequence[float]) -> list[float]:
    """Returns 0, the distinct values between it and `end`, and `end` [m]."""
    inner = {round(float(v), 3) for v in values}
    return [0.0, *sorted(v for v in inner if 1e-4 < v < end - 1e-4), end]


def _span(breaks: list[float], low: float, high: float) -> slice:
    array = np.array(breaks)
    first, last = np.searchsorted(array, [low - 6e-4, high - 6e-4])
    return slice(int(first), int(last))


def _front_quads(grid: WallCells, left_out: np.ndarray) -> Quads:
    """Yields the fewest fronts that a simple greedy merging finds."""
    xs, zs, depths = grid.xs, grid.zs, grid.depths
    groups = np.broadcast_to(grid.groups[:, None], depths.shape)
    keys = np.stack([depths, groups])
    wide = _merged(keys, left_out)
    tall = [
        (i0, i1, j0, j1)
        for j0, j1, i0, i1 in _merged(keys.transpose(0, 2, 1), left_out.T)
    ]
    for i0, i1, j0, j1 in min(wide, tall, key=len):
        d = depths[i0, j0]
        yield [
            Corner(xs[j0], zs[i0], d, i0),
            Corner(xs[j1], zs[i0], d, i0),
            Corner(xs[j1], zs[i1], d, i0),
            Corner(xs[j0], zs[i1], d, i0),
        ]


def _merged(
    keys: np.ndarray, left_out: np.ndarray
) -> list[tuple[int, int, int, int]]:
    """Covers cells of equal keys by (row0, row1, column0, column1) blocks."""
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
    """Yields the faces across the steps between cells of other depth."""
    xs, zs, depths = grid.xs, grid.zs, grid.depths
    num_rows, num_columns = depths.shape
    for j in range(1, num_columns):
        steps = [(depths[i, j - 1], depths[i, j]) for i in range(num_rows)]
        for i0, i1, (left, right) in _runs(steps):
            yield [
                Corner(xs[j], zs[i0], left, i0),
                Corner(xs[j], zs[i0], right, i0),
                Corner(xs[j], zs[i1], right, i0),
                Corner(xs[j], zs[i1], left, i0),
            ]
    closed = np.vstack([np.zeros(num_columns), depths, np.zeros(num_columns)])
    for i in range(num_rows + 1):
        steps = [(closed[i, j], closed[i + 1, j]) for j in range(num_columns)]
        for j0, j1, (below, above) in _runs(steps):
            yield [
                Corner(xs[j0], zs[i], below, i - 1),
                Corner(xs[j1], zs[i], below, i - 1),
                Corner(xs[j1], zs[i], above, i),
                Corner(xs[j0], zs[i], above, i),
            ]


def _runs(
    steps: list[tuple[float, float]],
) -> Iterator[tuple[int, int, tuple[float, float]]]:
    """Yields (start, end, step) of equal neighbours that are real steps."""
    start = 0
    for k in range(1, len(steps) + 1):
        if k == len(steps) or steps[k] != steps[start]:
            if steps[start][0] != steps[start][1]:
                yield start, k, steps[start]
            start = k


def _arch_outline(arch: Arch) -> tuple[list[float], list[float]]:
    """Returns x and z of the head's points, left to right."""
    middle, half = (arch.x0 + arch.x1) / 2, (arch.x1 - arch.x0) / 2
    rise = arch.z1 - arch.z_spring
    count = _WIDE_ARCH if 2 * half > _WIDE_ARCH_M else _NARROW_ARCH
    angles = np.linspace(math.pi, 0.0, count + 1)
    x = [middle + half * math.cos(a) for a in angles]
    z = [arch.z_spring + rise * math.sin(a) for a in angles]
    # The exact value, so that jambs and spandrels meet.
    x[0], x[-1] = arch.x0, arch.x1
    z[0] = z[-1] = arch.z_spring
    return x, z


def _arch_reveals(arch: Arch) -> Quads:
    """Yields spandrels, soffit, jambs and the floor of an arch."""
    (x, z), d = _arch_outline(arch), arch.depth
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
    """Yields the back wall of an arch, slice upon slice."""
    (x, z), d = _arch_outline(arch), arch.depth
    n = len(x) - 1
    slices = [((x[0], arch.z0), (x[n], arch.z0), (x[n], z[n]), (x[0], z[0]))]
    for k in range(n // 2):
        low = (x[k], z[k]), (x[n - k], z[k])
        high = (x[n - k - 1], z[k + 1]), (x[k + 1], z[k + 1])
        slices.append((*low, *high))
    for corners in slices:
        yield _face(*((corner, d) for corner in corners))


def _face(*corners: tuple[tuple[float, float], float]) -> list[Corner]:
    """Corners of a face inside a wall, each ((x, z), depth)."""
    return [Corner(x, z, depth, 0) for (x, z), depth in corners]
