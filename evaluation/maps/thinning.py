"""Clouds thinned to a point a voxel."""

from __future__ import annotations

import numpy as np

from evaluation.geometry.sorting import cell_order
from evaluation.maps.voxel_maps import Z_ORIGIN
from evaluation.maps.voxel_table import FARTHEST


def thin(points: np.ndarray, voxel_size: float) -> np.ndarray:
    """Returns the voxel centroids of a cloud in the frame of a sensor.

    They are those of `voxelise`, to the last bit: sums are relative to each
    voxel's corner, and in the order of the points.

    Args:
        points: (N, 3) [m]; points that are not finite are left out.
        voxel_size: length of a voxel's side [m].

    Returns:
        (V, 3), sorted by voxel.
    """
    lift = (0.0, 0.0, Z_ORIGIN)
    # One column at a time: NumPy reduces slowly along a short axis.
    columns = [
        np.asarray(column, np.float64) - low
        for column, low in zip(points.T, lift, strict=True)
    ]
    cells = [np.floor(column / voxel_size) for column in columns]
    # A comparison with NaN is false.
    kept = np.logical_and.reduce([np.abs(cell) < FARTHEST for cell in cells])
    rows = np.flatnonzero(kept)
    numbers = np.stack([cell[rows] for cell in cells], axis=1)
    order = cell_order(numbers.astype(np.int32))
    rows = rows[order]
    cells = [cell[rows] for cell in cells]
    is_first = np.ones(len(rows), bool)
    is_first[1:] = np.logical_or.reduce([np.diff(c) != 0.0 for c in cells])
    voxels = np.cumsum(is_first) - 1
    counts = np.bincount(voxels)
    centroids = np.empty((len(counts), 3))
    for axis, low in enumerate(lift):
        corners = cells[axis] * voxel_size
        offsets = columns[axis][rows] - corners
        centroids[:, axis] = (low + corners[is_first]) + (
            np.bincount(voxels, offsets) / counts
        )
    return centroids
