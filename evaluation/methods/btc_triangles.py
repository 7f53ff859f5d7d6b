"""Triangles between keypoints, and the search for similar ones.

Part of BTC (see `evaluation.methods.btc`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from cns_drake.base.compiled import compiled
from evaluation.geometry.sorting import cell_order
from evaluation.methods.btc_keypoints import Keypoints, count_bits

# Fixed in the public program: how much longer the two short sides must be than
# the long one [m], the sides' difference at which two triangles of one cloud
# are the same [m], and the greatest distance of a query from the center of a
# cell that is searched [cells].
_MIN_DETOUR = 0.2
_SAME = 0.001
_REACH = 1.5

# A similarity of exactly the limit counts, with either rounding: the public
# program holds the limit in single precision, where 0.7 is 1e-8 less.
_ROUNDING = 1e-8

# Three cell numbers of 20 bits make one key.
_KEY_BITS = 20


@dataclass(frozen=True)
class Triangles:
    """Triangles of keypoints.

    The vertices are, in this order: where the two shortest sides meet, where
    the shortest and the longest meet, where the two longest meet.

    Attributes:
        sides: (T, 3) lengths, shortest first [m].
        positions: (T, 3, 3) of the vertices, one a row [m].
        heights: (T, 3) int64 binary descriptors of the vertices.
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

    A cell holds the triangles whose sides, in units of the resolution, round
    to the same three numbers.

    Attributes:
        keys: (T,) int64, non-decreasing; the three numbers of the cell.
        triangles: T of them.
        clouds: (T,) number of each triangle's cloud.
        resolution: of the sides [m].
    """

    keys: np.ndarray
    triangles: Triangles
    clouds: np.ndarray
    resolution: float


def make_triangles(
    keypoints: Keypoints, num_neighbours: int, side_range: tuple[float, float]
) -> Triangles:
    """Returns the triangles between each keypoint and its neighbours.

    Args:
        keypoints: K of them.
        num_neighbours: nearest keypoints that are looked at, the keypoint
            itself included. (Where a cloud has fewer, the public program
            reads beyond them.)
        side_range: limits of the sides [m].
    """
    num_neighbours = min(num_neighbours, len(keypoints))
    if num_neighbours < 3:
        return Triangles(
            np.empty((0, 3)),
            np.empty((0, 3, 3)),
            np.empty((0, 3), dtype=np.int64),
        )
    positions = keypoints.positions
    _, nearest = cKDTree(positions).query(positions, k=num_neighbours)
    # Itself, then two different neighbours, all in order of distance.
    one, other = np.triu_indices(num_neighbours - 1, k=1)
    corners = np.stack(
        [
            np.repeat(nearest[:, 0], len(one)),
            nearest[:, one + 1].ravel(),
            nearest[:, other + 1].ravel(),
        ],
        axis=1,
    )
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
    # Each triangle is seen from up to three corners; the first one counts.
    lengths = (sides / _SAME).astype(np.int64)
    by_length = cell_order(lengths)
    differs = np.diff(lengths[by_length], axis=0, prepend=-1).any(axis=1)
    first = np.sort(by_length[differs])
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


def make_table(clouds: Sequence[Triangles], resolution: float) -> TriangleTable:
    """Returns the triangles of clouds, sorted by cell; ties in their order.

    Args:
        clouds: at least one.
        resolution: length that is one unit of the sides [m].
    """
    triangles = Triangles(
        np.concatenate([cloud.sides for cloud in clouds]),
        np.concatenate([cloud.positions for cloud in clouds]),
        np.concatenate([cloud.heights for cloud in clouds]),
    )
    numbers = np.repeat(np.arange(len(clouds)), [len(c) for c in clouds])
    cells = (triangles.sides / resolution + 0.5).astype(np.int64)
    keys = (cells[:, 0] << 2 * _KEY_BITS) | (cells[:, 1] << _KEY_BITS)
    keys |= cells[:, 2]
    order = np.argsort(keys, kind="stable")
    return TriangleTable(
        keys[order], triangles.take(order), numbers[order], resolution
    )


def match(
    query: Triangles,
    table: TriangleTable,
    side_tolerance: float,
    min_similarity: float,
) -> tuple[np.ndarray, np.ndarray]:
    """Finds the triangles that are similar to those of a query.

    Similar are triangles whose sides differ by little, relative to their
    length (Euclidean norms of the three), and whose vertices have about the
    same heights: Dice similarity, mean of the three. Only cells near those of
    the query are searched, so that large triangles must be more alike than the
    tolerance requires.

    Args:
        query: from one cloud.
        table: to search for its triangles.
        side_tolerance: upper limit of the sides' relative difference.
        min_similarity: lower limit of the similarity.

    Returns:
        (M,) triangles of the query, non-decreasing, and (M,) of the table;
        those of one triangle of the query in the order of the table.
    """
    return _match(
        query.sides / table.resolution,
        query.heights,
        table.keys,
        table.triangles.sides / table.resolution,
        table.triangles.heights,
        side_tolerance,
        min_similarity,
    )


@compiled
def _match(
    query_sides: np.ndarray,
    query_heights: np.ndarray,
    keys: np.ndarray,
    table_sides: np.ndarray,
    table_heights: np.ndarray,
    side_tolerance: float,
    min_similarity: float,
) -> tuple[np.ndarray, np.ndarray]:
    """See `match`; sides in units of the resolution."""
    found_query: np.ndarray = np.empty(1024, dtype=np.int64)
    found_table: np.ndarray = np.empty(1024, dtype=np.int64)
    num_found = 0
    for i in range(len(query_sides)):
        a, b, c = query_sides[i]
        limit = side_tolerance * np.sqrt(a * a + b * b + c * c)
        bits = count_bits(query_heights[i])
        for x in range(int(a) - 1, int(a) + 2):
            for y in range(int(b) - 1, int(b) + 2):
                # The three cells along the longest side follow each other.
                row = (x << 2 * _KEY_BITS) | (y << _KEY_BITS)
                z = int(c) - 1
                last = row | (z + 2)
                j = np.searchsorted(keys, row | z)
                while j < len(keys) and keys[j] <= last:
                    z = keys[j] - row
                    to_center = np.sqrt(
                        (x + 0.5 - a) ** 2
                        + (y + 0.5 - b) ** 2
                        + (z + 0.5 - c) ** 2
                    )
                    difference = np.sqrt(
                        (table_sides[j, 0] - a) ** 2
                        + (table_sides[j, 1] - b) ** 2
                        + (table_sides[j, 2] - c) ** 2
                    )
                    if to_center < _REACH and difference < limit:
                        similarity = 0.0
                        for vertex in range(3):
                            heights = table_heights[j, vertex]
                            common = count_bits(
                                query_heights[i, vertex] & heights
                            )
                            similarity += (
                                2.0
                                * common
                                / (bits[vertex] + count_bits(heights))
                            )
                        if similarity / 3.0 > min_similarity - _ROUNDING:
                            if num_found == len(found_query):
                                found_query = np.append(
                                    found_query, np.empty_like(found_query)
                                )
                                found_table = np.append(
                                    found_table, np.empty_like(found_table)
                                )
                            found_query[num_found] = i
                            found_table[num_found] = j
                            num_found += 1
                    j += 1
    return found_query[:num_found], found_table[:num_found]
