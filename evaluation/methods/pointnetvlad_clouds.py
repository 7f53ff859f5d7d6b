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

from evaluation.maps.voxel_maps import downsample
from evaluation.methods.sparse_convolution import coarser

NUM_POINTS = 4096
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
_TINY = 1e-6
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
    points = _without_ground(points, rng)
    if len(points) == 0:
        return np.zeros((0, 3), np.float32)
    size = bisect.bisect_left(
        range(_NUM_VOXELS),
        True,
        key=lambda k: (
            len(downsample(points, _LEAST_VOXEL + _VOXEL_STEP * k))
            <= NUM_POINTS
        ),
    )
    chosen = downsample(points, _LEAST_VOXEL + _VOXEL_STEP * size)
    chosen = np.concatenate([chosen, _sample_missing(points, chosen, rng)])
    centre = chosen.mean(axis=0)
    extent = np.linalg.norm(chosen - centre, axis=1).mean()
    if extent < _LEAST_EXTENT:
        return np.zeros((0, 3), np.float32)
    points, chosen = (0.5 / extent * (one - centre) for one in (points, chosen))
    points, chosen = (
        one[(np.abs(one) <= 1.0).all(axis=1)] for one in (points, chosen)
    )
    # Chosen points are means, of which a voxel may have no point within.
    source = points if len(points) else chosen
    chosen = np.concatenate([chosen, _sample_missing(source, chosen, rng)])
    return (chosen * [-1.0, 1.0, 1.0]).astype(np.float32)


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


def _sample_missing(
    points: np.ndarray, chosen: np.ndarray, rng: np.random.Generator
) -> np.ndarray:
    """Returns random points, as many as `chosen` lacks to be complete."""
    lacking = NUM_POINTS - len(chosen)
    repeats = lacking > len(points)
    return points[rng.choice(len(points), lacking, replace=repeats)]


# Side of a cell of the networks, in clouds from -1 to 1.
CELL = 0.01


def occupied_cells(cloud: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Returns the cells (N, 3) of a cloud, and their features (N, 1), all 1."""
    cells = np.floor(cloud / np.float32(CELL)).astype(np.int64)
    cells = coarser(cells, 1)
    return cells, np.ones((len(cells), 1), np.float32)
