"""The counts of layered overlap, by brute force."""

from helpers.layered_scans import image, shifted, some_cells
import numpy as np
import pytest

from evaluation.methods.layered_overlap import (
    best_overlaps,
    climb,
    coarse_maps,
    turns,
)

MAPS = np.array([0, 0, 1, 2, 3])
GROUPS = ([0, 1], [2], [3], [4])


@pytest.mark.parametrize("halvings", [2, 3])
def test_coarse_maps(halvings):
    cells, starts = some_cells(1)
    turned = turns(24)[[0, 5, 17]]
    bits, counts = coarse_maps(cells, starts, turned, halvings, MAPS)
    rows = 256 >> halvings
    assert bits.shape == (3, 4, rows)
    for heading, turn in enumerate(turned):
        wanted = np.zeros((4, rows, 64), dtype=bool)
        for layer in range(5):
            picture = image(cells, starts, layer, turn, halvings)
            wanted[MAPS[layer], :, :rows] |= picture
        columns = np.arange(64, dtype=np.uint64)
        found = (bits[heading][..., None] >> columns) & np.uint64(1)
        np.testing.assert_array_equal(found.astype(bool), wanted)
        assert counts[heading].tolist() == wanted.sum(axis=(1, 2)).tolist()


# Some shifts lead beyond the rows that are added to a place.
@pytest.mark.parametrize("halvings", [2, 3])
@pytest.mark.parametrize(
    "start", [[1, 0, 0, 0], [0, 7, 2, -1], [2, 3, -3, 5], [1, 4, 4, 0]]
)
def test_best_overlaps(halvings, start):
    query = some_cells(5)
    places = [some_cells(k) for k in range(20, 23)]
    turned = turns(8)
    weights = np.array([1, 1, 4, 2])
    moves = np.array(
        [
            (turn, right, up)
            for turn in (-1, 0, 1)
            for right in (-2, 0, 1)
            for up in (-1, 0, 1)
        ]
    )
    bits, _ = coarse_maps(*query, turned, halvings, MAPS)
    of_places = [
        coarse_maps(*place, turned[:1], halvings, MAPS)[0] for place in places
    ]
    counts, poses = best_overlaps(
        bits,
        np.pad(np.concatenate(of_places), ((0, 0), (0, 0), (3, 3))),
        weights,
        np.array([start]),
        moves,
    )
    best = (-1, None)
    for move in moves:
        heading, right, up = (start[1:] + move).tolist()
        if abs(right) > 3:
            continue
        total = 0
        for group, weight in zip(GROUPS, weights, strict=True):
            a, b = (
                np.logical_or.reduce(
                    [image(*scan, one, turn, halvings) for one in group]
                )
                for scan, turn in (
                    (query, turned[heading % 8]),
                    (places[start[0]], turned[0]),
                )
            )
            total += weight * (shifted(a, right, up) & b).sum()
        if total > best[0]:
            best = (total, [heading % 8, right, up])
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
    turned = turns(288)
    weights = np.array([3, 3, 2, 60, 5])
    found = climb(
        *query,
        *place,
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
        *full,
        np.ones(5, np.int64),
        turns(4),
        np.zeros(3, np.int64),
        np.array([[1, 2]]),
    )
    assert found.tolist() == [0, 0, 0, 65536, 0, 0, 0, 0]


@pytest.mark.parametrize("share", [0.0, 0.5, 1.0])
def test_full_maps(share):
    rng = np.random.default_rng(5)

    def maps(number):
        bits = rng.random((number, 4, 64, 64)) < share
        return np.packbits(bits, -1).view(np.uint64)[..., 0]

    query, places = maps(1), maps(3)
    starts = np.array([[d, 0, 0, 0] for d in range(3)])
    weights = np.array([1, 1, 4, 2])
    counts, _ = best_overlaps(
        query, places, weights, starts, np.zeros((1, 3), np.int64)
    )
    for count, place in zip(counts, places, strict=True):
        common = [
            [int(word).bit_count() for word in row] for row in query[0] & place
        ]
        assert count == np.sum(common, axis=1) @ weights
