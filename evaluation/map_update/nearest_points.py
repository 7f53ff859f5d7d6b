"""Distances between the points of two maps."""

import math

import numpy as np
from scipy.spatial import KDTree


def nearest_distances(
    points: np.ndarray, others: np.ndarray, most: float = math.inf
) -> np.ndarray:
    """Returns the distance (N,) from each point to the nearest other point [m].

    Distances beyond `most` are infinite.

    Args:
        points: (N, 3) points [m].
        others: (M, 3) other points [m].
        most: greatest distance [m].
    """
    if len(others) == 0:
        return np.full(len(points), math.inf)
    return KDTree(others, balanced_tree=False).query(
        points, distance_upper_bound=most, workers=-1
    )[0]
