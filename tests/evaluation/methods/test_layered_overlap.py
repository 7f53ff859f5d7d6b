"""Layered overlap: its counts by brute force, and its poses."""

import math

from helpers.layered_scans import matrix, seen_from, town
import numpy as np
import pytest

from evaluation.methods import LayeredOverlap, make_method


def method(**parameters) -> LayeredOverlap:
    return make_method("layered-overlap", parameters)


# By brute force: without words of bits, without compiled loops.


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
        np.testing.assert_array_equal(X_PQ[2], [0.0, 0.0, 1.0, 0.0])
        np.testing.assert_array_equal(X_PQ[:, 2], [0.0, 0.0, 1.0, 0.0])

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


def test_same_bytes_for_the_order_of_points():
    points = town(5)
    other = points[np.random.default_rng(0).permutation(len(points))]
    one, two = (method().describe(cloud) for cloud in (points, other))
    assert one.cells.tobytes() == two.cells.tobytes()
    assert one.starts.tobytes() == two.starts.tobytes()
