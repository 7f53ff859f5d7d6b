"""A learned descriptor: a small network on polar images, trained in simulation.

Convolutions that are circular in azimuth turn the polar image of a scan into a
map of features, 8 rings x 48 sectors x 16 channels. Two scans are compared by
the greatest correlation of their maps over all rotations. The rotation with
this correlation is the relative heading. The network has never seen a recorded
scan: `cns-drake train` makes its weights.

Related methods: OverlapNet (Chen et al., RSS 2020) and DiSCO (Xu et al., RA-L
2021) also correlate over headings.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
import hashlib
import math
from pathlib import Path
from typing import Literal

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from pydantic import computed_field

from evaluation.base import (
    InputError,
    check_regular,
    note,
    poses,
    read_npz,
    user_errors,
)
from evaluation.maps import extremes
from evaluation.methods.method import Method, MethodConfig
from evaluation.methods.network_weights import checked_weights
from evaluation.methods.registry import register

# Version of the layout of files of weights.
WEIGHTS_VERSION = 1
RINGS = 64
SECTORS = 192
# Channels: occupied bands of height, then greatest height, thickness and lowest
# height.
CHANNELS = 8
# Range of the outermost ring [m].
_REACH = 64.0
# Lower ends of the bands, above the ground below the sensor [m].
_BANDS = np.array([0.35, 1.0, 2.0, 4.0, 8.0])
# Heights at which the last three channels saturate [m].
_HIGHEST = 16.0
_THICKEST = 0.5
_LOWEST = 3.0


def polar_image(points: np.ndarray, sensor_height: float) -> np.ndarray:
    """Returns the polar image of a scan.

    The image shows the scan from above. The rows of the image are rings around
    the sensor, and the columns are sectors. A rotation of the sensor by a whole
    number of sectors only shifts the columns.

    Args:
        points: (N, 3) in the frame of the sensor [m].
        sensor_height: height of the sensor above the ground [m].

    Returns:
        (RINGS, SECTORS, CHANNELS) uint8, 0 where there is no point. The first
        five channels say which bands of height contain points; the bands begin
        at 0.35, 1, 2, 4 and 8 m. The other three channels are the greatest
        height (0 to 16 m), the difference between greatest and lowest height (0
        to 0.5 m), and the lowest height (-3 to 3 m).
    """
    x, y, z = points.T
    ring = np.hypot(x, y) * (RINGS / _REACH)
    near = ring < RINGS
    x = x[near]
    y = y[near]
    ring = ring[near].astype(np.int64)
    height = z[near] + sensor_height
    sector = np.arctan2(y, x) * (SECTORS / (2.0 * math.pi))
    cell = ring * SECTORS + np.floor(sector).astype(np.int64) % SECTORS
    band = np.searchsorted(_BANDS, height, side="right")
    counts = np.bincount(
        cell * (len(_BANDS) + 1) + band,
        minlength=RINGS * SECTORS * (len(_BANDS) + 1),
    ).reshape(RINGS * SECTORS, -1)
    least, greatest = extremes(height, cell, RINGS * SECTORS)
    filled = np.isfinite(least)
    greatest, least = greatest[filled], least[filled]
    image = np.zeros((RINGS * SECTORS, CHANNELS), np.uint8)
    image[:, :5] = np.where(counts[:, 1:] > 0, 255, 0)
    shares = (
        greatest / _HIGHEST,
        (greatest - least) / _THICKEST,
        (least + _LOWEST) / (2.0 * _LOWEST),
    )
    for channel, share in enumerate(shares, start=5):
        # Zero is reserved for empty cells.
        image[filled, channel] = 1.0 + 254.0 * np.clip(share, 0.0, 1.0)
    return image.reshape(RINGS, SECTORS, CHANNELS)


def _share_of_seen_sectors(image: np.ndarray) -> float:
    """Returns the share of a polar image's sectors with at least one point."""
    return float(image.any(axis=(0, 2)).mean())


# For each 3 x 3 convolution: channels in, channels out, stride over rings,
# stride over sectors.
LAYERS = ((CHANNELS, 16, 2, 2), (16, 32, 2, 2), (32, 64, 2, 1), (64, 16, 1, 1))
# Number of features: rings x channels.
FEATURES = 8 * 16
# Number of sectors of the map of features.
TURNS = 48
# Number of frequencies of a map along its sectors; the highest frequency has no
# phase and is left out.
FREQUENCIES = TURNS // 2
# Headings at which two maps are compared.
HEADINGS = 2 * TURNS
# Name of the array with the least and the greatest share of seen sectors in
# training.
SEEN_SHARES = "seen"
# The shipped weights: trained with matches by radius, on streets of the shipped
# cities; and trained with exact overlaps, on streets of no map.
SHIPPED = Path(__file__).with_name("learned_weights.npz")
GRADED = SHIPPED.with_name("learned_graded_weights.npz")


class LearnedConfig(MethodConfig):
    """Settings of the learned descriptor.

    Attributes:
        weights: file with weights from `cns-drake train`. By default the
            shipped weights of the variant.
        variant: which shipped weights to use: `radius`, trained on streets of
            the shipped cities, with matches within 7.5 m, or `graded`, on other
            streets, with exact overlaps.
    """

    weights: Path | None = None
    variant: Literal["radius", "graded"] = "radius"

    @property
    def path(self) -> Path:
        """Path of the file with the weights."""
        return (
            self.weights or {"radius": SHIPPED, "graded": GRADED}[self.variant]
        )

    @computed_field  # type: ignore[prop-decorator]
    @property
    def digest(self) -> str:
        """Digest of the file of weights: 16 hexadecimal digits.

        Two files with the same name can contain different weights; their
        digests differ.
        """
        load_weights(self.path)
        return hashlib.sha256(self.path.read_bytes()).hexdigest()[:16]


@dataclass(frozen=True)
class LearnedScan:
    """Descriptor of one scan.

    Attributes:
        features: (48, 128) float32, a feature vector for each of 48 sectors of
            azimuth. The norm of the whole array is 1, or 0 if the scan has no
            points within range.
    """

    features: np.ndarray


@dataclass(frozen=True)
class LearnedDatabase:
    """Descriptors of D places.

    Attributes:
        spectra: (FREQUENCIES, FEATURES, D) complex64 Fourier transforms of the
            places' features over the heading.
        filled: (D,) bool, whether a place has a point.
    """

    spectra: np.ndarray
    filled: np.ndarray


@register("learned")
class Learned(Method[LearnedScan, LearnedDatabase]):
    """A learned descriptor: a small network on polar images of scans.

    The score of two scans is the cosine similarity of their features, maximised
    over the relative heading.
    """

    title = "Learned"
    style = ("#56B4E9", "--", "P")
    standard = True
    order = 6
    Config = LearnedConfig
    skips_places = True
    divides = True
    config: LearnedConfig

    def __init__(self, config: MethodConfig | None = None):
        super().__init__(config)
        self._weights = load_weights(self.config.path)
        self._warned = False

    def describe(self, points: np.ndarray) -> LearnedScan:
        return self.describe_image(
            polar_image(points, self.config.sensor_height)
        )

    def describe_image(self, image: np.ndarray) -> LearnedScan:
        """Returns the descriptor of a polar image.

        Args:
            image: (RINGS, SECTORS, CHANNELS) uint8, see `polar_image`.
        """
        if not image.any():
            return LearnedScan(np.zeros((TURNS, FEATURES), np.float32))
        self._warn_if_it_sees_little(image)
        features = _feature_map(self._weights, image)
        length = float(np.linalg.norm(features))
        return LearnedScan(features / np.float32(max(length, 1e-9)))

    def build_database(self, places: Sequence[LearnedScan]) -> LearnedDatabase:
        spectra = np.empty(
            (FREQUENCIES, FEATURES, len(places)), dtype=np.complex64
        )
        for number, place in enumerate(places):
            spectra[:, :, number] = _spectrum(place)
        filled = np.array([bool(place.features.any()) for place in places])
        return LearnedDatabase(spectra, filled)

    def score(
        self,
        query: LearnedScan,
        database: LearnedDatabase,
        *,
        exhaustive: bool = False,
    ) -> np.ndarray:
        del exhaustive  # Always true here.
        if not query.features.any():
            return np.full(len(database.filled), np.nan)
        found = _correlations(query, database.spectra).max(axis=0)
        return np.where(database.filled, found, np.nan).astype(np.float64)

    def relative_pose(
        self, query: LearnedScan, database: LearnedDatabase, place: int
    ) -> np.ndarray | None:
        """Returns the query's heading relative to a place, as a pose (4, 4).

        The heading is a multiple of 3.75 deg; the translation is zero. The
        result is None if one of the two scans has no points within range.
        """
        if not (query.features.any() and database.filled[place]):
            return None
        spectrum = database.spectra[:, :, place : place + 1]
        turn = int(_correlations(query, spectrum)[:, 0].argmax())
        # What the query sees at azimuth a, the place sees at a + turn.
        yaw = 2.0 * math.pi * turn / HEADINGS
        return poses.yaw_pose(yaw)

    def _warn_if_it_sees_little(self, image: np.ndarray) -> None:
        """Warns once if fewer sectors have points than in any training scan."""
        if self._warned:
            return
        seen = _share_of_seen_sectors(image)
        least = float(self._weights[SEEN_SHARES][0])
        if seen < least:
            self._warned = True
            note(
                f"learned: points in {100 * seen:.0f} % of the image's sectors;"
                f" in training {100 * least:.0f} % or more"
            )


def load_weights(path: Path) -> Mapping[str, np.ndarray]:
    """Returns the weights in a file, after checking them.

    Returns:
        Name -> array: `kernel_0` (9 x channels in, channels out) float32,
        `bias_0` (channels out,) and so on for each layer; and `seen` (2,), the
        least and greatest share of a training scan's sectors that contain a
        point.

    Raises:
        InputError: the file cannot be read, or has another version or size.
    """
    check_regular(path)
    with user_errors(path):
        changed = path.stat()
    return _load_checked(path, changed.st_mtime_ns, changed.st_size)


@lru_cache(maxsize=4)
def _load_checked(
    path: Path, mtime_ns: int, size: int
) -> Mapping[str, np.ndarray]:
    """Returns the weights in a file; see `load_weights`.

    Args:
        mtime_ns: time of its last change [ns]; a file that has changed is read
            again.
        size: its size [bytes].
    """
    shapes = _shapes_of_weights()
    try:
        values = read_npz(path, ("version", *shapes))
    except ValueError as error:
        raise InputError(f"{path}: no file of weights ({error})") from error
    version = values.get("version")
    if version is None or version.shape != () or version != WEIGHTS_VERSION:
        raise InputError(
            f"{path}: version: {version} instead of {WEIGHTS_VERSION}; train "
            "again with this version of the program"
        )
    return checked_weights(values, shapes, path)


def _shapes_of_weights() -> dict[str, tuple[int, ...]]:
    """Returns the shape of each array of weights, by its name."""
    shapes: dict[str, tuple[int, ...]] = {SEEN_SHARES: (2,)}
    for number, (before, after, _, _) in enumerate(LAYERS):
        shapes[f"kernel_{number}"] = (9 * before, after)
        shapes[f"bias_{number}"] = (after,)
    return shapes


def _feature_map(
    weights: Mapping[str, np.ndarray], image: np.ndarray
) -> np.ndarray:
    """Returns the map of features (TURNS, FEATURES) of a polar image.

    Args:
        weights: the weights, see `load_weights`.
        image: (RINGS, SECTORS, CHANNELS) uint8.
    """
    cells = image.astype(np.float32) * np.float32(1.0 / 255.0)
    last = len(LAYERS) - 1
    for number, (before, after, down, along) in enumerate(LAYERS):
        rings, sectors = cells.shape[0] // down, cells.shape[1] // along
        # Sectors go round; there is nothing beyond the first and last ring.
        round_trip = np.pad(cells, ((0, 0), (1, 1), (0, 0)), "wrap")
        padded = np.pad(round_trip, ((1, 1), (0, 0), (0, 0)))
        windows = sliding_window_view(padded, (3, 3), (0, 1))[::down, ::along]
        taps = windows.transpose(0, 1, 3, 4, 2)
        flat = taps.reshape(rings * sectors, 9 * before)
        flat = flat @ weights[f"kernel_{number}"] + weights[f"bias_{number}"]
        if number < last:
            np.maximum(flat, 0.0, out=flat)
        cells = flat.reshape(rings, sectors, after)
    return cells.transpose(1, 0, 2).reshape(TURNS, FEATURES)


def _spectrum(scan: LearnedScan) -> np.ndarray:
    """Returns a map's spectrum over its sectors, (FREQUENCIES, FEATURES)."""
    return np.fft.rfft(scan.features, axis=0)[:FREQUENCIES]


def _correlations(query: LearnedScan, spectra: np.ndarray) -> np.ndarray:
    """Returns the correlations with D places at all headings, (HEADINGS, D).

    Args:
        query: descriptor of the query.
        spectra: (FREQUENCIES, FEATURES, D) spectra of the places.
    """
    own = np.conj(_spectrum(query)).astype(np.complex64)
    products = np.matmul(own[:, None, :], spectra)[:, 0]
    scale = HEADINGS / TURNS
    return np.fft.irfft(products * scale, n=HEADINGS, axis=0)
