"""Layered overlap: its counts by brute force, and its poses."""

import itertools
import math

from helpers.layered_scans import image, some_cells, town
import numpy as np
import pytest

from evaluation.methods import LayeredOverlap, layered_overlap, make_method
from evaluation.methods.layered_overlap import (
    LayeredScan,
    climb,
    layer_cells,
    turns,
)


def method(**parameters) -> LayeredOverlap:
    return make_method("layered-overlap", parameters)


# By brute force: without words of bits, without compiled loops.


def cells_by_layers(points, height=1.6):
    """Returns five sets of (row, column), of a scene on flat ground."""
    of_cell = {}
    for x, y, z in points:
        if -64.0 <= x < 64.0 and -64.0 <= y < 64.0:
            key = (int((x + 64.0) // 0.5), int((y + 64.0) // 0.5))
            of_cell.setdefault(key, []).append(z + height)
    layers = [set() for _ in range(5)]
    for key, z in of_cell.items():
        z = np.array(z)
        for layer, (low, high) in enumerate(
            [(0.35, 1.5), (1.5, 4.0), (4.0, np.inf)]
        ):
            if ((z > low) & (z <= high)).any():
                layers[layer].add(key)
        if z.max() <= 0.35 and 0.08 <= z.max() - z.min() <= 0.30:
            layers[4].add(key)
    tall = {key for key, z in of_cell.items() if max(z) >= 2.0}
    for row, column in tall:
        near = [
            (i, j)
            for i, j in tall
            if abs(i - row) <= 3 and abs(j - column) <= 3
        ]
        if len(near) <= 4 and all(
            abs(i - row) <= 1 and abs(j - column) <= 1 for i, j in near
        ):
            layers[3].add((row, column))
    return layers


class TestLayers:
    def test_equal_to_brute_force(self):
        points = town(1)
        cells, starts = layer_cells(points, 1.6, 0.5, 1)
        for layer, wanted in enumerate(cells_by_layers(points)):
            found = cells[starts[layer] : starts[layer + 1]].tolist()
            assert {divmod(number, 256) for number in found} == wanted
            assert found == sorted(set(found))
        assert (np.diff(starts) > 0).all()

    def test_a_kerb_is_a_small_step(self):
        flat = np.array([[10.2, 3.2, -1.6], [10.3, 3.3, -1.6]])
        for step, layer in ((0.05, None), (0.15, 4), (0.5, 0)):
            points = flat.copy()
            points[1, 2] += step
            _, starts = layer_cells(points, 1.6, 0.5, 1)
            wanted = [0] * 5
            if layer is not None:
                wanted[layer] = 1
            assert np.diff(starts).tolist() == wanted

    # A layer ends with its upper limit, a pole and a kerb begin with theirs.
    @pytest.mark.parametrize(
        ("limit", "until", "beyond"),
        [
            (0.08, [4], [4]),
            (0.30, [4], []),
            (0.35, [], [0]),
            (1.5, [0], [1]),
            (2.0, [1, 3], [1, 3]),
            (4.0, [1, 3], [2, 3]),
        ],
    )
    def test_limits_of_height(self, limit, until, beyond):
        below, above = np.nextafter(limit, [0.0, 9.0])
        before = {0.08: [], 2.0: [1]}.get(limit, until)
        for z, layers in ((below, before), (limit, until), (above, beyond)):
            points = np.array([[10.2, 3.2, 0.0], [10.2, 3.2, z]])
            _, starts = layer_cells(points, 0.0, 0.5, 1)
            assert np.flatnonzero(np.diff(starts)).tolist() == layers

    def test_the_ground_is_followed_uphill(self):
        rng = np.random.default_rng(3)
        xy = rng.uniform(-60.0, 60.0, (20000, 2))
        slope = np.column_stack([xy, 0.08 * xy[:, 0] - 1.6])
        _, starts = layer_cells(slope, 1.6, 0.5, 1)
        # A ring is 2 m long: within it the slope alone rises by 0.16 m.
        assert starts[4] < 0.01 * len(np.unique((xy // 0.5), axis=0))

    def test_points_that_fill_a_cell(self):
        points = np.array([[10.2, 3.2, 8.0]] * 2 + [[20.2, 3.2, 8.0]])
        for least, number in ((1, 2), (2, 1), (3, 0)):
            _, starts = layer_cells(points, 1.6, 0.5, least)
            assert starts[3] - starts[2] == number


def pictures(scan, turn, halvings):
    """Returns the four coarse maps of a scan, (4, n, n) of bool."""
    low, middle, *others = (
        image(scan.cells, scan.starts, layer, turn, halvings)
        for layer in range(5)
    )
    return np.array([low | middle, *others])


def look_near(query, place, weights, start, moves):
    """Returns how much the best pose is above chance, and that pose."""
    best = (-1, None)
    size = place.shape[1]
    for heading, row, column in np.array(start) + moves:
        turned = query[heading % len(query)]
        wide = np.pad(turned, ((0, 0), (9, 9), (9, 9)))
        shifted = wide[:, 9 - row :, 9 - column :][:, :size, :size]
        total = weights @ (shifted & place).sum(axis=(1, 2))
        if total > best[0]:
            best = total, (heading % len(query), row, column)
    product = query[best[1][0]].sum(axis=(1, 2)) * place.sum(axis=(1, 2))
    variance = weights**2 @ product / size**2 + 1.0
    return (best[0] - weights @ product / size**2) / math.sqrt(variance), best[
        1
    ]


@pytest.mark.parametrize("seed", range(5))
def test_search_by_brute_force(seed):
    query, *places = (
        LayeredScan(*some_cells([seed, k], np.roll([9, 90, 40, 60, 20], k)))
        for k in range(5)
    )
    # 15 deg and 4 m; all shifts by two cells at most, but for corners.
    shifts = [*itertools.product(range(-2, 3), repeat=2)]
    moves = [(0, r, c) for r, c in shifts if abs(r) + abs(c) < 4]
    turned = [pictures(query, turn, 3) for turn in turns(24)]
    found = []
    for number, place in enumerate(places):
        fixed = pictures(place, (1 << 14, 0), 3)
        weights = np.array([1, 1, 2, 2])
        near = [
            look_near(turned, fixed, weights, (heading, 0, 0), moves)
            for heading in range(24)
        ]
        mean = np.mean([surprise for surprise, _ in near])
        found += [(s - 0.5 * mean, number, pose) for s, pose in near]
    # 5 deg and 2 m, then 2.5 deg.
    turned = [pictures(query, turn, 2) for turn in turns(144)]
    weights = np.array([1, 1, 4, 2])
    scale = [6, 2, 2]
    least = 12
    for moves in (
        [*itertools.product((-2, 0, 2), range(-1, 2), range(-1, 2))],
        [*itertools.product(range(-3, 4), range(-2, 3), range(-2, 3))],
    ):
        starts = sorted(found, key=lambda one: -one[0])[:least]
        found = []
        for _, number, pose in starts:
            fixed = pictures(places[number], (1 << 14, 0), 2)
            surprise, pose = look_near(
                turned, fixed, weights, np.array(pose) * scale, moves
            )
            found.append((surprise, number, pose))
        scale = [1, 1, 1]
        least = 5
    # 2.5 deg and 1 m, then half of that; two places only.
    expected = np.full(len(places), np.nan)
    weights = np.array([3, 3, 2, 60, 5])
    best = {}
    for _, number, pose in sorted(found, key=lambda one: -one[0]):
        best.setdefault(number, np.array(pose) * [2, 8, 8])
    for number, pose in [*best.items()][:2]:
        place = places[number]
        common = climb(
            query.cells,
            query.starts,
            place.cells,
            place.starts,
            weights,
            turns(288),
            pose,
            np.array([(2, 4), (1, 2)]),
        )[3:]
        cells = [weights @ np.diff(one.starts) + 150 for one in (query, place)]
        expected[number] = weights @ common / math.sqrt(math.prod(cells))
    chosen = method(poses=12, refined=5, candidates=2)
    scores = chosen.score(query, chosen.build_database(places))
    np.testing.assert_allclose(scores, expected, rtol=1e-12)


def test_poses_are_those_of_the_score(monkeypatch):
    chosen = make_method("layered-overlap", {})
    query, *scans = (chosen.describe(town(seed)) for seed in (2, 1, 2, 3))
    database = chosen.build_database(scans)
    alone = chosen.relative_poses(query, database, [2, 0, 1])
    chosen.score(query, database)
    # The climbs of the score are not made again.
    monkeypatch.setattr(layered_overlap, "climb", None)
    again = LayeredScan(query.cells.copy(), query.starts.copy())
    found = chosen.relative_poses(again, database, [2, 0, 1])
    np.testing.assert_array_equal(found, alone)
