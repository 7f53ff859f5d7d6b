"""Bird's-eye images that count voxels, as in the data of BEVPlace.

An image is (151, 151) uint8 and shows the points within 25.2 m of the LiDAR.
The area ahead of the LiDAR is at the top of the image, and the area to its left
is on the left. A pixel is a column of voxels with sides of 0.4 m. The value of
a pixel is the number of voxels with points in this column, minus one (because
the first of these voxels is mostly ground), and at most 10. Values are
scaled so that the largest value in the image is 255.

The program that the authors of BEVPlace (Luo et al.: ICCV 2023) published with
their images of KITTI makes different images. The rules of this module were
found from the published images themselves. On five scans of KITTI 00, the
pixels of this module's images have a correlation of 0.86 with the pixels of the
published images. One rule is that indices are rounded towards zero, so that the
middle row and the middle column are twice as wide as the others.
"""

from __future__ import annotations

from collections.abc import Iterator
import contextlib
from pathlib import Path
from typing import TYPE_CHECKING
import zlib

import numpy as np

from cns_drake.base import InputError, check_regular, open_image, user_errors

if TYPE_CHECKING:
    from PIL.Image import Image

# Side of a voxel and of a pixel [m].
PIXEL = 0.4
# Number of pixels on each side of the middle one.
_HALF = 75
WIDTH = 2 * _HALF + 1
# Greatest absolute coordinate of a point: 63 pixels [m].
_REACH = 25.2
# Counts of voxels end here.
_MOST = 10
# Largest number of pixels on a side.
_WIDEST = 1001


def count_image(points: np.ndarray) -> np.ndarray:
    """Returns the image of a cloud, (151, 151) uint8.

    Args:
        points: (N, 3) points in the frame of the LiDAR: x ahead, y left, z up
            [m].
    """
    near = points[(np.abs(points) < _REACH).all(axis=1)] / PIXEL
    cells = np.column_stack(
        [np.trunc(near[:, :2]), np.floor(near[:, 2])]
    ).astype(np.int64)
    ahead, left, _ = np.unique(cells, axis=0).T
    counts = np.zeros((WIDTH, WIDTH), np.int64)
    np.add.at(counts, (_HALF - ahead, _HALF - left), 1)
    counts = np.clip(counts - 1, 0, _MOST)
    return np.rint(counts * (255.0 / max(counts.max(), 1))).astype(np.uint8)


def image_points(image: np.ndarray) -> np.ndarray:
    """Returns a cloud (N, 3) [m] that `count_image` turns into a given image.

    A pixel that is not zero becomes a column of one point in each voxel, at
    heights of 0.2 m, 0.6 m and so on. The image that `count_image` makes is the
    same if `image` has 151 x 151 pixels. Images of other programs can have more
    than ten different values; their values are rounded.

    Args:
        image: (W, W) uint8, W odd; the LiDAR is at the middle pixel.
    """
    counts = np.rint(image * (_largest_count(image) / 255.0)).astype(np.int64)
    half = len(image) // 2
    row, column = np.nonzero(counts)
    number = counts[row, column] + 1
    index = half - np.stack([row, column], axis=1)
    # The pixels in the middle reach to both sides.
    centre = (index + 0.5 * np.sign(index)) * PIXEL
    level = np.arange(number.sum()) - np.repeat(
        np.cumsum(number) - number, number
    )
    return np.column_stack(
        [np.repeat(centre, number, axis=0), (level + 0.5) * PIXEL]
    )


def _largest_count(image: np.ndarray) -> int:
    """Returns the number of voxels that a pixel with the value 255 counts."""
    values = np.unique(image)
    for most in range(1, _MOST):
        steps = values * (most / 255.0)
        # Programs round values, or cut them off.
        if (np.abs(steps - np.rint(steps)) <= most / 255.0).all():
            return most
    return _MOST


def check_image(path: Path) -> None:
    """Checks that a file is an image that `read_image` can read.

    Only the beginning of the file is read.

    Raises:
        InputError: see `read_image`.
    """
    with _opened_image(path):
        pass


def read_image(path: Path) -> np.ndarray:
    """Returns the image (W, W) uint8 in a PNG file; W is odd.

    Raises:
        InputError: the file is damaged, is not a square image with one channel
            of 8 bits, or has an even or a too large number of pixels on a side.
    """
    with _opened_image(path) as image, _naming_damage(path):
        return np.asarray(image)


@contextlib.contextmanager
def _opened_image(path: Path) -> Iterator[Image]:
    check_regular(path)
    with contextlib.ExitStack() as stack:
        with user_errors(path), _naming_damage(path):
            image = stack.enter_context(open_image(path, ("PNG",)))
        if image.mode != "L":
            raise InputError(
                f"{path}: an image of mode {image.mode}, not of one channel of"
                " 8 bits"
            )
        width, height = image.size
        if width != height:
            raise InputError(f"{path}: {width} x {height} pixels, not square")
        if width > _WIDEST or width % 2 == 0:
            raise InputError(
                f"{path}: {width} pixels on a side; it must be an odd number up"
                f" to {_WIDEST}"
            )
        yield image


@contextlib.contextmanager
def _naming_damage(path: Path) -> Iterator[None]:
    """Turns what Pillow raises for a damaged file into an `InputError`."""
    try:
        yield
    except (SyntaxError, ValueError, OSError, EOFError, zlib.error) as error:
        raise InputError(f"{path}: no image (PNG), or damaged") from error
