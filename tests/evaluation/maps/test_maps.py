from helpers.drive_files import make_scan, write_recording, yaw_pose
from helpers.internal.listening import listening
import numpy as np
import pytest

from evaluation.base import from_xyz
from evaluation.drives import open_drive
from evaluation.maps import VoxelAccumulator, map_drive, voxelise


def reference_map(points, voxel_size):
    """Voxel -> (centroid, count), by a dictionary."""
    members = {}
    for p in points:
        key = tuple(np.floor((p - [0.0, 0.0, -2.5]) / voxel_size).astype(int))
        members.setdefault(key, []).append(p)
    return {
        key: (np.mean(values, axis=0), len(values))
        for key, values in members.items()
    }


def assert_is(voxels, expected):
    assert [tuple(index) for index in voxels.indices] == sorted(expected)
    centroids = np.array([expected[key][0] for key in sorted(expected)])
    np.testing.assert_allclose(voxels.centroids_W, centroids, atol=1e-9)
    assert voxels.counts.tolist() == [expected[k][1] for k in sorted(expected)]


def random_points(number=5000, seed=0):
    rng = np.random.default_rng([seed, number])
    return rng.uniform([-60, -30, -9], [60, 30, 40], (number, 3))


@pytest.mark.parametrize("voxel_size", [0.5, 1.7, 5.0])
def test_agrees_with_a_dictionary(voxel_size):
    points = random_points()
    voxels, ignored = voxelise(from_xyz(points), voxel_size)
    assert_is(voxels, reference_map(points, voxel_size))
    assert ignored == 0
    assert voxels.voxel_size == voxel_size


def test_grid_is_anchored_in_the_world():
    epsilon = 1e-9
    points = np.array(
        [
            [0.0, 0.0, -2.5],
            [0.0, 0.0, 2.5 - epsilon],
            [0.0, 0.0, 2.5],
            [-epsilon, 5.0 - epsilon, 0.0],
            [5.0, -5.0, -2.5 - epsilon],
        ]
    )
    voxels, _ = voxelise(from_xyz(points))
    assert voxels.indices.tolist() == [
        [-1, 0, 0],
        [0, 0, 0],
        [0, 0, 1],
        [1, -1, -1],
    ]
    assert voxels.counts.tolist() == [1, 2, 1, 1]


def test_many_voxels_make_the_table_grow():
    # One point in each of 64^3 voxels, more than a table starts with.
    axis = np.arange(64) + 0.25
    grid = np.stack(np.meshgrid(axis, axis, axis), axis=-1).reshape(-1, 3)
    points = np.random.default_rng(1).permutation(grid)
    voxels, _ = voxelise(from_xyz(points), 1.0)
    assert len(voxels) == 64**3
    np.testing.assert_allclose(
        voxels.centroids_W, grid[np.lexsort(grid.T[::-1])], atol=1e-12
    )


def test_poses_are_applied():
    points = random_points(300)
    X = yaw_pose(31.0, -17.0, 3.0, 0.7)
    accumulator = VoxelAccumulator()
    accumulator.add(from_xyz(points), X)
    expected = points @ X[:3, :3].T + X[:3, 3]
    assert_is(accumulator.to_map(), reference_map(expected, 5.0))


def test_sums_in_batches_and_in_any_type():
    points = random_points(70_000)
    whole = VoxelAccumulator()
    whole.add(from_xyz(points))
    parts = VoxelAccumulator()
    for start in range(0, len(points), 999):
        parts.add(from_xyz(points[start : start + 999]))
    first, second = whole.to_map(), parts.to_map()
    assert first.indices.tobytes() == second.indices.tobytes()
    assert first.centroids_W.tobytes() == second.centroids_W.tobytes()
    big_endian = VoxelAccumulator()
    big_endian.add(from_xyz(points.astype(">f8")))
    assert big_endian.to_map().centroids_W.tobytes() == (
        first.centroids_W.tobytes()
    )


def test_what_is_not_finite_is_left_out_and_counted():
    points = random_points(100)
    spoilt = np.insert(
        points,
        [3, 50, 99, 100],
        [[np.nan, 0, 0], [0, np.inf, 0], [0, 0, -np.inf], [1e300, 0, 0]],
        axis=0,
    )
    voxels, ignored = voxelise(from_xyz(spoilt))
    assert ignored == 4
    assert_is(voxels, reference_map(points, 5.0))


def test_large_coordinates_lose_nothing():
    points = random_points(2000)
    # A UTM position that is a whole number of voxels.
    offset = np.array([352_345.0, 4_026_780.0, 25.0])
    here, _ = voxelise(from_xyz(points))
    there, _ = voxelise(from_xyz(points + offset))
    np.testing.assert_allclose(
        there.centroids_W - offset, here.centroids_W, atol=2e-9
    )
    np.testing.assert_array_equal(there.counts, here.counts)


@pytest.mark.parametrize("divisions", [1, 3, 10])
def test_samples_are_the_first_point_of_each_part(divisions):
    points = random_points(20_000)
    accumulator = VoxelAccumulator(5.0, divisions)
    for start in range(0, len(points), 999):
        accumulator.add(from_xyz(points[start : start + 999]))
    cells = np.floor((points - [0.0, 0.0, -2.5]) / (5.0 / divisions))
    _, firsts = np.unique(cells, axis=0, return_index=True)
    np.testing.assert_allclose(
        accumulator.samples(), points[np.sort(firsts)], atol=1e-12
    )
    # These points do not change the map.
    plain, _ = voxelise(from_xyz(points))
    voxels = accumulator.to_map()
    assert voxels.indices.tobytes() == plain.indices.tobytes()
    assert voxels.centroids_W.tobytes() == plain.centroids_W.tobytes()


def test_samples_stay_when_the_table_grows():
    rng = np.random.default_rng(2)
    points = rng.uniform(-60, 60, (120_000, 3))
    accumulator = VoxelAccumulator(1.0, 2)
    accumulator.add(from_xyz(points))
    accumulator.add(from_xyz(points[::-1]))
    cells = np.floor((points - [0.0, 0.0, -2.5]) / 0.5)
    _, firsts = np.unique(cells, axis=0, return_index=True)
    np.testing.assert_allclose(
        accumulator.samples(), points[np.sort(firsts)], atol=1e-12
    )


@pytest.mark.parametrize("origin", [0.0, 35.0, -4_026_780.0])
@pytest.mark.parametrize("voxel_size", [5.0, 0.7])
def test_points_next_to_a_border_are_sampled_in_a_part_beside_it(
    origin, voxel_size
):
    borders = origin + voxel_size * np.arange(-20, 21)
    places = np.concatenate(
        [borders, np.nextafter(borders, np.inf), np.nextafter(borders, -np.inf)]
    )
    for axis in range(3):
        for place in places:
            accumulator = VoxelAccumulator(voxel_size, 10)
            points = np.full((1, 3), 0.25)
            points[0, axis] = place
            accumulator.add(from_xyz(points))
            voxels, samples = accumulator.to_map(), accumulator.samples()
            assert voxels.counts.tolist() == [1]
            np.testing.assert_allclose(samples, points, rtol=1e-15, atol=1e-14)
            # The point may be counted on either side.
            middle = voxels.origin_W + voxel_size * (voxels.indices + 0.5)
            off = np.abs(middle - points)
            assert off.max() <= 0.5 * voxel_size + 2e-9


def test_empty_map():
    voxels, ignored = voxelise(from_xyz(np.empty((0, 3))))
    assert len(voxels) == 0
    assert ignored == 0
    assert voxels.centroids_W.shape == (0, 3)
    assert VoxelAccumulator(5.0, 10).samples().shape == (0, 3)


def test_map_of_a_recording(tmp_path):
    rng = np.random.default_rng(5)
    scans = [make_scan(rng.uniform(-20, 20, (400, 3))) for _ in range(6)]
    X_WBs = [yaw_pose(5.0 * i, 2.0, 0.1, 0.5 * i) for i in range(6)]
    path = write_recording(tmp_path / "s", scans, X_WBs, p_BS=(0.5, 0, 1.6))
    world = []
    for scan, X_WB in zip(scans, X_WBs, strict=True):
        p_S = np.stack([scan[name] for name in "xyz"], axis=1)
        p_B = p_S.astype(np.float64) + np.array([0.5, 0.0, 1.6])
        world.append(p_B @ X_WB[:3, :3].T + X_WB[:3, 3])
    with listening() as heard:
        voxels = map_drive(open_drive(path))
    assert heard.counts("mapping s") == [(done, 6) for done in range(6)]
    assert_is(voxels, reference_map(np.concatenate(world), 5.0))
    again = map_drive(open_drive(path))
    assert again.centroids_W.tobytes() == voxels.centroids_W.tobytes()


@pytest.mark.parametrize("shift", [(0, 0, 0), (2, -1, 4)], ids=str)
def test_cells_make_larger_voxels(shift):
    """On aligned grids they are those of the points themselves."""
    rng = np.random.default_rng(8)
    points = rng.uniform(-30.0, 30.0, (5000, 3))
    points += np.array([352_345.0, 4_026_780.0, 40.0])
    cells, _ = voxelise(from_xyz(points), 1.0)
    merged = cells.merged(5.0, tuple(map(float, shift)))
    direct, _ = voxelise(from_xyz(points - shift), 5.0)
    np.testing.assert_array_equal(merged.indices, direct.indices)
    np.testing.assert_array_equal(merged.counts, direct.counts)
    np.testing.assert_allclose(
        merged.centroids_W, direct.centroids_W + shift, rtol=0, atol=1e-8
    )
    np.testing.assert_allclose(
        merged.origin_W, np.add(direct.origin_W, shift), rtol=1e-15
    )


def test_an_empty_map_has_no_larger_voxels():
    empty, _ = voxelise(from_xyz(np.empty((0, 3))), 1.0)
    assert len(empty.merged()) == 0
