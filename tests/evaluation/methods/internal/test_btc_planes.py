import math

import numpy as np
import pytest

from evaluation.methods.btc_planes import (
    Planes,
    base_plane,
    group_alike,
    merge,
    voxel_planes,
)


def voxels(points, **changes):
    parameters = {"voxel_size": 2.0, "max_points": 10, "flatness": 0.01}
    return voxel_planes(np.asarray(points, float), **parameters | changes)


def patch(seed, number, center, normal, thickness=0.0):
    """Returns points of a 1.2 m wide patch of a plane."""
    rng = np.random.default_rng([seed, 31])
    normal = np.asarray(normal, float) / np.linalg.norm(normal)
    _, _, axes = np.linalg.svd(normal[None])
    flat = rng.uniform(-0.4, 0.4, (number, 2)) @ axes[1:]
    off = rng.normal(0.0, thickness, (number, 1)) * normal
    return flat + off + np.asarray(center, float)


def moments(points):
    offsets = points - points.mean(axis=0)
    return points.mean(axis=0), offsets.T @ offsets / len(points)


def is_alike(planes, i, j, normal_limit, distance_limit):
    """The definition, with explicit differences of normals."""
    n, m = planes.normals[i], planes.normals[j]
    offset = planes.centers[j] - planes.centers[i]
    return (
        min(np.linalg.norm(n - m), np.linalg.norm(n + m)) < normal_limit
        and abs(n @ offset) < distance_limit
        and abs(m @ offset) < distance_limit
    )


class TestVoxelPlanes:
    def test_plane_of_a_voxel(self):
        normal = np.array([1.0, -2.0, 3.0]) / math.sqrt(14.0)
        points = patch(0, 40, [11.0, -7.0, 3.0], normal)
        planes = voxels(points)
        assert planes.counts.tolist() == [40]
        mean, covariance = moments(points)
        np.testing.assert_allclose(planes.centers, mean[None], atol=1e-12)
        np.testing.assert_allclose(planes.covariances[0], covariance, atol=1e-9)
        assert abs(planes.normals[0] @ normal) == pytest.approx(1.0)

    def test_large_coordinates_leave_the_covariance_alone(self):
        far = np.array([350_001.0, -4_150_001.0, 1.0])
        points = patch(1, 40, [0.0, 0.0, 0.0], [0.0, 0.3, 1.0]) + far
        planes = voxels(points)
        np.testing.assert_allclose(
            planes.covariances[0], moments(points - far)[1], atol=1e-8
        )

    @pytest.mark.parametrize(("number", "found"), [(10, 0), (11, 1)])
    def test_sparse_voxels_are_not_looked_at(self, number, found):
        assert len(voxels(patch(2, number, [1, 1, 1], [0, 0, 1]))) == found

    @pytest.mark.parametrize(("half", "found"), [(0.0999, 1), (0.1001, 0)])
    def test_limit_of_flatness(self, half, found):
        # Two layers, half of the points in each: the variance is half^2.
        layer = patch(3, 30, [1.0, 1.0, 1.0], [0.0, 0.0, 1.0])
        up = np.array([0.0, 0.0, half])
        layers = [layer + up, layer - up]
        assert len(voxels(np.concatenate(layers))) == found

    def test_negative_multiples_belong_to_the_voxel_below(self):
        edge = np.array([[-2.0, 0.1 * k, 0.03 * k * k] for k in range(8)])
        beyond = np.array([[-2.5, 0.1 * k, 0.3] for k in range(8)])
        before = np.array([[-1.5, 0.1 * k, 0.3] for k in range(8)])
        assert voxels(np.concatenate([edge, beyond])).counts.tolist() == []
        found = voxels(np.concatenate([edge, beyond]), flatness=1.0)
        assert found.counts.tolist() == [16]
        assert len(voxels(np.concatenate([edge, before]), flatness=1.0)) == 0

    def test_zero_and_positive_multiples_belong_to_the_voxel_above(self):
        edge = np.array([[2.0, 0.1 * k, 0.3] for k in range(11)])
        zero = np.array([[0.0, 0.1 * k, 0.3] for k in range(11)])
        inside = np.array([[1.9, 0.1 * k, 0.3] for k in range(11)])
        found = voxels(np.concatenate([edge, zero, inside]))
        assert sorted(found.counts) == [11, 22]

    def test_come_in_the_order_of_the_hash_table(self):
        parts = [
            patch(k, 20, center, [0.0, 0.0, 1.0])
            for k, center in enumerate(
                [[5.0, 1.0, 1.0], [-3.0, 9.0, 1.0], [-3.0, -9.0, 1.0]]
            )
        ]
        # A table of few elements that share no bucket: the last one leads.
        for order in ([0, 1, 2], [2, 0, 1]):
            planes = voxels(np.concatenate([parts[k] for k in order]))
            expected = [moments(parts[k])[0] for k in reversed(order)]
            np.testing.assert_allclose(planes.centers, expected, atol=1e-12)

    @pytest.mark.parametrize("number", [0, 1])
    def test_next_to_nothing(self, number):
        assert len(voxels(np.zeros((number, 3)))) == 0


class TestMerging:
    @pytest.mark.parametrize("seed", range(4))
    def test_groups_as_defined(self, seed):
        rng = np.random.default_rng([seed, 32])
        number = 60
        normals = rng.normal(0.0, 0.05, (number, 3))
        normals[:, 2] += 1.0
        normals *= rng.choice([-1.0, 1.0], number)[:, None]
        normals /= np.linalg.norm(normals, axis=1)[:, None]
        centers = rng.uniform(-4.0, 4.0, (number, 3)) * [1.0, 1.0, 0.1]
        planes = Planes(
            centers, normals, np.zeros((number, 3, 3)), np.ones(number, int)
        )
        expected = [0] * number
        next_group = 1
        for i in reversed(range(1, number)):
            for j in range(i):
                if not is_alike(planes, i, j, 0.1, 0.3):
                    continue
                if expected[i] == expected[j] == 0:
                    expected[i] = expected[j] = next_group
                    next_group += 1
                elif expected[i] == 0:
                    expected[i] = expected[j]
                elif expected[j] == 0:
                    expected[j] = expected[i]
        assert 3 < next_group < number // 2
        labels = group_alike(centers, normals, 0.1, 0.3)
        assert (labels + 1).tolist() == expected

    def test_merged_plane_has_the_moments_of_all_points(self):
        parts = [
            patch(k, 20 + k, [4.0 * k + 1.0, 1.0, 1.0], [0.0, 0.0, 1.0], 0.02)
            for k in range(5)
        ]
        wall = patch(9, 400, [1.0, 31.0, 1.0], [1.0, 0.0, 0.0], 0.01)
        planes = voxels(np.concatenate([*parts, wall]))
        assert len(planes) == 6
        merged = merge(planes, 0.1, 0.3, keep_single=False)
        mean, covariance = moments(np.concatenate(parts))
        assert merged.counts.tolist() == [sum(map(len, parts))]
        np.testing.assert_allclose(merged.centers[0], mean, atol=1e-12)
        np.testing.assert_allclose(merged.covariances[0], covariance, atol=1e-9)
        assert abs(merged.normals[0, 2]) == pytest.approx(1.0, abs=1e-3)
        both = merge(planes, 0.1, 0.3, keep_single=True)
        assert sorted(both.counts) == [sum(map(len, parts)), 400]

    def test_the_last_patches_choose_first(self):
        # A chain D, A, B, C in which only neighbours are alike.
        heights = {"D": -0.25, "A": 0.0, "B": 0.25, "C": 0.5}
        counts = {"D": 15, "A": 40, "B": 30, "C": 20}

        def merged(order):
            planes = Planes(
                np.array([[0.0, 0.0, heights[name]] for name in order]),
                np.tile([0.0, 0.0, 1.0], (4, 1)),
                np.tile(np.diag([0.3, 0.3, 0.0]), (4, 1, 1)),
                np.array([counts[name] for name in order]),
            )
            return sorted(merge(planes, 0.1, 0.3, keep_single=False).counts)

        # D and C found groups with their only neighbours.
        assert merged("ABCD") == [50, 55]
        # B joins with A first; C and D follow.
        assert merged("DCAB") == [105]


class TestBasePlane:
    def test_ground_rather_than_walls(self):
        ground = [
            patch(k, 30, [4.0 * k + 1.0, 1.0, -1.6], [0.0, 0.0, 1.0])
            for k in range(6)
        ]
        walls = [
            patch(k, 60, [1.0, 9.0, 4.0 * k + 1.0], [0.0, 1.0, 0.0])
            for k in range(2)
        ]
        planes = voxels(np.concatenate([*walls, *ground]))
        center, normal = base_plane(planes, 0.1, 0.3)
        np.testing.assert_allclose(normal, [0.0, 0.0, 1.0], atol=1e-9)
        assert center[2] == pytest.approx(-1.6)

    def test_points_up(self):
        tilted = np.array([0.6, -0.64, 0.48])
        _, _, axes = np.linalg.svd(tilted[None])
        parts = [patch(k, 30, 4.0 * k * axes[1], tilted, 0.0) for k in range(4)]
        planes = voxels(np.concatenate(parts), voxel_size=4.0, max_points=3)
        for sign in (1.0, -1.0):
            turned = Planes(
                planes.centers,
                sign * planes.normals,
                planes.covariances,
                planes.counts,
            )
            _, normal = base_plane(turned, 0.1, 0.3)
            np.testing.assert_allclose(normal, tilted, atol=1e-9)

    def test_merged_twice(self):
        # Two separate groups of flat patches are alike as groups.
        centers = np.array([[0, 0, 0], [3, 0, 0], [20, 0, 0], [23, 0, 0]])
        angles = [0.06, 0.06, -0.06, -0.06]
        normals = np.array([[0, math.sin(a), math.cos(a)] for a in angles])
        planes = Planes(
            centers.astype(float),
            normals,
            np.zeros((4, 3, 3)) + np.diag([0.3, 0.3, 0.0]),
            np.array([20, 20, 20, 20]),
        )
        first = merge(planes, 0.1, 0.3, keep_single=False)
        assert first.counts.tolist() == [40, 40]
        center, normal = base_plane(planes, 0.1, 0.3)
        np.testing.assert_allclose(center, [11.5, 0.0, 0.0], atol=1e-12)
        np.testing.assert_allclose(normal, [0.0, 0.0, 1.0], atol=1e-12)

    def test_second_time_the_largest_go_first(self):
        # Pairs of patches that lean in four ways, and whose points do not
        # lean: a chain, by height, of 40 points, 120, 80 and 160. Only
        # neighbours are alike; the smallest founds a group first, and leaves
        # 80 to 160.
        sizes = np.array([20, 60, 40, 80] * 2)
        heights, angles = 0.25 * np.arange(4), 0.3 * np.arange(4)
        none = np.zeros(8)
        planes = Planes(
            np.stack([none, none, np.tile(heights, 2)], axis=1),
            np.stack(
                [none, np.tile(np.sin(angles), 2), np.tile(np.cos(angles), 2)],
                axis=1,
            ),
            np.tile(np.diag([0.3, 0.3, 0.0]), (8, 1, 1)),
            sizes,
        )
        once = merge(planes, 0.1, 0.3, keep_single=False)
        assert sorted(once.counts) == [40, 80, 120, 160]
        center, _ = base_plane(planes, 0.1, 0.3)
        expected = [0.0, 0.0, (80 * 0.5 + 160 * 0.75) / 240]
        np.testing.assert_allclose(center, expected, atol=1e-12)

    def test_none_without_a_pair(self):
        alone = voxels(patch(0, 30, [1.0, 1.0, 1.0], [0.0, 0.0, 1.0]))
        assert len(alone) == 1
        assert base_plane(alone, 0.1, 0.3) is None
        assert base_plane(voxels(np.empty((0, 3))), 0.1, 0.3) is None
