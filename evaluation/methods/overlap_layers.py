"""Divides a scan into the layers of layered overlap, as occupied cells.

Part of layered overlap (see `evaluation.methods.layered_overlap`). Cells depend
only on sums, products, quotients and square roots. These results are the same
on every processor, because IEEE 754 defines them to the last bit.
"""

import math

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from evaluation.maps import extremes

# Rows and columns of the grid: a cell's number, row times 256 plus column, is
# a uint16.
GRID = 256
NUM_LAYERS = 5
# Heights above the ground [m]: the top of the ground, of the low layer and of
# the middle layer.
_HEIGHTS = np.array([0.35, 1.5, 4.0])
# Least height of a pole [m].
_POLE_TOP = 2.0
# Greatest number of cells of a pole among 3 x 3 cells; the 7 x 7 cells around
# must otherwise be free.
_POLE_CELLS = 4
# Range of the ground's rise within a cell with a kerb [m].
_KERB_STEP = (0.08, 0.30)
# The ground is followed outwards in this number of sectors, in steps of this
# length [m].
_SECTORS = 90
_RING = 2.0
# Greatest change of the ground's height from one step to the next [m].
_GROUND_STEP = 0.15
# Greatest slope of the ground.
_GROUND_SLOPE = 0.2


def layer_cells(
    points: np.ndarray, sensor_height: float, cell: float, least_points: int
) -> tuple[np.ndarray, np.ndarray]:
    """Returns the occupied cells of each layer of a scan.

    The layers are low, middle and high points, poles and kerbs.

    Args:
        points: (N, 3) in the frame of the LiDAR [m].
        sensor_height: height of the sensor above the ground [m].
        cell: length of a cell [m].
        least_points: number of points that fill a cell.

    Returns:
        (M,) uint16 numbers of the occupied cells, layer by layer, increasing in
        each layer; and (6,) int64, the index at which each layer begins and the
        last one ends. Rows are along x, columns along y; the sensor is in the
        middle.
    """
    # Sums, products, quotients and square roots are the same on every
    # processor: IEEE 754 defines them to the last bit.
    half = 0.5 * GRID * cell
    x, y, z = points.T
    is_inside = (-half <= x) & (x < half) & (-half <= y) & (y < half)
    x, y, z = points.compress(is_inside, axis=0).T
    # Rounding may reach the limit.
    row, column = (
        np.minimum(((along + half) / cell).astype(np.int64), GRID - 1)
        for along in (x, y)
    )
    number = row * GRID + column
    height = z - _ground_below(x, y, z, half, -sensor_height)
    layer = np.searchsorted(_HEIGHTS, height)
    counts = np.bincount(
        layer * GRID * GRID + number, minlength=4 * GRID * GRID
    )
    bottom, top = extremes(height, number, GRID * GRID)
    step = top - bottom
    is_kerb = (
        (top <= _HEIGHTS[0]) & (_KERB_STEP[0] <= step) & (step <= _KERB_STEP[1])
    )
    layers = [
        *map(np.flatnonzero, counts.reshape(4, -1)[1:] >= least_points),
        _poles(top.reshape(GRID, GRID) >= _POLE_TOP),
        np.flatnonzero(is_kerb),
    ]
    starts = np.cumsum([0, *map(len, layers)])
    return np.concatenate(layers).astype(np.uint16), starts


def _ground_below(
    x: np.ndarray, y: np.ndarray, z: np.ndarray, half: float, start: float
) -> np.ndarray:
    """Returns the height of the ground below each point (N,) [m].

    In each sector, the lowest points of successive rings give the height of the
    ground. The search begins at the sensor, below which the ground has the
    height `start`, and continues outwards up to a distance of `half` in x and y
    [m].
    """
    # Sectors divide the sides of a square evenly. Angles would need an arc
    # tangent, whose last bits differ between processors.
    length = np.abs(x) + np.abs(y)
    turn = y / np.where(length > 0.0, length, 1.0)
    turn = np.where(x < 0.0, 2.0 - turn, np.where(turn < 0.0, turn + 4.0, turn))
    sector = np.minimum((turn * (0.25 * _SECTORS)).astype(int), _SECTORS - 1)
    ring = (np.sqrt(x * x + y * y) / _RING).astype(int)
    num_rings = math.ceil(half * math.sqrt(2.0) / _RING) + 1
    lowest, _ = extremes(z, ring * _SECTORS + sector, num_rings * _SECTORS)
    lowest = lowest.reshape(num_rings, _SECTORS)
    height, last = np.full(_SECTORS, start), np.full(_SECTORS, -1)
    ground = np.empty_like(lowest)
    for number, here in enumerate(lowest):
        limit = _GROUND_STEP + _GROUND_SLOPE * _RING * (number - last)
        is_ground = np.abs(here - height) <= limit
        height = np.where(is_ground, here, height)
        last[is_ground] = number
        ground[number] = height
    return ground[ring, sector]


def _poles(is_tall: np.ndarray) -> np.ndarray:
    """Returns the numbers of the cells with poles: isolated tall cells.

    Args:
        is_tall: (GRID, GRID) bool.
    """
    row, column = np.nonzero(is_tall)
    windows = sliding_window_view(np.pad(is_tall, 3), (7, 7))
    around = windows[row, column]
    near = around[:, 2:5, 2:5].sum(axis=(1, 2))
    is_alone = (near <= _POLE_CELLS) & (near == around.sum(axis=(1, 2)))
    return (row * GRID + column)[is_alone]
