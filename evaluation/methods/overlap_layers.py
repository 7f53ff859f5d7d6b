"""Layers of a scan from above: filled cells by height.

The cell of a point follows from sums, products, quotients and square roots
only. IEEE 754 defines these to the last bit, so that cells are the same on
every processor.
"""

from __future__ import annotations

import math

import numpy as np

from cns_drake.base.compiled import compiled

# Rows and columns of the grid: a cell's number, row times 256 plus column, is
# a uint16.
GRID = 256
# Low, middle, high, poles, kerbs.
NUM_LAYERS = 5
LOW, MIDDLE, HIGH, POLES, KERBS = range(NUM_LAYERS)

# Heights above the ground: limit of the ground, and ends of the layers [m].
_LOWEST = 0.35
_LOW_TOP = 1.5
_MIDDLE_TOP = 4.0
# Least height of a pole [m].
_POLE_TOP = 2.0
# Greatest number of cells of a pole, of 3 x 3; around them, 7 x 7 are free.
_POLE_CELLS = 4
# Range of the ground's rise within a cell with a kerb [m].
_KERB_STEP = (0.08, 0.30)

# The ground is followed outwards in so many sectors, in steps of [m].
_SECTORS = 90
_RING = 2.0
# Greatest rise or fall from one step to the next [m, 1].
_GROUND_STEP = 0.15
_GROUND_SLOPE = 0.2


@compiled
def layer_cells(
    points: np.ndarray, sensor_height: float, cell: float, least_points: int
) -> tuple[np.ndarray, np.ndarray]:
    """Returns the filled cells of each layer.

    Args:
        points: (N, 3) in the frame of the LiDAR [m].
        sensor_height: above the ground [m].
        cell: length of a cell [m].
        least_points: that fill a cell.

    Returns:
        (M,) uint16 numbers of cells, layer by layer and increasing in each,
        and (6,) int64 where each layer begins and the last one ends. Rows
        are along x, columns along y, with the sensor in the middle.
    """
    half = 0.5 * GRID * cell
    num_rings = math.ceil(half * math.sqrt(2.0) / _RING) + 1
    number = np.full(len(points), -1, np.int64)
    place = np.empty(len(points), np.int64)
    lowest = np.full(_SECTORS * num_rings, np.inf)
    for i in range(len(points)):
        x, y, z = points[i, 0], points[i, 1], points[i, 2]
        if not (-half <= x < half and -half <= y < half):
            continue
        row, column = int((x + half) / cell), int((y + half) / cell)
        # Rounding may reach the limit.
        number[i] = min(row, GRID - 1) * GRID + min(column, GRID - 1)
        place[i] = _sector(x, y) * num_rings + int(
            math.sqrt(x * x + y * y) / _RING
        )
        lowest[place[i]] = min(lowest[place[i]], z)
    ground = _follow(lowest, num_rings, -sensor_height)

    counts = np.zeros((3, GRID * GRID), np.int32)
    top = np.full(GRID * GRID, -np.inf)
    bottom = np.full(GRID * GRID, np.inf)
    for i in range(len(points)):
        if number[i] < 0:
            continue
        z = points[i, 2]
        height = z - ground[place[i]]
        top[number[i]] = max(top[number[i]], height)
        bottom[number[i]] = min(bottom[number[i]], height)
        if height > _MIDDLE_TOP:
            counts[HIGH, number[i]] += 1
        elif height > _LOW_TOP:
            counts[MIDDLE, number[i]] += 1
        elif height > _LOWEST:
            counts[LOW, number[i]] += 1
    return _collect(counts, top, bottom, least_points)


@compiled
def _sector(x: float, y: float) -> int:
    """Returns in which sector a direction lies.

    Sectors are equal along a square: its angles need no arc tangent, whose
    last bits differ between processors.
    """
    length = abs(x) + abs(y)
    if length == 0.0:
        return 0
    turn = y / length
    turn = 2.0 - turn if x < 0.0 else turn % 4.0
    return min(int(turn * (0.25 * _SECTORS)), _SECTORS - 1)


@compiled
def _follow(lowest: np.ndarray, num_rings: int, start: float) -> np.ndarray:
    """Returns the height of the ground in each ring of each sector.

    Args:
        lowest: (sectors * rings,) of the points there; infinite without any.
        num_rings: of each sector.
        start: height below the sensor.
    """
    ground = np.empty(len(lowest))
    for first in range(0, len(lowest), num_rings):
        height, last = start, -1
        for ring in range(num_rings):
            here = lowest[first + ring]
            limit = _GROUND_STEP + _GROUND_SLOPE * _RING * (ring - last)
            if abs(here - height) <= limit:
                height, last = here, ring
            ground[first + ring] = height
    return ground


@compiled
def _collect(
    counts: np.ndarray, top: np.ndarray, bottom: np.ndarray, least_points: int
) -> tuple[np.ndarray, np.ndarray]:
    """Returns the numbers of the cells, and where layers begin."""
    starts = np.zeros(NUM_LAYERS + 1, np.int64)
    cells = np.empty(NUM_LAYERS * GRID * GRID, np.uint16)
    size = 0
    for layer in range(NUM_LAYERS):
        for number in range(GRID * GRID):
            if layer == POLES:
                is_filled = top[number] >= _POLE_TOP and _is_pole(top, number)
            elif layer == KERBS:
                step = top[number] - bottom[number]
                is_filled = (
                    top[number] <= _LOWEST
                    and _KERB_STEP[0] <= step <= _KERB_STEP[1]
                )
            else:
                is_filled = counts[layer, number] >= least_points
            if is_filled:
                cells[size] = number
                size += 1
        starts[layer + 1] = size
    return cells[:size].copy(), starts


@compiled
def _is_pole(top: np.ndarray, number: int) -> bool:
    """Returns whether a tall cell stands alone."""
    row, column = number // GRID, number % GRID
    near = 0
    for i in range(max(row - 3, 0), min(row + 4, GRID)):
        for j in range(max(column - 3, 0), min(column + 4, GRID)):
            if top[i * GRID + j] < _POLE_TOP:
                continue
            if abs(i - row) > 1 or abs(j - column) > 1:
                return False
            near += 1
    return near <= _POLE_CELLS
