"""Finds the free space for a car between the buildings of a city."""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from scipy import ndimage
import shapely
from shapely import STRtree

from worlds.imports.faces import joined_triangles
from worlds.imports.ground import Ground
from worlds.imports.imported_objects import ImportedObject, boxes_of
from worlds.imports.surface_samples import surface_samples

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
        [
            one
            for one in objects
            if one.is_ground and one.structure.semantic_class == "road"
        ],
        window,
        shape,
    )
    in_water = _area_of([o for o in objects if _is_water(o)], window, shape)
    obstacles = [o for o in objects if not (o.is_ground or _is_water(o))]
    blocked, walls = _blocked_by(obstacles, ground, window, shape)
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
    outlines = walls[:, [0, 1, 2, 0], :2]
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
    for row, column, _ in _covered_cells(surfaces, window):
        covered[row, column] = True
    return covered


def _is_water(imported: ImportedObject) -> bool:
    return imported.object_type.startswith("Water")


def _covered_cells(
    triangles: np.ndarray, window: _Window, ground: Ground | None = None
) -> Iterator[tuple[np.ndarray, np.ndarray, np.ndarray]]:
    """Yields cells that triangles (M, 3, 3) cover.

    Each time these are rows, columns, and indices of triangles, (N,) each. With
    a ground, only places that a car on this ground could hit count.
    """
    low, _ = window
    for points, number in surface_samples(triangles, _SAMPLE_SPACING, window):
        if ground is not None:
            above = points[:, 2] - ground.height(points[:, :2])
            is_low = above < _HEADROOM
            points, number = points[is_low], number[is_low]
        # The columns one by one: NumPy is slow for rows of two.
        row, column = (
            ((points[:, axis] - low[axis]) / CELL).astype(int)
            for axis in (1, 0)
        )
        yield row, column, number


def _blocked_by(
    objects: Sequence[ImportedObject],
    ground: Ground,
    window: _Window,
    shape: tuple[int, int],
) -> tuple[np.ndarray, np.ndarray]:
    """Returns the cells that structures block, and the triangles that block.

    The cells, (R, C) bool, include the insides of buildings. The triangles are
    (M, 3, 3) [m]. `window` contains the limits of the grid, and `shape` is
    (R, C).
    """
    triangles = joined_triangles(one.triangles for one in objects)
    owner = np.repeat(
        np.arange(len(objects)), [len(one.triangles) for one in objects]
    )
    corners = triangles.reshape(-1, 3)
    above = corners[:, 2] - ground.height(corners[:, :2])
    lowest = above.reshape(-1, 3).min(axis=1)
    highest = above.reshape(-1, 3).max(axis=1)
    tallest = np.full(len(objects), -np.inf)
    np.maximum.at(tallest, owner, highest)
    is_low = (lowest < _HEADROOM) & (tallest[owner] >= _KERB)
    walls = triangles[is_low & (highest > _KERB)]
    triangles, owner = triangles[is_low], owner[is_low]
    is_building = np.array(
        [o.structure.semantic_class == "building" for o in objects], bool
    )[owner]
    blocked = _filled(
        triangles[is_building], owner[is_building], ground, window, shape
    )
    others = triangles[~is_building]
    for row, column, _ in _covered_cells(others, window, ground):
        blocked[row, column] = True
    return blocked, walls


def _filled(
    triangles: np.ndarray,
    owner: np.ndarray,
    ground: Ground,
    window: _Window,
    shape: tuple[int, int],
) -> np.ndarray:
    """Returns the cells (R, C) bool of buildings, with those they enclose.

    Each building gets a place of its own on a sheet, so that one call fills
    all, and none is filled by the walls of several.

    Args:
        triangles: (M, 3, 3) the triangles of all buildings [m].
        owner: (M,) the building of each triangle, in ascending order.
        ground, window, shape: see `_blocked_by`.
    """
    blocked = np.zeros(shape, dtype=bool)
    if not len(triangles):
        return blocked
    _, firsts, building = np.unique(
        owner, return_index=True, return_inverse=True
    )
    # Rows and columns that each can have, with an empty one on each side.
    places = (triangles[:, :, 1::-1] - window[0][::-1]) / CELL
    limits = np.array(shape) - 1
    first = np.minimum.reduceat(places.min(axis=1), firsts)
    first = np.clip(np.floor(first), 0, limits).astype(int)
    last = np.maximum.reduceat(places.max(axis=1), firsts)
    last = np.clip(np.floor(last), 0, limits).astype(int)
    sizes = last - first + 3
    # Shelves of similar height.
    order = np.argsort(-sizes[:, 0], kind="stable")
    ends = np.cumsum(sizes[order, 1])
    width = max(int(np.sqrt(np.prod(sizes, axis=1).sum())), 1)
    shelf, left = np.divmod(ends - sizes[order, 1], width)
    _, begins = np.unique(shelf, return_index=True)
    tops = np.cumsum([0, *sizes[order, 0][begins]])
    rank = np.searchsorted(shelf[begins], shelf)
    corner = np.empty_like(first)
    corner[order] = np.column_stack([tops[rank], left])
    sheet = np.zeros((tops[-1], width + sizes[:, 1].max()), dtype=bool)
    shift = corner + 1 - first
    for row, column, number in _covered_cells(triangles, window, ground):
        down, right = shift[building[number]].T
        sheet[row + down, column + right] = True
    # What is connected with the sheet's corner is outside.
    parts, _ = ndimage.label(~sheet)
    inside = parts != parts[0, 0]
    for (top, left), (low, start), (high, end) in zip(
        (corner + 1).tolist(), first.tolist(), (last + 1).tolist(), strict=True
    ):
        blocked[low:high, start:end] |= inside[
            top : top + high - low, left : left + end - start
        ]
    return blocked


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
