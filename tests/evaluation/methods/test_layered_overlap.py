"""Layered overlap: what it counts, by brute force, and what it finds."""

import math

import numpy as np
import pytest

from evaluation.methods import make_method
from evaluation.methods.layered_overlap import LayeredOverlap, LayeredScan
from evaluation.methods.overlap_bits import (
    coarse_bits,
    count_bits,
    fine_bits,
    shifted_columns,
    turns,
)
from evaluation.methods.overlap_layers import layer_cells
from evaluation.methods.overlap_search import (
    best_overlaps,
    climb,
    overlaps_nearby,
)

MAPS, HALVES = np.array([0, 0, 0, 1, 1]), np.array([0, 0, 1, 0, 1])


def method(**parameters) -> LayeredOverlap:
    return make_method("layered-overlap", parameters)


def some_cells(seed, sizes=(60, 50, 40, 9, 20)):
    """Returns a scan's cells by lot, layer by layer."""
    rng = np.random.default_rng(seed)
    cells = [
        np.sort(rng.choice(256 * 256, size, replace=False)) for size in sizes
    ]
    starts = np.concatenate([[0], np.cumsum(sizes)])
    return np.concatenate(cells).astype(np.uint16), starts


def town(seed, number=45):
    """Returns walls, poles and ground around a sensor at 1.6 m, (N, 3)."""
    rng = np.random.default_rng([seed, 7])
    parts = [np.zeros((0, 3))]
    for _ in range(number):
        centre = rng.uniform(-55.0, 55.0, 2)
        if np.hypot(*centre) < 5.0:
            continue
        length = rng.uniform(0.2, 14.0, 2) * [1.0, 0.02]
        turn = rng.choice([0.0, 0.5 * math.pi, 0.7])
        box = rng.uniform(-0.5, 0.5, (400, 2)) * length @ matrix(turn)[:2, :2].T
        height = rng.uniform(0.0, rng.choice([1.0, 3.0, 12.0]), (400, 1))
        parts.append(np.hstack([box + centre, height - 1.6]))
    for _ in range(25):
        centre = rng.uniform(-40.0, 40.0, 2)
        z = np.linspace(-1.6, 3.0, 40)
        parts.append(np.column_stack([np.tile(centre, (40, 1)), z]))
    # Ground in each ring of each sector in which it is sought.
    r, turn = np.meshgrid(np.arange(0.5, 90.0), np.arange(0.5, 360.0))
    x, y = (r * f(np.radians(turn)) for f in (np.cos, np.sin))
    parts.append(np.stack([x, y, np.full(x.shape, -1.6)], -1).reshape(-1, 3))
    return np.concatenate(parts)


def matrix(yaw):
    c, s = math.cos(yaw), math.sin(yaw)
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])


def seen_from(points, yaw, x, y):
    """Returns points in the frame of a sensor with that pose."""
    return (points - [x, y, 0.0]) @ matrix(yaw)


# By brute force: no words, no bits, no compiled loops.


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


def image(cells, starts, layer, turn, halvings):
    """Returns a layer as a turned picture (n, n) of bool."""
    n = 256 >> halvings
    picture = np.zeros((n, n), dtype=bool)
    for number in cells[starts[layer] : starts[layer + 1]].tolist():
        u, v = 2 * (number // 256) + 1 - 256, 2 * (number % 256) + 1 - 256
        unit = 2 * 2**14 << halvings
        row = (int(turn[0]) * u - int(turn[1]) * v + (256 << 14)) // unit
        column = (int(turn[1]) * u + int(turn[0]) * v + (256 << 14)) // unit
        if 0 <= row < n and 0 <= column < n:
            picture[row, column] = True
    return picture


def shifted(picture, right, up):
    n = len(picture)
    result = np.zeros_like(picture)
    for row, column in np.argwhere(picture).tolist():
        if 0 <= row + right < n and 0 <= column + up < n:
            result[row + right, column + up] = True
    return result


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


class TestCounts:
    def test_coarse_maps(self):
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

    def test_first_search(self):
        query, places = some_cells(2), [some_cells(3), some_cells(4)]
        turned, weights = turns(6), np.array([1, 2])
        shifts = np.array([(r, c) for r in range(3) for c in range(3)])
        bits = coarse_bits(*query, turned, 3, MAPS, HALVES)
        maps = np.concatenate(
            [coarse_bits(*p, turned[:1], 3, MAPS, HALVES) for p in places]
        )
        counts, found = best_overlaps(
            shifted_columns(bits, 1),
            np.pad(maps, ((0, 0), (0, 0), (1, 1))),
            weights,
            shifts,
        )
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
                        # The map's rows were shifted the other way round.
                        common = shifted(a, right, up) & b
                        total += (1 if group[0] < 3 else 2) * common.sum()
                    totals.append(total)
                assert counts[d, h] == max(totals)
                assert found[d, h] == totals.index(max(totals))

    def test_second_search(self):
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
            weights,
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

    def test_third_search_counts_cells_that_meet_neighbours(self):
        query, place = some_cells(7), some_cells(8, (900, 800, 700, 60, 300))
        turned = turns(288)
        found = climb(
            *query,
            fine_bits(*place),
            np.array([3, 3, 2, 60, 5]),
            turned,
            np.array([40, 8, -8]),
            np.array([[2, 4], [1, 2]]),
        )
        heading, right, up = found[:3].tolist()
        for layer in range(5):
            wide = np.zeros((258, 258), dtype=bool)
            picture = image(*place, layer, turned[0], 0)
            for i in range(3):
                for j in range(3):
                    wide[i : i + 256, j : j + 256] |= picture
            wide = wide[1:-1, 1:-1]
            c, s = turned[heading].tolist()
            count = 0
            first, last = query[1][layer : layer + 2]
            for number in query[0][first:last].tolist():
                u, v = 2 * (number // 256) - 255, 2 * (number % 256) - 255
                row = (c * u - s * v + ((right + 256) << 14)) // 2**15
                column = (s * u + c * v + ((up + 256) << 14)) // 2**15
                if 0 <= row < 256 and 0 <= column < 256:
                    count += wide[row, column]
            assert found[3 + layer] == count

    def test_words_of_all_bits(self):
        ones = np.full((1, 1, 3), 2**64 - 1, np.uint64)
        assert count_bits(ones).tolist() == [[192]]


class TestFinding:
    @pytest.mark.parametrize(
        ("yaw_deg", "x", "y"),
        [(0.0, 0.0, 0.0), (180.0, 2.0, 3.5), (77.0, -3.0, 1.0)],
    )
    def test_place_and_pose(self, yaw_deg, x, y):
        chosen = method()
        places = [chosen.describe(town(seed)) for seed in range(6)]
        database = chosen.build_database(places)
        yaw = math.radians(yaw_deg)
        query = chosen.describe(seen_from(town(4), yaw, x, y))
        scores = chosen.score(query, database)
        assert np.nanargmax(scores) == 4
        X_PQ = chosen.relative_pose(query, database, 4)
        np.testing.assert_allclose(X_PQ[:2, 3], [x, y], atol=0.5)
        error = X_PQ[:3, :3].T @ matrix(yaw)
        assert abs(math.degrees(math.atan2(error[1, 0], error[0, 0]))) < 1.5

    def test_half_of_it_is_gone(self):
        chosen = method()
        everything = town(2)
        rng = np.random.default_rng(1)
        gone = rng.choice(45, 22, replace=False)
        kept = ~np.isin(np.arange(len(everything)) // 400, gone)
        database = chosen.build_database(
            [chosen.describe(town(seed)) for seed in range(6)]
        )
        query = chosen.describe(seen_from(everything[kept], 2.0, 1.0, 2.0))
        assert np.nanargmax(chosen.score(query, database)) == 2

    def test_turned_queries_score_alike(self):
        chosen = method()
        database = chosen.build_database([chosen.describe(town(3))])
        scores = [
            chosen.score(
                chosen.describe(seen_from(town(3), math.radians(a), 0.0, 0.0)),
                database,
            )[0]
            for a in range(0, 360, 45)
        ]
        assert min(scores) > 0.75 * max(scores)

    def test_a_place_too_far_away_is_none(self):
        near, far = (
            method(radius=radius).score(
                method().describe(seen_from(town(3), 0.0, 6.0, 0.0)),
                method().build_database([method().describe(town(3))]),
            )[0]
            for radius in (8.5, 5.0)
        )
        assert near > 0.3
        assert far == 0.0

    def test_the_search_passes_over_what_is_not_alike(self):
        chosen = method(candidates=2)
        database = chosen.build_database(
            [chosen.describe(town(seed)) for seed in range(5)]
        )
        query = chosen.describe(town(1))
        some = chosen.score(query, database)
        every = chosen.score(query, database, exhaustive=True)
        assert np.isfinite(some).sum() == 2
        assert np.isfinite(every).all()
        assert np.nanargmax(some) == np.nanargmax(every) == 1


class TestLittleToSee:
    ground = np.array(
        [[x, y, -1.6] for x in range(-9, 10) for y in range(-9, 10)], float
    )

    @pytest.mark.parametrize(
        "points", [np.zeros((0, 3)), ground], ids=["none", "ground"]
    )
    def test_nothing(self, points):
        chosen = method()
        nothing, something = chosen.describe(points), chosen.describe(town(1))
        assert len(nothing.cells) == 0
        database = chosen.build_database([nothing, something])
        assert np.isnan(chosen.score(nothing, database)).all()
        scores = chosen.score(something, database)
        assert np.isnan(scores[0])
        assert scores[1] > 0.5
        assert chosen.relative_pose(something, database, 0) is None
        assert chosen.relative_pose(nothing, database, 1) is None

    def test_one_point(self):
        chosen = method()
        one = chosen.describe(np.array([[12.3, -4.5, 6.0]]))
        database = chosen.build_database([one])
        # It coincides with itself, and says little.
        assert 0.0 < chosen.score(one, database)[0] < 0.3

    def test_layers_that_do_not_count(self):
        chosen = method(weights=(0, 0, 0, 0, 0), least_cells=0)
        scan = LayeredScan(*some_cells(1))
        database = chosen.build_database([scan])
        assert chosen.score(scan, database).tolist() == [0.0]


def test_same_bytes_for_the_order_of_points():
    points = town(5)
    other = points[np.random.default_rng(0).permutation(len(points))]
    one, two = (method().describe(cloud) for cloud in (points, other))
    assert one.cells.tobytes() == two.cells.tobytes()
    assert one.starts.tobytes() == two.starts.tobytes()
