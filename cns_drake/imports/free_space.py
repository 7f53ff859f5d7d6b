"""Where a car has room between the buildings of an imported city."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.ndimage import (
    binary_closing,
    distance_transform_edt,
    label,
)

from cns_drake.imports.foreign_city import Imported
from cns_drake.imports.import_ground import Ground

CELL = 1.0  # [m]
# A car passes below what hangs higher than this above the ground [m].
_HEADROOM = 3.5
# From the middle of a path to a wall, and to the edge of a road, at least [m].
_FROM_WALL = 2.5
_FROM_EDGE = 1.6
# Half of the widest street; what is wider open is outside the city [m].
_HALF_STREET = 20.0
_SAMPLE_SPACING = 0.5
# From the middle of a city room is looked for at most so far: no drive is
# longer [m].
_FARTHEST = 1500.0
# Of an edge that is not parted before, and points at once.
_MOST_STEPS = 256
_AT_ONCE = 1_000_000
# Roads are used where they hold at least so much connected room [m^2].
_LEAST_ROAD = 800.0


@dataclass(frozen=True)
class FreeSpace:
    """Room on a grid.

    Attributes:
        low: (2,) where the grid begins, the corner of its first cell [m].
        clearance: (rows along y, columns along x) from the middle of each
            cell to what stands nearest [m]; 0 where no car may be.
        on_roads: whether only roads of the file count.
        least: the clearance that a path needs [m].
    """

    low: np.ndarray
    clearance: np.ndarray
    on_roads: bool
    least: float

    def cells(self, xy: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Returns row and column of places (N, 2), clipped to the grid."""
        index = np.floor((xy - self.low) / CELL).astype(int)
        rows, columns = self.clearance.shape
        return (
            np.clip(index[:, 1], 0, rows - 1),
            np.clip(index[:, 0], 0, columns - 1),
        )

    def clearance_at(self, xy: np.ndarray) -> np.ndarray:
        """Returns the clearance at places (N, 2) [m]."""
        return self.clearance[self.cells(xy)]

    def middle(self, row: np.ndarray, column: np.ndarray) -> np.ndarray:
        """Returns the middles (N, 2) of cells [m]."""
        return self.low + CELL * (np.c_[column, row] + 0.5)


def find_free_space(
    structures: Sequence[Imported], ground: Ground
) -> FreeSpace:
    """Returns where a car has room, on roads if the file has any.

    Args:
        structures: of the whole city, all that ever stand.
        ground: below them.
    """
    low, high = _window(structures)
    size = np.ceil((high - low) / CELL).astype(int) + 1
    shape = (int(size[1]), int(size[0]))
    blocked = np.zeros(shape, dtype=bool)
    roads = np.zeros(shape, dtype=bool)
    water = np.zeros(shape, dtype=bool)
    for one in structures:
        if one.structure.semantic_class == "road":
            grid = roads
        elif one.kind.startswith("Water"):
            grid = water
        elif one.is_ground:
            continue
        else:
            grid = blocked
        highest, low_down = -np.inf, []
        for points in surface_samples(
            one.triangles, _SAMPLE_SPACING, (low, high)
        ):
            if grid is blocked:
                above = points[:, 2] - ground.height(points[:, :2])
                highest = max(highest, above.max())
                points = points[above < _HEADROOM]
            column, row = np.floor((points[:, :2] - low) / CELL).astype(int).T
            low_down.append(np.unique(row * shape[1] + column))
        # What is no higher than a kerb is driven over.
        if grid is blocked and highest < 0.3:
            continue
        for cells in low_down:
            grid.ravel()[cells] = True
    free = ~(blocked | (water & ~roads))
    on_roads = False
    paved = binary_closing(roads, iterations=1) & ~blocked
    if _largest(_clearance(paved) >= _FROM_EDGE) * CELL**2 >= _LEAST_ROAD:
        free, on_roads = paved, True
    elif blocked.any():
        free &= _between(blocked)
    least = _FROM_EDGE if on_roads else _FROM_WALL
    return FreeSpace(low, _clearance(free), on_roads, least)


def _clearance(free: np.ndarray) -> np.ndarray:
    """Returns the distance of each cell to one that is not free [m]."""
    # Beyond the grid there is nothing to drive on.
    return distance_transform_edt(np.pad(free, 1))[1:-1, 1:-1] * CELL


def _between(blocked: np.ndarray) -> np.ndarray:
    """Returns the cells that have buildings on both sides."""
    reach = int(_HALF_STREET / CELL)
    near = distance_transform_edt(~np.pad(blocked, 2 * reach)) <= reach
    return (distance_transform_edt(near) > reach)[
        2 * reach : -2 * reach, 2 * reach : -2 * reach
    ]


def _largest(cells: np.ndarray) -> int:
    """Returns how many cells the largest connected part has."""
    parts, number = label(cells, np.ones((3, 3)))
    return int(np.bincount(parts.ravel())[1:].max()) if number else 0


def _window(structures: Sequence[Imported]) -> tuple[np.ndarray, np.ndarray]:
    """Returns the corners (2,) of where room is looked for [m]."""
    boxes = np.array(
        [
            (s.triangles.min(axis=(0, 1)), s.triangles.max(axis=(0, 1)))
            for s in structures
        ]
    )[:, :, :2]
    middle = np.median(boxes.mean(axis=1), axis=0)
    low = np.maximum(boxes[:, 0].min(axis=0), middle - _FARTHEST)
    high = np.minimum(boxes[:, 1].max(axis=0), middle + _FARTHEST)
    return np.floor(low), np.maximum(high, np.floor(low))


def surface_samples(
    triangles: np.ndarray,
    spacing: float,
    window: tuple[np.ndarray, np.ndarray] | None = None,
) -> Iterator[np.ndarray]:
    """Yields points (N, 3) on triangles (M, 3, 3), edges included [m].

    No place on a triangle is farther from all of them than the spacing. There
    are not more than about a million at once.

    Args:
        triangles: to sample.
        spacing: of the points [m].
        window: (2,) least and greatest x and y; what is outside is left out.
    """
    for part, number in _in_pieces(triangles, spacing, window):
        i, j = np.meshgrid(np.arange(number + 1), np.arange(number + 1))
        inside = i + j <= number
        u, v = i[inside] / number, j[inside] / number
        weights = np.stack([1.0 - u - v, u, v], axis=1)
        most = max(1, _AT_ONCE // len(weights))
        for first in range(0, len(part), most):
            some = part[first : first + most]
            points = np.einsum("kc,mcx->mkx", weights, some).reshape(-1, 3)
            if window is not None:
                low, high = window
                xy = points[:, :2]
                points = points[((xy >= low) & (xy <= high)).all(axis=1)]
            if len(points):
                yield points


def _in_pieces(
    triangles: np.ndarray,
    spacing: float,
    window: tuple[np.ndarray, np.ndarray] | None,
) -> Iterator[tuple[np.ndarray, int]]:
    """Yields triangles of a size, and into how many steps to part an edge."""
    while len(triangles):
        if window is not None:
            low, high = window
            xy = triangles[:, :, :2]
            is_near = (xy.max(axis=1) >= low) & (xy.min(axis=1) <= high)
            triangles = triangles[is_near.all(axis=1)]
        edges = triangles - np.roll(triangles, 1, axis=1)
        longest = np.linalg.norm(edges, axis=2).max(axis=1)
        steps = np.maximum(1, np.ceil(longest / spacing)).astype(int)
        for number in np.unique(steps[steps <= _MOST_STEPS]):
            yield triangles[steps == number], int(number)
        # Large ones in four, so that what is far of them is left out.
        a, b, c = np.moveaxis(triangles[steps > _MOST_STEPS], 1, 0)
        ab, bc, ca = (a + b) / 2, (b + c) / 2, (c + a) / 2
        quarters = ((a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca))
        triangles = np.concatenate([np.stack(q, axis=1) for q in quarters])
