"""A point a voxel, as maps have it."""

import numpy as np
import pytest

from evaluation.base import from_xyz
from evaluation.maps import downsample, voxelise


def test_thin():
    points = np.array([[0.1, 0.1, 0.1], [0.3, 0.1, 0.1], [-0.1, 0.1, 0.1]])
    np.testing.assert_allclose(
        downsample(points, 0.5), [[-0.1, 0.1, 0.1], [0.2, 0.1, 0.1]], atol=1e-12
    )


@pytest.mark.parametrize("voxel_size", [0.3, 0.5, 4.0])
@pytest.mark.parametrize("number", [0, 1, 5000])
def test_centroids_are_those_of_a_map(number, voxel_size):
    """Bits depend on the order in which points are summed."""
    rng = np.random.default_rng(number)
    points = rng.normal(0.0, 6.0, (number, 3))
    points[::7] = np.round(points[::7])
    points[3::50, 1] = np.nan
    points[4::50, 2] = np.inf
    points[5::900, 0] = 1e12
    voxels, _ = voxelise(from_xyz(points), voxel_size)
    assert (
        downsample(points, voxel_size).tobytes() == voxels.centroids_W.tobytes()
    )


def test_voxels_near_miss_apart_to_be_numbered():
    points = 4e8 * np.random.default_rng(3).normal(size=(300, 3))
    voxels, _ = voxelise(from_xyz(points), 0.5)
    assert len(voxels) > 200
    assert downsample(points, 0.5).tobytes() == voxels.centroids_W.tobytes()


def test_any_memory_order_and_type():
    points = np.random.default_rng(5).normal(0.0, 3.0, (400, 3))
    points = points.astype(np.float32)
    expected = downsample(points.astype(np.float64), 0.5)
    for same in (points, np.asfortranarray(points)):
        assert downsample(same, 0.5).tobytes() == expected.tobytes()
