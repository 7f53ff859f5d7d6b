"""Layered overlap: its counts by brute force, and its poses."""

import math

from helpers.layered_scans import matrix, seen_from, some_cells, town
import numpy as np
import pytest

from evaluation.methods import make_method
from evaluation.methods.layered_overlap import LayeredOverlap, LayeredScan
from evaluation.methods.overlap_maps import layer_cells


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

    def test_poses_of_several_places_at_once(self):
        chosen = method()
        scans = [chosen.describe(town(seed)) for seed in range(4)]
        scans.insert(2, chosen.describe(np.zeros((0, 3))))
        database = chosen.build_database(scans)
        query = chosen.describe(seen_from(town(1), 0.4, 2.0, -1.0))
        places = [4, 1, 2, 0]
        found = chosen.relative_poses(query, database, places)
        assert found[2] is None
        for place, X_PQ in zip(places, found, strict=True):
            alone = chosen.relative_pose(query, database, place)
            assert alone is X_PQ is None or (alone == X_PQ).all()

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
        # A scan of one point coincides with itself, and its score is low.
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
