"""The counts of layered overlap, by brute force."""

from helpers.layered_scans import image, shifted, some_cells
import numpy as np
import pytest

from evaluation.methods.overlap_bits import (
    coarse_bits,
    count_bits,
    fine_bits,
    shifted_columns,
    turns,
)
from evaluation.methods.overlap_search import (
    best_overlaps,
    climb,
    in_lanes,
    overlaps_nearby,
)

MAPS, HALVES = np.array([0, 0, 0, 1, 1]), np.array([0, 0, 1, 0, 1])


def test_coarse_maps():
    cells, starts = some_cells(1)
    turned = turns(24)[[0, 5, 17]]
    bits = coarse_bits(cells, starts, turned, 3, MAPS, HALVES)
    assert bits.shape == (3, 2, 32)
    for heading, turn in enumerate(turned):
        wanted = np.zeros((2, 32, 64), dtype=bool)
        for layer in range(5):
            picture = image(cells, starts, layer, turn, 3)
            first = 32 * HALVES[layer]
            wanted[MAPS[layer], :, first : first + 32] |= picture
        columns = np.arange(64, dtype=np.uint64)
        found = (bits[heading][..., None] >> columns) & np.uint64(1)
        np.testing.assert_array_equal(found.astype(bool), wanted)
        counts = count_bits(bits[heading : heading + 1])[0]
        assert counts.tolist() == wanted.sum(axis=(1, 2)).tolist()


def test_first_search():
    # More numbers than are handled side by side.
    query, places = some_cells(2), [some_cells(k) for k in range(20, 30)]
    turned = turns(3)
    shifts = np.array([(r, c) for r in range(3) for c in range(3)])
    bits = coarse_bits(*query, turned, 3, MAPS, HALVES)
    maps = np.concatenate(
        [coarse_bits(*p, turned[:1], 3, MAPS, HALVES) for p in places]
    )
    counts, found = best_overlaps(
        shifted_columns(bits, 1), in_lanes(maps, 1), shifts
    )
    assert counts.shape == (16, 3)
    assert not counts[10:].any()
    for d, place in enumerate(places):
        for h, turn in enumerate(turned):
            totals = []
            for right, up in (shifts - 1).tolist():
                total = 0
                for group in ([0, 1], [2], [3], [4]):
                    a, b = (
                        np.logical_or.reduce(
                            [image(*scan, one, t, 3) for one in group]
                        )
                        for scan, t in ((query, turn), (place, turned[0]))
                    )
                    # The rows of the map were shifted in the opposite
                    # direction.
                    common = shifted(a, right, up) & b
                    total += (1 if group[0] < 3 else 2) * common.sum()
                totals.append(total)
            assert counts[d, h] == max(totals)
            assert found[d, h] == totals.index(max(totals))


def test_second_search():
    query, place = some_cells(5), some_cells(6)
    turned, weights = turns(8), np.array([1, 1, 4, 2])
    maps, halves = np.array([0, 0, 1, 2, 3]), np.zeros(5, np.int64)
    bits = coarse_bits(*query, turned, 2, maps, halves)
    padded = np.pad(
        coarse_bits(*place, turned[:1], 2, maps, halves),
        ((0, 0), (0, 0), (3, 3)),
    )
    counts, poses = overlaps_nearby(
        bits,
        padded,
        np.array([[0, 7, 2, -1]]),
        np.array([1, 1]),
    )
    best = (-1, None)
    for heading in (6, 7, 0):
        for right in (1, 2, 3):
            for up in (-2, -1, 0):
                total = 0
                for group, weight in zip(
                    ([0, 1], [2], [3], [4]), weights, strict=True
                ):
                    a, b = (
                        np.logical_or.reduce(
                            [image(*scan, one, t, 2) for one in group]
                        )
                        for scan, t in (
                            (query, turned[heading]),
                            (place, turned[0]),
                        )
                    )
                    total += weight * (shifted(a, right, up) & b).sum()
                if total > best[0]:
                    best = (total, [heading, right, up])
    assert (counts[0], poses[0].tolist()) == best


def wide_layers(place):
    """Returns a place's layers (5, 256, 256) with all cells' neighbours."""
    wide = np.zeros((5, 258, 258), dtype=bool)
    for layer in range(5):
        picture = image(*place, layer, (1 << 14, 0), 0)
        for i in range(3):
            for j in range(3):
                wide[layer, i : i + 256, j : j + 256] |= picture
    return wide[:, 1:-1, 1:-1]


def count_common(query, wide, turn, right, up):
    """Returns how many of a query's cells meet each of a place's layers."""
    counts = []
    c, s = turn.tolist()
    for layer in range(5):
        first, last = query[1][layer : layer + 2]
        u, v = (
            2 * k - 255 for k in np.divmod(query[0][first:last], 256, dtype=int)
        )
        row = (c * u - s * v + ((right + 256) << 14)) // 2**15
        column = (s * u + c * v + ((up + 256) << 14)) // 2**15
        shown = (row >= 0) & (row < 256) & (column >= 0) & (column < 256)
        counts.append(int(wide[layer, row[shown], column[shown]].sum()))
    return counts


def climb_slowly(query, wide, weights, turned, pose, steps):
    """Climbs as `climb` is described, pose by pose."""
    counts = {}

    def total(*pose):
        if pose not in counts:
            turn, right, up = pose
            counts[pose] = count_common(query, wide, turned[turn], right, up)
        return int(weights @ counts[pose])

    best = tuple(pose)
    for step, shift in steps:
        while True:
            row, column = best[1:]
            near = [
                ((best[0] + dt) % len(turned), row + dr, column + dc)
                for dt in (-step, 0, step)
                for dr in (-shift, 0, shift)
                for dc in (-shift, 0, shift)
            ]
            better = max(near, key=lambda one: total(*one))
            if total(*better) == total(*best):
                break
            best = better
    return [*best, *counts[best]]


# Some begin where half of a query, or nearly all of it, is beside the map.
@pytest.mark.parametrize(
    "start",
    [(40, 8, -8), (0, 0, 0), (287, -250, 120), (100, 480, -470), (9, -900, 0)],
)
@pytest.mark.parametrize("steps", [[(2, 4), (1, 2)], [(3, 12), (1, 6)]])
def test_last_search_climbs_by_cells_that_meet_neighbours(start, steps):
    query = some_cells(7, (500, 400, 300, 40, 200))
    place = some_cells(8, (900, 800, 700, 60, 300))
    turned, weights = turns(288), np.array([3, 3, 2, 60, 5])
    found = climb(
        *query,
        fine_bits(*place),
        weights,
        turned,
        np.array(start),
        np.array(steps),
    )
    assert found.tolist() == climb_slowly(
        query, wide_layers(place), weights, turned, start, steps
    )


def test_last_search_of_full_layers():
    full = (
        np.arange(256 * 256).astype(np.uint16),
        65536 * np.array([0, 1, 1, 1, 1, 1]),
    )
    found = climb(
        *full,
        fine_bits(*full),
        np.ones(5, np.int64),
        turns(4),
        np.zeros(3, np.int64),
        np.array([[1, 2]]),
    )
    assert found.tolist() == [0, 0, 0, 65536, 0, 0, 0, 0]


@pytest.mark.parametrize("share", [0.0, 0.5, 1.0])
def test_full_maps(share):
    # The sums have every carry, up to the greatest possible count.
    rng = np.random.default_rng(5)

    def maps(*shape):
        bits = rng.random((*shape, 64)) < share
        return np.packbits(bits, -1).view(np.uint64)[..., 0]

    def common(a, b):
        return [int(n).bit_count() for n in (a & b).ravel()]

    query, places = maps(1, 1, 2, 32), maps(9, 2, 32)
    counts, _ = best_overlaps(
        query, in_lanes(places, 0), np.zeros((1, 2), np.int64)
    )
    for count, place in zip(counts[:9, 0], places, strict=True):
        first, second = (common(query[0, 0, s], place[s]) for s in (0, 1))
        assert count == sum(first) + 2 * sum(second)

    query, places = maps(1, 4, 64), maps(3, 4, 64)
    starts = np.array([[d, 0, 0, 0] for d in range(3)])
    counts, _ = overlaps_nearby(query, places, starts, np.array([0, 0]))
    for count, place in zip(counts, places, strict=True):
        totals = [sum(common(query[0, s], place[s])) for s in range(4)]
        assert count == np.dot(totals, [1, 1, 4, 2])


def test_words_of_all_bits():
    ones = np.full((1, 1, 3), 2**64 - 1, np.uint64)
    assert count_bits(ones).tolist() == [[192]]
