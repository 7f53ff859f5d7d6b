"""Where a car has room between the buildings of an imported city."""

from __future__ import annotations

from collections.abc import Sequence
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
    corners = np.concatenate([s.triangles.reshape(-1, 3) for s in structures])
    low = np.floor(corners[:, :2].min(axis=0))
    size = np.ceil((corners[:, :2].max(axis=0) - low) / CELL).astype(int) + 1
    shape = (int(size[1]), int(size[0]))
    blocked = np.zeros(shape, dtype=bool)
    roads = np.zeros(shape, dtype=bool)
    water = np.zeros(shape, dtype=bool)
    for one in structures:
        points = surface_samples(one.triangles, _SAMPLE_SPACING)
        if one.structure.semantic_class == "road":
            grid = roads
        elif one.kind.startswith("Water"):
            grid = water
        elif one.is_ground:
            continue
        else:
            above = points[:, 2] - ground.height(points[:, :2])
            points = points[above < _HEADROOM]
            # What is no higher than a kerb is driven over.
            if len(points) and above.max() < 0.3:
                continue
            grid = blocked
        column, row = np.floor((points[:, :2] - low) / CELL).astype(int).T
        grid[
            np.clip(row, 0, shape[0] - 1), np.clip(column, 0, shape[1] - 1)
        ] = True
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


def surface_samples(triangles: np.ndarray, spacing: float) -> np.ndarray:
    """Returns points (N, 3) on triangles (M, 3, 3), edges included [m].

    No place on a triangle is farther from all of them than the spacing.
    """
    edges = triangles - np.roll(triangles, 1, axis=1)
    longest = np.linalg.norm(edges, axis=2).max(axis=1)
    steps = np.maximum(1, np.ceil(longest / spacing)).astype(int)
    found = [np.zeros((0, 3))]
    for number in np.unique(steps):
        i, j = np.meshgrid(np.arange(number + 1), np.arange(number + 1))
        inside = i + j <= number
        u, v = i[inside] / number, j[inside] / number
        weights = np.stack([1.0 - u - v, u, v], axis=1)
        of_size = triangles[steps == number]
        found.append(np.einsum("kc,mcx->mkx", weights, of_size).reshape(-1, 3))
    return np.concatenate(found)
