"""Batches of queries and places, sampled from the scans of random cities."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.linalg import block_diag

from evaluation.base import InputError
from evaluation.methods import SECTORS

# Number of cities in a batch.
_CITIES = 2
# Number of clusters of queries in each of these cities.
_CLUSTERS = 4
# Number of queries in a cluster; every query comes with a place near and one
# further along.
_QUERIES = 5
# Greatest number of clusters that are tried for a batch.
_MOST_CLUSTERS = 100
# The queries of a cluster lie within this distance [m].
_CLUSTER = 40.0
# Greatest distance of a right place [m].
_RIGHT_WITHIN = 7.5
# Least distance of a wrong place [m]; places in between do not count.
_WRONG_FROM = 11.0
# Greatest distance of the places further along [m].
_ALONG = 35.0
# Standard deviation of the Gaussian by which weights fall with distance [m].
_DEVIATION = 4.0
# A query counts if its most similar place has at least this overlap.
_LEAST_OVERLAP = 0.2
# Right places have at least this share of the greatest overlap.
_NEAR_BEST = 0.9
# Their weights are this power of the share.
_WEIGHT_POWER = 16
# Share of the images with an occluded sector.
_HIDDEN_SHARE = 0.4
# Least and greatest angle of an occluded sector.
HIDDEN_DEG = (30.0, 120.0)
# Share of the images with lost pixels.
_LOST_SHARE = 0.3
# Greatest share of the pixels of an image that are lost.
_MOST_LOST = 0.3


@dataclass(frozen=True)
class TrainingScans:
    """Scans of several drives through several cities.

    Attributes:
        images: (N, RINGS, SECTORS, CHANNELS) uint8 polar images, see
            `evaluation.methods.polar_image`.
        xy: (N, 2) positions of the sensors [m].
        cities: (N,) number of the city.
        drives: (N,) number of the drive in its city.
        overlaps: (N, N) share of each scan that is visible from the place of
            each other scan. None if distances, and not overlaps, determine
            which places are right.
    """

    images: np.ndarray
    xy: np.ndarray
    cities: np.ndarray
    drives: np.ndarray
    overlaps: np.ndarray | None = None

    @classmethod
    def joined(cls, parts: Sequence[TrainingScans]) -> TrainingScans:
        """Joins the scans of several cities into one object.

        Args:
            parts: the scans of each city. The result numbers the cities in
                this order.
        """
        overlaps = [part.overlaps for part in parts]
        return cls(
            np.concatenate([part.images for part in parts]),
            np.concatenate([part.xy for part in parts]),
            np.repeat(np.arange(len(parts)), [len(p.xy) for p in parts]),
            np.concatenate([part.drives for part in parts]),
            None if overlaps[0] is None else block_diag(*overlaps),
        )


@dataclass(frozen=True)
class Batch:
    """Images of Q queries and P places, with the ground truth.

    Attributes:
        images: (Q + P, RINGS, SECTORS, CHANNELS) uint8 polar images, queries
            first.
        weights: (Q, P) weights of right places, with sum 1 in each row.
        counts: (Q, P) whether a place takes part in the softmax of the loss.
    """

    images: np.ndarray
    weights: np.ndarray
    counts: np.ndarray


class BatchSampler:
    """Samples batches of scans for training.

    A batch depends only on the seed and on the number of its step.
    """

    def __init__(self, scans: TrainingScans, seed: int):
        """Finds the drives that share a city.

        Raises:
            InputError: no city has two drives.
        """
        self._scans = scans
        self._seed = seed
        self._groups = {
            int(city): {
                int(drive): np.flatnonzero(
                    (scans.cities == city) & (scans.drives == drive)
                )
                for drive in np.unique(scans.drives[scans.cities == city])
            }
            for city in np.unique(scans.cities)
        }
        self._groups = {
            city: drives
            for city, drives in self._groups.items()
            if len(drives) > 1
        }
        if not self._groups:
            raise InputError("training: no city has two drives that meet")

    def batch(self, step: int) -> Batch:
        """Returns the batch of a training step."""
        rng = np.random.default_rng([self._seed, step])
        queries, places = self._queries_and_places(rng)
        weights, counts = self._targets(queries, places)
        images = self._scans.images[[*queries, *places]]
        _augment(images, rng)
        return Batch(images, weights, counts)

    def _queries_and_places(
        self, rng: np.random.Generator
    ) -> tuple[list[int], list[int]]:
        """Returns the scans of the queries, and two places for each query."""
        queries: list[int] = []
        places: list[int] = []
        wanted = _CITIES * _CLUSTERS * _QUERIES
        keys = list(self._groups)
        size = min(_CITIES, len(keys))
        cities = [keys[k] for k in rng.permutation(len(keys))[:size]]
        for turn in range(_MOST_CLUSTERS):
            # Some clusters lie where the two drives do not meet.
            of_query, of_places = self._cluster(cities[turn % size], rng)
            room = wanted - len(queries)
            queries += of_query[:room]
            places += of_places[: 2 * room]
            if len(queries) == wanted:
                return queries, places
        raise InputError("training: the drives of a city hardly meet")

    def _targets(
        self, queries: list[int], places: list[int]
    ) -> tuple[np.ndarray, np.ndarray]:
        """Returns `weights` and `counts` of a `Batch`."""
        scans = self._scans
        distance = np.linalg.norm(
            scans.xy[queries][:, None] - scans.xy[places], axis=2
        )
        same = scans.cities[queries][:, None] == scans.cities[places]
        if scans.overlaps is None:
            right = same & (distance <= _RIGHT_WITHIN)
            weights = np.exp(-0.5 * (distance / _DEVIATION) ** 2) * right
            counts = right | ~same | (distance >= _WRONG_FROM)
        else:
            shared = scans.overlaps[np.ix_(queries, places)].astype(float)
            part = shared / shared.max(axis=1, keepdims=True)
            weights = np.where(part >= _NEAR_BEST, part**_WEIGHT_POWER, 0.0)
            counts = np.ones_like(same)
        weights = weights / weights.sum(axis=1, keepdims=True)
        return weights.astype(np.float32), counts

    def _cluster(
        self, city: int, rng: np.random.Generator
    ) -> tuple[list[int], list[int]]:
        """Returns neighbouring queries, with a right and a wrong place each."""
        xy = self._scans.xy
        drives = list(self._groups[city].values())
        first, second = rng.permutation(len(drives))[:2]
        asked, asked_of = drives[first], drives[second]
        center = xy[asked[int(rng.integers(len(asked)))]]
        near = asked[np.linalg.norm(xy[asked] - center, axis=1) <= _CLUSTER]
        queries: list[int] = []
        places: list[int] = []
        for query in rng.permutation(near)[:_QUERIES].tolist():
            away = np.linalg.norm(xy[asked_of] - xy[query], axis=1)
            is_right, is_wrong = away <= _RIGHT_WITHIN, away >= _WRONG_FROM
            if self._scans.overlaps is not None:
                shared = self._scans.overlaps[query, asked_of].astype(float)
                is_right = shared >= max(
                    _LEAST_OVERLAP, _NEAR_BEST * shared.max()
                )
                is_wrong = ~is_right
            right = asked_of[is_right]
            along = asked_of[is_wrong & (away <= _ALONG)]
            if len(right) and len(along):
                queries.append(query)
                places += [int(rng.choice(right)), int(rng.choice(along))]
        return queries, places


def _augment(images: np.ndarray, rng: np.random.Generator) -> None:
    """Augments images in place: random yaws, occluded sectors, lost pixels."""
    is_mirrored = rng.random() < 0.5
    for number, image in enumerate(images):
        if is_mirrored:
            image = image[:, ::-1]
        image = np.roll(image, int(rng.integers(SECTORS)), axis=1)
        if rng.random() < _HIDDEN_SHARE:
            width = rng.uniform(*HIDDEN_DEG) / 360.0 * SECTORS
            image[:, : int(width)] = 0
            image = np.roll(image, int(rng.integers(SECTORS)), axis=1)
        if rng.random() < _LOST_SHARE:
            share = rng.uniform(0.0, _MOST_LOST)
            image[rng.random(image.shape[:2]) < share] = 0
        images[number] = image
