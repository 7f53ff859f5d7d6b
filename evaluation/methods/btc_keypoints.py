"""Keypoints of a cloud: places that stand out from a plane.

Part of BTC (see `evaluation.methods.btc`). Seen along the normal of the
plane, the cloud is an image; each of its cells has bits for the heights above
the plane that have points. Cells with many heights (walls, trunks, posts) are
the keypoints, if they are not part of a line of such.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeVar

import numpy as np
from scipy.spatial import cKDTree

from cns_drake.base.compiled import compiled

# Cells along the side of a square in which one keypoint may lie, the least
# number of points of an image, and by how many heights a cell may have less
# than its neighbour and still continue a line: fixed in the public program.
_SEGMENT = 5
_MIN_POINTS = 6
_LINE_MARGIN = 3

_NEIGHBOURS = ((0, 1), (1, 0), (1, 1), (1, -1))

_Words = TypeVar("_Words", int, np.ndarray)


@dataclass(frozen=True)
class Keypoints:
    """Keypoints with their binary descriptors.

    Attributes:
        positions: (K, 3) on the plane [m].
        heights: (K,) int64, bit k set if there are points in layer k.
    """

    positions: np.ndarray
    heights: np.ndarray

    def __len__(self) -> int:
        return len(self.heights)


@dataclass(frozen=True)
class HeightImage:
    """A cloud seen along the normal of a plane.

    Attributes:
        heights: (rows, columns) int64, bit k set if there are points in
            layer k. At least one more cell than there are points for, up and
            to the right; a multiple of the segment.
        means: (rows, columns, 2) mean of the points of a cell, along rows
            and along columns [m]; NaN where there are none.
    """

    heights: np.ndarray
    means: np.ndarray


def image_axes(normal: np.ndarray, orthogonal: bool) -> np.ndarray:
    """Returns the directions of an image on a plane, (3, 3) of length 1.

    They are, one a row: along the rows' numbers, along the columns' (which
    follows the x axis as far as the plane allows), and the normal.

    By a wrong term, the second direction of the public program has a
    component along the normal that is the normal's y component. Keypoints
    then lie on a plane through the same center that is tilted by as much:
    on level ground, about as much as the ground itself. It is followed
    unless `orthogonal`.

    Args:
        normal: (3,) unit, z >= 0.
        orthogonal: whether all directions are.
    """
    a, b, c = normal
    if orthogonal:
        along = [c, 0.0, -a] if abs(b) < 1.0 else [1.0, 0.0, 0.0]
    elif c != 0.0:
        along = [1.0, 0.0, -(a + b) / c]
    else:
        along = [1.0, -a / b, 0.0] if b != 0.0 else [0.0, 1.0, 0.0]
    along = np.array(along) / np.linalg.norm(along)
    across = np.cross(normal, along)
    return np.stack([across / np.linalg.norm(across), along, normal])


def height_image(
    points: np.ndarray,
    center: np.ndarray,
    axes: np.ndarray,
    *,
    resolution: float,
    height_range: tuple[float, float],
    height_step: float,
    num_layers: int,
) -> HeightImage:
    """Draws points into the cells of a grid that starts at the first.

    Its memory grows with the area that the points cover.

    Args:
        points: (N, 3) [m].
        center: (3,) a point of the plane [m].
        axes: (3, 3) of the image.
        resolution: length of a cell [m].
        height_range: limits of the heights above the plane [m].
        height_step: of the layers of height [m].
        num_layers: how many layers; points above them only count for the
            means.
    """
    near = _project(points, center, axes, *height_range)
    if len(near) < _MIN_POINTS:
        empty = np.zeros((_SEGMENT, _SEGMENT), dtype=np.int64)
        return HeightImage(empty, np.full((_SEGMENT, _SEGMENT, 2), np.nan))
    # Column by column: NumPy reduces slowly along the longer axis.
    low = np.array([near[:, axis].min() for axis in range(2)])
    high = np.array([near[:, axis].max() for axis in range(2)])
    last = ((high - low) / resolution).astype(np.int64)
    heights, means = _draw(
        near,
        low,
        resolution,
        height_range[0],
        height_step,
        num_layers,
        (last // _SEGMENT + 2) * _SEGMENT,
    )
    return HeightImage(heights, means)


def peaks(
    num_heights: np.ndarray, min_heights: int
) -> tuple[np.ndarray, np.ndarray]:
    """Finds the cells that stand out, away from lines.

    One a segment: the cell with most heights, the first of equal ones. It is
    part of a line if in some direction one neighbour is nearly as high and
    the opposite one at least half as high.

    Args:
        num_heights: (rows, columns) bits set in each cell; multiples of the
            segment.
        min_heights: that a peak needs.

    Returns:
        Rows (C,) and columns (C,), by segment along rows, then columns.
    """
    rows, columns = (length // _SEGMENT for length in num_heights.shape)
    segments = (
        num_heights.reshape(rows, _SEGMENT, columns, _SEGMENT)
        .transpose(0, 2, 1, 3)
        .reshape(rows * columns, _SEGMENT * _SEGMENT)
    )
    highest = segments.argmax(axis=1)
    most = segments[np.arange(len(segments)), highest]
    segment = np.flatnonzero(most >= min_heights)
    row = segment // columns * _SEGMENT + highest[segment] // _SEGMENT
    column = segment % columns * _SEGMENT + highest[segment] % _SEGMENT
    # At the other two sides, the image ends in empty cells.
    inside = (row > 0) & (column > 0)
    row, column = row[inside], column[inside]
    peak = num_heights[row, column]
    in_line = np.zeros(len(row), dtype=bool)
    for down, right in _NEIGHBOURS:
        one = num_heights[row + down, column + right]
        other = num_heights[row - down, column - right]
        low, high = np.minimum(one, other), np.maximum(one, other)
        in_line |= (high >= peak - _LINE_MARGIN) & (
            (low >= 0.5 * peak) | (low >= peak - _LINE_MARGIN)
        )
    return row[~in_line], column[~in_line]


def find_keypoints(
    image: HeightImage, center: np.ndarray, axes: np.ndarray, min_heights: int
) -> Keypoints:
    """Returns the peaks of an image, as places on its plane.

    Args:
        image: of a cloud.
        center: (3,) with which the image was drawn [m].
        axes: (3, 3) likewise.
        min_heights: that a keypoint needs.
    """
    cells = peaks(count_bits(image.heights), min_heights)
    return Keypoints(
        positions=center + image.means[cells] @ axes[:2],
        heights=image.heights[cells],
    )


def suppress(keypoints: Keypoints, radius: float, max_number: int) -> Keypoints:
    """Returns keypoints with more heights than any other nearby.

    If two are equal, neither stays.

    Args:
        keypoints: all.
        radius: of the neighbourhood [m].
        max_number: greatest number of kept ones, those with most heights.
    """
    tree = cKDTree(keypoints.positions)
    pairs = tree.query_pairs(radius, output_type="ndarray")
    num_heights = count_bits(keypoints.heights)
    one, other = num_heights[pairs[:, 0]], num_heights[pairs[:, 1]]
    kept = np.ones(len(keypoints), dtype=bool)
    kept[pairs[one <= other, 0]] = False
    kept[pairs[other <= one, 1]] = False
    chosen = np.flatnonzero(kept)
    if len(chosen) > max_number:
        order = np.argsort(-num_heights[chosen], kind="stable")
        chosen = chosen[order[:max_number]]
    return Keypoints(keypoints.positions[chosen], keypoints.heights[chosen])


@compiled
def count_bits(words: _Words) -> _Words:
    """Returns the number of set bits in numbers from 0 to 2^62 - 1.

    Args:
        words: an int64 or an array of them.

    Sums of neighbouring bits, pairs, nibbles, then of all bytes at once.
    """
    words = words - ((words >> 1) & 0x5555555555555555)
    words = (words & 0x3333333333333333) + ((words >> 2) & 0x3333333333333333)
    words = (words + (words >> 4)) & 0x0F0F0F0F0F0F0F0F
    return (words * 0x0101010101010101) >> 56


@compiled
def _project(
    points: np.ndarray,
    center: np.ndarray,
    axes: np.ndarray,
    low: float,
    high: float,
) -> np.ndarray:
    """Returns (M, 3) rows, columns and heights of points between limits."""
    near = np.empty((len(points), 3))
    num_near = 0
    for i in range(len(points)):
        x = points[i, 0] - center[0]
        y = points[i, 1] - center[1]
        z = points[i, 2] - center[2]
        height = axes[2, 0] * x + axes[2, 1] * y + axes[2, 2] * z
        if low <= height <= high:
            # On the plane: the other axes need not be orthogonal to it.
            x -= height * axes[2, 0]
            y -= height * axes[2, 1]
            z -= height * axes[2, 2]
            near[num_near, 0] = axes[0, 0] * x + axes[0, 1] * y + axes[0, 2] * z
            near[num_near, 1] = axes[1, 0] * x + axes[1, 1] * y + axes[1, 2] * z
            near[num_near, 2] = height
            num_near += 1
    return near[:num_near]


@compiled
def _draw(
    near: np.ndarray,
    low: np.ndarray,
    resolution: float,
    lowest: float,
    height_step: float,
    num_layers: int,
    shape: tuple[int, int],
) -> tuple[np.ndarray, np.ndarray]:
    """Returns heights and means as of a `HeightImage`."""
    heights = np.zeros((shape[0], shape[1]), dtype=np.int64)
    counts = np.zeros((shape[0], shape[1]))
    means = np.zeros((shape[0], shape[1], 2))
    for i in range(len(near)):
        row = int((near[i, 0] - low[0]) / resolution)
        column = int((near[i, 1] - low[1]) / resolution)
        layer = int((near[i, 2] - lowest) / height_step)
        if layer < num_layers:
            heights[row, column] |= 1 << layer
        counts[row, column] += 1.0
        means[row, column, 0] += near[i, 0]
        means[row, column, 1] += near[i, 1]
    for row in range(shape[0]):
        for column in range(shape[1]):
            for axis in range(2):
                if counts[row, column] > 0.0:
                    means[row, column, axis] /= counts[row, column]
                else:
                    means[row, column, axis] = np.nan
    return heights, means
