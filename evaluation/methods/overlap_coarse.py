"""The coarse searches of layered overlap: one query against all places."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from evaluation.methods.overlap_bits import (
    WORD,
    coarse_bits,
    count_bits,
    shifted_columns,
    turns,
)
from evaluation.methods.overlap_lanes import FIRST_POWERS, SECOND_POWERS
from evaluation.methods.overlap_layers import GRID, NUM_LAYERS
from evaluation.methods.overlap_search import (
    best_overlaps,
    in_lanes,
    overlaps_nearby,
)

# The first search: cells of 4 m, of two maps in the halves of each word: low
# with middle and high; poles and kerbs. Headings are 15 deg apart.
_FIRST_HALVINGS = 3
_FIRST_MAPS = np.array([0, 0, 0, 1, 1])
_FIRST_HALVES = np.array([0, 0, 1, 0, 1])
_FIRST_WEIGHTS = 2 ** np.array(FIRST_POWERS)
NUM_HEADINGS = 24
_FIRST_TURNS = turns(NUM_HEADINGS)
_FIRST_REACH = 2
# All shifts within reach, except corners, which are too far for a match.
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


def build_database(places: Sequence[LayeredScan]) -> LayeredDatabase:
    """Draws the coarse maps of places."""
    first = np.concatenate([_first_bits(p, _FIRST_TURNS[:1]) for p in places])
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


def search_coarse(
    query: LayeredScan,
    database: LayeredDatabase,
    number: int,
    refined: int,
    exhaustive: bool,
) -> np.ndarray:
    """Searches for the places and poses at which coarse maps overlap most.

    Args:
        query: the query.
        database: of the places.
        number: of places with a heading in the second search.
        refined: number of these in the third search.
        exhaustive: keep each place to the last search, with its best heading.

    Returns:
        (N, 4) int64 place, heading in steps of 2.5 deg, and shifts along rows
        and columns in cells of 2 m; decreasing by how much the overlap is
        more than chance would have.
    """
    poses = _search_first(query, database, number, exhaustive)
    bits = _second_bits(query, _SECOND_TURNS)
    coarse = _search_nearby(
        np.ascontiguousarray(bits[::_SECOND_STEP]),
        database,
        poses // [1, _SECOND_STEP, 1, 1],
        _SECOND_REACH,
    )
    if not exhaustive:
        coarse = coarse[:refined]
    fine = _search_nearby(
        bits, database, coarse * [1, _SECOND_STEP, 1, 1], _THIRD_REACH
    )
    # The best pose of each place, in the order of the places.
    _, first = np.unique(fine[:, 0], return_index=True)
    return fine[np.sort(first)]


def _search_first(
    query: LayeredScan,
    database: LayeredDatabase,
    number: int,
    exhaustive: bool,
) -> np.ndarray:
    """Returns (N, 4) place, heading and shifts to begin the second with.

    These are the best of all, or the best of each place.
    """
    bits = _first_bits(query, _FIRST_TURNS)
    counts, shifts = best_overlaps(
        shifted_columns(bits, _FIRST_REACH),
        database.first,
        _FIRST_SHIFTS,
    )
    counts = counts[: len(database.places)]
    # Products of floats that hold whole numbers are exact and fast.
    of_query = _count_halves(bits).reshape(len(bits), -1).T.astype(float)
    of_places = database.first_counts.reshape(len(counts), -1).astype(float)
    weights = np.repeat(_FIRST_WEIGHTS, 2)[:, None]
    surprise = _surprise(
        counts,
        of_places @ (weights * of_query),
        of_places @ (weights**2 * of_query),
        (GRID >> _FIRST_HALVINGS) ** 2,
    )
    # Overlap at all headings is no sign of a place, since both scans are full
    # near their sensors. Half of it is subtracted, by trials.
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
    """Returns the number of standard deviations of counts above chance.

    Args:
        counts: weighted common bits.
        product: weighted product of the bits that either has.
        square: likewise with weights squared.
        cells: of a map.
    """
    # The variance is at least one, for maps without bits.
    return (counts - product / cells) / np.sqrt(square / cells + 1.0)


def _greatest(values: np.ndarray, number: int) -> np.ndarray:
    """Returns the indices of the greatest values (N,), decreasing.

    The first of equal ones counts: a partial sort leaves that to the processor.
    """
    some = np.arange(len(values))
    if number < len(values):
        least = np.partition(values, -number)[-number]
        some = np.flatnonzero(values >= least)
    order = some[np.argsort(-values[some], kind="stable")]
    return order[:number]
