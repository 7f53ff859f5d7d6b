"""Planes in a cloud: one a voxel, and the ground plane.

Part of BTC (see `evaluation.methods.btc`).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cns_drake.base.compiled import compiled
from evaluation.geometry.sorting import stable_order
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
    index, numbers = _voxels(points, voxel_size)
    order = stable_order(numbers)
    starts = np.flatnonzero(np.diff(numbers[order], prepend=-1))
    counts = np.diff(starts, append=len(points))
    by_first_point = np.argsort(order[starts])
    firsts = order[starts[by_first_point]]
    visited = by_first_point[voxel_order(index[firsts])]
    dense = visited[counts[visited] > max_points]
    counts = counts[dense]
    centers, covariances = _moments(points, order, starts[dense], counts)
    planes, variances = _fit(centers, covariances, counts)
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
    # |n1 - n2| < d of unit vectors; either sign of a normal will do.
    min_cosine = 1.0 - 0.5 * normal_limit * normal_limit
    for i in range(num_planes - 1, 0, -1):
        for j in range(i):
            if labels[i] >= 0 and labels[j] >= 0:
                continue
            cosine = (
                normals[i, 0] * normals[j, 0]
                + normals[i, 1] * normals[j, 1]
                + normals[i, 2] * normals[j, 2]
            )
            if abs(cosine) <= min_cosine:
                continue
            from_i = 0.0
            from_j = 0.0
            for axis in range(3):
                offset = centers[j, axis] - centers[i, axis]
                from_i += normals[i, axis] * offset
                from_j += normals[j, axis] * offset
            if abs(from_i) >= distance_limit or abs(from_j) >= distance_limit:
                continue
            if labels[i] < 0 and labels[j] < 0:
                labels[i] = num_groups
                labels[j] = num_groups
                num_groups += 1
            elif labels[i] < 0:
                labels[i] = labels[j]
            else:
                labels[j] = labels[i]
    return labels


@compiled
def _voxels(
    points: np.ndarray, voxel_size: float
) -> tuple[np.ndarray, np.ndarray]:
    """Returns (N, 3) int64 indices of voxels, and (N,) numbers >= 0 of them.

    The numbers go by index along x, then y, then z.
    """
    num_points = len(points)
    index = np.empty((num_points, 3), dtype=np.int64)
    first = np.full(3, np.iinfo(np.int64).max)
    last = np.full(3, np.iinfo(np.int64).min)
    for i in range(num_points):
        for axis in range(3):
            scaled = points[i, axis] / voxel_size
            # As in the public program: truncated, and one less below zero,
            # so that a negative multiple belongs to the voxel below it.
            voxel = int(scaled - 1.0) if scaled < 0.0 else int(scaled)
            index[i, axis] = voxel
            first[axis] = min(first[axis], voxel)
            last[axis] = max(last[axis], voxel)
    numbers = np.empty(num_points, dtype=np.int64)
    for i in range(num_points):
        number = 0
        for axis in range(3):
            number *= last[axis] - first[axis] + 1
            number += index[i, axis] - first[axis]
        numbers[i] = number
    return index, numbers


@compiled
def _moments(
    points: np.ndarray,
    order: np.ndarray,
    starts: np.ndarray,
    counts: np.ndarray,
) -> tuple[np.ndarray, np.ndarray]:
    """Returns the mean (V, 3) and covariance (V, 3, 3) of runs of points.

    Args:
        points: (N, 3).
        order: (N,) of the points.
        starts: (V,) where each run starts in that order.
        counts: (V,) its length, > 0.
    """
    num_runs = len(starts)
    means = np.zeros((num_runs, 3))
    covariances = np.zeros((num_runs, 3, 3))
    for run in range(num_runs):
        members = order[starts[run] : starts[run] + counts[run]]
        for i in members:
            for axis in range(3):
                means[run, axis] += points[i, axis]
        for axis in range(3):
            means[run, axis] /= counts[run]
        for i in members:
            for axis in range(3):
                offset = points[i, axis] - means[run, axis]
                for other in range(axis + 1):
                    covariances[run, axis, other] += offset * (
                        points[i, other] - means[run, other]
                    )
        for axis in range(3):
            for other in range(axis + 1):
                covariances[run, axis, other] /= counts[run]
                covariances[run, other, axis] = covariances[run, axis, other]
    return means, covariances


def _fit(
    centers: np.ndarray, covariances: np.ndarray, counts: np.ndarray
) -> tuple[Planes, np.ndarray]:
    """Returns the planes of least squares, and the variances (P,) off them."""
    variances, axes = np.linalg.eigh(covariances)
    return Planes(centers, axes[:, :, 0], covariances, counts), variances[:, 0]
