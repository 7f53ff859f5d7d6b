"""Parts that coincide, against all distances."""

import numpy as np
import pytest
from scipy.spatial.distance import cdist

from evaluation.geometry.coinciding import CoincidingPoints


def walls(rng):
    """Returns points (N, 3) of two upright walls."""
    along = rng.uniform(-60.0, 60.0, 900)
    across = np.where(along > 0.0, 9.0, -7.0)
    return np.column_stack([along, across, rng.uniform(0.0, 12.0, 900)])


def line(rng):
    return np.outer(rng.uniform(-9.0, 9.0, 300), [0.0, 1.0, 0.0])


def lattice(rng):
    """Returns points whose distances are the limit, or just not."""
    steps = np.arange(7.0)
    points = np.stack(np.meshgrid(steps, steps, steps), axis=-1).reshape(-1, 3)
    return rng.permutation(points)


def two_far_ones(rng):
    return np.array([[0.0, 0.0, 0.0], [3e5, -2e5, 1e5]]) + rng.normal(size=3)


@pytest.mark.parametrize("make", [walls, line, lattice, two_far_ones])
@pytest.mark.parametrize("distance", [0.3, 1.0, 25.0])
def test_against_all_distances(make, distance):
    rng = np.random.default_rng([len(make.__name__), 7])
    cloud = make(rng)
    some = cloud[rng.integers(len(cloud), size=500)]
    points = some + rng.normal(0.0, distance, some.shape)
    points[:40, 0] = some[:40, 0] + distance
    points[40:60] *= 1e7
    is_near = cdist(points, cloud) < distance
    found = CoincidingPoints(cloud, distance).shares(points)
    assert found == (is_near.any(axis=1).mean(), is_near.any(axis=0).mean())
    assert 0.0 < found[0] < 1.0


def test_the_limit_itself_is_too_far():
    cloud = np.zeros((1, 3))
    for length, share in ((1.0, 0.0), (np.nextafter(1.0, 0.0), 1.0)):
        points = np.array([[0.0, length, 0.0]])
        assert CoincidingPoints(cloud, 1.0).shares(points) == (share, share)
