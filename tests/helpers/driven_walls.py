"""Maps of walls, driven along."""

import numpy as np

from evaluation.base import from_xyz
from evaluation.maps import VoxelAccumulator
from evaluation.results import DrivenMap


def driven_map(cloud, positions):
    accumulator = VoxelAccumulator(5.0, 10)
    accumulator.add(from_xyz(cloud))
    return DrivenMap(cloud, accumulator.to_map(), np.array(positions))


def wall(x, half_width, height=10.0):
    """A wall across the x axis, of points 0.5 m apart."""
    y, z = np.meshgrid(
        np.arange(-half_width, half_width, 0.5), np.arange(0.0, height, 0.5)
    )
    return np.stack([np.full(y.size, x), y.ravel(), z.ravel()], axis=1)


ROUTE = [[0.0, y, 2.0] for y in np.arange(-10.0, 10.0, 1.0)]
