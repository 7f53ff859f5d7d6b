"""Finds the free space for a car between the buildings of a city."""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from scipy import ndimage
import shapely
from shapely import STRtree

from cns_drake.imports.faces import joined_triangles
from cns_drake.imports.ground import Ground
from cns_drake.imports.imported_objects import ImportedObject, boxes_of
from cns_drake.imports.surface_samples import surface_samples

# Size of a cell of the grid [m].
CELL = 1.0
# A car passes below things higher than this above the ground [m].
_HEADROOM = 3.5
# A car passes over things no higher than a kerb [m].
_KERB = 0.3
# Least distance from the middle of a path to a wall [m].
_FROM_WALL = 2.5
# Least distance from the middle of a path to the edge of a road [m].
_FROM_EDGE = 1.6
# A car that follows a path may come closer to obstacles than the path by this
# much [m].
_SLACK = 0.6
# Least distance from the middle of the car to an obstacle [m].
_HALF_CAR = 1.1
# Half the width of the widest street; wider open ground is outside the city
# [m].
_HALF_STREET = 20.0
# Distance between the samples of a surface [m].
_SAMPLE_SPACING = 0.5
# Free space is searched within this distance of a city's middle, because no
# drive is longer [m].
_FARTHEST = 1500.0
# Least and greatest x and y (2,) [m].
_Window = tuple[np.ndarray, np.ndarray]
# Roads are used if their largest connected part has at least this area [m^2].
_LEAST_ROAD = 800.0


@dataclass(frozen=True)
class FreeSpace:
    """The free space for a car, on a grid of square cells.

    Attributes:
        low: (2,) corner of the grid with the least x and y [m].
        clearance: (R, C) distance from the centre of each cell to the nearest
            obstacle [m]; 0 where a car must not drive. Rows are along y,
            columns along x.
        least: clearance that a path needs [m].
        walls: search tree of the obstacles, seen from above.
    """

    low: np.ndarray
    clearance: np.ndarray
    least: float
    walls: STRtree

    def clearance_at(self, xy: np.ndarray) -> np.ndarray:
        """Returns the distance (N,) from places (N, 2) to obstacles [m].

        A place outside of the grid gets the distance of the nearest cell.
        """
        index = np.floor((xy - self.low) / CELL).astype(int)
        rows, columns = self.clearance.shape
        row = np.clip(index[:, 1], 0, rows - 1)
        column = np.clip(index[:, 0], 0, columns - 1)
        return self.clearance[row, column]

    def obstacle(self, path: np.ndarray) -> np.ndarray | None:
        """Returns the first place (2,) of a path where a car does not fit [m].

        The result is None if the car fits everywhere. `path` (N, 2) contains
        places on the path that are close together [m].
        """
        narrow = self.clearance_at(path) < self.least - _SLACK
        hit = self.walls.query(shapely.points(path), "dwithin", _HALF_CAR)[0]
        narrow[hit] = True
        return path[narrow.argmax()] if narrow.any() else None

    def middle(self, row: np.ndarray, column: np.ndarray) -> np.ndarray:
        """Returns the centres (N, 2) of cells [m], given by row and column.

        `row` and `column` are (N,) indices of the grid.
        """
        return self.low + CELL * (np.c_[column, row] + 0.5)


def find_free_space(
    objects: Sequence[ImportedObject], ground: Ground
) -> FreeSpace:
    """Returns the space for a car that is free in all stages of a city.

    `objects` contains the objects of all stages. If the city has connected
    roads on which a car has at least 800 m^2, only space on roads counts as
    free. Otherwise, only space between buildings does, if there are any.
    """
    low, high = _search_bounds(objects)
    size = np.ceil((high - low) / CELL).astype(int) + 1
    window = (low, high)
    shape = (size[1], size[0])
    on_road = _area_of(
        [o for o in objects if o.structure.semantic_class == "road"],
        window,
        shape,
    )
    in_water = _area_of([o for o in objects if _is_water(o)], window, shape)
    blocked = np.zeros(shape, dtype=bool)
    walls = []
    for imported in objects:
        if not (imported.is_ground or _is_water(imported)):
            cells, triangles = _blocked_by(imported, ground, window)
            blocked[cells] = True
            walls.append(triangles)
    free = ~(blocked | (in_water & ~on_road))
    least = _FROM_WALL
    paved = ndimage.binary_closing(on_road, iterations=1) & ~blocked
    if (
        _largest_part_size(_clearance(paved) >= _FROM_EDGE) * CELL**2
        >= _LEAST_ROAD
    ):
        free = paved
        least = _FROM_EDGE
    elif blocked.any():
        free &= _between_buildings(blocked)
    outlines = joined_triangles(walls)[:, [0, 1, 2, 0], :2]
    return FreeSpace(
        low,
        _clearance(free),
        least,
        STRtree(np.asarray(shapely.linearrings(outlines))),
    )


def _area_of(
    objects: Iterable[ImportedObject],
    window: _Window,
    shape: tuple[int, int],
) -> np.ndarray:
    """Returns (R, C) bool: which cells of a grid some objects cover.

    `window` contains the limits of the grid, and `shape` is (R, C).
    """
    covered = np.zeros(shape, dtype=bool)
    # In one call: thousands of small groups would take far longer.
    surfaces = joined_triangles(imported.triangles for imported in objects)
    for row, column in _covered_cells(surfaces, window):
        covered[row, column] = True
    return covered


def _is_water(imported: ImportedObject) -> bool:
    return imported.object_type.startswith("Water")


def _covered_cells(
    triangles: np.ndarray, window: _Window, ground: Ground | None = None
) -> Iterator[np.ndarray]:
    """Yields row and column (2, N) of cells that triangles (M, 3, 3) cover.

    With a ground, only places that a car on this ground could hit count.
    """
    low, _ = window
    for points in surface_samples(triangles, _SAMPLE_SPACING, window):
        if ground is not None:
            above = points[:, 2] - ground.height(points[:, :2])
            points = points[above < _HEADROOM]
        yield ((points[:, :2] - low) / CELL).astype(int).T[::-1]


def _blocked_by(
    imported: ImportedObject, ground: Ground, window: _Window
) -> tuple[tuple[np.ndarray, np.ndarray], np.ndarray]:
    """Returns the cells that a structure blocks, and the triangles that block.

    The cells, given by row and column (N,) each, include the inside of a
    building. The triangles are (M, 3, 3) [m]. `window` contains the limits of
    the grid.
    """
    corners = imported.triangles.reshape(-1, 3)
    above = corners[:, 2] - ground.height(corners[:, :2])
    lowest = above.reshape(-1, 3).min(axis=1)
    highest = above.reshape(-1, 3).max(axis=1)
    is_low = (lowest < _HEADROOM) & (above.max() >= _KERB)
    cells = [np.zeros((2, 0), dtype=int)]
    cells += _covered_cells(imported.triangles[is_low], window, ground)
    row, column = np.concatenate(cells, axis=1)
    if imported.structure.semantic_class == "building" and len(row):
        row, column = _with_enclosed(row, column)
    return (row, column), imported.triangles[is_low & (highest > _KERB)]


def _with_enclosed(
    row: np.ndarray, column: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Returns cells (N,), at least one, together with those they enclose."""
    first = np.array([row.min(), column.min()])
    shape = np.array([row.max(), column.max()]) - first + 1
    walls = np.zeros(shape, dtype=bool)
    walls[row - first[0], column - first[1]] = True
    row, column = np.nonzero(ndimage.binary_fill_holes(walls))
    return row + first[0], column + first[1]


def _clearance(free: np.ndarray) -> np.ndarray:
    """Returns the distance from each cell to the nearest cell not free [m].

    `free` (R, C) says which cells are free, and the result has this shape, too.
    """
    # Padded, since no car can drive beyond the grid.
    return ndimage.distance_transform_edt(np.pad(free, 1))[1:-1, 1:-1] * CELL


def _between_buildings(blocked: np.ndarray) -> np.ndarray:
    """Returns (R, C) bool: which cells have buildings on both sides.

    `blocked` (R, C) says in which cells a building stands. The sides are at
    most half the width of the widest street away.
    """
    reach = int(_HALF_STREET / CELL)
    near = ndimage.distance_transform_edt(~np.pad(blocked, 2 * reach)) <= reach
    return (ndimage.distance_transform_edt(near) > reach)[
        2 * reach : -2 * reach, 2 * reach : -2 * reach
    ]


def _largest_part_size(cells: np.ndarray) -> int:
    """Returns the size of the largest connected part, in cells."""
    parts, number = ndimage.label(cells, np.ones((3, 3)))
    return int(np.bincount(parts.ravel())[1:].max()) if number else 0


def _search_bounds(objects: Sequence[ImportedObject]) -> _Window:
    """Returns the limits of the area in which free space is searched."""
    boxes = boxes_of(objects)[:, :, :2]
    middle = np.median(boxes.mean(axis=1), axis=0)
    low = np.maximum(boxes[:, 0].min(axis=0), middle - _FARTHEST)
    high = np.minimum(boxes[:, 1].max(axis=0), middle + _FARTHEST)
    return np.floor(low), np.maximum(high, np.floor(low))
