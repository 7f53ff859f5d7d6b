import numpy as np
import pytest

from evaluation.geometry.nearest import NearestPoints


def walls(rng):
    """Returns points (N, 3) of upright walls and of the ground."""
    along = rng.uniform(-60.0, 60.0, 900)
    wall = np.stack([along, np.where(along > 0.0, 9.0, -7.0)], axis=1)
    upright = np.column_stack([wall, rng.uniform(0.0, 12.0, 900)])
    ground = np.column_stack(
        [rng.uniform(-60.0, 60.0, (700, 2)), np.zeros(700)]
    )
    return np.concatenate([upright, ground])


def line(rng):
    return np.outer(rng.uniform(-9.0, 9.0, 300), [0.0, 1.0, 0.0])


def level(rng):
    return np.column_stack([rng.uniform(-9.0, 9.0, (300, 2)), np.ones(300)])


def lattice(rng):
    steps = np.arange(8.0)
    points = np.stack(np.meshgrid(steps, steps, steps), axis=-1).reshape(-1, 3)
    return rng.permutation(points)


def one(rng):
    return rng.normal(size=(1, 3))


@pytest.mark.parametrize("make", [walls, line, level, lattice, one])
@pytest.mark.parametrize("spread", [0.01, 1.0, 40.0])
def test_against_all_distances(make, spread):
    rng = np.random.default_rng([len(make.__name__), 5])
    cloud = make(rng)
    points = rng.choice(cloud, 200) + spread * rng.normal(size=(200, 3))
    indices, distances = NearestPoints(cloud).find(points)
    expected = np.linalg.norm(points[:, None] - cloud, axis=2)
    np.testing.assert_array_equal(indices, expected.argmin(axis=1))
    np.testing.assert_allclose(distances, expected.min(axis=1), rtol=1e-12)


def test_far_points():
    rng = np.random.default_rng(3)
    cloud = walls(rng)
    points = rng.choice([-4000.0, 0.5, 4000.0], (60, 3))
    indices, _ = NearestPoints(cloud).find(points)
    expected = np.linalg.norm(points[:, None] - cloud, axis=2)
    chosen = expected[np.arange(len(points)), indices]
    np.testing.assert_allclose(chosen, expected.min(axis=1), rtol=1e-12)


def test_only_points_within_the_limit_are_found():
    cloud = np.array([[0.0, 0.0, 0.0], [7.0, 0.0, 3.0]])
    offsets = np.array([0.0, 1.0 - 1e-9, 1.0, 1.0 + 1e-9, 90.0])
    points = np.array([7.0, 0.0, 3.0]) + np.outer(offsets, [0.0, 1.0, 0.0])
    indices, distances = NearestPoints(cloud).find(points, 1.0)
    np.testing.assert_array_equal(indices, [1, 1, 2, 2, 2])
    np.testing.assert_array_equal(distances[:2], offsets[:2])
    assert np.isinf(distances[2:]).all()


def test_points_in_one_place():
    indices, distances = NearestPoints(np.ones((500, 3))).find(
        np.array([[1.0, 1.0, 1.0], [1.0, 3.0, 1.0]])
    )
    assert (indices < 500).all()
    np.testing.assert_array_equal(distances, [0.0, 2.0])


def test_an_empty_cloud_has_no_nearest_point():
    indices, distances = NearestPoints(np.empty((0, 3))).find(np.ones((2, 3)))
    np.testing.assert_array_equal(indices, [0, 0])
    assert np.isinf(distances).all()
    indices, _ = NearestPoints(np.ones((4, 3))).find(np.empty((0, 3)))
    assert len(indices) == 0
