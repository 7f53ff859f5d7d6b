from helpers.towns import make_town, rigid
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from evaluation.alignment import make_surface, register
from evaluation.base import poses
from evaluation.maps import downsample


def surface(points, reach=40.0):
    near = np.hypot(points[:, 0] - 40.0, points[:, 1]) < reach
    return make_surface(downsample(points[near] - [40.0, 0.0, 1.6], 0.7))


@pytest.fixture(scope="module")
def town():
    return surface(make_town())


def difference(X, Y):
    """Returns the distance [m] and the angle [deg] between two poses."""
    E = poses.inverse(X) @ Y
    angle = Rotation.from_matrix(E[:3, :3]).magnitude()
    return np.linalg.norm(E[:3, 3]), np.degrees(angle)


def test_normals_are_those_of_the_eigenvectors():
    rng = np.random.default_rng(4)
    tilt = Rotation.from_rotvec([0.4, -0.7, 0.2]).as_matrix()
    flat = rng.normal(size=(400, 3)) * [20.0, 20.0, 0.01]
    # The cloud is far from the origin, where squares of coordinates would
    # cancel.
    points = flat @ tilt.T + [4e5, -2e5, 50.0]
    found = make_surface(points)
    cosines = np.abs(found.normals @ tilt[:, 2])
    assert cosines.min() > 0.999
    np.testing.assert_allclose(np.linalg.norm(found.normals, axis=1), 1.0)


@pytest.mark.parametrize(
    ("move", "yaw"),
    [
        ((0.0, 0.0, 0.0), 0.0),
        ((2.0, -3.0, 1.0), 4.0),
        ((-5.0, 2.0, -1.0), -6.0),
    ],
)
def test_finds_back_from_a_rough_guess(town, move, yaw):
    rng = np.random.default_rng(5)
    X_TS = rigid([3.0, 1.0, 0.2], 130.0)
    X_TS[:3, :3] = X_TS[:3, :3] @ Rotation.from_rotvec([0.02, 0, 0]).as_matrix()
    noise = rng.normal(scale=0.03, size=town.points.shape)
    moved = make_surface(
        poses.transform(poses.inverse(X_TS), town.points + noise)
    )
    result = register(moved, town, rigid(move, yaw) @ X_TS)
    distance, angle = difference(X_TS, result.X_TS)
    assert distance < 0.03
    assert angle < 0.1
    assert result.fitness > 0.95
    assert result.structure > 0.95


def test_what_is_gone_does_not_count(town):
    """One cloud lacks most houses; the rest fits in both directions."""
    left = surface(make_town(gone=[i for i in range(26) if i % 4]))
    guess = rigid([1.0, 1.0, 0.2], 2.0)
    for source, target in ((left, town), (town, left)):
        result = register(source, target, guess)
        assert difference(np.eye(4), result.X_TS)[0] < 0.05
        assert result.fitness > 0.8
        assert result.structure > 0.8


def test_another_place_does_not_fit(town):
    other = surface(make_town(seed=8))
    result = register(other, town, np.eye(4))
    assert result.structure < 0.5


def test_a_road_without_houses_is_open_along_itself():
    """Two walls and the ground fix all directions except along the road."""
    rng = np.random.default_rng(6)
    ground = rng.uniform([-40, -10, 0], [40, 10, 0], (6000, 3))
    walls = rng.uniform([-40, -10, 0], [40, -10, 8], (6000, 3))
    walls[::2, 1] = 10.0
    road = make_surface(np.concatenate([ground, walls]))
    covariance = register(road, road, np.eye(4)).covariance
    deviation = np.sqrt(np.diag(covariance))
    assert deviation[3] > 8.0 * max(deviation[4:])
    assert np.degrees(deviation[:3]).max() < 0.5
