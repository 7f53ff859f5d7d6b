"""Search for the pose at which two maps of bits overlap most.

First on coarse maps, a word a row: of one query against many places, and then
near some poses. At last cell by cell, of one query against one place.
"""

from __future__ import annotations

import numpy as np

from cns_drake.base.compiled import compiled
from evaluation.methods.overlap_bits import UNIT_BITS, WORD, window
from evaluation.methods.overlap_lanes import (
    LANES,
    common_of_places,
    common_of_rows,
)
from evaluation.methods.overlap_layers import GRID

_WORD_BYTES = WORD // 8
# Three counts share a word. A layer has at most GRID * GRID cells.
_COUNT_BITS = 21
_COUNT_MASK = np.uint64((1 << _COUNT_BITS) - 1)


def in_lanes(maps: np.ndarray, margin: int) -> np.ndarray:
    """Returns maps of places for `best_overlaps`.

    Args:
        maps: (D, S, R) uint64.
        margin: m rows without bits to add on either side.

    Returns:
        (ceil(D / LANES), S, R + 2 m, LANES) uint64. What D lacks to a multiple
        of LANES has no bits.
    """
    missing = -len(maps) % LANES
    padded = np.pad(maps, ((0, missing), (0, 0), (margin, margin)))
    blocks = padded.reshape(-1, LANES, *padded.shape[1:])
    return np.ascontiguousarray(blocks.transpose(0, 2, 3, 1))


@compiled
def best_overlaps(
    queries: np.ndarray, places: np.ndarray, shifts: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Returns how much of a query places overlap at most, at each heading.

    Args:
        queries: (H, C, S, R) uint64, contiguous: maps of the first search at H
            headings and C shifts along the columns' axis.
        places: of D places, see `in_lanes`.
        shifts: (K, 2) int64 to try: by 0 to 2 m rows, and which of the C.

    Returns:
        (D, H) int64 each, D a multiple of LANES: the weighted count of common
        bits, and at which shift it is found first.
    """
    num_headings, num_columns, num_maps, num_rows = queries.shape
    num_blocks, _, num_place_rows, _ = places.shape
    counts = np.full((num_blocks * LANES, num_headings), -1, np.int64)
    found = np.zeros((num_blocks * LANES, num_headings), np.int64)
    query_words, place_words = queries.ravel(), places.ravel()
    common = np.zeros(LANES, np.int64)
    for block in range(num_blocks):
        for heading in range(num_headings):
            for k in range(len(shifts)):
                first, column = shifts[k]
                query = (heading * num_columns + column) * num_maps
                common_of_places(
                    query_words,
                    query * num_rows,
                    place_words,
                    (block * num_maps * num_place_rows + first) * LANES,
                    num_place_rows * LANES,
                    common,
                )
                for lane in range(LANES):
                    place = block * LANES + lane
                    if common[lane] > counts[place, heading]:
                        counts[place, heading] = common[lane]
                        found[place, heading] = k
    return counts, found


@compiled
def overlaps_nearby(
    queries: np.ndarray,
    places: np.ndarray,
    starts: np.ndarray,
    reach: np.ndarray,
) -> tuple[np.ndarray, np.ndarray]:
    """Returns how much of a query places overlap at most near some poses.

    Args:
        queries: (H, S, R) uint64, contiguous: maps of the second search, at
            headings of equal steps of a full turn.
        places: (D, S, R + 2 m) uint64, contiguous, m rows without bits on
            either side.
        starts: (N, 4) int64: which place, heading, and shift of the query
            along rows and along columns.
        reach: (2,) int64: how far from there to look, of heading and shifts.

    Returns:
        (N,) int64 weighted counts of common bits, and (N, 3) where they are
        found first: heading and shifts.
    """
    num_headings, num_maps, num_rows = queries.shape
    num_place_rows = places.shape[2]
    margin = (num_place_rows - num_rows) // 2
    query_words, place_words = queries.ravel(), places.ravel()
    counts = np.full(len(starts), -1, np.int64)
    poses = np.zeros((len(starts), 3), np.int64)
    for n in range(len(starts)):
        place = starts[n, 0] * num_maps * num_place_rows
        for dt in range(-reach[0], reach[0] + 1):
            heading = (starts[n, 1] + dt) % num_headings
            for right in range(
                max(starts[n, 2] - reach[1], -margin),
                min(starts[n, 2] + reach[1], margin) + 1,
            ):
                for up in range(
                    starts[n, 3] - reach[1], starts[n, 3] + reach[1] + 1
                ):
                    total = common_of_rows(
                        query_words,
                        heading * num_maps * num_rows,
                        np.uint64(max(up, 0)),
                        np.uint64(max(-up, 0)),
                        place_words,
                        place + margin + right,
                        num_place_rows,
                    )
                    if total > counts[n]:
                        counts[n] = total
                        poses[n, 0] = heading
                        poses[n, 1], poses[n, 2] = right, up
    return counts, poses


@compiled
def climb(
    cells: np.ndarray,
    starts: np.ndarray,
    place: np.ndarray,
    weights: np.ndarray,
    turns: np.ndarray,
    start: np.ndarray,
    steps: np.ndarray,
) -> np.ndarray:
    """Climbs to the pose at which a query overlaps a place most.

    The best of a pose and its 26 neighbours becomes the next one, until none is
    better; then steps get smaller.

    Args:
        cells: (M,) uint16 of the query.
        starts: (layers + 1,) where its layers begin.
        place: of the place, see `fine_bits`.
        weights: (layers,) int64.
        turns: (H, 2) int64 cosines and sines of equal steps of a full turn.
        start: (3,) int64: which turn, shift along rows and along columns in
            half cells.
        steps: (K, 2) int64: of the turn and of the shifts, which are even,
            coarse to fine.

    Returns:
        (3 + layers,) int64: the pose, and the query's cells that meet some
        of the place, in each layer.
    """
    common = np.zeros((3, 3, len(weights)), np.int64)
    pose = start.copy()
    _count_common(cells, starts, place, turns, pose, 1, common)
    best = np.concatenate((start, common[1, 1]))
    most = _weighted(common[1, 1], weights)
    move = (0, 0, 0)
    for level in range(len(steps)):
        step = steps[level, 1]
        # How the centre moved last, in steps; at first, from out of reach.
        last = (3, 3, 3)
        while True:
            centre = best.copy()
            before = most
            for dt in range(-1, 2):
                # Those around the centre before are no better.
                if abs(last[0] + dt) <= 1 and last[1] == 0 and last[2] == 0:
                    continue
                pose[0] = (centre[0] + dt * steps[level, 0]) % len(turns)
                pose[1], pose[2] = centre[1], centre[2]
                _count_common(
                    cells, starts, place, turns, pose, step // 2, common
                )
                for dr in range(-1, 2):
                    for dc in range(-1, 2):
                        found = common[dr + 1, dc + 1]
                        total = _weighted(found, weights)
                        if total > most:
                            most = total
                            best[0] = pose[0]
                            best[1] = centre[1] + dr * step
                            best[2] = centre[2] + dc * step
                            for layer in range(len(found)):
                                best[3 + layer] = found[layer]
                            move = (dt, dr, dc)
            if most == before:
                break
            last = move
    return best


@compiled
def _weighted(counts: np.ndarray, weights: np.ndarray) -> int:
    total = 0
    for layer in range(len(counts)):
        total += counts[layer] * weights[layer]
    return total


@compiled
def _count_common(
    cells: np.ndarray,
    starts: np.ndarray,
    place: np.ndarray,
    turns: np.ndarray,
    pose: np.ndarray,
    step: int,
    common: np.ndarray,
) -> None:
    """Counts the cells of each layer that meet the place's, near a pose.

    Shifts by whole cells move all cells alike: each is turned once, and of the
    place's bits those of three columns are read together.

    Args:
        cells, starts, place, turns: see `climb`.
        pose: (3,) int64.
        step: k, of the shifts in whole cells, from 1 to 6.
        common: (3, 3, layers) int64 to fill: for shifts by -k, 0 and k
            along rows and along columns.
    """
    c, s = turns[pose[0], 0], turns[pose[0], 1]
    right, up = (pose[1] + GRID) << UNIT_BITS, (pose[2] + GRID) << UNIT_BITS
    one, k = np.uint64(1), np.uint64(step)
    # A product takes the three bits of a row, k apart, to where their counts
    # begin: none of its other terms is there.
    first, second = np.uint64(_COUNT_BITS), np.uint64(2 * _COUNT_BITS)
    wanted = one | one << k | one << (k + k)
    spread = one | one << (first - k) | one << (second - k - k)
    counted = one | one << first | one << second
    row_bytes = place.shape[2] * _WORD_BYTES
    for layer in range(len(starts) - 1):
        origin = (layer * place.shape[1] + 1) * row_bytes
        before = here = after = np.uint64(0)
        for i in range(starts[layer], starts[layer + 1]):
            u = 2 * (np.int64(cells[i]) >> 8) + 1 - GRID
            v = 2 * (np.int64(cells[i]) & 255) + 1 - GRID
            row = (c * u - s * v + right) >> (UNIT_BITS + 1)
            column = (s * u + c * v + up) >> (UNIT_BITS + 1)
            # Beside the map are no bits.
            bit = WORD - step + min(max(column, -1 - step), GRID + step)
            byte, shift = origin + (bit >> 3), np.uint64(bit & 7)
            at = byte + min(max(row - step, -1), GRID) * row_bytes
            bits = window(place, at) >> shift & wanted
            before += bits * spread & counted
            at = byte + min(max(row, -1), GRID) * row_bytes
            bits = window(place, at) >> shift & wanted
            here += bits * spread & counted
            at = byte + min(max(row + step, -1), GRID) * row_bytes
            bits = window(place, at) >> shift & wanted
            after += bits * spread & counted
        for dr, counts in enumerate((before, here, after)):
            for dc in range(3):
                common[dr, dc, layer] = np.int64(
                    counts >> np.uint64(dc * _COUNT_BITS) & _COUNT_MASK
                )
