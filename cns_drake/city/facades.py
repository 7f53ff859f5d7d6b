"""Walls with relief: windows, ledges and pilasters as a grid of depths.

A wall is described in its own panel coordinates: x along the wall seen from
outside (left to right), z up, depth inwards (negative: sticks out). Patches
painted on the panel give each rectangle a depth; the surface between them,
with every reveal, sill and ledge, follows from the depths alone and is
therefore closed, whatever is painted. Walls around a polygon are mitred at
its corners, so that a ledge runs around them.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
import itertools
import math
from typing import NamedTuple

import numpy as np

from cns_drake.city.mesh import Mesh

# Patches keep this distance from the ends of a wall: there two walls meet
# and must have the same relief to close [m].
END_MARGIN_M = 0.01

# Chords of an arch, for narrow windows and for anything wider than 2 m.
_NARROW_ARCH, _WIDE_ARCH, _WIDE_ARCH_M = 4, 6, 2.0


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


class Band(NamedTuple):
    """A strip of wall that runs around the building at one depth [m]."""

    z0: float
    z1: float
    depth: float


Relief = Patch | Arch
Layout = Callable[[int, float], Sequence[Relief]]


def _no_relief(edge: int, length: float) -> Sequence[Relief]:
    return ()


@dataclass(frozen=True)
class Facade:
    """The walls of one or several storeys, whatever polygon they follow.

    Attributes:
        height: [m].
        bands: strips around the building, painted in order; else depth 0.
        layout: (edge index, edge length [m]) -> patches, painted in order.
        glass: depths whose fronts are glass; `facade_mesh` leaves them open
            for `glass_mesh` or a pane behind all windows to close.
    """

    height: float
    bands: tuple[Band, ...] = ()
    layout: Layout = _no_relief
    glass: tuple[float, ...] = ()

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

        return Facade(count * self.height, bands, layout, self.glass)


def _lifted(item, dz: float):
    moved = {
        name: getattr(item, name) + dz
        for name in item._fields
        if name.startswith("z")
    }
    return item._replace(**moved)


def facade_mesh(points, facade: Facade, z0: float = 0.0) -> Mesh:
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
    return _quads_mesh(points, facade, z0, _wall_quads)


def glass_mesh(points, facade: Facade, z0: float = 0.0) -> Mesh:
    """Returns the glass that `facade_mesh` leaves out."""
    return _quads_mesh(points, facade, z0, _glass_quads)


def _quads_mesh(points, facade: Facade, z0: float, quads_of) -> Mesh:
    points = np.asarray(points, dtype=float)
    vertices: list[np.ndarray] = []
    faces: list[tuple[int, ...]] = []
    for edge in range(len(points)):
        panel = _Panel(points, edge, z0)
        reliefs = facade.layout(edge, panel.length)
        grid = _Grid.painted(panel.length, facade, reliefs)
        for quad in quads_of(grid, facade.glass):
            faces.append(tuple(range(len(vertices), len(vertices) + 4)))
            vertices.extend(panel.place(x, z, depth) for x, z, depth in quad)
    return _welded(np.array(vertices).reshape(-1, 3), faces)


def _welded(vertices: np.ndarray, faces) -> Mesh:
    """Returns the mesh with coinciding vertices (to 0.1 mm) merged."""
    keys = np.round(vertices, 4)
    unique, inverse = np.unique(keys, axis=0, return_inverse=True)
    inverse = inverse.reshape(-1)
    return Mesh(unique, tuple(tuple(int(inverse[i]) for i in f) for f in faces))


class _Panel:
    """Panel coordinates of one wall, mitred towards its neighbours."""

    def __init__(self, points: np.ndarray, edge: int, z0: float):
        count = len(points)
        start, end = points[edge], points[(edge + 1) % count]
        self.length = float(np.hypot(*(end - start)))
        self._start, self._z0 = start, z0
        self._along = (end - start) / self.length
        self._inward = np.array([-self._along[1], self._along[0]])
        before = start - points[edge - 1]
        after = points[(edge + 2) % count] - end
        self._shift_start = _mitre(before, self._along)
        self._shift_end = _mitre(self._along, after)

    def place(self, x: float, z: float, depth: float) -> np.ndarray:
        if x == 0.0:
            x = depth * self._shift_start
        elif x == self.length:
            x = self.length - depth * self._shift_end
        p = self._start + x * self._along + depth * self._inward
        return np.array([p[0], p[1], self._z0 + z])


def _mitre(before: np.ndarray, after: np.ndarray) -> float:
    """Returns how far an edge shortens per metre of inward offset.

    With the turn angle t at the corner, two lines moved inwards by d meet
    d tan(t / 2) before the corner.
    """
    cross = before[0] * after[1] - before[1] * after[0]
    turn = math.atan2(cross, float(before @ after))
    return math.tan(turn / 2)


@dataclass(frozen=True)
class _Grid:
    """The cells of one wall: their breaks, their depths, and its arches."""

    xs: list[float]
    zs: list[float]
    depths: np.ndarray
    hidden: np.ndarray  # True where an arch brings its own faces.
    arches: tuple[Arch, ...]

    @staticmethod
    def painted(
        length: float, facade: Facade, reliefs: Sequence[Relief]
    ) -> _Grid:
        for relief in reliefs:
            if (
                relief.x0 < END_MARGIN_M
                or relief.x1 > length - END_MARGIN_M
                or relief.z0 < -1e-6
                or relief.z1 > facade.height + 1e-6
            ):
                raise ValueError(f"{relief} leaves a wall of {length:.2f} m")
        xs = _breaks(length, [v for r in reliefs for v in (r.x0, r.x1)])
        levels = [v for r in (*reliefs, *facade.bands) for v in (r.z0, r.z1)]
        zs = _breaks(facade.height, levels)
        depths = np.zeros((len(zs) - 1, len(xs) - 1))
        hidden = np.zeros(depths.shape, dtype=bool)
        for band in facade.bands:
            depths[_span(zs, band.z0, band.z1), :] = band.depth
        arches = tuple(r for r in reliefs if isinstance(r, Arch))
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
        return _Grid(xs, zs, depths, hidden, arches)


def _wall_quads(grid: _Grid, glass: tuple[float, ...]):
    """Yields quads of (x, z, depth) corners, counter-clockwise outside."""
    for arch in grid.arches:
        yield from _arch_reveals(arch)
        if arch.depth not in glass:
            yield from _arch_back(arch)
    left_out = grid.hidden | np.isin(grid.depths, glass)
    yield from _front_quads(grid, left_out)
    yield from _reveal_quads(grid.xs, grid.zs, grid.depths)


def _glass_quads(grid: _Grid, glass: tuple[float, ...]):
    for arch in grid.arches:
        if arch.depth in glass:
            yield from _arch_back(arch)
    left_out = grid.hidden | ~np.isin(grid.depths, glass)
    yield from _front_quads(grid, left_out)


def _breaks(end: float, values: Sequence[float]) -> list[float]:
    inner = {round(float(v), 3) for v in values}
    return [0.0, *sorted(v for v in inner if 1e-4 < v < end - 1e-4), end]


def _span(breaks: list[float], low: float, high: float) -> slice:
    array = np.array(breaks)
    first, last = np.searchsorted(array, [low - 6e-4, high - 6e-4])
    return slice(int(first), int(last))


def _front_quads(grid: _Grid, left_out: np.ndarray):
    """Yields the fewest fronts that a simple greedy merging finds."""
    xs, zs, depths = grid.xs, grid.zs, grid.depths
    wide = _merged(depths, left_out)
    tall = [
        (i0, i1, j0, j1) for j0, j1, i0, i1 in _merged(depths.T, left_out.T)
    ]
    for i0, i1, j0, j1 in min(wide, tall, key=len):
        d = depths[i0, j0]
        yield [
            (xs[j0], zs[i0], d),
            (xs[j1], zs[i0], d),
            (xs[j1], zs[i1], d),
            (xs[j0], zs[i1], d),
        ]


def _merged(depths, left_out) -> list[tuple[int, int, int, int]]:
    """Covers equal cells by (row0, row1, column0, column1) blocks."""
    todo = ~left_out
    blocks = []
    num_rows, num_columns = depths.shape
    for i in range(num_rows):
        for j in range(num_columns):
            if not todo[i, j]:
                continue
            same = todo & (depths == depths[i, j])
            j1 = j + 1
            while j1 < num_columns and same[i, j1]:
                j1 += 1
            i1 = i + 1
            while i1 < num_rows and same[i1, j:j1].all():
                i1 += 1
            todo[i:i1, j:j1] = False
            blocks.append((i, i1, j, j1))
    return blocks


def _reveal_quads(xs, zs, depths):
    """Yields the faces across the steps between cells of other depth."""
    num_rows, num_columns = depths.shape
    for j in range(1, num_columns):
        steps = [(depths[i, j - 1], depths[i, j]) for i in range(num_rows)]
        for i0, i1, (left, right) in _runs(steps):
            yield [
                (xs[j], zs[i0], left),
                (xs[j], zs[i0], right),
                (xs[j], zs[i1], right),
                (xs[j], zs[i1], left),
            ]
    closed = np.vstack([np.zeros(num_columns), depths, np.zeros(num_columns)])
    for i in range(num_rows + 1):
        steps = [(closed[i, j], closed[i + 1, j]) for j in range(num_columns)]
        for j0, j1, (below, above) in _runs(steps):
            yield [
                (xs[j0], zs[i], below),
                (xs[j1], zs[i], below),
                (xs[j1], zs[i], above),
                (xs[j0], zs[i], above),
            ]


def _runs(steps):
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
    # Exactly, so that jambs and spandrels meet.
    x[0], x[-1] = arch.x0, arch.x1
    z[0] = z[-1] = arch.z_spring
    return x, z


def _arch_reveals(arch: Arch):
    """Yields spandrels, soffit, jambs and the floor of an arch."""
    (x, z), d = _arch_outline(arch), arch.depth
    for k in range(len(x) - 1):
        a, b = (x[k], z[k]), (x[k + 1], z[k + 1])
        yield [
            (*a, 0.0),
            (*b, 0.0),
            (b[0], arch.z1, 0.0),
            (a[0], arch.z1, 0.0),
        ]
        yield [(*a, d), (*b, d), (*b, 0.0), (*a, 0.0)]
    left, right, low, spring = arch.x0, arch.x1, arch.z0, arch.z_spring
    corners = [(left, spring), (left, low), (right, low), (right, spring)]
    for a, b in itertools.pairwise(corners):
        yield [(*a, 0.0), (*b, 0.0), (*b, d), (*a, d)]


def _arch_back(arch: Arch):
    """Yields the back wall of an arch, slice upon slice."""
    (x, z), d = _arch_outline(arch), arch.depth
    n = len(x) - 1
    yield [
        (x[0], arch.z0, d),
        (x[n], arch.z0, d),
        (x[n], z[n], d),
        (x[0], z[0], d),
    ]
    for k in range(n // 2):
        yield [
            (x[k], z[k], d),
            (x[n - k], z[k], d),
            (x[n - k - 1], z[k + 1], d),
            (x[k + 1], z[k + 1], d),
        ]
