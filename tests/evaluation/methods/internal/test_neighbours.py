import numpy as np
import pytest

from evaluation.methods.ringpp import nearest_neighbours


def rings(seed):
    """Returns a LiDAR's points (N, 3) on uneven ground, dense nearby."""
    rng = np.random.default_rng([seed, 3])
    r = np.repeat(3.0 * 1.25 ** np.arange(14), 150)
    a = np.tile(np.linspace(0.0, 2.0 * np.pi, 150, endpoint=False), 14)
    z = rng.normal(0.0, 0.02, len(r)) + 0.3 * np.sin(5.0 * a)
    return np.stack([r * np.cos(a), r * np.sin(a), z], axis=1)


def clusters(seed):
    """Returns clumps of points of very different sizes, (N, 3)."""
    rng = np.random.default_rng([seed, 4])
    centres = rng.uniform(-50.0, 50.0, (25, 3))
    sizes = 10.0 ** rng.uniform(-3.0, 1.0, 25)
    counts = rng.integers(1, 90, 25)
    return np.concatenate(
        [
            centre + size * rng.normal(size=(count, 3))
            for centre, size, count in zip(centres, sizes, counts, strict=True)
        ]
    )


def lattice(seed):
    rng = np.random.default_rng([seed, 6])
    steps = np.arange(9.0)
    points = np.stack(np.meshgrid(steps, steps, steps), axis=-1).reshape(-1, 3)
    return rng.permutation(points)


def line(seed):
    rng = np.random.default_rng([seed, 8])
    return np.outer(rng.uniform(-9.0, 9.0, 300), [0.0, 1.0, 0.0])


def all_distances(points):
    return np.linalg.norm(points[:, None] - points[None], axis=2)


@pytest.mark.parametrize("make", [rings, clusters, lattice, line])
@pytest.mark.parametrize("k", [1, 2, 30])
def test_against_all_distances(make, k):
    points = make(1)
    neighbours = nearest_neighbours(points, k)
    assert neighbours.shape == (len(points), k)
    distances = all_distances(points)
    expected = np.sort(distances, axis=1)[:, :k]
    chosen = np.take_along_axis(distances, neighbours.astype(int), axis=1)
    # Any of equally far points may be chosen, but each only once.
    np.testing.assert_array_equal(np.sort(chosen, axis=1), expected)
    ordered = np.sort(neighbours, axis=1)
    assert (np.diff(ordered, axis=1) > 0).all()


def test_points_in_one_place():
    neighbours = nearest_neighbours(np.ones((500, 3)), 30)
    assert (np.diff(np.sort(neighbours, axis=1), axis=1) > 0).all()
