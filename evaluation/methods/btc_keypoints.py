"""Keypoints of a cloud: spots with points at many heights.

Part of BTC (see `evaluation.methods.btc`). Seen along the normal of a plane,
the cloud is an image. Each cell of the image has one bit for each layer of
height above the plane. The bit is set if the cell has points in this layer.
Cells with many layers set (walls, trunks, posts) are the keypoints, unless they
are part of a line of such cells.
"""

from collections.abc import Sequence
from dataclasses import dataclass
import math
from typing import NamedTuple

import numpy as np
from scipy.spatial import cKDTree

from evaluation.base import compiled, product

# Fixed in the public program: side of a square that may contain one keypoint
# [cells].
_SEGMENT = 5
# Fixed in the public program: least number of points of an image.
_MIN_POINTS = 6
# Fixed in the public program: by how many heights a cell may have fewer than
# its neighbour and still continue a line.
_LINE_MARGIN = 3
_NEIGHBOURS = ((0, 1), (1, 0), (1, 1), (1, -1))


@dataclass(frozen=True)
class Keypoints:
    """Keypoints with their binary descriptors.

    Attributes:
        positions: (K, 3) on the plane [m].
        heights: (K,) int64; bit k is set if the keypoint's cell has points in
            layer k above the plane.
    """

    positions: np.ndarray
    heights: np.ndarray

    def __len__(self) -> int:
        return len(self.heights)


class HeightImage(NamedTuple):
    """A cloud seen along the normal of a plane.

    Attributes:
        heights: (rows, columns) int64; bit k of a cell is set if the cell has
            points in layer k above the plane. The last row and the last column
            are always empty. The numbers of rows and columns are multiples of
            the side of a segment, see `peaks`.
        means: (rows, columns, 2) mean position of the points of each cell,
            along rows and along columns [m]; NaN for a cell without points.
    """

    heights: np.ndarray
    means: np.ndarray


def image_axes(normal: np.ndarray, orthogonal: bool) -> np.ndarray:
    """Returns three unit vectors that span an image on a plane, (3, 3).

    Row 0 of the result is the direction in which the row numbers of the image
    increase, row 1 is the direction in which the image's column numbers
    increase, and row 2 is the normal. Row 1 is the x axis, moved vertically
    onto the plane.

    In the authors' public program, a wrong term makes row 1 not quite
    orthogonal to the normal. Keypoints then lie on a plane that is tilted by
    about the slope of the ground.

    Args:
        normal: (3,) unit normal of the plane, z >= 0.
        orthogonal: whether row 1 is orthogonal; otherwise row 1 has the
            program's error.
    """
    a, b, c = normal
    if orthogonal:
        along = [c, 0.0, -a] if abs(b) < 1.0 else [1.0, 0.0, 0.0]
    elif c != 0.0:
        along = [1.0, 0.0, -(a + b) / c]
    else:
        along = [1.0, -a / b, 0.0] if b != 0.0 else [0.0, 1.0, 0.0]
    unit = np.array(along) / _length(along)
    across = np.cross(normal, unit)
    return np.stack([across / _length(across), unit, normal])


def _length(vector: Sequence[float] | np.ndarray) -> float:
    """Returns the length of a vector (3,), with equal bits everywhere."""
    x, y, z = vector
    return math.sqrt(x * x + y * y + z * z)


@compiled
def height_image(
    points: np.ndarray,
    center: np.ndarray,
    axes: np.ndarray,
    resolution: float,
    height_range: tuple[float, float],
    height_step: float,
    num_layers: int,
) -> HeightImage:
    """Returns an image of a cloud, seen along the normal of a plane.

    Each cell of the image contains the layers of height in which it has points,
    and the mean position of its points.

    The grid of the cells starts at the first occupied row and column. Memory
    grows with the area that the points cover.

    Args:
        points: (N, 3) points [m].
        center: (3,) a point of the plane [m].
        axes: (3, 3) directions of rows and columns and the normal, as
            `image_axes` returns them.
        resolution: length of a cell [m].
        height_range: limits of the heights above the plane [m]; other points
            are left out.
        height_step: thickness of the layers of height [m].
        num_layers: number of layers. Points above the highest layer count only
            for the mean positions.
    """
    # Rows, columns and heights of the points between the limits.
    near = np.empty((len(points), 3))
    num_near = 0
    low, high = np.full(2, np.inf), np.full(2, -np.inf)
    for i in range(len(points)):
        x = points[i, 0] - center[0]
        y = points[i, 1] - center[1]
        z = points[i, 2] - center[2]
        height = axes[2, 0] * x + axes[2, 1] * y + axes[2, 2] * z
        if height_range[0] <= height <= height_range[1]:
            # Project onto the plane first, because the other axes need not be
            # orthogonal to the normal.
            x -= height * axes[2, 0]
            y -= height * axes[2, 1]
            z -= height * axes[2, 2]
            for axis in range(2):
                along_axis = (
                    axes[axis, 0] * x + axes[axis, 1] * y + axes[axis, 2] * z
                )
                near[num_near, axis] = along_axis
                low[axis] = min(low[axis], along_axis)
                high[axis] = max(high[axis], along_axis)
            near[num_near, 2] = height
            num_near += 1
    shape = (_SEGMENT, _SEGMENT)
    if num_near < _MIN_POINTS:
        num_near = 0
    else:
        rows = int((high[0] - low[0]) / resolution) // _SEGMENT + 2
        columns = int((high[1] - low[1]) / resolution) // _SEGMENT + 2
        shape = (rows * _SEGMENT, columns * _SEGMENT)
    heights = np.zeros(shape, dtype=np.int64)
    counts = np.zeros(shape)
    means = np.zeros((shape[0], shape[1], 2))
    for i in range(num_near):
        row = int((near[i, 0] - low[0]) / resolution)
        column = int((near[i, 1] - low[1]) / resolution)
        layer = int((near[i, 2] - height_range[0]) / height_step)
        if layer < num_layers:
            heights[row, column] |= 1 << layer
        counts[row, column] += 1.0
        means[row, column, 0] += near[i, 0]
        means[row, column, 1] += near[i, 1]
    # Without points, 0 / 0 is NaN.
    means /= counts.reshape(shape[0], shape[1], 1)
    return HeightImage(heights, means)


def peaks(
    num_heights: np.ndarray, min_heights: int
) -> tuple[np.ndarray, np.ndarray]:
    """Returns the peaks of an image: cells that have points in many layers.

    The image is divided into square segments, each of which has at most one
    peak: the cell that has points in the most layers, or the first of several
    such cells. A cell is part of a line, and not a peak, if in some direction
    one neighbour has points in nearly as many layers as the cell, and the
    opposite neighbour has points in at least half as many.

    Args:
        num_heights: (rows, columns) number of layers with points in each cell.
            Rows and columns must be multiples of the side of a segment.
        min_heights: least number of layers with points in a peak.

    Returns:
        Row (C,) and column (C,) of each peak. Peaks are in the order of their
        segments: from left to right, one row of segments after the other.
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
    # No padding is needed at the other two sides, where the image ends in empty
    # cells.
    inside = (row > 0) & (column > 0)
    row, column = row[inside], column[inside]
    peak = num_heights[row, column]
    in_line = np.zeros(len(row), dtype=bool)
    for down, right in _NEIGHBOURS:
        neighbour = num_heights[row + down, column + right]
        other = num_heights[row - down, column - right]
        low, high = np.minimum(neighbour, other), np.maximum(neighbour, other)
        in_line |= (high >= peak - _LINE_MARGIN) & (
            (low >= 0.5 * peak) | (low >= peak - _LINE_MARGIN)
        )
    return row[~in_line], column[~in_line]


def find_keypoints(
    image: HeightImage, center: np.ndarray, axes: np.ndarray, min_heights: int
) -> Keypoints:
    """Returns the peaks of an image (see `peaks`) as points on its plane.

    Args:
        image: image of a cloud, seen along the normal of the plane.
        center: (3,) centre with which the image was made [m].
        axes: (3, 3) axes with which the image was made.
        min_heights: least number of layers with points in a keypoint's cell.
    """
    cells = peaks(count_bits(image.heights), min_heights)
    return Keypoints(
        positions=center + product(image.means[cells], axes[:2]),
        heights=image.heights[cells],
    )


def suppress(keypoints: Keypoints, radius: float, max_number: int) -> Keypoints:
    """Returns the keypoints with more occupied layers than their neighbours.

    If two neighbours have equally many occupied layers, both are dropped.

    Args:
        keypoints: all keypoints.
        radius: distance within which keypoints are neighbours [m].
        max_number: largest number of keypoints to return. If there are more,
            the keypoints with the most occupied layers are returned.
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
def count_bits(words: np.ndarray) -> np.ndarray:
    """Returns the number of set bits in int64 numbers from 0 to 2^62 - 1.

    The result has the shape of the argument.
    """
    words = words - ((words >> 1) & 0x5555555555555555)
    words = (words & 0x3333333333333333) + ((words >> 2) & 0x3333333333333333)
    words = (words + (words >> 4)) & 0x0F0F0F0F0F0F0F0F
    return (words * 0x0101010101010101) >> 56
