import math

import numpy as np
import pytest

from evaluation.base import InputError, poses
from evaluation.methods import make_method
from evaluation.recognition import write_scores

GROUND = -1.6
SIZE = 40.0


def method(**parameters):
    return make_method("btc", parameters)


def make_scene(seed, noise=0.0):
    """Returns ground, posts of many heights and a few houses, (N, 3)."""
    rng = np.random.default_rng([seed, 71])
    grid = np.arange(-SIZE, SIZE, 0.5)
    x, y = (values.ravel() for values in np.meshgrid(grid, grid))
    parts = [np.stack([x, y, np.full(len(x), GROUND)], axis=1)]
    for _ in range(60):
        foot = rng.uniform(-SIZE, SIZE, 2)
        height = rng.uniform(1.2, 3.9)
        layers = np.arange(0.02, height, 0.03)
        around = rng.uniform(0.0, 2.0 * math.pi, len(layers))
        parts.append(
            np.stack(
                [
                    foot[0] + 0.1 * np.cos(around),
                    foot[1] + 0.1 * np.sin(around),
                    GROUND + layers,
                ],
                axis=1,
            )
        )
    for _ in range(4):
        corner = rng.uniform(-SIZE, SIZE, 2)
        width = rng.uniform(5.0, 12.0)
        u, z = np.meshgrid(np.arange(0, width, 0.25), np.arange(0, 6, 0.25))
        wall = np.zeros((u.size, 3))
        wall[:, rng.integers(2)] = u.ravel()
        wall[:, 2] = GROUND + z.ravel()
        wall[:, :2] += corner
        parts.append(wall)
    points = np.concatenate(parts)
    return points + rng.normal(0.0, noise, points.shape)


def motion(yaw_deg, offset, tilt=0.0):
    half = math.radians(yaw_deg) / 2.0
    turn = [0.0, 0.0, math.sin(half), math.cos(half)]
    lean = [math.sin(tilt / 2.0), 0.0, 0.0, math.cos(tilt / 2.0)]
    R = poses.rotation_from_quaternion(np.array([lean, turn]))
    return poses.make_pose(R[0] @ R[1], np.array(offset, float))


def seen_from(X_PQ, points):
    """Returns points of P in the frame Q."""
    return poses.transform(poses.inverse(X_PQ), points)


@pytest.fixture(scope="module")
def scenes():
    return [make_scene(seed) for seed in range(4)]


@pytest.fixture(scope="module")
def places(scenes):
    return [method().describe(points) for points in scenes]


@pytest.fixture(scope="module")
def database(places):
    return method().build_database(places)


class TestMovedCopies:
    def check(self, X_PQ, points, database, place, lowest, **parameters):
        """A moved copy scores highest at its place, and its motion is found."""
        query = method(**parameters).describe(points)
        scores = method().score(query, database)
        assert np.nanargmax(scores) == place
        assert scores[place] >= lowest
        others = np.delete(scores, place)
        assert (np.isnan(others) | (others < 0.8 * scores[place])).all()
        found = method().relative_pose(query, database, place)
        error = poses.inverse(X_PQ) @ found
        assert np.linalg.norm(error[:3, 3]) < 0.3
        assert math.acos(min(1.0, (np.trace(error[:3, :3]) - 1) / 2)) < 0.03

    def test_itself(self, scenes, database):
        for place, points in enumerate(scenes):
            self.check(np.eye(4), points, database, place, 1.0)

    def test_moved_by_whole_voxels(self, scenes, database):
        X_PQ = motion(0.0, [6.0, -4.0, 0.0])
        self.check(X_PQ, seen_from(X_PQ, scenes[1]), database, 1, 1.0)

    @pytest.mark.parametrize("yaw_deg", [-155.0, -90.0, 30.0, 180.0])
    def test_moved_and_turned(self, yaw_deg, scenes, database):
        X_PQ = motion(yaw_deg, [3.3, -1.7, 0.4])
        self.check(X_PQ, seen_from(X_PQ, scenes[2]), database, 2, 0.9)

    def test_leaning(self, scenes, database):
        """With the axes of the public program, keypoints lean, too."""
        X_PQ = motion(20.0, [1.3, 0.8, 0.0], tilt=0.15)
        points = seen_from(X_PQ, scenes[0])
        self.check(X_PQ, points, database, 0, 0.9, image_axes="orthogonal")
        scores = method().score(method().describe(points), database)
        assert np.nanargmax(scores) == 0
        assert scores[0] < 0.5

    def test_noise(self, database):
        X_PQ = motion(75.0, [-2.3, 1.1, 0.0])
        points = seen_from(X_PQ, make_scene(3, noise=0.02))
        self.check(X_PQ, points, database, 3, 0.85)


class TestSmallClouds:
    @pytest.mark.parametrize(
        "points",
        [
            np.empty((0, 3)),
            np.zeros((1, 3)),
            np.ones((20, 3)),
            np.outer(np.arange(30.0), [1.0, 2.0, 0.1]),
            make_scene(0)[::97],
        ],
        ids=["empty", "one", "equal", "line", "sparse"],
    )
    def test_has_no_score(self, points, places, database):
        description = method().describe(points)
        assert np.isnan(method().score(description, database)).all()
        both = method().build_database([description, places[0]])
        assert np.isnan(method().score(description, both)).all()
        assert method().relative_pose(places[0], both, 0) is None
        assert method().score(places[0], both)[1] == 1.0

    def test_posts_without_ground(self):
        # No two voxels share a plane, so the plane is level and through the
        # first point. Bits start 1 m below it.
        posts = make_scene(0)
        posts = posts[posts[:, 2] > GROUND + 1e-6]
        first = np.array([[0.0, 0.0, GROUND]])
        found = method(max_sparse_points=10**6).describe(
            np.concatenate([first, posts])
        )
        assert len(found.planes) == 0
        assert len(found.triangles) > 50
        np.testing.assert_allclose(found.triangles.positions[..., 2], GROUND)
        # Nothing is lower than the ground, so the lowest ten bits are free.
        assert (found.triangles.heights & 0x3FF == 0).all()
        database = method().build_database([found])
        assert np.isnan(method().score(found, database)).all()


class TestDescription:
    def test_same_again(self, scenes, places):
        again = method().describe(scenes[0].copy())
        for part in ("planes", "triangles"):
            first, second = getattr(places[0], part), getattr(again, part)
            for name in vars(first):
                np.testing.assert_array_equal(
                    getattr(first, name), getattr(second, name)
                )

    def test_leaves_the_points_alone(self, scenes):
        points = scenes[0].copy()
        method().describe(points)
        np.testing.assert_array_equal(points, scenes[0])

    def test_submaps(self):
        assert method().scans_per_place == 10


class TestParameters:
    @pytest.mark.parametrize(
        ("parameters", "said"),
        [
            ({"voxel_size": 0.0}, "btc: voxel_size: "),
            ({"num_layers": 63}, "btc: num_layers: "),
            ({"height_range": (4.0, -1.0)}, "btc: height_range: "),
            ({"side_range": (2.0, 2.0)}, "btc: side_range: "),
            ({"cells": 3}, "btc: no parameter 'cells'"),
        ],
    )
    def test_refused(self, parameters, said):
        with pytest.raises(InputError, match=said):
            method(**parameters)

    def test_other_limits_are_taken(self):
        assert method(side_range=(3.0, 3.1)).config.side_range == (3.0, 3.1)


def test_scores_of_folders(tmp_path, scenes):
    for folder, seeds in (("places", (0, 1)), ("queries", (1, 0))):
        (tmp_path / folder).mkdir()
        for number, seed in enumerate(seeds):
            np.save(tmp_path / folder / f"{number}.npy", scenes[seed])
    np.save(tmp_path / "queries" / "2.npy", scenes[0][:500])
    write_scores(
        method(), tmp_path / "places", tmp_path / "queries", tmp_path / "s.csv"
    )
    rows = [line.split(",") for line in (tmp_path / "s.csv").open()][1:]
    scores = {(query, place): text.strip() for query, place, text in rows}
    assert scores["0", "1"] == scores["1", "0"] == "1.0"
    assert scores["2", "0"] == scores["2", "1"] == ""
