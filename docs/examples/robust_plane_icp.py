"""Point to plane with a robust kernel, as an own method of `cns-eval localise`.

A pair at a distance d off its plane weighs (c / (c + d^2))^2, where c is the
square of `SCALE` (Geman and McClure): what has changed hardly counts.
"""

import numpy as np
from scipy.spatial.transform import Rotation
import small_gicp

WIDTH = 2.0  # greatest distance of a pair [m]
SCALE = 0.2  # distance off a plane at which a weight is 1/4 [m]
FIT = 0.15  # a point that is nearer to a plane fits [m]


def localise(map, scan, start):
    """Moves a scan onto a map.

    Args:
        map: (M, 3) points around the start, in the world [m].
        scan: (N, 3) points in the LiDAR's frame [m].
        start: (4, 4) pose of the LiDAR in the world.

    Returns:
        The pose (4, 4), and the share of the points that fit.
    """
    target = small_gicp.PointCloud(map)
    tree = small_gicp.KdTree(target)
    small_gicp.estimate_normals(target, tree, 10)
    normals = target.normals()[:, :3]
    cloud = small_gicp.voxelgrid_sampling(small_gicp.PointCloud(scan), 0.5)
    points = cloud.points()[:, :3]
    X = start.copy()
    for _ in range(50):
        arms = points @ X[:3, :3].T
        moved = arms + X[:3, 3]
        found, squares = tree.batch_nearest_neighbor_search(moved)
        near = np.asarray(squares) < WIDTH**2
        nearest = np.asarray(found, dtype=np.int64)[near]
        n = normals[nearest]
        off = np.sum(n * (moved[near] - map[nearest]), axis=1)
        if len(off) < 6:
            break
        weights = (SCALE**2 / (SCALE**2 + off**2)) ** 2
        J = np.concatenate([np.cross(arms[near], n), n], axis=1)
        H = (J.T * weights) @ J + 1e-6 * np.eye(6)
        step = np.linalg.solve(H, -(J.T * weights) @ off)
        X[:3, :3] = Rotation.from_rotvec(step[:3]).as_matrix() @ X[:3, :3]
        X[:3, 3] += step[3:]
        if np.abs(step).max() < 1e-4:
            break
    return X, np.count_nonzero(np.abs(off) < FIT) / len(points)
