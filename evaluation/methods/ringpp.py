"""RING++ (Xu, Lu, Wu, Lu, Zhu, Liang, Xiong, Wang: T-RO 2023).

A scan becomes a bird's-eye map with six channels that describe the shape of the
cloud. In the Radon transform of this map, a rotation of the scan is a shift of
rows; the magnitude of each row's spectrum does not change if the LiDAR is
moved. Two scans are similar if these spectra correlate well at some shift of
the rows. This shift is also the difference in heading. Once the heading is
known, the correlation of the bird's-eye maps gives the translation.

Scores have the same bits on every processor. Everything outside of SciPy's
Fourier transforms is computed in a fixed order; these transforms use no vector
instructions that only some processors have.
"""

from __future__ import annotations

import cmath
from collections.abc import Callable, Sequence
from dataclasses import dataclass
import functools
import math
from typing import Annotated, Literal

import numpy as np
from pydantic import Field, PositiveFloat, PositiveInt, model_validator
import scipy.fft
import scipy.sparse
import small_gicp

from evaluation.base import compiled, poses
from evaluation.methods.method import Method, MethodConfig
from evaluation.methods.registry import register

# See `local_features`.
_NUM_FEATURES = 6
# Added to the variance, so that the normalised spectrum of a nearly constant
# channel stays bounded: the default of PyTorch's InstanceNorm2d, which the
# authors' program uses. It removes a third of the power of the channel with the
# variance of z, and is therefore part of the method.
_NORM_EPSILON = 1e-5
# With the setting `candidates`, this number of the lowest radial frequencies
# chooses the places that are compared by all frequencies.
_FIRST_FREQUENCIES = 20
# Number of spectra of places kept in memory, a third of a megabyte each.
_REFERENCES_KEPT = 64
# Number of pairs of a query and a place whose shifts are kept in memory, two
# bytes each. A search scores at most as many pairs before it asks for poses
# (`_MOST_PAIRS` in `evaluation.recognition.retrieval`).
_SHIFTS_KEPT = 16_000_000
# Number of headings whose rotated pixels are kept in memory: those of a whole
# turn, 60 kB each.
_HEADINGS_KEPT = 120
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
        crop: which points of the map are used: all (`square`), or those within
            `half_width` of the map's centre (`round`), the same at each heading
            of the LiDAR.
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
        candidates: number of places that a query is compared with by all radial
            frequencies: the most similar ones by the lowest 20; by default all,
            as in the authors' program.
    """

    half_width: PositiveFloat = 70.0
    crop: Literal["square", "round"] = "square"
    min_height: float = 0.73
    max_height: float = 11.73
    height_unit: PositiveFloat = 10.0
    neighbours: Annotated[int, Field(ge=2)] = 30
    cells: Annotated[int, Field(ge=2)] = 120
    candidates: PositiveInt | None = None

    @model_validator(mode="after")
    def _limits_are_in_order(self) -> RingPlusPlusConfig:
        if self.min_height >= self.max_height:
            raise ValueError("min_height must be below max_height")
        return self


@dataclass(frozen=True, eq=False)
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
        shifts: function that takes a query, and returns an array (D,) int16:
            the shift at which the query correlates best with each place, -1
            where this is not yet known. `RingPlusPlus.score` fills in what
            `RingPlusPlus.relative_poses` needs.
    """

    places: Sequence[Ring]
    is_empty: np.ndarray
    reference: Callable[[int], np.ndarray]
    shifts: Callable[[Ring], np.ndarray]


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
    divides = True
    config: RingPlusPlusConfig

    def describe(self, points: np.ndarray) -> Ring:
        num_cells = self.config.cells
        image = self._bev(points)
        # From 0 to a full turn, both included, as in the program.
        angles = np.linspace(0.0, 2.0 * math.pi, num_cells)
        sinogram = radon(image, angles)
        rays = scipy.fft.rfft(sinogram, axis=1, norm="ortho")
        # The last bits of NumPy's absolute values depend on the processor.
        magnitudes = np.sqrt(rays.real * rays.real + rays.imag * rays.imag)
        normalised = _normalise(
            np.ascontiguousarray(magnitudes.transpose(2, 1, 0)), num_cells
        )
        spectrum = scipy.fft.rfft(normalised, axis=2)
        flat = image.reshape(-1, _NUM_FEATURES)
        filled = np.flatnonzero(flat.any(axis=1))
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

        def unknown(query: Ring) -> np.ndarray:
            del query  # Each query has an array of its own.
            return np.full(len(places), -1, np.int16)

        return RingDatabase(
            places=places,
            is_empty=np.array([len(place.filled) == 0 for place in places]),
            # Successive queries have many of their top-ranked places in common.
            reference=functools.lru_cache(_REFERENCES_KEPT)(reference),
            shifts=functools.lru_cache(
                max(1, _SHIFTS_KEPT // max(1, len(places)))
            )(unknown),
        )

    def score(
        self, query: Ring, database: RingDatabase, *, exhaustive: bool = False
    ) -> np.ndarray:
        number = self.config.candidates
        if exhaustive or number is None:
            number = len(database.places)
        return self.score_best(query, database, number)

    @property
    def num_shortlisted(self) -> int | None:
        return self.config.candidates

    def shortlist(self, query: Ring, database: RingDatabase) -> np.ndarray:
        return self._most_similar(query, database)[1]

    def score_best(
        self, query: Ring, database: RingDatabase, number: int
    ) -> np.ndarray:
        scores = np.full(len(database.places), np.nan)
        if len(query.filled) == 0:
            return scores
        chosen: Sequence[int] = range(len(scores))
        if number < len(scores):
            chosen = self._most_similar(query, database)[0][:number].tolist()
        conjugate = self._weighted_spectrum(query).conj()
        shifts = database.shifts(query)
        for k in chosen:
            scores[k], shifts[k] = self._best_shift(
                conjugate, database.places[k].spectrum
            )
        return np.where(database.is_empty, np.nan, scores)

    def _most_similar(
        self, query: Ring, database: RingDatabase
    ) -> tuple[np.ndarray, np.ndarray]:
        """Returns the places most similar by low radial frequencies, and how.

        The results are (K,) places, best first, and (K,) decreasing
        correlations, with K at most `candidates`.
        """
        conjugate = _low_rows(self._weighted_spectrum(query).conj())
        correlations = np.array(
            [
                self._best_shift(conjugate, _low_rows(place.spectrum))[0]
                for place in database.places
            ]
        )
        best = np.argsort(-correlations, kind="stable")[
            : self.config.candidates
        ]
        return best, correlations[best]

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
        shifts = database.shifts(query)
        if any(shifts[place] < 0 for place in places):
            conjugate = self._weighted_spectrum(query).conj()
            for place in places:
                _, shifts[place] = self._best_shift(
                    conjugate, database.places[place].spectrum
                )
        query_bev = query.bev(num_cells)

        # Places along one street have few different headings.
        @functools.cache
        def turned(heading: float) -> tuple[np.ndarray, np.ndarray]:
            """Returns the spectra at a heading and at the opposite heading."""
            spectrum = _normalised_spectrum(_rotated(query_bev, heading))
            return spectrum, _product(spectrum.conj(), _half_turn(num_cells))

        return [
            None
            if database.is_empty[place]
            else self._pose_at(
                int(shifts[place]), turned, database.reference(place)
            )
            for place in places
        ]

    def _pose_at(
        self,
        shift: int,
        turned: Callable[[float], tuple[np.ndarray, np.ndarray]],
        reference: np.ndarray,
    ) -> np.ndarray:
        """Returns X_PQ (4, 4) at a place.

        Args:
            shift: the shift of the place's rows that correlates best.
            turned: function that returns the spectra of the query's map at a
                heading [rad] and at the opposite heading.
            reference: conjugate spectrum of the place's map.
        """
        num_cells = self.config.cells
        # Rows are 360 / (n - 1) deg apart. The last row repeats the first, so
        # that a shift by one stands for 360 / n deg on average. Spectra of
        # opposite rays are equal, which leaves two possible headings.
        yaw = -2.0 * math.pi * _signed_shift(shift, num_cells) / num_cells
        headings = (yaw, yaw - math.pi)
        fits = [
            _best_offset(_product(spectrum, reference), num_cells)
            for spectrum in turned(yaw)
        ]
        best = 1 if fits[1][0] > fits[0][0] else 0
        offset = fits[best][1]
        yaw = headings[best]
        cell = 2.0 * self.config.half_width / num_cells
        return poses.yaw_pose(yaw, -offset[0] * cell, -offset[1] * cell)

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
        # Single precision hides the last bits of the C library's functions.
        features = local_features(scaled, neighbours).astype(np.float32)
        cells = ((scaled[:, :2] + 1.0) * (0.5 * config.cells)).astype(np.int64)
        # Rounding can put a value on the limit.
        row, column = np.minimum(cells, config.cells - 1).T
        cell = row * config.cells + column
        order = np.argsort(cell, kind="stable")
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

    def _best_shift(
        self, conjugate: np.ndarray, spectrum: np.ndarray
    ) -> tuple[float, int]:
        """Returns the greatest correlation of a query with a place, and where.

        The result is the correlation, and the shift of the place's rows, from 0
        to n - 1, at which it occurs. As in the authors' program, the circular
        correlation over the angles is computed for each channel and frequency,
        and the magnitudes are summed.

        Args:
            conjugate: (6 F, F) complex64, complex conjugate of the result of
                `_weighted_spectrum`.
            spectrum: (6 F, F) complex64, spectrum of the place.
        """
        n = self.config.cells
        rows = scipy.fft.irfft(
            _product(conjugate, spectrum), n=n, axis=1, overwrite_x=True
        )
        correlation = _sum_of_magnitudes(rows)
        # The product with the other one's conjugate runs backwards.
        best = int(correlation.argmax())
        return float(correlation[best]), -best % n


def _low_rows(spectrum: np.ndarray) -> np.ndarray:
    """Returns the rows of the lowest radial frequencies of each channel."""
    num_angular = spectrum.shape[1]
    channels = spectrum.reshape(_NUM_FEATURES, -1, num_angular)
    return channels[:, :_FIRST_FREQUENCIES].reshape(-1, num_angular)


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


@compiled
def _normalise(magnitudes: np.ndarray, n: int) -> np.ndarray:
    """Returns channels of zero mean and (nearly) unit variance.

    Args:
        magnitudes: (C, F, A) half of the spectra, for A angles.
        n: length of the whole spectra.
    """
    num_channels, num_frequencies, num_angles = magnitudes.shape
    result = np.empty(magnitudes.shape)
    for channel in range(num_channels):
        total, squares = 0.0, 0.0
        for power in range(2):
            mean = total / (n * num_angles)
            for row in range(num_frequencies):
                # Each frequency but 0 and n / 2 stands for two of n.
                weight = 1.0 if row == 0 or 2 * row == n else 2.0
                for k in range(num_angles):
                    value = magnitudes[channel, row, k]
                    if power == 0:
                        total += weight * value
                    else:
                        squares += weight * (value - mean) * (value - mean)
        deviation = math.sqrt(squares / (n * num_angles) + _NORM_EPSILON)
        for row in range(num_frequencies):
            for k in range(num_angles):
                centred = magnitudes[channel, row, k] - mean
                result[channel, row, k] = centred / deviation
    return result


@compiled
def _product(one: np.ndarray, other: np.ndarray) -> np.ndarray:
    """Returns the products of complex numbers, in a new array.

    NumPy's products have other last bits where a processor multiplies and adds
    in one step. The shape of `other` may be the end of the shape of `one`.
    """
    result = np.empty_like(one)
    length = one.shape[-1]
    a, b = one.reshape(-1, length), other.reshape(-1, length)
    c = result.reshape(-1, length)
    for row in range(len(a)):
        of_other = row % len(b)
        for k in range(length):
            u, v = a[row, k], b[of_other, k]
            c[row, k] = complex(
                u.real * v.real - u.imag * v.imag,
                u.real * v.imag + u.imag * v.real,
            )
    return result


@compiled
def _sum_of_magnitudes(rows: np.ndarray) -> np.ndarray:
    """Returns the sums of the magnitudes of (R, N) over the rows, (N,)."""
    result = np.zeros(rows.shape[1], rows.dtype)
    for row in range(rows.shape[0]):
        for k in range(rows.shape[1]):
            result[k] += abs(rows[row, k])
    return result


def _rotated(image: np.ndarray, angle: float) -> np.ndarray:
    """Returns an image (C, n, n) rotated by an angle.

    A positive angle rotates the row axis towards the column axis.
    Each pixel takes the value of the nearest source pixel, or 0 outside the
    image.
    """
    n = image.shape[1]
    outside = np.zeros((len(image), 1), image.dtype)
    padded = np.concatenate([image.reshape(len(image), -1), outside], axis=1)
    return padded.take(_rotated_pixels(n, angle), axis=1)


@functools.lru_cache(_HEADINGS_KEPT)
def _rotated_pixels(n: int, angle: float) -> np.ndarray:
    """Returns the source pixels (n, n) of `_rotated`; n^2 is outside."""
    centred = np.arange(n) - 0.5 * (n - 1)
    x, y = centred[:, None], centred
    c, s = math.cos(angle), math.sin(angle)
    row = np.rint(c * x + s * y + 0.5 * (n - 1)).astype(np.int32)
    column = np.rint(-s * x + c * y + 0.5 * (n - 1)).astype(np.int32)
    inside = (row >= 0) & (row < n) & (column >= 0) & (column < n)
    return np.where(inside, row * n + column, n * n)


@functools.lru_cache(1)
def _half_turn(n: int) -> np.ndarray:
    """Returns the factors (n, F) complex64 that turn a map by 180 degrees.

    Half a turn moves a pixel from row or column i to n - 1 - i. This changes
    the spectrum of a real image to its conjugate times these factors.
    """
    return np.array(
        [
            [
                cmath.exp(2j * math.pi * ((row + column) % n) / n)
                for column in range(n // 2 + 1)
            ]
            for row in range(n)
        ],
        np.complex64,
    )


def _normalised_spectrum(image: np.ndarray) -> np.ndarray:
    """Returns the spectrum (C, n, F) of a standardised image (C, n, n).

    Before the transform, the image is shifted to zero mean and scaled to unit
    norm, both over all channels together. The product of one spectrum with the
    conjugate of another is then the spectrum of their normalised
    cross-correlation.
    """
    return scipy.fft.rfft2(_standardised(image), overwrite_x=True)


@compiled
def _standardised(image: np.ndarray) -> np.ndarray:
    """Returns an image with zero mean and unit norm, see above.

    An image of one value, which lacks a direction, becomes zero.
    """
    pixels = image.ravel()
    total, squares = 0.0, 0.0
    for value in pixels:
        total += value
    mean = total / len(pixels)
    for value in pixels:
        squares += (value - mean) * (value - mean)
    norm = math.sqrt(squares) or 1.0
    result = np.empty_like(pixels)
    for k in range(len(pixels)):
        result[k] = (pixels[k] - mean) / norm
    return result.reshape(image.shape)


def _best_offset(product: np.ndarray, n: int) -> tuple[float, tuple[int, int]]:
    """Returns the greatest correlation of two images, and the shift.

    `product` (C, n, F) is the spectrum of the image times the conjugate
    spectrum of the reference; n is the side of the images. The correlations of
    the channels are computed separately, and their magnitudes are summed. The
    shift is in rows and columns. The product is overwritten.
    """
    correlations = scipy.fft.irfft2(product, s=(n, n), overwrite_x=True)
    correlation = _sum_of_magnitudes(correlations.reshape(len(product), -1))
    best = int(correlation.argmax())
    row, column = divmod(best, n)
    return (
        float(correlation[best]),
        (_signed_shift(row, n), _signed_shift(column, n)),
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
    cosines = np.array([math.cos(angle) for angle in angles])
    sines = np.array([math.sin(angle) for angle in angles])
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


@compiled
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
    result = np.empty((len(neighbours), 6))
    for point in range(len(neighbours)):
        mean_x, mean_y, mean_z = 0.0, 0.0, 0.0
        lowest, highest = np.inf, -np.inf
        for other in neighbours[point]:
            mean_x += points[other, 0]
            mean_y += points[other, 1]
            mean_z += points[other, 2]
            lowest = min(lowest, points[other, 2])
            highest = max(highest, points[other, 2])
        num_neighbours = neighbours.shape[1]
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
        half_sum, half_difference = 0.5 * (xx + yy), 0.5 * (xx - yy)
        root = math.sqrt(half_difference * half_difference + xy * xy)
        # A vertical line has no horizontal part.
        roundness = 0.0
        if half_sum > 0.0:
            roundness = max(half_sum - root, 0.0) / (half_sum + root)
        total = xx + yy + zz
        l1, l2, l3 = _eigenvalues(
            xx / total,
            yy / total,
            zz / total,
            xy / total,
            xz / total,
            yz / total,
        )
        entropy = 0.0
        for eigenvalue in (l1, l2, l3):
            if eigenvalue > 0.0:
                entropy -= eigenvalue * math.log(eigenvalue)
        result[point, 0] = l3
        result[point, 1] = (l1 * l2 * l3) ** (1.0 / 3.0)
        result[point, 2] = entropy
        result[point, 3] = roundness
        result[point, 4] = highest - lowest
        result[point, 5] = zz / num_neighbours
    return result


@compiled
def _eigenvalues(
    xx: float, yy: float, zz: float, xy: float, xz: float, yz: float
) -> tuple[float, float, float]:
    """Returns the eigenvalues of a covariance, l1 >= l2 >= l3 >= 0.

    The formulas are O. K. Smith's (Comm. ACM 4 (4), 1961), but the cosine of a
    third of an angle is a root of 4 y^3 - 3 y = cos(angle), found with
    Newton's method. Thus only sums, products, quotients and square roots are
    needed, which IEEE 754 defines to the last bit.
    """
    mean = (xx + yy + zz) / 3.0
    a, b, c = xx - mean, yy - mean, zz - mean
    scale = math.sqrt(
        (a * a + b * b + c * c + 2.0 * (xy * xy + xz * xz + yz * yz)) / 6.0
    )
    determinant = (
        a * (b * c - yz * yz)
        - xy * (xy * c - yz * xz)
        + xz * (xy * yz - b * xz)
    )
    cosine = 0.0
    if scale > 0.0:
        cosine = determinant / (2.0 * scale * scale * scale)
    size = min(abs(cosine), 1.0)
    # The root for the size of the cosine lies between sqrt(3) / 2 and 1. The
    # first value is right to 0.002, so that three steps are enough.
    y = 0.8660254 + size * (0.1666667 - 0.0326921 * size)
    for _ in range(3):
        y -= (y * (4.0 * y * y - 3.0) - size) / (12.0 * y * y - 3.0)
    # The two other roots.
    spread = math.sqrt(max(3.0 * (1.0 - y * y), 0.0))
    if cosine >= 0.0:
        greatest, least = y, -0.5 * (y + spread)
    else:
        greatest, least = 0.5 * (y + spread), -y
    l1 = mean + 2.0 * scale * greatest
    l3 = mean + 2.0 * scale * least
    # Values that rounding makes negative are set to 0.
    return l1, max(3.0 * mean - l1 - l3, 0.0), max(l3, 0.0)
