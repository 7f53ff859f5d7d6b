"""Triangles of keypoints, and the search for similar triangles.

Part of BTC (see `evaluation.methods.btc`). The lengths of a triangle's sides do
not change if the sensor moves. Two triangles are similar if their sides have
about the same lengths, and their vertices about the same binary descriptors.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
import itertools
import math

import numpy as np
from scipy.spatial import cKDTree

from evaluation.methods.btc_keypoints import Keypoints, count_bits

# Fixed in the public program: least excess of the sum of the two short sides
# over the long one [m].
_MIN_DETOUR = 0.2
# Fixed in the public program: greatest difference of the sides of two triangles
# of a cloud that count as the same [m].
_SAME = 0.001
# Fixed in the public program: greatest distance of a query from the center of a
# cell that is searched [cells].
_REACH = 1.5

# The search reaches this much farther, to allow for rounding.
_MARGIN = 1.0 + 1e-9

# A similarity equal to the limit counts, whatever the rounding: in the public
# program's single precision, the limit 0.7 is 1e-8 less.
_ROUNDING = 1e-8


@dataclass(frozen=True)
class Triangles:
    """Triangles of keypoints.

    The vertices are ordered by the sides that meet there: the two shortest
    sides; the shortest and the longest side; the two longest sides.

    Attributes:
        sides: (T, 3) lengths, shortest first [m].
        positions: (T, 3, 3) positions of the vertices, one in each row [m].
        heights: (T, 3) int64, the binary descriptor of each vertex: bit k is
            set if the vertex's cell has points in layer k above the plane.
    """

    sides: np.ndarray
    positions: np.ndarray
    heights: np.ndarray

    def __len__(self) -> int:
        return len(self.sides)

    def take(self, chosen: np.ndarray) -> Triangles:
        """Returns some of the triangles, by index."""
        return Triangles(
            self.sides[chosen], self.positions[chosen], self.heights[chosen]
        )


@dataclass(frozen=True)
class TriangleTable:
    """The triangles of some clouds, sorted by cell.

    A cell contains the triangles whose sides round to the same multiples of
    the resolution.

    Attributes:
        triangles: the T triangles.
        clouds: (T,) number of each triangle's cloud.
        resolution: step to which the sides are rounded [m].
        tree: search tree over the sides [m].
    """

    triangles: Triangles
    clouds: np.ndarray
    resolution: float
    tree: cKDTree


def make_triangles(
    keypoints: Keypoints, num_neighbours: int, side_range: tuple[float, float]
) -> Triangles:
    """Returns the triangles between each keypoint and its neighbours.

    Args:
        keypoints: the K keypoints.
        num_neighbours: number of nearest keypoints that are used, including the
            keypoint itself; all keypoints if there are fewer than this number.
        side_range: limits of the sides [m].
    """
    # The public program reads beyond its array if there are fewer keypoints.
    num_neighbours = min(num_neighbours, len(keypoints))
    if num_neighbours < 3:
        return Triangles(
            np.empty((0, 3)),
            np.empty((0, 3, 3)),
            np.empty((0, 3), dtype=np.int64),
        )
    positions = keypoints.positions
    corners = _corner_triples(positions, num_neighbours)
    ends = np.array([[0, 1], [0, 2], [1, 2]])
    difference = positions[corners[:, ends[:, 0]]]
    difference -= positions[corners[:, ends[:, 1]]]
    sides = np.sqrt((difference**2).sum(axis=2))
    order = np.argsort(sides, axis=1, kind="stable")
    sides = np.take_along_axis(sides, order, axis=1)
    low, high = side_range
    detour = sides[:, 0] + sides[:, 1] - sides[:, 2]
    kept = (sides[:, 0] >= low) & (sides[:, 2] <= high)
    kept &= detour >= _MIN_DETOUR
    sides, order, corners = sides[kept], order[kept], corners[kept]
    first = _first_of_each(sides)
    sides, order, corners = sides[first], order[first], corners[first]
    # Sides 0, 1 and 2 lie between corners 0-1, 0-2 and 1-2.
    meeting = np.stack(
        [
            order[:, 0] + order[:, 1] - 1,
            order[:, 0] + order[:, 2] - 1,
            order[:, 1] + order[:, 2] - 1,
        ],
        axis=1,
    )
    vertices = np.take_along_axis(corners, meeting, axis=1)
    return Triangles(sides, positions[vertices], keypoints.heights[vertices])


def _corner_triples(positions: np.ndarray, num_neighbours: int) -> np.ndarray:
    """Returns each keypoint with any two of its neighbours, (T, 3) indices.

    Args:
        positions: (K, 3) positions of the keypoints [m].
        num_neighbours: number of nearest keypoints, including the keypoint
            itself; at most K.
    """
    _, nearest = cKDTree(positions).query(positions, k=num_neighbours)
    # The keypoint itself, then two of its neighbours, in order of distance.
    one, other = np.triu_indices(num_neighbours - 1, k=1)
    return np.stack(
        [
            np.repeat(nearest[:, 0], len(one)),
            nearest[:, one + 1].ravel(),
            nearest[:, other + 1].ravel(),
        ],
        axis=1,
    )


def _first_of_each(sides: np.ndarray) -> np.ndarray:
    """Returns the first of all triangles with the same sides, as indices.

    Each triangle is found from up to three corners.

    Args:
        sides: (T, 3) sides of the triangles, shortest first [m].
    """
    lengths = (sides / _SAME).astype(np.int64)
    by_length = np.lexsort(lengths.T)
    differs = np.diff(lengths[by_length], axis=0, prepend=-1).any(axis=1)
    return np.sort(by_length[differs])


def make_table(clouds: Sequence[Triangles], resolution: float) -> TriangleTable:
    """Returns the triangles of several clouds, sorted for the search.

    Triangles whose sides round to the same multiples of the resolution form a
    cell. Triangles are sorted by cell, and keep their order within a cell.

    Args:
        clouds: triangles of each cloud; at least one.
        resolution: step to which the sides are rounded [m].
    """
    triangles = Triangles(
        np.concatenate([cloud.sides for cloud in clouds]),
        np.concatenate([cloud.positions for cloud in clouds]),
        np.concatenate([cloud.heights for cloud in clouds]),
    )
    numbers = np.repeat(np.arange(len(clouds)), [len(c) for c in clouds])
    order = np.lexsort(_cells(triangles.sides / resolution).T[::-1])
    triangles = triangles.take(order)
    return TriangleTable(
        triangles, numbers[order], resolution, cKDTree(triangles.sides)
    )


def _cells(sides: np.ndarray) -> np.ndarray:
    """Returns the cells (T, 3) of sides (T, 3) in units of the resolution."""
    return (sides + 0.5).astype(np.int64)


def match(
    query: Triangles,
    table: TriangleTable,
    side_tolerance: float,
    min_similarity: float,
) -> tuple[np.ndarray, np.ndarray]:
    """Returns the pairs of similar triangles of a query and of a table.

    Similar triangles have about the same side lengths, and about the same
    binary descriptors at their vertices.

    Args:
        query: triangles of one cloud.
        table: table in which similar triangles are sought.
        side_tolerance: greatest difference of the side lengths, as the norm of
            three differences divided by the norm of the query's three lengths.
            For large triangles, the limit is smaller, because only cells of the
            table near the query's lengths are searched.
        min_similarity: least Dice similarity of the descriptors, as the mean
            over three vertices.

    Returns:
        (M,) indices of triangles of the query, non-decreasing, and (M,) indices
        of triangles of the table. Matches of one query triangle are in the
        order of the table.
    """
    limits = side_tolerance * np.sqrt((query.sides**2).sum(axis=1))
    # Triangles farther away are in cells that are not searched; the corners of
    # a cell are sqrt(3) from its center.
    farthest = (_REACH + math.sqrt(3.0)) * table.resolution
    reach = np.minimum(limits, farthest) * _MARGIN
    near = table.tree.query_ball_point(query.sides, reach, return_sorted=True)
    of_query = np.repeat(np.arange(len(query)), [len(one) for one in near])
    of_table = np.fromiter(
        itertools.chain.from_iterable(near), np.int64, len(of_query)
    )
    sides = query.sides[of_query] / table.resolution
    others = table.triangles.sides[of_table] / table.resolution
    limit = side_tolerance * np.sqrt((sides**2).sum(axis=1))
    difference = np.sqrt(((others - sides) ** 2).sum(axis=1))
    to_center = np.sqrt(((_cells(others) + 0.5 - sides) ** 2).sum(axis=1))
    is_near = (to_center < _REACH) & (difference < limit)
    of_query, of_table = of_query[is_near], of_table[is_near]
    heights = query.heights[of_query]
    others = table.triangles.heights[of_table]
    common = count_bits(heights & others)
    similarity = 2.0 * common / (count_bits(heights) + count_bits(others))
    is_alike = similarity.sum(axis=1) / 3.0 > min_similarity - _ROUNDING
    return of_query[is_alike], of_table[is_alike]
