"""Clouds as input of networks that were trained on PointNetVLAD's data.

SVT-Net and DPA-Net use these clouds. As in PointNetVLAD's program (Uy and Lee,
CVPR 2018), points near the largest plane are removed. The other points are
downsampled to 4096 points, centred, and scaled so that the mean distance from
the centre is 1/2. Points outside of [-1, 1] are replaced by other points. As in
that program, the x axis is directed backwards. Deliberate differences:

- A place is one scan of a spinning LiDAR, not 20 m of a planar scanner.
- Random draws have a fixed seed.
- A cloud with fewer than 4096 points repeats some points.
"""

import bisect

import numpy as np

from evaluation.maps import downsample
from evaluation.methods.sparse_convolution import coarser

# Number of points of a cloud for PointNetVLAD.
NUM_POINTS = 4096
# Side of a cell of the networks, in clouds from -1 to 1.
CELL = 0.01
# Points this near to the greatest plane count as ground [m].
_GROUND_WITHIN = 0.5
# Number of planes that are tried.
_TRIALS = 200
# Number of points that vote for a plane.
_VOTERS = 2000
# Least side of the voxels for downsampling [m].
_LEAST_VOXEL = 0.001
# Difference between the sides that are tried [m].
_VOXEL_STEP = 0.025
# Number of sides that are tried.
_NUM_VOXELS = 400
# Greatest length of the normal of three points that are on a line except for
# rounding [m^2]. Lengths are increased by as much before a division.
_TINY = 1e-6
# Mean distance of the points from their centre, in clouds from -1 to 1.
_MEAN_DISTANCE = 0.5
# Least mean distance of points from their centre [m].
_LEAST_EXTENT = 1e-3


def prepare_cloud(points: np.ndarray) -> np.ndarray:
    """Returns a cloud in the form that PointNetVLAD's networks expect.

    Args:
        points: (N, 3) points, x ahead, y left, z up [m].

    Returns:
        (4096, 3) float32, or (0, 3) if there are no points above the ground, or
        all of them are at one position.
    """
    rng = np.random.default_rng(0)
    non_ground = _without_ground(points, rng)
    if len(non_ground) == 0:
        return np.zeros((0, 3), np.float32)
    centroids = downsample(non_ground, _least_voxel_size(non_ground))
    chosen = _completed(centroids, non_ground, rng)
    centre = chosen.mean(axis=0)
    extent = np.linalg.norm(chosen - centre, axis=1).mean()
    if extent < _LEAST_EXTENT:
        return np.zeros((0, 3), np.float32)
    scale = _MEAN_DISTANCE / extent
    inside = _inside_cube(scale * (chosen - centre))
    source = _inside_cube(scale * (non_ground - centre))
    # Centroids can be inside although no point is.
    cloud = _completed(inside, source if len(source) else inside, rng)
    return (cloud * [-1.0, 1.0, 1.0]).astype(np.float32)


def _least_voxel_size(points: np.ndarray) -> float:
    """Returns the least voxel size that leaves at most 4096 points [m].

    Only sizes in steps of `_VOXEL_STEP` are tried. The number of voxels is
    assumed to fall with their size.

    Args:
        points: (N, 3) the points to downsample [m].
    """

    def size_of(k: int) -> float:
        return _LEAST_VOXEL + _VOXEL_STEP * k

    least = bisect.bisect_left(
        range(_NUM_VOXELS),
        True,
        key=lambda k: len(downsample(points, size_of(k))) <= NUM_POINTS,
    )
    return size_of(least)


def _inside_cube(points: np.ndarray) -> np.ndarray:
    """Returns those of N points whose coordinates are all from -1 to 1."""
    return points[(np.abs(points) <= 1.0).all(axis=1)]


def _without_ground(points: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Returns the points that are not near the greatest plane (RANSAC)."""
    if len(points) < 3:
        return points[:0]
    a, b, c = points[rng.integers(len(points), size=(3, _TRIALS))]
    normals = np.cross(b - a, c - a)
    # Three points on a line, such as one drawn twice, are in no one plane.
    is_plane = np.linalg.norm(normals, axis=1) > _TINY
    normals, a = normals[is_plane], a[is_plane]
    if len(normals) == 0:
        return points
    normals /= np.linalg.norm(normals, axis=1, keepdims=True) + _TINY
    offsets = (normals * a).sum(axis=1)
    voters = points[rng.integers(len(points), size=_VOTERS)]
    votes = np.abs(voters @ normals.T - offsets) < _GROUND_WITHIN
    best = votes.sum(axis=0).argmax()
    return points[
        np.abs(points @ normals[best] - offsets[best]) >= _GROUND_WITHIN
    ]


def _completed(
    chosen: np.ndarray, source: np.ndarray, rng: np.random.Generator
) -> np.ndarray:
    """Returns points (4096, 3), of which random ones complete the chosen ones.

    Args:
        chosen: (N, 3) the chosen points, N <= 4096.
        source: (M, 3) points from which the others are drawn, M > 0; points
            repeat only if there are too few.
        rng: random generator.
    """
    lacking = NUM_POINTS - len(chosen)
    repeats = lacking > len(source)
    drawn = source[rng.choice(len(source), lacking, replace=repeats)]
    return np.concatenate([chosen, drawn])


def occupied_cells(cloud: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Returns the cells (N, 3) of a cloud, and their features (N, 1), all 1."""
    cells = np.floor(cloud / np.float32(CELL)).astype(np.int64)
    cells = coarser(cells, 1)
    return cells, np.ones((len(cells), 1), np.float32)
