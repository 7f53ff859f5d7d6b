"""BEVPlace (Luo et al.: ICCV 2023), with the weights of its authors.

A scan becomes a bird's-eye image (151, 151) uint8 of the points within 25.2 m.
Ahead is at its top. A pixel is a column of voxels with sides of 0.4 m, and its
value the number of voxels with points, minus one (because the first of these is
mostly ground), and at most 10. Values are scaled so that the largest is 255.

The image is rotated by five angles and reduced to five scales. A small network
describes each of these 25 images at
each point of a grid. A second network then combines the 25 descriptors of a
point into one descriptor, which depends little on the heading. A NetVLAD layer
(Arandjelovic et al.: CVPR 2016) sums up all points in one descriptor of the
image, with 8192 numbers. The score of two scans is the negative distance of
their descriptors. The method estimates no pose.

The architecture is reimplemented from the paper and the authors' program (MIT
licence); no weights are shipped. The page `docs/notes/bevplace.md` shows how to
convert the authors' weights to an .npz file. PyTorch's own files are not read,
because they contain pickles, which can run code. With the same weights, the
descriptors of images of KITTI differ from the program's descriptors by less
than 1e-4 of their length. Deliberate differences:

- The rules of the image were found from the images of KITTI that the authors
  published, because their program makes others. On five scans of KITTI 00,
  the pixels of both have a correlation of 0.86. One rule is that indices are
  rounded towards zero, so that the middle row and column are twice as wide.
- An image whose pixels are all 0 has no descriptor. A place with such an image
  is never a candidate, and a query with such an image has no candidates.
"""

from collections.abc import Iterator, Sequence
import hashlib
import itertools
import math
from pathlib import Path

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from pydantic import computed_field
from scipy.ndimage import correlate1d
from scipy.special import softmax

from evaluation.base import InputError, read_bytes, read_npz
from evaluation.methods.method import Method, MethodConfig
from evaluation.methods.network_weights import Weights, checked_weights
from evaluation.methods.registry import register

_ADVICE = (
    "no .npz file of this network's weights; the page docs/notes/bevplace.md"
    " shows how to make one"
)

# Side of a voxel and of a pixel [m].
_PIXEL = 0.4
# Number of pixels on each side of the middle one.
_HALF = 75
# Greatest absolute coordinate of a point: 63 pixels [m].
_REACH = 25.2
# Counts of voxels end here.
_MOST = 10
# Number of scales of the image.
_SCALES = 5
# Turns of the image [deg].
_TURNS = (-90.0, -45.0, 0.0, 45.0, 90.0)
# Distance of the points of the grid, and of the grid from the border [pixels].
_GRID = 5
# Value around a turned image.
_BORDER = 127.0
# Mean and standard deviation of the three channels (ImageNet).
_MEAN = (0.485, 0.456, 0.406)
_DEVIATION = (0.229, 0.224, 0.225)
# Greatest value of a pixel.
_WHITE = 255.0
# Half the range of the values of a turned image, which are scaled by it.
_HALF_RANGE = 128.0
# Factor of the sizes of two successive scales.
_SHRINKING = 0.5
# Standard deviation of the Gaussian filter between two scales [pixels].
_SIGMA = 1.5
# OpenCV's fixed-point numbers: positions in 1/1024, rounded to 1/32 pixel.
_FINE = 1024
_COARSE = 32
# Added to the variance, as in the published program.
_NORM_EPSILON = 1e-5
# Least length by which a vector is divided.
_TINY = 1e-6
# Sizes of NetVLAD in the published weights.
_CLUSTERS = 64
_CHANNELS = 128
_CONVOLUTION = "encoder.extractor.extractor.conv"
_EMBEDDING = "encoder.embedder.embedder.network"


def _embedding_shapes(name: str, channels: int) -> dict[str, tuple[int, ...]]:
    """Returns the shapes of one network's weights, by name, for `_embedded`."""
    kernels = {
        "embed1.0": (64, 32, 3, 3),
        "embed1.2": (64, 64, 3, 3),
        "embed1_short": (64, 32, 1, 1),
        "embed2.0": (64, 64, 3, 3),
        "embed2.2": (64, 64, 3, 3),
        "embed2_short": (64, 64, 1, 1),
        "embed3.0": (64, 64, 3, 3),
        "embed3.2": (channels, 64, 3, 3),
    }
    shapes: dict[str, tuple[int, ...]] = {}
    for layer, shape in kernels.items():
        shapes[f"{_EMBEDDING}{name}_{layer}.weight"] = shape
        shapes[f"{_EMBEDDING}{name}_{layer}.bias"] = shape[:1]
    return shapes


SHAPES = {
    f"{_CONVOLUTION}0.0.weight": (16, 3, 5, 5),
    f"{_CONVOLUTION}0.3.weight": (32, 16, 5, 5),
    f"{_CONVOLUTION}1.0.weight": (32, 32, 5, 5),
    f"{_CONVOLUTION}1.3.weight": (32, 32, 5, 5),
    **_embedding_shapes("1", 8),
    **_embedding_shapes("2", 16),
    "netvlad.centroids": (_CLUSTERS, _CHANNELS),
    "netvlad.conv.weight": (_CLUSTERS, _CHANNELS, 1, 1),
}


def count_image(points: np.ndarray) -> np.ndarray:
    """Returns the image of a cloud, (151, 151) uint8.

    Args:
        points: (N, 3) points in the frame of the LiDAR: x ahead, y left, z up
            [m].
    """
    near = points[(np.abs(points) < _REACH).all(axis=1)] / _PIXEL
    cells = np.column_stack(
        [np.trunc(near[:, :2]), np.floor(near[:, 2])]
    ).astype(np.int64)
    ahead, left, _ = np.unique(cells, axis=0).T
    counts = np.zeros((2 * _HALF + 1, 2 * _HALF + 1), np.int64)
    np.add.at(counts, (_HALF - ahead, _HALF - left), 1)
    counts = np.clip(counts - 1, 0, _MOST)
    return np.rint(counts * (_WHITE / max(counts.max(), 1))).astype(np.uint8)


def describe_image(weights: Weights, image: np.ndarray) -> np.ndarray:
    """Returns BEVPlace's descriptor (8192,) float32 of an image.

    Args:
        weights: name -> tensor, with the shapes `SHAPES`.
        image: (W, W) uint8 with at least 57 pixels on a side.
    """
    features = np.stack(
        [
            _features_at(_feature_map(weights, turned), points)
            for turned, points in _turned_images(image)
        ]
    )
    # At each point, five scales x five turns are treated like pixels.
    grid = features.reshape(_SCALES, len(_TURNS), *features.shape[1:])
    first, second = (
        _embedded(weights, f"{_EMBEDDING}{name}_", grid) for name in "12"
    )
    local = np.matmul(first.transpose(0, 2, 1), second)
    return _netvlad(weights, _unit(local.reshape(len(local), _CHANNELS)))


def _turned_images(
    image: np.ndarray,
) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """Yields 25 images (H, W, 3) with values near [-1, 1], and their points.

    The points (N, 2) are the columns and rows of the grid in the turned image.
    """
    size = len(image)
    white = np.float32(_WHITE)
    scaled = image[..., None] / white - np.array(_MEAN, np.float32)
    scaled = scaled / np.array(_DEVIATION, np.float32) * white
    steps = np.arange(_GRID, size - _GRID, _GRID)
    grid = np.stack(np.meshgrid(steps, steps), axis=-1).reshape(-1, 2)
    corners = np.array([[0, 0], [0, size], [size, size], [size, 0]], np.float32)
    centre = corners.mean(axis=0)
    for number in range(_SCALES):
        if number:
            scaled = _blurred(scaled)
        for turn in np.radians(_TURNS):
            cosine, sine = math.cos(turn), math.sin(turn)
            R = np.array([[cosine, -sine], [sine, cosine]], np.float32)
            M = _SHRINKING**number * R
            moved = (corners - centre) @ M.T
            least = moved.min(axis=0)
            extent = np.rint((moved - least).max(axis=0)).astype(int)
            offset = -M @ centre - least
            turned = _warped(scaled, M, offset, extent)
            points = (grid @ M.T + offset).astype(np.float32)
            yield (turned - _BORDER) / np.float32(_HALF_RANGE), points


def _blurred(image: np.ndarray) -> np.ndarray:
    """Returns an image after a Gaussian filter of 5 x 5, sigma 1.5 pixels."""
    kernel = np.exp(-(np.arange(-2, 3) ** 2) / (2.0 * _SIGMA**2))
    for axis in (0, 1):
        image = correlate1d(image, kernel / kernel.sum(), axis, mode="mirror")
    return image


def _warped(
    image: np.ndarray, M: np.ndarray, offset: np.ndarray, size: np.ndarray
) -> np.ndarray:
    """Returns an image (H, W, channels) after an affine map.

    Positions are rounded to 1/32 pixel as in OpenCV, with whose images the
    weights were trained.

    Args:
        image: (S, S, channels) image.
        M: (2, 2) linear part of the map of column and row.
        offset: (2,) translation of the map.
        size: (2,) width and height of the result.
    """
    inverse = np.linalg.inv(M.astype(np.float64))
    start = -inverse @ offset
    column, row = np.arange(size[0]), np.arange(size[1])[:, None]
    unit = _FINE // _COARSE
    positions = []
    for axis in (0, 1):
        along = np.rint(inverse[axis, 0] * column * _FINE)
        across = np.rint((inverse[axis, 1] * row + start[axis]) * _FINE)
        positions.append((across + unit // 2 + along) // unit / _COARSE)
    x, y = positions
    return _sampled(image, x, y, _BORDER)


def _sampled(
    image: np.ndarray, x: np.ndarray, y: np.ndarray, border: float = 0.0
) -> np.ndarray:
    """Returns values between pixels, by bilinear interpolation.

    Args:
        image: (H, W, channels) image.
        x, y: columns and rows, as arrays of any shape.
        border: value of all pixels around the image.

    Returns:
        Array float32 with the axes of `x`, and the channels as last axis.
    """
    height, width, channels = image.shape
    padded = np.pad(image, ((1, 1), (1, 1), (0, 0)), constant_values=border)
    left, low = np.floor(x), np.floor(y)
    result = np.zeros((*x.shape, channels), np.float32)
    for dy, dx in itertools.product((0, 1), repeat=2):
        share = (x - left if dx else 1.0 - (x - left)) * (
            y - low if dy else 1.0 - (y - low)
        )
        # Pixels farther outside are like the first pixels around the image.
        column = np.clip(left + dx + 1, 0, width + 1).astype(np.int64)
        row = np.clip(low + dy + 1, 0, height + 1).astype(np.int64)
        result += share.astype(np.float32)[..., None] * padded[row, column]
    return result


def _feature_map(weights: Weights, image: np.ndarray) -> np.ndarray:
    """Returns a map of features (H / 2, W / 2, 32), each of length 1."""
    x = image
    for block in "01":
        x = _convolved(x, weights[f"{_CONVOLUTION}{block}.0.weight"])
        x = np.maximum(_normalised(x), 0.0)
        x = _normalised(
            _convolved(x, weights[f"{_CONVOLUTION}{block}.3.weight"])
        )
        if block == "0":
            x = _halved(np.maximum(x, 0.0))
    return _unit(x)


def _convolved(image: np.ndarray, kernel: np.ndarray) -> np.ndarray:
    """Returns the convolution of an image, with zeros around it.

    Args:
        image: (H, W, channels) image.
        kernel: (channels out, channels, k, k) kernel; k is odd.
    """
    out, channels, size, _ = kernel.shape
    height, width, _ = image.shape
    half = size // 2
    padded = np.pad(image, ((half, half), (half, half), (0, 0)))
    windows = sliding_window_view(padded, size, 1).transpose(0, 1, 3, 2)
    rows = windows.reshape(height + 2 * half, width, size * channels)
    taps = kernel.transpose(2, 3, 1, 0).reshape(size, size * channels, out)
    result = rows[:height] @ taps[0]
    for number in range(1, size):
        result += rows[number : number + height] @ taps[number]
    return result


def _normalised(image: np.ndarray) -> np.ndarray:
    """Returns an image with mean 0 and variance 1 in each channel."""
    image = image - image.mean(axis=(0, 1))
    return image / np.sqrt((image * image).mean(axis=(0, 1)) + _NORM_EPSILON)


def _halved(image: np.ndarray) -> np.ndarray:
    """Returns the means over blocks of 2 x 2 pixels."""
    height, width = (size // 2 for size in image.shape[:2])
    even = image[: 2 * height, : 2 * width]
    return even.reshape(height, 2, width, 2, -1).mean(axis=(1, 3))


def _unit(x: np.ndarray) -> np.ndarray:
    """Returns vectors, along the last axis, scaled to length 1."""
    length = np.linalg.norm(x, axis=-1, keepdims=True)
    return x / np.maximum(length, np.float32(_TINY))


def _features_at(features: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Returns the features (N, channels) at points of an image.

    To scale positions, the authors' program takes the centres of the first and
    the last pixel as the ends of the image. To interpolate, it takes the outer
    borders of these pixels.

    Args:
        features: (H, W, channels) map of features, of half the image's size.
        points: (N, 2) columns and rows in the image.
    """
    size = np.array(features.shape[1::-1], np.float32)
    positions = ((points + 0.5) / 2.0 - 0.5) * size / (size - 1.0) - 0.5
    return _sampled(features, *positions.T)


def _embedded(weights: Weights, name: str, grid: np.ndarray) -> np.ndarray:
    """Returns the output of a network of small convolutions at each point.

    Args:
        name: prefix of the names of the network's layers.
        grid: (5, 5, N, 32) features over scales and turns.

    Returns:
        (N, 25, channels).
    """
    x = grid
    for block in ("embed1", "embed2"):
        y = _convolved_over_turns(weights, f"{name}{block}.0", x)
        y = _convolved_over_turns(
            weights, f"{name}{block}.2", np.maximum(y, 0.0)
        )
        y += _convolved_over_turns(weights, f"{name}{block}_short", x)
        x = np.maximum(y, 0.0)
    y = _convolved_over_turns(weights, f"{name}embed3.0", x)
    y = _convolved_over_turns(weights, f"{name}embed3.2", np.maximum(y, 0.0))
    return y.reshape(-1, *y.shape[2:]).transpose(1, 0, 2)


def _convolved_over_turns(
    weights: Weights, name: str, x: np.ndarray
) -> np.ndarray:
    """Returns a convolution over the first two axes, with zeros around.

    Args:
        name: name of the layer, whose kernel is 1 x 1 or 3 x 3.
        x: (H, W, N, channels).
    """
    kernel = weights[f"{name}.weight"].transpose(2, 3, 1, 0)
    half = len(kernel) // 2
    height, width, number, _ = x.shape
    result = np.empty((height, width, number, kernel.shape[3]), np.float32)
    result[:] = weights[f"{name}.bias"]
    for dy, dx in itertools.product(range(-half, half + 1), repeat=2):
        to, of = (
            (
                slice(max(-sign * dy, 0), height - max(sign * dy, 0)),
                slice(max(-sign * dx, 0), width - max(sign * dx, 0)),
            )
            for sign in (1, -1)
        )
        result[to] += x[of] @ kernel[dy + half, dx + half]
    return result


def _netvlad(weights: Weights, x: np.ndarray) -> np.ndarray:
    """Returns the NetVLAD descriptor (8192,) of local descriptors (N, 128)."""
    kernel = weights["netvlad.conv.weight"].reshape(_CLUSTERS, _CHANNELS)
    shares = softmax(x @ kernel.T, axis=1)
    sums = shares.sum(axis=0)[:, None] * weights["netvlad.centroids"]
    return _unit(_unit(shares.T @ x - sums).ravel())


class BevPlaceConfig(MethodConfig):
    """Settings of BEVPlace.

    `sensor_height` has no effect.

    Attributes:
        weights: .npz file with the weights that the authors of the network
            published: the arrays of the state dict, by their names.
    """

    weights: Path

    @computed_field  # type: ignore[prop-decorator]
    @property
    def digest(self) -> str:
        """Digest of the contents of the file `weights`: 16 hexadecimal digits.

        Two files with the same name can contain different weights; their
        digests differ.
        """
        content = read_bytes(self.weights)
        return hashlib.sha256(content).hexdigest()[:16]


@register("bevplace")
class BevPlace(Method[np.ndarray, np.ndarray]):
    """The place-recognition method BEVPlace.

    The descriptor (8192,) of a cloud whose image is empty is NaN. Scores are
    negative distances between descriptors.
    """

    Config = BevPlaceConfig
    title = "BEVPlace"
    source = "Luo et al.: ICCV 2023"
    order = 10
    skips_places = True
    config: BevPlaceConfig

    def __init__(self, config: BevPlaceConfig | None = None):
        super().__init__(config)
        self._weights = _read_weights(self.config.weights)

    def describe(self, points: np.ndarray) -> np.ndarray:
        image = count_image(points)
        if not image.any():
            return np.full(_CLUSTERS * _CHANNELS, np.nan, np.float32)
        return describe_image(self._weights, image)

    def build_database(self, places: Sequence[np.ndarray]) -> np.ndarray:
        return np.stack(places)

    def score(
        self,
        query: np.ndarray,
        database: np.ndarray,
        *,
        exhaustive: bool = False,
    ) -> np.ndarray:
        del exhaustive  # Always true here.
        distances = np.linalg.norm(database - query, axis=1)
        return -distances.astype(np.float64)


def _read_weights(path: Path) -> dict[str, np.ndarray]:
    """Returns the weights (float32) in an .npz file, by name."""
    try:
        found = read_npz(path, SHAPES)
    except ValueError as error:
        raise InputError(f"{path}: {_ADVICE} ({error})") from error
    if not found:
        raise InputError(
            f"{path}: {_ADVICE} (no array {next(iter(SHAPES))}, with just this"
            " name and no prefix, such as module.)"
        )
    return checked_weights(found, SHAPES, path)
