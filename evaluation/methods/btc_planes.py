"""Planes in a cloud: one per voxel, and the ground plane.

Part of BTC (see `evaluation.methods.btc`). All keypoints depend on the largest
plane, which is the ground. The order in which patches are compared decides
which patches are merged into this plane. That order is the order of the voxels
in the public program.
"""

from __future__ import annotations

from dataclasses import dataclass
import math

import numpy as np

from evaluation.base import compiled


@dataclass(frozen=True)
class Planes:
    """Patches of planes, each with the moments of its points.

    Attributes:
        centers: (P, 3) mean of each patch's points [m].
        normals: (P, 3) unit vectors of either sign.
        covariances: (P, 3, 3) covariance matrix of each patch's N points, with
            the divisor N instead of N - 1 [m^2].
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
    """Returns a plane for each voxel whose points lie on a plane.

    The planes are in the same order as in the public program of BTC. This order
    depends on the order of the points.

    Args:
        points: (N, 3) points [m].
        voxel_size: side of a voxel [m].
        max_points: only voxels with more than this number of points are used.
        flatness: upper limit of the variance along the normal [m^2].
    """
    index, counts, centers, covariances = _moments_of_voxels(points, voxel_size)
    visited = voxel_order(index)
    dense = visited[counts[visited] > max_points]
    covariances = covariances[dense] / counts[dense, None, None]
    planes, variances = _planes_of_moments(
        centers[dense], covariances, counts[dense]
    )
    return planes.take(variances < flatness)


def base_plane(
    planes: Planes, normal_limit: float, distance_limit: float
) -> tuple[np.ndarray, np.ndarray] | None:
    """Returns the largest plane that patches form; outdoors, the ground.

    Similar patches are merged into larger planes, and patches to which no other
    patch is similar are dropped. Then similar planes are merged.

    Args:
        planes: patches, one for each voxel.
        normal_limit: greatest length of the difference between the unit normals
            of two similar patches. The sign of a normal does not matter.
        distance_limit: greatest distance between the center of a patch and the
            plane of a similar patch [m].

    Returns:
        Center (3,) of the plane, and normal (3,), which points up; None if no
        patches are similar.
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
    """Merges similar patches; returns the merged planes.

    Args:
        planes: patches to merge. The order of the patches decides which of them
            are merged.
        normal_limit: see `base_plane`.
        distance_limit: see `base_plane`.
        keep_single: whether to keep patches that are not similar to any other
            patch.
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
    return _planes_of_moments(centers, covariances, counts)[0]


@compiled
def group_alike(
    centers: np.ndarray,
    normals: np.ndarray,
    normal_limit: float,
    distance_limit: float,
) -> np.ndarray:
    """Divides patches into groups of similar patches.

    As in the public program of BTC, groups that already exist are never merged.
    The result therefore depends on the order of the patches.

    Args:
        centers: (P, 3) centres of the patches [m].
        normals: (P, 3) unit normals of the patches, of either sign.
        normal_limit: see `base_plane`.
        distance_limit: see `base_plane`.

    Returns:
        (P,) number of each patch's group; -1 for a patch that is not similar to
        any other patch.
    """
    # From the last patch to the first, each is compared with all patches before
    # it, in their order.
    num_planes = len(centers)
    # |n1 - n2| < d of unit vectors; either sign of a normal will do.
    min_cosine = 1.0 - 0.5 * normal_limit * normal_limit
    labels = np.full(num_planes, -1)
    num_groups = 0
    excesses = np.empty(num_planes)
    # One element more than needed, for writes without effect.
    alike = np.empty(num_planes + 1, dtype=np.int64)
    p, n = np.ascontiguousarray(centers.T), np.ascontiguousarray(normals.T)
    for i in range(num_planes - 1, 0, -1):
        x, y, z = p[0, i], p[1, i], p[2, i]
        a, b, c = n[0, i], n[1, i], n[2, i]
        # There is no branch, so that the processor compares several patches at
        # a time.
        for j in range(i):
            u, v, w = n[0, j], n[1, j], n[2, j]
            dx, dy, dz = p[0, j] - x, p[1, j] - y, p[2, j] - z
            from_i = abs(a * dx + b * dy + c * dz)
            from_j = abs(u * dx + v * dy + w * dz)
            apart = max(from_i, from_j) - distance_limit
            cosine = abs(a * u + b * v + c * w)
            excesses[j] = max(apart, min_cosine - cosine)
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
def _moments_of_voxels(
    points: np.ndarray, voxel_size: float
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Returns the voxels of a cloud, in the order of their first points.

    Returns:
        For each voxel: (V, 3) int64 indices along x, y and z; (V,) number of
        points; (V, 3) mean of the points; (V, 3, 3) covariance of the points,
        times their number.
    """
    num_points = len(points)
    cells = np.empty(3 * num_points, dtype=np.int64)
    for i, coordinate in enumerate(points.ravel()):
        scaled = coordinate / voxel_size
        # As in the public program: truncated, and one less below zero,
        # so that a negative multiple belongs to the voxel below it.
        cells[i] = int(scaled - 1.0 if scaled < 0.0 else scaled)
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
        x, y, z = cells[3 * i], cells[3 * i + 1], cells[3 * i + 2]
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
        for axis, offset in enumerate((dx, dy, dz)):
            covariances[voxel, axis, 0] += offset * dx
            covariances[voxel, axis, 1] += offset * dy
            covariances[voxel, axis, 2] += offset * dz
    found = slice(num_voxels)
    return index[found], counts[found], means[found], covariances


def _planes_of_moments(
    centers: np.ndarray, covariances: np.ndarray, counts: np.ndarray
) -> tuple[Planes, np.ndarray]:
    """Returns the least-squares planes, and the variances (P,) across them.

    Args:
        centers: (P, 3) means of the points of each plane [m].
        covariances: (P, 3, 3) their covariances [m^2].
        counts: (P,) their numbers.
    """
    variances, normals = _least_axes(covariances)
    return Planes(centers, normals, covariances, counts), variances


@compiled
def _least_axes(covariances: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Returns the least eigenvalue (P,) of each covariance, and its axis.

    Jacobi's method needs only sums, products, quotients and square roots, which
    IEEE 754 defines to the last bit. It finds small eigenvalues of a covariance
    as exactly as large ones.

    Args:
        covariances: (P, 3, 3), symmetric.

    Returns:
        (P,) least eigenvalues; (P, 3) unit eigenvectors of either sign.
    """
    variances = np.empty(len(covariances))
    normals = np.empty((len(covariances), 3))
    V = np.empty((3, 3))
    for plane in range(len(covariances)):
        A = covariances[plane].copy()
        for i in range(3):
            for j in range(3):
                V[i, j] = 1.0 if i == j else 0.0
        # Convergence is quadratic: far fewer sweeps are needed.
        for _ in range(_MOST_SWEEPS):
            size = A[0, 0] * A[0, 0] + A[1, 1] * A[1, 1] + A[2, 2] * A[2, 2]
            off = A[0, 1] * A[0, 1] + A[0, 2] * A[0, 2] + A[1, 2] * A[1, 2]
            if off <= 1e-34 * size:
                break
            for p, q in ((0, 1), (0, 2), (1, 2)):
                if A[p, q] == 0.0:
                    continue
                ratio = (A[q, q] - A[p, p]) / (2.0 * A[p, q])
                t = 1.0 / (abs(ratio) + math.sqrt(ratio * ratio + 1.0))
                t = t if ratio >= 0.0 else -t
                c = 1.0 / math.sqrt(t * t + 1.0)
                s = t * c
                r = 3 - p - q
                change = t * A[p, q]
                A[p, p] -= change
                A[q, q] += change
                A[p, q] = A[q, p] = 0.0
                one, other = A[r, p], A[r, q]
                A[r, p] = A[p, r] = c * one - s * other
                A[r, q] = A[q, r] = s * one + c * other
                for i in range(3):
                    one, other = V[i, p], V[i, q]
                    V[i, p] = c * one - s * other
                    V[i, q] = s * one + c * other
        least = 0
        for axis in range(1, 3):
            if A[axis, axis] < A[least, least]:
                least = axis
        variances[plane] = A[least, least]
        for i in range(3):
            normals[plane, i] = V[i, least]
    return variances, normals


# Sweeps of Jacobi's method, at most.
_MOST_SWEEPS = 30


# The hash of a voxel's index, in the public program.
_FACTOR = 116101
_MODULUS = 10_000_000_000
# Numbers of buckets of a std::unordered_map of libstdc++ that grows by one
# element at a time. When there are as many elements as buckets, it takes the
# next prime of its table that is at least twice as large.
_NUM_BUCKETS = (
    13, 29, 59, 127, 257, 541, 1109, 2357, 5087, 10273, 20753, 42043, 85229,
    172933, 351061, 712697, 1447153, 2938679, 5967347, 12117689, 24607243,
    49969847, 101473717, 206062531,
)  # fmt: skip


def voxel_order(index: np.ndarray) -> np.ndarray:
    """Returns the order in which the authors' program of BTC visits voxels.

    Args:
        index: (V, 3) int64 indices of distinct voxels along x, y and z, in the
            order in which the voxels first occur in the cloud.

    Returns:
        (V,) row numbers of `index`, in the order of the program.
    """
    x, y, z = np.asarray(index, dtype=np.int64).T
    # fmod: a remainder with the sign of the dividend, as in C++.
    code = np.fmod(z * _FACTOR, _MODULUS) + y
    code = np.fmod(code * _FACTOR, _MODULUS) + x
    return hash_table_order(code.astype(np.uint64))


def hash_table_order(codes: np.ndarray) -> np.ndarray:
    """Returns the order (N,) in which a std::unordered_map is iterated.

    All elements form one list, in which the elements of a bucket follow each
    other. A new element goes to the front of its bucket, and a new bucket to
    the front of the list. When the number of buckets grows, all elements are
    inserted again, in the order of the list.

    Args:
        codes: (N,) uint64 hashes of the elements, in the order in which they
            were put in, one by one.

    Raises:
        ValueError: there are too many elements.
    """
    if len(codes) > _NUM_BUCKETS[-1]:
        raise ValueError(f"{len(codes)} elements")
    order = np.zeros(0, dtype=np.int64)
    for num_buckets in _NUM_BUCKETS:
        added = np.arange(len(order), min(num_buckets, len(codes)))
        order = np.concatenate([order, added])
        buckets = codes[order] % np.uint64(num_buckets)
        # Index of each bucket's first element: among equal indices, the first
        # is assigned last.
        first = np.empty(num_buckets, dtype=np.int64)
        first[buckets[::-1]] = np.arange(len(order))[::-1]
        # The newest bucket comes first, and in each bucket the newest element.
        ranks = first[buckets] * len(order) + np.arange(len(order))
        order = order[np.argsort(ranks, kind="stable")[::-1]]
        if len(order) == len(codes):
            break
    return order
