import math

import numpy as np
import pytest

from evaluation.base import InputError
from evaluation.methods import Method, make_method


def solid(**parameters) -> Method:
    return make_method("solid", parameters)


def at(r, azimuth_deg, elevation_deg):
    """Returns one point at a horizontal distance, (1, 3)."""
    a = math.radians(azimuth_deg)
    z = r * math.tan(math.radians(elevation_deg))
    return np.array([[r * math.cos(a), r * math.sin(a), z]])


def make_scene(seed, number=60):
    """Returns walls around the sensor, (N, 3)."""
    rng = np.random.default_rng([seed, 5])
    boxes = [
        rng.uniform(size=(200, 3)) * rng.uniform(0.5, 12.0, 3)
        + [*rng.uniform(-60.0, 60.0, 2), -1.6]
        for _ in range(number)
    ]
    return np.concatenate(boxes)


def turned(points, angle_deg):
    a = math.radians(angle_deg)
    c, s = math.cos(a), math.sin(a)
    return points @ np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]]).T


def yaw_deg(X):
    return math.degrees(math.atan2(X[1, 0], X[0, 0]))


def score(method, query, place):
    database = method.build_database([method.describe_place(place)])
    return method.score(method.describe(query), database)[0]


class TestDescribe:
    @pytest.mark.parametrize(
        ("r", "azimuth_deg", "range_cell", "azimuth_cell"),
        [
            (5.999, 0.1, 2, 0),
            (6.001, 5.9, 3, 0),
            (41.0, 6.1, 20, 1),
            (41.0, 90.1, 20, 15),
            (41.0, 179.9, 20, 29),
            (41.0, -179.9, 20, 30),
            (79.0, -0.1, 39, 59),
        ],
    )
    def test_cells(self, r, azimuth_deg, range_cell, azimuth_cell):
        descriptor = solid().describe(at(r, azimuth_deg, 3.0))
        expected = np.zeros(40)
        expected[range_cell] = 1.0
        np.testing.assert_array_equal(descriptor.ranges, expected)
        expected = np.zeros(60)
        expected[azimuth_cell] = 1.0
        np.testing.assert_array_equal(descriptor.azimuths, expected)

    def test_azimuth_just_below_a_full_turn(self):
        scan = np.array([[10.0, -1e-300, 0.0]])
        azimuths = solid().describe(scan).azimuths
        assert azimuths.sum() == 1.0
        assert azimuths[0] + azimuths[59] == 1.0

    def test_weights_are_scaled_counts(self):
        # Three of four elevations have 4, 2 and 1 points, the lowest has none.
        config = {"elevations": 4, "lowest_deg": -20.0, "highest_deg": 20.0}
        near = [at(10.0, 1.0 + 30.0 * i, -15.0) for i in range(4)]
        middle = [at(21.0, 1.0 + 30.0 * i, -5.0) for i in range(2)]
        far = [at(41.0, 1.0, 15.0)]
        descriptor = solid(**config).describe(np.vstack(near + middle + far))
        expected = np.zeros(40)
        expected[[5, 10, 20]] = 4 * 4 / 4, 2 * 2 / 4, 1 * 1 / 4
        np.testing.assert_allclose(descriptor.ranges, expected)
        expected = np.zeros(60)
        expected[[0, 5, 10, 15]] = 1.0 + 0.5 + 0.25, 1.0 + 0.5, 1.0, 1.0
        np.testing.assert_allclose(descriptor.azimuths, expected)

    def test_least_count_weighs_nothing(self):
        config = {"elevations": 2, "lowest_deg": -10.0, "highest_deg": 10.0}
        scan = np.vstack(
            [at(10.0, 0.0, 5.0), at(20.0, 0.0, -5.0), at(30.0, 0.0, -5.0)]
        )
        ranges = solid(**config).describe(scan).ranges
        np.testing.assert_array_equal(np.flatnonzero(ranges), [10, 15])
        np.testing.assert_array_equal(ranges[[10, 15]], 1.0)

    def test_equal_counts_all_weigh_one(self):
        config = {"elevations": 2, "lowest_deg": -10.0, "highest_deg": 10.0}
        scan = np.vstack([at(10.0, 0.0, 5.0), at(20.0, 0.0, -5.0)])
        ranges = solid(**config).describe(scan).ranges
        np.testing.assert_array_equal(np.flatnonzero(ranges), [5, 10])
        assert solid(elevations=1).describe(scan).ranges.sum() == 2.0

    def test_outside_of_the_field_of_view_counts_at_its_limit(self):
        limits = [at(30.0, 0.0, -22.4), at(40.0, 0.0, 22.4)]
        beyond = [at(30.0, 0.0, -35.0), at(40.0, 0.0, 35.0)]
        middle = [at(50.0, a, 1.0) for a in (0.0, 10.0, 20.0)]
        inside = solid().describe(np.vstack(limits + middle))
        outside = solid().describe(np.vstack(beyond + middle))
        np.testing.assert_array_equal(inside.ranges, outside.ranges)

    def test_range_limits(self):
        # Distances are in three dimensions, with both limits excluded.
        kept = [[3.001, 0.0, 0.0], [0.0, 79.0, 12.0]]
        dropped = [
            [3.0, 0.0, 0.0],
            [0.0, 2.0, 1.0],
            [80.0, 0.0, 0.0],
            [0.0, 79.0, 13.0],
        ]
        descriptor = solid(elevations=1).describe(np.array(kept + dropped))
        assert descriptor.ranges.sum() == 2.0
        assert descriptor.ranges[1] == descriptor.ranges[39] == 1.0

    def test_voxels_begin_half_a_voxel_below_the_least_coordinates(self):
        # One voxel reaches from 9.5 to 10.5 m, the next one to 11.5 m.
        x = np.array([10.0, 10.4, 10.6, 11.4])
        scan = np.stack([x, np.full(4, 20.0), np.full(4, 7.3)], axis=1)
        thinned = solid()._downsampled_within_range(scan)
        np.testing.assert_allclose(
            thinned, [[10.2, 20.0, 7.3], [11.0, 20.0, 7.3]]
        )

    def test_against_a_plain_loop(self):
        method = solid()
        scan = make_scene(1)
        over_range = np.zeros((40, 32))
        over_azimuth = np.zeros((60, 32))
        for x, y, z in method._downsampled_within_range(scan):
            r = math.sqrt(x * x + y * y)
            row = (math.degrees(math.atan2(z, r)) + 22.5) / (45.0 / 32)
            row = min(max(math.floor(row), 0), 31)
            over_range[math.floor(r / 2.0), row] += 1
            azimuth = math.degrees(math.atan2(y, x))
            over_azimuth[math.floor((azimuth + 360.0) % 360.0 / 6.0), row] += 1
        counts = over_range.sum(axis=0)
        weights = (counts - counts.min()) / (counts.max() - counts.min())
        descriptor = method.describe(scan)
        np.testing.assert_allclose(descriptor.ranges, over_range @ weights)
        np.testing.assert_allclose(descriptor.azimuths, over_azimuth @ weights)


class TestScore:
    def test_is_the_cosine(self):
        method = solid(elevations=1)
        one = np.vstack([at(10.0, 0.0, 0.0), at(20.0, 0.0, 0.0)])
        two = np.vstack([at(10.0, 90.0, 0.0), at(30.0, 0.0, 0.0)])
        other = at(50.0, 0.0, 0.0)
        assert score(method, one, one) == pytest.approx(1.0)
        assert score(method, one, two) == pytest.approx(0.5)
        assert score(method, one, other) == 0.0
        assert score(method, one, at(10.0, 5.0, 0.0)) == pytest.approx(
            math.sqrt(0.5)
        )

    def test_is_symmetric_and_bounded(self):
        method = solid()
        scenes = [make_scene(seed) for seed in range(4)]
        descriptors = [method.describe(scene) for scene in scenes]
        database = method.build_database(descriptors)
        scores = np.array([method.score(d, database) for d in descriptors])
        np.testing.assert_allclose(scores, scores.T)
        np.testing.assert_allclose(np.diagonal(scores), 1.0)
        off_diagonal = scores[~np.eye(4, dtype=bool)]
        assert (off_diagonal > 0.0).all()
        assert (off_diagonal < 0.9999).all()

    def test_does_not_depend_on_heading(self):
        # A right angle maps the voxels onto each other, about the centre of
        # a square whose corners are points.
        scan = make_scene(3)
        corners = [[s * 78.0, t * 78.0, 0.0] for s in (-1, 1) for t in (-1, 1)]
        scan = np.vstack([scan, np.array(corners)])
        method = solid(max_range=120.0)
        assert score(method, turned(scan, 90.0), scan) == pytest.approx(
            1.0, abs=1e-4
        )

    def test_nothing_within_range(self):
        method = solid()
        nothing = np.empty((0, 3))
        near = at(1.0, 0, 0)
        scene = make_scene(1)
        database = method.build_database(
            [method.describe_place(scan) for scan in (nothing, near, scene)]
        )
        scores = method.score(method.describe(scene), database)
        assert np.isnan(scores[:2]).all()
        assert scores[2] == pytest.approx(1.0)
        for scan in (nothing, near):
            query = method.describe(scan)
            assert np.isnan(method.score(query, database)).all()
            assert method.relative_pose(query, database, 2) is None
        query = method.describe(scene)
        assert method.relative_pose(query, database, 0) is None


class TestRelativePose:
    @pytest.mark.parametrize("angle_deg", [0.0, 6.0, 60.0, 174.0, 180.0, 348.0])
    def test_a_known_turn(self, angle_deg):
        method = solid()
        scan = make_scene(7)
        # Seen from a sensor that has turned by the angle to the left.
        query = method.describe(turned(scan, -angle_deg))
        database = method.build_database([method.describe_place(scan)])
        X_PQ = method.relative_pose(query, database, 0)
        difference = (yaw_deg(X_PQ) - angle_deg + 180.0) % 360.0 - 180.0
        assert abs(difference) < 1e-6
        np.testing.assert_array_equal(X_PQ[:3, 3], 0.0)
        np.testing.assert_allclose(
            X_PQ[:3, :3] @ X_PQ[:3, :3].T, np.eye(3), atol=1e-15
        )


class TestConfig:
    @pytest.mark.parametrize(
        ("parameters", "fault"),
        [
            ({"voxel_size": 0.0}, "voxel_size"),
            ({"min_range": 80.0}, "min_range must be below max_range"),
            ({"lowest_deg": 22.5}, "lowest_deg must be below highest_deg"),
            ({"highest_deg": 91.0}, "highest_deg"),
            ({"elevations": 0}, "elevations"),
            ({"rows": 32}, "no parameter 'rows'"),
        ],
    )
    def test_faults(self, parameters, fault):
        with pytest.raises(InputError, match=fault):
            solid(**parameters)

    def test_same_scan_same_bytes(self):
        scan = make_scene(2)
        one, two = (solid().describe(scan.copy()) for _ in range(2))
        assert one.ranges.tobytes() == two.ranges.tobytes()
        assert one.azimuths.tobytes() == two.azimuths.tobytes()
