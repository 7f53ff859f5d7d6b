"""Layered overlap: a matched filter on maps of bits, made to survive change.

A scan becomes maps from above: one for each layer of height, one for poles
and one for kerbs. Two scans are compared at the pose at which most of their
filled cells coincide. What has vanished or is new only lowers this number;
what has stayed adds up at one pose.

The idea of a matched filter for places is that of Joseph, Fischer and
Milford (arXiv 2409.03998), which uses one map of occupied cells; that of
layers, poles and kerbs, and of bits instead of a Fourier transform, is ours.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
import math

import numpy as np
from pydantic import (
    NonNegativeFloat,
    NonNegativeInt,
    PositiveFloat,
    PositiveInt,
)

from evaluation.geometry.poses import make_pose
from evaluation.methods.method import Method, MethodConfig, register
from evaluation.methods.overlap_bits import (
    WORD,
    coarse_bits,
    count_bits,
    fine_bits,
    shifted_columns,
    turns,
)
from evaluation.methods.overlap_lanes import FIRST_POWERS, SECOND_POWERS
from evaluation.methods.overlap_layers import GRID, NUM_LAYERS, layer_cells
from evaluation.methods.overlap_search import (
    best_overlaps,
    climb,
    in_lanes,
    overlaps_nearby,
)

# The first search: cells of 4 m, of two maps in the halves of each word: low
# with middle and high; poles and kerbs. Headings are 15 deg apart.
_FIRST_HALVINGS = 3
_FIRST_MAPS = np.array([0, 0, 0, 1, 1])
_FIRST_HALVES = np.array([0, 0, 1, 0, 1])
_FIRST_WEIGHTS = 2 ** np.array(FIRST_POWERS)
_FIRST_TURNS = turns(24)
_FIRST_REACH = 2
# All within reach but the corners, which lie too far away to be a match.
_FIRST_SHIFTS = np.array(
    [
        (right, up)
        for right in range(2 * _FIRST_REACH + 1)
        for up in range(2 * _FIRST_REACH + 1)
        if abs(right - _FIRST_REACH) + abs(up - _FIRST_REACH) < 2 * _FIRST_REACH
    ]
)
# The second and the third: cells of 2 m, of a map a word: low with middle,
# high, poles, kerbs. Headings are 5 deg apart, then 2.5 deg.
_SECOND_HALVINGS = 2
_SECOND_MAPS = np.array([0, 0, 1, 2, 3])
_SECOND_HALVES = np.zeros(NUM_LAYERS, np.int64)
_SECOND_WEIGHTS = 2 ** np.array(SECOND_POWERS)
_SECOND_TURNS = turns(144)
_SECOND_STEP = 2
_SECOND_REACH = np.array([1, 1])
_THIRD_REACH = np.array([3, 2])
_SECOND_MARGIN = 2 * _FIRST_REACH + 3
# From a pose of the first search to one of the second: place, heading, shifts.
_TO_SECOND = np.array([1, 6, 2, 2])
# The last: whole cells; steps of 2.5 deg and 1 m, then of half of that.
_LAST_TURNS = turns(288)
_LAST_STEPS = np.array([[2, 4], [1, 2]])
_TO_LAST = np.array([1, 2, 8, 8])
# (distance / radius) to the power of two to the power of this is taken off.
_SQUARINGS = 3


class LayeredOverlapConfig(MethodConfig):
    """Parameters of layered overlap.

    Source of all: trials on development worlds, which the documentation
    tells apart from those that results are reported of.

    Attributes:
        cell: length of a cell of the finest maps, of 256 x 256 [m].
        min_points: that fill a cell.
        poses: of places with a heading that the second search looks at.
        refined: of these, that the third one looks at.
        candidates: places that are compared cell by cell.
        weights: of common cells: low, middle, high, poles and kerbs.
        least_cells: weighted cells that are added to those of either scan,
            lest two be alike that hardly show anything.
        radius: from which on a place is too far away to be a match [m]; the
            default suits the protocol's radius of 7.5 m. 0 leaves it out.
    """

    cell: PositiveFloat = 0.5
    min_points: PositiveInt = 1
    poses: PositiveInt = 8000
    refined: PositiveInt = 250
    candidates: PositiveInt = 40
    weights: tuple[
        NonNegativeInt,
        NonNegativeInt,
        NonNegativeInt,
        NonNegativeInt,
        NonNegativeInt,
    ] = (3, 3, 2, 60, 5)
    least_cells: NonNegativeInt = 150
    radius: NonNegativeFloat = 8.5


@dataclass(frozen=True)
class LayeredScan:
    """Descriptor of one cloud.

    Attributes:
        cells: (M,) uint16, filled cells of the layers, one after the other.
        starts: (6,) int64, where each begins, and the last one ends.
    """

    cells: np.ndarray
    starts: np.ndarray


@dataclass(frozen=True)
class LayeredDatabase:
    """Descriptors of D places.

    Attributes:
        places: the D descriptors.
        first: (D / 8, 2, R + 2 m, 8) uint64 maps of the first search, see
            `in_lanes`.
        first_counts: (D, 2, 2) int64 bits in the halves of each map.
        second: (D, 4, R + 2 m) uint64 maps of the second and the third.
        second_counts: (D, 4) int64 bits in each map.
    """

    places: Sequence[LayeredScan]
    first: np.ndarray
    first_counts: np.ndarray
    second: np.ndarray
    second_counts: np.ndarray


@register("layered-overlap")
class LayeredOverlap(Method[LayeredScan, LayeredDatabase]):
    """Layered overlap, in four searches from coarse to fine.

    The first three take the pose at which most bits coincide, and rank places
    by how many standard deviations this is more than chance would have. The
    last one climbs from there, cell by cell. The score is the weighted number
    of the query's cells that meet one of the place or a neighbour of one,
    over the geometric mean of how many either has; less where the place's
    sensor is so far from the query's that it is no match.

    What two equal counts decide, the first of them wins. All counts are
    integers, so that scores are the same on every processor.
    """

    Config = LayeredOverlapConfig
    config: LayeredOverlapConfig

    def describe(self, points: np.ndarray) -> LayeredScan:
        config = self.config
        return LayeredScan(
            *layer_cells(
                points, config.sensor_height, config.cell, config.min_points
            )
        )

    def build_database(self, places: Sequence[LayeredScan]) -> LayeredDatabase:
        first = np.concatenate(
            [_first_bits(p, _FIRST_TURNS[:1]) for p in places]
        )
        second = np.concatenate(
            [_second_bits(p, _SECOND_TURNS[:1]) for p in places]
        )
        return LayeredDatabase(
            places=places,
            first=in_lanes(first, _FIRST_REACH),
            first_counts=_count_halves(first),
            second=np.pad(
                second, ((0, 0), (0, 0), (_SECOND_MARGIN, _SECOND_MARGIN))
            ),
            second_counts=count_bits(second),
        )

    def score(
        self,
        query: LayeredScan,
        database: LayeredDatabase,
        *,
        exhaustive: bool = False,
    ) -> np.ndarray:
        scores = np.full(len(database.places), np.nan)
        if len(query.cells) == 0:
            return scores
        poses = self._search_coarse(query, database, exhaustive)
        if not exhaustive:
            poses = poses[: self.config.candidates]
        for pose in poses:
            place = database.places[pose[0]]
            if len(place.cells) > 0:
                found = self._climb(query, place, pose[1:])
                scores[pose[0]] = self._rate(query, place, found)
        return scores

    def relative_pose(
        self, query: LayeredScan, database: LayeredDatabase, place: int
    ) -> np.ndarray | None:
        """Returns turn and horizontal translation of the query.

        None if one of the two shows nothing.
        """
        scan = database.places[place]
        if len(query.cells) == 0 or len(scan.cells) == 0:
            return None
        alone = self.build_database([scan])
        poses = self._search_coarse(query, alone, exhaustive=False)
        found = self._climb(query, scan, poses[0, 1:])
        c, s = _LAST_TURNS[found[0]] / _LAST_TURNS[0, 0]
        R_PQ = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
        half_cell = 0.5 * self.config.cell
        return make_pose(
            R_PQ, np.array([found[1] * half_cell, found[2] * half_cell, 0.0])
        )

    def _search_coarse(
        self, query: LayeredScan, database: LayeredDatabase, exhaustive: bool
    ) -> np.ndarray:
        """Returns (N, 4) places, each with heading and shifts to climb from.

        Decreasing by how much they are more than chance would have; either
        those that were looked at to the last, or all.
        """
        config = self.config
        poses = _search_first(query, database, config.poses, exhaustive)
        bits = _second_bits(query, _SECOND_TURNS)
        coarse = _search_nearby(
            np.ascontiguousarray(bits[::_SECOND_STEP]),
            database,
            poses // [1, _SECOND_STEP, 1, 1],
            _SECOND_REACH,
        )
        if not exhaustive:
            coarse = coarse[: config.refined]
        fine = _search_nearby(
            bits, database, coarse * [1, _SECOND_STEP, 1, 1], _THIRD_REACH
        )
        # Of each place the best pose, in the order of these.
        _, first = np.unique(fine[:, 0], return_index=True)
        return fine[np.sort(first)] * _TO_LAST

    def _climb(
        self, query: LayeredScan, place: LayeredScan, start: np.ndarray
    ) -> np.ndarray:
        """Returns pose and common cells of two scans, see `climb`."""
        return climb(
            query.cells,
            query.starts,
            fine_bits(place.cells, place.starts),
            np.array(self.config.weights),
            _LAST_TURNS,
            start,
            _LAST_STEPS,
        )

    def _rate(
        self, query: LayeredScan, place: LayeredScan, found: np.ndarray
    ) -> float:
        """Returns the score of two scans at the pose that was found."""
        config = self.config
        weights = np.array(config.weights)
        common = int(weights @ found[3:])
        of_query = int(weights @ np.diff(query.starts)) + config.least_cells
        of_place = int(weights @ np.diff(place.starts)) + config.least_cells
        if of_query == 0 or of_place == 0:
            return 0.0
        alike = common / math.sqrt(of_query * of_place)
        if config.radius == 0.0:
            return alike
        half_cells = int(found[1]) ** 2 + int(found[2]) ** 2
        far = half_cells * (0.5 * config.cell / config.radius) ** 2
        for _ in range(_SQUARINGS):
            far *= far
        return alike * max(1.0 - far, 0.0)


def _search_first(
    query: LayeredScan,
    database: LayeredDatabase,
    number: int,
    exhaustive: bool,
) -> np.ndarray:
    """Returns (N, 4) place, heading and shifts to begin the second with.

    Either the best of all, or the best of each place.
    """
    bits = _first_bits(query, _FIRST_TURNS)
    counts, shifts = best_overlaps(
        shifted_columns(bits, _FIRST_REACH),
        database.first,
        _FIRST_SHIFTS,
    )
    counts = counts[: len(database.places)]
    # Of floats that hold whole numbers, products are exact and fast.
    of_query = _count_halves(bits).reshape(len(bits), -1).T.astype(float)
    of_places = database.first_counts.reshape(len(counts), -1).astype(float)
    weights = np.repeat(_FIRST_WEIGHTS, 2)[:, None]
    surprise = _surprise(
        counts,
        of_places @ (weights * of_query),
        of_places @ (weights**2 * of_query),
        (GRID >> _FIRST_HALVINGS) ** 2,
    )
    # What all headings have is no sign of a place: both scans are full near
    # their sensors. Half of it, by trials.
    surprise -= 0.5 * surprise.mean(axis=1, keepdims=True)
    if exhaustive:
        heading = surprise.argmax(axis=1)
        place = np.arange(len(heading))
    else:
        best = _greatest(surprise.ravel(), number)
        place, heading = np.divmod(best, len(_FIRST_TURNS))
    found = _FIRST_SHIFTS[shifts[place, heading]] - _FIRST_REACH
    return np.column_stack([place, heading, found]) * _TO_SECOND


def _search_nearby(
    bits: np.ndarray,
    database: LayeredDatabase,
    poses: np.ndarray,
    reach: np.ndarray,
) -> np.ndarray:
    """Returns the best poses (N, 4) near others, the best of them first.

    Args:
        bits: (H, 4, R) maps of the query.
        database: of the places.
        poses: (N, 4) place, heading and shifts to look near.
        reach: see `overlaps_nearby`.
    """
    counts, found = overlaps_nearby(bits, database.second, poses, reach)
    place = poses[:, 0]
    product = count_bits(bits)[found[:, 0]] * database.second_counts[place]
    surprise = _surprise(
        counts,
        product @ _SECOND_WEIGHTS,
        product @ _SECOND_WEIGHTS**2,
        (GRID >> _SECOND_HALVINGS) ** 2,
    )
    order = _greatest(surprise, len(surprise))
    return np.column_stack([place[order], found[order]])


def _first_bits(scan: LayeredScan, at: np.ndarray) -> np.ndarray:
    """Returns (H, 2, R) maps of the first search, at some turns."""
    return coarse_bits(
        scan.cells, scan.starts, at, _FIRST_HALVINGS, _FIRST_MAPS, _FIRST_HALVES
    )


def _second_bits(scan: LayeredScan, at: np.ndarray) -> np.ndarray:
    """Returns (H, 4, R) maps of the second search, at some turns."""
    return coarse_bits(
        scan.cells,
        scan.starts,
        at,
        _SECOND_HALVINGS,
        _SECOND_MAPS,
        _SECOND_HALVES,
    )


def _count_halves(bits: np.ndarray) -> np.ndarray:
    """Returns (N, S, 2) bits in the halves of the words of (N, S, R)."""
    half = np.uint64((1 << (WORD // 2)) - 1)
    return np.stack([count_bits(bits & half), count_bits(bits & ~half)], axis=2)


def _surprise(
    counts: np.ndarray, product: np.ndarray, square: np.ndarray, cells: int
) -> np.ndarray:
    """Returns how many standard deviations counts are more than by chance.

    Args:
        counts: weighted common bits.
        product: weighted product of the bits that either has.
        square: likewise with weights squared.
        cells: of a map.
    """
    # Beside a variance of one, for maps without bits.
    return (counts - product / cells) / np.sqrt(square / cells + 1.0)


def _greatest(values: np.ndarray, number: int) -> np.ndarray:
    """Returns where some of the greatest values (N,) are, decreasing.

    Of equal ones the first: a partial sort leaves that to the processor.
    """
    some = np.arange(len(values))
    if number < len(values):
        least = np.partition(values, -number)[-number]
        some = np.flatnonzero(values >= least)
    order = some[np.argsort(-values[some], kind="stable")]
    return order[:number]
