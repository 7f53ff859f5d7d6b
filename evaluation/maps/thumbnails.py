"""Scans reduced to small pictures from above."""

import numpy as np

# Side of a cell [m]; there are 256 cells across, so that a byte counts them.
CELL = 0.5
_HALF_CELLS = 128
# Least height above the ground of kept points [m]; lower points are road.
_LOWEST = 0.4
# Step of the stored heights above the ground [m].
HEIGHT_STEP = 0.1
# Greatest number of kept points of a scan.
MAX_POINTS = 2000


def thumbnail(
    points: np.ndarray, sensor_height: float, seed: int
) -> np.ndarray:
    """Returns the highest point in each cell around the sensor.

    Args:
        points: (N, 3) points in the frame of the sensor [m].
        sensor_height: height of the sensor above the ground [m].
        seed: seed of the random order, which decides which points stay if there
            are too many.

    Returns:
        (M, 3) uint8, M <= 2000: cell along x, cell along y, and height above
        the ground in steps of 0.1 m, at most 25.5 m. Cell numbers along x and y
        begin at 0; cell 128 begins at the sensor, so that greater numbers lie
        in front of the sensor (x) or to its left (y). The order is random, so
        that the first points of the array are a downsampled scan.
    """
    x, y = np.floor(points[:, :2].T / CELL).astype(np.int64) + _HALF_CELLS
    heights = points[:, 2] + sensor_height
    kept = heights >= _LOWEST
    for cells in (x, y):
        kept &= (cells >= 0) & (cells < 2 * _HALF_CELLS)
    highest = np.zeros((2 * _HALF_CELLS) ** 2)
    flat = x[kept] * 2 * _HALF_CELLS + y[kept]
    np.maximum.at(highest, flat, heights[kept])
    filled = np.flatnonzero(highest)
    rng = np.random.default_rng([seed, len(filled)])
    chosen = rng.permutation(filled)[:MAX_POINTS]
    steps = np.minimum(highest[chosen] / HEIGHT_STEP, 255.0)
    return np.stack(
        [chosen // (2 * _HALF_CELLS), chosen % (2 * _HALF_CELLS), steps],
        axis=1,
    ).astype(np.uint8)
