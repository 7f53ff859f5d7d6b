"""Planes in a cloud: one a voxel, and the ground plane.

Part of BTC (see `evaluation.methods.btc`).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cns_drake.base.compiled import compiled
from evaluation.methods.btc_voxel_order import voxel_order


@dataclass(frozen=True)
class Planes:
    """Patches of planes, each with the moments of its points.

    Attributes:
        centers: (P, 3) mean of each patch's points [m].
        normals: (P, 3) unit vectors; their sign means nothing.
        covariances: (P, 3, 3) of the points, divided by their number [m^2].
        counts: (P,) int64 number of points.
    """

    centers: np.ndarray
    normals: np.ndarray
    covariances: np.ndarray
    counts: np.ndarray

    def __len__(self) -> int:
        return len(self.counts)

    def take(self, chosen: np.ndarray) -> Planes:
        """Returns some of the patches, by index or by mask."""
        return Planes(
            self.centers[chosen],
            self.normals[chosen],
            self.covariances[chosen],
            self.counts[chosen],
        )


def voxel_planes(
    points: np.ndarray, voxel_size: float, max_points: int, flatness: float
) -> Planes:
    """Returns the voxels whose points lie on a plane.

    They come in the order of the public program, which depends on the order of
    the points; see `evaluation.methods.btc_voxel_order`.

    Args:
        points: (N, 3) [m].
        voxel_size: side of a voxel [m].
        max_points: only voxels with more points are used.
        flatness: upper limit of the variance along the normal [m^2].
    """
    index, counts, centers, covariances = _moments(points, voxel_size)
    visited = voxel_order(index)
    dense = visited[counts[visited] > max_points]
    planes, variances = _fit(centers[dense], covariances[dense], counts[dense])
    return planes.take(variances < flatness)


def base_plane(
    planes: Planes, normal_limit: float, distance_limit: float
) -> tuple[np.ndarray, np.ndarray] | None:
    """Returns the largest plane that the patches form; outdoors, the ground.

    Patches that are alike are merged, those without a partner dropped, and
    the merged ones merged once more, the largest first.

    Args:
        planes: of the voxels.
        normal_limit: difference of the normals of patches that are alike.
        distance_limit: of each center from the other's plane [m].

    Returns:
        Its center (3,) and normal (3,), pointing up; None without alike
        patches.
    """
    groups = merge(planes, normal_limit, distance_limit, keep_single=False)
    if len(groups) == 0:
        return None
    groups = groups.take(np.argsort(-groups.counts, kind="stable"))
    groups = merge(groups, normal_limit, distance_limit, keep_single=True)
    largest = int(groups.counts.argmax())
    normal = groups.normals[largest]
    return groups.centers[largest], normal if normal[2] >= 0.0 else -normal


def merge(
    planes: Planes,
    normal_limit: float,
    distance_limit: float,
    keep_single: bool,
) -> Planes:
    """Returns the planes that alike patches form together.

    Args:
        planes: some of them alike. The groups depend on their order.
        normal_limit: see `base_plane`.
        distance_limit: see `base_plane`.
        keep_single: keep also patches that are like no other.
    """
    labels = group_alike(
        planes.centers, planes.normals, normal_limit, distance_limit
    )
    single = labels < 0
    if keep_single:
        labels[single] = labels.max(initial=-1) + 1 + np.arange(single.sum())
    else:
        planes = planes.take(~single)
        labels = labels[~single]
    num_groups = labels.max(initial=-1) + 1
    counts = np.zeros(num_groups, dtype=np.int64)
    np.add.at(counts, labels, planes.counts)
    weights = planes.counts / counts[labels]
    centers = np.zeros((num_groups, 3))
    np.add.at(centers, labels, weights[:, None] * planes.centers)
    offsets = planes.centers - centers[labels]
    spread = planes.covariances + offsets[:, :, None] * offsets[:, None, :]
    covariances = np.zeros((num_groups, 3, 3))
    np.add.at(covariances, labels, weights[:, None, None] * spread)
    return _fit(centers, covariances, counts)[0]


@compiled
def group_alike(
    centers: np.ndarray,
    normals: np.ndarray,
    normal_limit: float,
    distance_limit: float,
) -> np.ndarray:
    """Returns the group (P,) of each patch; -1 for one that is like no other.

    From the last patch to the first, each is compared with all before it, in
    their order. If two are alike, one without a group joins that of the
    other, or both found a new one; two groups never become one.

    Args:
        centers: (P, 3) [m].
        normals: (P, 3) unit.
        normal_limit: see `base_plane`.
        distance_limit: see `base_plane`.
    """
    num_planes = len(centers)
    labels = np.full(num_planes, -1)
    num_groups = 0
    excesses = np.empty(num_planes)
    # One more than needed, for a write that is not kept.
    alike = np.empty(num_planes + 1, dtype=np.int64)
    by_axis = np.ascontiguousarray(centers.T), np.ascontiguousarray(normals.T)
    for i in range(num_planes - 1, 0, -1):
        _compare(*by_axis, i, normal_limit, distance_limit, excesses)
        num_alike = 0
        for j in range(i):
            alike[num_alike] = j
            num_alike += excesses[j] < 0.0
        for j in alike[:num_alike]:
            if labels[i] < 0 and labels[j] < 0:
                labels[i] = num_groups
                labels[j] = num_groups
                num_groups += 1
            elif labels[i] < 0:
                labels[i] = labels[j]
            elif labels[j] < 0:
                labels[j] = labels[i]
    return labels


@compiled
def _compare(
    centers: np.ndarray,
    normals: np.ndarray,
    i: int,
    normal_limit: float,
    distance_limit: float,
    excesses: np.ndarray,
) -> None:
    """Writes by how much patches before `i` are not like it; below 0 if alike.

    The loop has no branch, so that it handles several patches at a time.

    Args:
        centers: (3, P) [m].
        normals: (3, P) unit.
        i: number of a patch.
        normal_limit: see `base_plane`.
        distance_limit: see `base_plane`.
        excesses: (P,) to write to.
    """
    # |n1 - n2| < d of unit vectors; either sign of a normal will do.
    min_cosine = 1.0 - 0.5 * normal_limit * normal_limit
    x, y, z = centers[0, i], centers[1, i], centers[2, i]
    a, b, c = normals[0, i], normals[1, i], normals[2, i]
    for j in range(i):
        u, v, w = normals[0, j], normals[1, j], normals[2, j]
        cosine = abs(a * u + b * v + c * w)
        dx, dy, dz = centers[0, j] - x, centers[1, j] - y, centers[2, j] - z
        from_i = abs(a * dx + b * dy + c * dz)
        from_j = abs(u * dx + v * dy + w * dz)
        apart = max(from_i, from_j) - distance_limit
        excesses[j] = max(apart, min_cosine - cosine)


@compiled
def _moments(
    points: np.ndarray, voxel_size: float
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Returns the voxels of a cloud, in the order in which it meets them.

    Returns:
        (V, 3) int64 indices along x, y and z; (V,) number of points; (V, 3)
        their mean; (V, 3, 3) their covariance.
    """
    num_points = len(points)
    places = np.empty(3 * num_points, dtype=np.int64)
    for i, coordinate in enumerate(points.ravel()):
        scaled = coordinate / voxel_size
        # As in the public program: truncated, and one less below zero,
        # so that a negative multiple belongs to the voxel below it.
        places[i] = int(scaled - 1.0 if scaled < 0.0 else scaled)
    members = np.empty(num_points, dtype=np.int32)
    index = np.empty((num_points, 3), dtype=np.int64)
    counts = np.empty(num_points, dtype=np.int64)
    means = np.empty((num_points, 3))
    num_voxels = 0
    # A hash table of voxels, at most half full; -1 is a free slot.
    size = 1
    while size < 2 * num_points:
        size *= 2
    table = np.full(size, -1, dtype=np.int32)
    for i in range(num_points):
        x, y, z = places[3 * i], places[3 * i + 1], places[3 * i + 2]
        # Large odd factors spread neighbouring voxels; products wrap around.
        slot = (x * 73856093 ^ y * 19349669 ^ z * 83492791) & (size - 1)
        voxel = table[slot]
        while voxel >= 0 and not (
            index[voxel, 0] == x
            and index[voxel, 1] == y
            and index[voxel, 2] == z
        ):
            slot = (slot + 1) & (size - 1)
            voxel = table[slot]
        if voxel < 0:
            voxel = num_voxels
            num_voxels += 1
            table[slot] = voxel
            index[voxel, 0], index[voxel, 1], index[voxel, 2] = x, y, z
            counts[voxel] = 0
            for axis in range(3):
                means[voxel, axis] = 0.0
        members[i] = voxel
        counts[voxel] += 1
        for axis in range(3):
            means[voxel, axis] += points[i, axis]
    for voxel in range(num_voxels):
        for axis in range(3):
            means[voxel, axis] /= counts[voxel]
    covariances = np.zeros((num_voxels, 3, 3))
    for i in range(num_points):
        voxel = members[i]
        dx = points[i, 0] - means[voxel, 0]
        dy = points[i, 1] - means[voxel, 1]
        dz = points[i, 2] - means[voxel, 2]
        covariances[voxel, 0, 0] += dx * dx
        covariances[voxel, 1, 0] += dy * dx
        covariances[voxel, 1, 1] += dy * dy
        covariances[voxel, 2, 0] += dz * dx
        covariances[voxel, 2, 1] += dz * dy
        covariances[voxel, 2, 2] += dz * dz
    for voxel in range(num_voxels):
        for axis in range(3):
            for other in range(axis + 1):
                covariance = covariances[voxel, axis, other] / counts[voxel]
                covariances[voxel, axis, other] = covariance
                covariances[voxel, other, axis] = covariance
    found = slice(num_voxels)
    return index[found], counts[found], means[found], covariances


def _fit(
    centers: np.ndarray, covariances: np.ndarray, counts: np.ndarray
) -> tuple[Planes, np.ndarray]:
    """Returns the planes of least squares, and the variances (P,) off them."""
    variances, axes = np.linalg.eigh(covariances)
    return Planes(centers, axes[:, :, 0], covariances, counts), variances[:, 0]
