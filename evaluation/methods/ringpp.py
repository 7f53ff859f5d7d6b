"""RING++ (Xu, Lu, Wu, Lu, Zhu, Liang, Xiong, Wang: T-RO 2023).

A scan becomes a bird's-eye map with six channels that describe the shape of the
cloud. In the Radon transform of this map, a rotation of the scan is a shift of
rows; the magnitude of each row's spectrum does not change if the LiDAR is
moved. Two scans are similar if these spectra correlate well at some shift of
the rows. This shift is also the difference in heading. Once the heading is
known, the correlation of the bird's-eye maps gives the translation.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
import functools
import math
from typing import Annotated, Literal

import numpy as np
from pydantic import Field, PositiveFloat, model_validator
import scipy.fft
import scipy.sparse
import scipy.special
import small_gicp

from cns_drake.base import compiled, yaw_pose
from evaluation.methods.method import Method, MethodConfig
from evaluation.methods.registry import register

# See `local_features`.
_NUM_FEATURES = 6
# Added to the variance, so that the normalised spectrum of a nearly constant
# channel stays bounded: the default of PyTorch's InstanceNorm2d, which the
# authors' program uses. It removes a third of the power of the channel with the
# variance of z, and is therefore part of the method.
_NORM_EPSILON = 1e-5
# Number of spectra of places kept in memory, a third of a megabyte each.
_REFERENCES_KEPT = 64
# The authors' scale of the correlation, chosen so that distances are from 0 to
# 1.
_CORRELATION_SCALE = 0.15


class RingPlusPlusConfig(MethodConfig):
    """Settings of RING++.

    All defaults are the values of the authors' program for KITTI.

    Attributes:
        half_width: half the side of the square map from above [m]. The protocol
            uses points up to 100 m away; RING++ leaves out the points beyond
            this square.
        crop: which points of the map are used: `square` uses all points,
            `round` only the points within `half_width` of the map's centre. If
            the LiDAR is rotated, a square contains other points than before,
            but a circle contains the same points.
        min_height: smallest height of a point that is used, measured from the
            ground [m]; the authors have z > -1.0 m for a LiDAR at 1.73 m.
        max_height: largest height of a point that is used, measured from the
            ground [m]; the authors have z < 10 m for a LiDAR at 1.73 m.
        height_unit: length by which heights are divided before the shape around
            a point is described [m]. Horizontal coordinates are divided by
            `half_width`.
        neighbours: number of nearest points, including the point itself, that
            describe the shape around a point.
        cells: number of rows and of columns of the map from above, and also of
            angles and of rays of its Radon transform.
    """

    half_width: PositiveFloat = 70.0
    crop: Literal["square", "round"] = "square"
    min_height: float = 0.73
    max_height: float = 11.73
    height_unit: PositiveFloat = 10.0
    neighbours: Annotated[int, Field(ge=2)] = 30
    cells: Annotated[int, Field(ge=2)] = 120

    @model_validator(mode="after")
    def _limits_are_in_order(self) -> RingPlusPlusConfig:
        if self.min_height >= self.max_height:
            raise ValueError("min_height must be below max_height")
        return self


@dataclass(frozen=True)
class Ring:
    """Descriptor of one scan, with n = `cells` and F = n // 2 + 1.

    Attributes:
        filled: (M,) flat indices, row * n + column, of the cells that are not
            zero in the map from above. Rows are along x, columns along y.
        features: (M, 6) float32 values of the six channels in these cells.
        spectrum: (6 F, F) complex64, F rows for each of the six channels. The
            Radon transform of a channel is Fourier-transformed along its rays
            (rows); the normalised magnitudes are then Fourier-transformed along
            its angles (columns).
    """

    filled: np.ndarray
    features: np.ndarray
    spectrum: np.ndarray

    def bev(self, num_cells: int) -> np.ndarray:
        """Returns the feature map from above, (6, n, n) float32."""
        image = np.zeros((_NUM_FEATURES, num_cells * num_cells), np.float32)
        image[:, self.filled] = self.features.T
        return image.reshape(_NUM_FEATURES, num_cells, num_cells)


@dataclass(frozen=True)
class RingDatabase:
    """Descriptors of D places.

    Attributes:
        places: the D descriptors.
        is_empty: (D,) bool, whether a place's map has no points.
        reference: function that takes the index of a place, and returns the
            complex conjugate of the spectrum of its bird's-eye view.
    """

    places: Sequence[Ring]
    is_empty: np.ndarray
    reference: Callable[[int], np.ndarray]


@register("ring++")
class RingPlusPlus(Method[Ring, RingDatabase]):
    """RING++; the score of two scans is 1 minus their distance.

    Where this method differs from the authors' program:

    - For neighbours that lie in a plane, omnivariance and entropy are the
      limits of their formulas. In the authors' program, which has single
      precision, rounding makes about one in ten of these values NaN, and such
      points are skipped.
    - The Radon transform interpolates between the last pixels of the map and
      zeros around the map. In the authors' program, rays end at the edge of the
      map, where rounding adds or drops a sample.
    - If there are fewer points than `neighbours`, all points are neighbours.
    - A place with an empty map is never a candidate, and a query with an empty
      map has no candidates.
    """

    title = "RING++"
    style = ("#0072B2", "-", "o")
    source = "Xu, Lu, Wu, Lu, Zhu, Liang, Xiong, Wang: T-RO 2023"
    standard = True
    order = 3
    Config = RingPlusPlusConfig
    skips_places = True
    sees_images = True
    divides = True
    config: RingPlusPlusConfig

    def describe(self, points: np.ndarray) -> Ring:
        num_cells = self.config.cells
        image = self._bev(points)
        # From 0 to a full turn, both included, as in the program.
        angles = np.linspace(0.0, 2.0 * math.pi, num_cells)
        sinogram = radon(image, angles)
        magnitudes = np.abs(np.fft.rfft(sinogram, axis=1, norm="ortho"))
        normalised = _normalise(magnitudes.transpose(2, 1, 0), num_cells)
        spectrum = np.fft.rfft(normalised, axis=2)
        flat = image.reshape(-1, _NUM_FEATURES)
        # No feature is negative, so their sum is 0 only where all are 0.
        filled = np.flatnonzero(flat @ np.ones(_NUM_FEATURES))
        return Ring(
            filled=filled,
            features=flat[filled].astype(np.float32),
            spectrum=spectrum.reshape(-1, spectrum.shape[2]).astype(
                np.complex64
            ),
        )

    def build_database(self, places: Sequence[Ring]) -> RingDatabase:
        def reference(place: int) -> np.ndarray:
            return _normalised_spectrum(
                places[place].bev(self.config.cells)
            ).conj()

        return RingDatabase(
            places=places,
            is_empty=np.array([len(place.filled) == 0 for place in places]),
            # Successive queries have many of their top-ranked places in common.
            reference=functools.lru_cache(_REFERENCES_KEPT)(reference),
        )

    def score(
        self, query: Ring, database: RingDatabase, *, exhaustive: bool = False
    ) -> np.ndarray:
        del exhaustive  # Always true here.
        if len(query.filled) == 0:
            return np.full(len(database.places), np.nan)
        weighted = self._weighted_spectrum(query)
        scores = [
            self._correlate(weighted, place.spectrum).max()
            for place in database.places
        ]
        return np.where(database.is_empty, np.nan, scores)

    def relative_poses(
        self, query: Ring, database: RingDatabase, places: Sequence[int]
    ) -> list[np.ndarray | None]:
        """Returns a query's pose X_PQ relative to each of several places.

        X_PQ (4, 4) is the pose of the query's LiDAR frame Q in the LiDAR frame
        P of a place. X_PQ consists of a yaw and a horizontal translation. The
        result is None for a place if its map or the map of the query is empty.
        """
        if len(query.filled) == 0:
            return [None] * len(places)
        num_cells = self.config.cells
        weighted = self._weighted_spectrum(query)
        query_bev = query.bev(num_cells)
        # Places along one street have few different headings.
        turned = functools.cache(
            lambda heading: _normalised_spectrum(_rotated(query_bev, heading))
        )
        return [
            None
            if database.is_empty[place]
            else self._pose_at(weighted, turned, database, place)
            for place in places
        ]

    def _pose_at(
        self,
        weighted: np.ndarray,
        turned: Callable[[float], np.ndarray],
        database: RingDatabase,
        place: int,
    ) -> np.ndarray:
        """Returns X_PQ (4, 4) for a query's weighted spectrum and a place."""
        num_cells = self.config.cells
        correlation = self._correlate(weighted, database.places[place].spectrum)
        shift = -_signed_shift(int(correlation.argmax()), num_cells)
        reference = database.reference(place)
        # Rows are 360 / (n - 1) deg apart. The last row repeats the first, so
        # that a shift by one stands for 360 / n deg on average. Spectra of
        # opposite rays are equal, which leaves two possible headings.
        yaw = 2.0 * math.pi * shift / num_cells
        headings = (yaw, yaw - math.pi)
        fits = [
            _best_offset(turned(heading) * reference, num_cells)
            for heading in headings
        ]
        best = 1 if fits[1][0] > fits[0][0] else 0
        offset = fits[best][1]
        yaw = headings[best]
        cell = 2.0 * self.config.half_width / num_cells
        return yaw_pose(yaw, -offset[0] * cell, -offset[1] * cell)

    def _bev(self, points: np.ndarray) -> np.ndarray:
        """Returns the map from above, (n, n, 6): rows along x, columns along y.

        A cell holds the greatest value of each feature over its points.

        Args:
            points: (N, 3) points of a scan [m].
        """
        config = self.config
        within = _without_duplicates(self._cropped(points))
        image = np.zeros((config.cells, config.cells, _NUM_FEATURES))
        if len(within) < 2:
            return image
        scaled = within / [
            config.half_width,
            config.half_width,
            config.height_unit,
        ]
        neighbours = nearest_neighbours(
            scaled, min(config.neighbours, len(within))
        )
        features = local_features(scaled, neighbours)
        cells = ((scaled[:, :2] + 1.0) * (0.5 * config.cells)).astype(np.int64)
        # Rounding can put a value on the limit.
        row, column = np.minimum(cells, config.cells - 1).T
        cell = row * config.cells + column
        order = np.argsort(cell)
        first = np.flatnonzero(np.diff(cell[order], prepend=-1))
        greatest = np.maximum.reduceat(features[order], first)
        image.reshape(-1, _NUM_FEATURES)[cell[order[first]]] = greatest
        return image

    def _cropped(self, points: np.ndarray) -> np.ndarray:
        """Returns the points of a scan (N, 3) that the map contains."""
        config = self.config
        ground = -config.sensor_height
        # One column at a time: NumPy reduces slowly along a short axis.
        z = points[:, 2]
        within = points.compress(
            (z > ground + config.min_height) & (z < ground + config.max_height),
            axis=0,
        )
        x, y, z = within.T
        within = within.compress(
            (np.abs(x) < config.half_width)
            & (np.abs(y) < config.half_width)
            # Some drivers report (0, 0, 0) for beams without a return.
            & ((x != 0.0) | (y != 0.0) | (z != 0.0)),
            axis=0,
        )
        if config.crop == "round":
            x, y, _ = within.T
            within = within[x * x + y * y < config.half_width**2]
        return within

    def _weighted_spectrum(self, query: Ring) -> np.ndarray:
        """Returns a query's spectrum (6 F, F), weighted for the correlation.

        The weights account for the frequencies that are not stored (about half
        of all). The scale is the scale of the authors' program, whose
        transforms are unitary.
        """
        n = self.config.cells
        scale = _CORRELATION_SCALE * _NUM_FEATURES * n * n * math.sqrt(n)
        weights = np.tile(_frequency_weights(n) / scale, _NUM_FEATURES)
        return query.spectrum * weights[:, None].astype(np.float32)

    def _correlate(
        self, weighted: np.ndarray, spectrum: np.ndarray
    ) -> np.ndarray:
        """Returns the (n,) correlation of a query with a place, by shift.

        The query is a result of `_weighted_spectrum`. The place's rows are
        shifted by 0, ..., n - 1. As in the authors' program, the circular
        correlation over the angles is computed for each channel and frequency,
        and the magnitudes are summed.
        """
        correlations = scipy.fft.irfft(
            weighted * spectrum.conj(), n=self.config.cells, axis=1
        )
        return np.abs(correlations, out=correlations).sum(axis=0)


def _without_duplicates(points: np.ndarray) -> np.ndarray:
    """Returns the distinct points of (N, 3), sorted by z, then y, then x."""
    points = points[np.lexsort(points.T)]
    return points[np.diff(points, axis=0, prepend=np.nan).any(axis=1)]


def _frequency_weights(n: int) -> np.ndarray:
    """Returns how many of n frequencies each stored frequency represents.

    Of n frequencies, n // 2 + 1 are stored.
    """
    weights = np.full(n // 2 + 1, 2.0)
    weights[0] = 1.0
    if n % 2 == 0:
        weights[-1] = 1.0
    return weights


def _normalise(magnitudes: np.ndarray, n: int) -> np.ndarray:
    """Returns channels of zero mean and (nearly) unit variance.

    Args:
        magnitudes: (C, F, A) half of the spectra, for A angles.
        n: length of the whole spectra.
    """
    weights = _frequency_weights(n)[:, None] / (n * magnitudes.shape[2])
    mean = (magnitudes * weights).sum(axis=(1, 2), keepdims=True)
    centred = magnitudes - mean
    variance = (centred**2 * weights).sum(axis=(1, 2), keepdims=True)
    return centred / np.sqrt(variance + _NORM_EPSILON)


def _rotated(image: np.ndarray, angle: float) -> np.ndarray:
    """Returns an image (C, n, n) rotated by an angle.

    A positive angle rotates the row axis towards the column axis.
    Each pixel takes the value of the nearest source pixel, or 0 outside the
    image.
    """
    n = image.shape[1]
    centred = np.arange(n) - 0.5 * (n - 1)
    x, y = centred[:, None], centred
    c, s = math.cos(angle), math.sin(angle)
    row = np.rint(c * x + s * y + 0.5 * (n - 1)).astype(np.int64)
    column = np.rint(-s * x + c * y + 0.5 * (n - 1)).astype(np.int64)
    inside = (row >= 0) & (row < n) & (column >= 0) & (column < n)
    pixels = np.where(inside, row * n + column, 0)
    return image.reshape(-1, n * n).take(pixels, axis=1) * inside


def _normalised_spectrum(image: np.ndarray) -> np.ndarray:
    """Returns the spectrum (C, n, F) of a standardised image (C, n, n).

    Before the transform, the image is shifted to zero mean and scaled to unit
    norm, both over all channels together. The product of one spectrum with the
    conjugate of another is then the spectrum of their normalised
    cross-correlation.
    """
    centred = image - image.mean()
    return scipy.fft.rfft2(centred / np.linalg.norm(centred))


def _best_offset(product: np.ndarray, n: int) -> tuple[float, tuple[int, int]]:
    """Returns the greatest correlation of two images, and the shift.

    `product` (C, n, F) is the spectrum of the image times the conjugate
    spectrum of the reference; n is the side of the images. The correlations of
    the channels are computed separately, and their magnitudes are summed. The
    shift is in rows and columns.
    """
    correlations = scipy.fft.irfft2(product, s=(n, n))
    correlation = np.abs(correlations, out=correlations).sum(axis=0)
    row, column = np.unravel_index(correlation.argmax(), correlation.shape)
    return (
        float(correlation[row, column]),
        (_signed_shift(int(row), n), _signed_shift(int(column), n)),
    )


def _signed_shift(shift: int, n: int) -> int:
    """Returns a shift by 0, ..., n - 1 as one of -n // 2, ..., n // 2 - 1."""
    return (shift + n // 2) % n - n // 2


def radon(image: np.ndarray, angles: np.ndarray) -> np.ndarray:
    """Returns the integrals of an image along parallel rays.

    Let u be the column and v the row of a pixel, counted from the centre of the
    image. The ray s of angle t is u cos t - v sin t = s, where s also counts
    pixels from the centre. Axes and values agree with torch-radon (Ronchetti
    2020). A ray within 45 degrees of the vertical samples the image once in
    each row, any other ray once in each column. Each sample interpolates
    between the two nearest pixels; a sample outside the image is zero. The sum
    of the samples is multiplied by the distance between samples.

    A pixel at distance d from a ray contributes hat(d / w) / w with w =
    max(|cos t|, |sin t|) and hat(x) = max(1 - |x|, 0).

    Args:
        image: (n, n, C) rows, columns, channels.
        angles: (A,) [rad].

    Returns:
        (A, n, C) for each angle and s = -(n - 1) / 2, ..., (n - 1) / 2.
    """
    size, _, num_channels = image.shape
    centre = 0.5 * (size - 1)
    flat = image.reshape(size * size, num_channels)
    pixels = np.flatnonzero(flat.any(axis=1))
    row, column = np.divmod(pixels, size)
    cosines, sines = np.cos(angles), np.sin(angles)
    width = np.maximum(np.abs(cosines), np.abs(sines))
    projected = (
        centre
        + (column - centre)[:, None] * cosines
        - (row - centre)[:, None] * sines
    )
    # width <= 1, so that at most two rays pass near enough.
    left = np.floor(projected)
    rays = np.stack([left, left + 1.0], axis=1)
    share = (
        np.maximum(1.0 - np.abs(rays - projected[:, None]) / width, 0.0) / width
    )
    share[(rays < 0.0) | (rays >= size)] = 0.0
    cells = np.arange(len(angles)) * size + np.clip(rays, 0.0, size - 1.0)
    # A column for each pixel, with two rays of each angle.
    shares = scipy.sparse.csc_array(
        (
            share.ravel(),
            cells.ravel().astype(np.int32),
            np.arange(len(pixels) + 1, dtype=np.int32) * 2 * len(angles),
        ),
        shape=(len(angles) * size, len(pixels)),
    )
    return (shares @ flat[pixels]).reshape(len(angles), size, num_channels)


def nearest_neighbours(points: np.ndarray, k: int) -> np.ndarray:
    """Returns the k nearest neighbours of each point, including the point.

    Args:
        points: (N, 3) finite float64.
        k: number of neighbours, from 1 to N.

    Returns:
        (N, k) indices in no particular order. Of several equally far points,
        any may be chosen, but for equal clouds always the same points.
    """
    found, _ = small_gicp.KdTree(points).batch_knn_search(points, k)
    return found.astype(np.int64)


def local_features(points: np.ndarray, neighbours: np.ndarray) -> np.ndarray:
    """Returns six numbers that describe the shape of a cloud at each point.

    The numbers are a selection of the hand-made features of LPD-Net (Liu et
    al., ICCV 2019). Let l1 >= l2 >= l3 be the eigenvalues of the covariance of
    a point's neighbours, s their sum, and m1 >= m2 the eigenvalues of the
    covariance's horizontal part. The features are change of curvature l3 / s;
    omnivariance (l1 l2 l3)^(1/3) / s; entropy of the eigenvalues, -sum (li / s)
    ln (li / s); horizontal roundness m2 / m1 (which LPD-Net calls linearity);
    range and variance of z.

    If the neighbours lie in a plane or on a line, the limits of the formulas
    are used (0 ln 0 = 0, and 0 / 0 = 0 for a vertical line).

    Args:
        points: (N, 3) float64 points.
        neighbours: (N, K) indices, K >= 2, of points that are not all at the
            same position.

    Returns:
        (N, 6) float64, in the order above; all are at least 0. Eigenvalues
        are exact to about 1e-8 of the greatest.
    """
    xx, yy, zz, xy, xz, yz, height = _second_moments(points, neighbours)
    half_sum = 0.5 * (xx + yy)
    root = np.hypot(0.5 * (xx - yy), xy)
    # A vertical line has no horizontal part.
    greatest = np.where(half_sum > 0.0, half_sum + root, 1.0)
    roundness = np.maximum(half_sum - root, 0.0) / greatest
    variance = zz / neighbours.shape[1]
    # Eigenvalues in closed form (O. K. Smith, Comm. ACM 4 (4), 1961).
    total = xx + yy + zz
    xx, yy, zz, xy, xz, yz = (m / total for m in (xx, yy, zz, xy, xz, yz))
    mean = (xx + yy + zz) / 3.0
    a, b, c = xx - mean, yy - mean, zz - mean
    scale = np.sqrt(
        (a * a + b * b + c * c + 2.0 * (xy * xy + xz * xz + yz * yz)) / 6.0
    )
    determinant = (
        a * (b * c - yz * yz)
        - xy * (xy * c - yz * xz)
        + xz * (xy * yz - b * xz)
    )
    cosine = determinant / np.where(scale > 0.0, 2.0 * scale**3, 1.0)
    angle = np.arccos(np.clip(cosine, -1.0, 1.0)) / 3.0
    l1 = mean + 2.0 * scale * np.cos(angle)
    least = mean + 2.0 * scale * np.cos(angle + 2.0 * math.pi / 3.0)
    # Values that rounding makes negative are set to 0.
    l2, l3 = np.maximum(3.0 * mean - l1 - least, 0.0), np.maximum(least, 0.0)
    entropy = sum(scipy.special.entr(eigenvalue) for eigenvalue in (l1, l2, l3))
    return np.stack(
        [l3, np.cbrt(l1 * l2 * l3), entropy, roundness, height, variance],
        axis=1,
    )


@compiled
def _second_moments(points: np.ndarray, neighbours: np.ndarray) -> np.ndarray:
    """Returns the second moments of each point's K neighbours about their mean.

    The result is (7, N): sums of the products xx, yy, zz, xy, xz and yz, and
    the range of z.
    """
    num_points, num_neighbours = neighbours.shape
    result = np.empty((7, num_points))
    for point in range(num_points):
        mean_x, mean_y, mean_z = 0.0, 0.0, 0.0
        least, most = np.inf, -np.inf
        for other in neighbours[point]:
            mean_x += points[other, 0]
            mean_y += points[other, 1]
            mean_z += points[other, 2]
            least = min(least, points[other, 2])
            most = max(most, points[other, 2])
        mean_x /= num_neighbours
        mean_y /= num_neighbours
        mean_z /= num_neighbours
        xx, yy, zz, xy, xz, yz = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
        for other in neighbours[point]:
            dx = points[other, 0] - mean_x
            dy = points[other, 1] - mean_y
            dz = points[other, 2] - mean_z
            xx += dx * dx
            yy += dy * dy
            zz += dz * dz
            xy += dx * dy
            xz += dx * dz
            yz += dy * dz
        found = xx, yy, zz, xy, xz, yz, most - least
        for row in range(7):
            result[row, point] = found[row]
    return result
