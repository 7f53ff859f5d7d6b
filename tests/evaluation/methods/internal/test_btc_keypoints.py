import math

import numpy as np
import pytest

from evaluation.methods.btc_keypoints import (
    Keypoints,
    count_bits,
    find_keypoints,
    height_image,
    image_axes,
    peaks,
    suppress,
)

LEVEL = image_axes(np.array([0.0, 0.0, 1.0]), orthogonal=True)
CORNERS = np.array(
    [[x, y, 0.05] for x in (-10.25, 10.25) for y in (-10.25, 10.25)]
)


def draw(points, center=(0.0, 0.0, 0.0), axes=LEVEL, num_layers=49):
    return height_image(
        np.asarray(points, float),
        np.asarray(center, float),
        axes,
        resolution=0.5,
        height_range=(-1.0, 4.0),
        height_step=0.1,
        num_layers=num_layers,
    )


def post(x, y, low, high, step=0.1):
    """Returns points above (x, y), in the middle of layers."""
    z = np.arange(low + 0.05, high, step)
    return np.stack([np.full(len(z), x), np.full(len(z), y), z], axis=1)


def bits(*layers):
    return sum(1 << layer for layer in layers)


def rotation(axis, angle):
    axis = np.asarray(axis, float) / np.linalg.norm(axis)
    K = np.cross(np.eye(3), axis)
    return np.eye(3) - math.sin(angle) * K + (1.0 - math.cos(angle)) * K @ K


class TestAxes:
    def test_level(self):
        # Columns along x, rows along y.
        np.testing.assert_allclose(LEVEL, [[0, 1, 0], [1, 0, 0], [0, 0, 1]])

    @pytest.mark.parametrize(
        "normal",
        [[0.1, 0.2, 1.0], [-0.3, 0.0, 1.0], [1, 0, 0], [0, 1, 0], [0, -1, 0]],
    )
    def test_orthonormal_with_columns_along_x(self, normal):
        normal = np.asarray(normal, float) / np.linalg.norm(normal)
        axes = image_axes(normal, orthogonal=True)
        np.testing.assert_allclose(axes @ axes.T, np.eye(3), atol=1e-12)
        np.testing.assert_array_equal(axes[2], normal)
        assert axes[1, 1] == 0.0
        assert axes[1, 0] >= 0.0

    @pytest.mark.parametrize(
        "normal", [[0.1, 0.2, 1.0], [-0.3, -0.1, 1.0], [0.2, 0.0, 1.0]]
    )
    def test_public_axes_lean_by_the_normals_y(self, normal):
        normal = np.asarray(normal, float) / np.linalg.norm(normal)
        across, along, up = image_axes(normal, orthogonal=False)
        np.testing.assert_array_equal(up, normal)
        np.testing.assert_allclose(
            np.linalg.norm([across, along], axis=1), 1.0, atol=1e-12
        )
        assert along[1] == 0.0
        # (1, 0, -(a + b) / c) has -b along the normal, before its scaling.
        scale = np.hypot(1.0, (normal[0] + normal[1]) / normal[2])
        assert along @ up == pytest.approx(-normal[1] / scale, abs=1e-12)
        assert across @ up == pytest.approx(0.0, abs=1e-12)
        assert across @ along == pytest.approx(0.0, abs=1e-12)

    @pytest.mark.parametrize(
        ("normal", "along"),
        [
            ([0.6, 0.8, 0.0], [0.8, -0.6, 0.0]),
            ([0.0, 1.0, 0.0], [1.0, 0.0, 0.0]),
            ([1.0, 0.0, 0.0], [0.0, 1.0, 0.0]),
        ],
    )
    def test_public_axes_on_a_wall(self, normal, along):
        axes = image_axes(np.array(normal), orthogonal=False)
        np.testing.assert_allclose(axes[1], along, atol=1e-12)
        np.testing.assert_allclose(axes @ axes.T, np.eye(3), atol=1e-12)


class TestCountBits:
    def test_many(self):
        words = np.random.default_rng(41).integers(0, 1 << 62, (30, 20))
        expected = [[bin(word).count("1") for word in row] for row in words]
        np.testing.assert_array_equal(count_bits(words), expected)


class TestHeightImage:
    def test_in_the_frame_of_the_plane(self):
        points = np.concatenate(
            [CORNERS, post(1.1, 2.2, 0, 2), post(-3.4, 7.7, 1, 3)]
        )
        expected = draw(points)
        R = rotation([1.0, -2.0, 0.5], 0.6)
        center = np.array([40.0, -3.0, 7.0])
        image = draw(points @ R.T + center, center, LEVEL @ R.T)
        np.testing.assert_array_equal(image.heights, expected.heights)
        np.testing.assert_allclose(image.means, expected.means, atol=1e-9)

    @pytest.mark.parametrize(("number", "drawn"), [(0, 0), (5, 0), (6, 1)])
    def test_too_few_points(self, number, drawn):
        image = draw(post(0.0, 0.0, 0.0, 3.0)[:number])
        assert np.count_nonzero(image.heights) == drawn

    def test_brute_force(self):
        rng = np.random.default_rng(42)
        points = rng.uniform([-6, -9, -2], [8, 5, 5], (3000, 3))
        image = draw(points, num_layers=20)
        expected = np.zeros(image.heights.shape, dtype=np.int64)
        members = {}
        near = points[(points[:, 2] >= -1.0) & (points[:, 2] <= 4.0)]
        low = near.min(axis=0)
        for x, y, z in near:
            cell = int((y - low[1]) / 0.5), int((x - low[0]) / 0.5)
            members.setdefault(cell, []).append((y, x))
            if int((z + 1.0) / 0.1) < 20:
                expected[cell] |= 1 << int((z + 1.0) / 0.1)
        np.testing.assert_array_equal(image.heights, expected)
        for cell, places in members.items():
            np.testing.assert_allclose(
                image.means[cell], np.mean(places, axis=0), atol=1e-12
            )
        assert np.count_nonzero(~np.isnan(image.means[..., 0])) == len(members)


class TestLeaningAxes:
    def test_image_is_of_the_plane_whatever_the_axes(self):
        """A post along the normal is one cell even if an axis leans."""
        normal = np.array([0.05, 0.3, 1.0]) / np.linalg.norm([0.05, 0.3, 1.0])
        foot = np.array([3.0, -2.0, 0.0])
        points = foot + np.arange(0.05, 3.5, 0.1)[:, None] * normal
        corners = CORNERS - (CORNERS @ normal)[:, None] * normal
        points = np.concatenate([corners + 0.01 * normal, points])
        axes = image_axes(normal, orthogonal=False)
        image = draw(points, foot, axes)
        assert count_bits(image.heights).max() == 35
        (keypoint,) = find_keypoints(image, foot, axes, 10).positions
        np.testing.assert_allclose(keypoint, foot, atol=1e-9)


class TestPeaks:
    def test_brute_force(self):
        """So large that each limit of a line is met."""
        rng = np.random.default_rng(43)
        image = rng.integers(0, 30, (200, 300))
        image *= rng.random((200, 300)) < 0.25
        image[-1] = image[:, -1] = 0
        expected = []
        for top in range(0, 200, 5):
            for left in range(0, 300, 5):
                cells = [
                    (top + i, left + j) for i in range(5) for j in range(5)
                ]
                row, column = max(cells, key=lambda cell: image[cell])
                peak = image[row, column]
                if peak < 12 or row == 0 or column == 0:
                    continue
                line = False
                for i, j in ((0, 1), (1, 0), (1, 1), (1, -1)):
                    a = image[row + i, column + j]
                    b = image[row - i, column - j]
                    line |= a >= peak - 3 and b >= peak / 2
                    line |= b >= peak - 3 and a >= peak / 2
                    line |= a >= peak - 3 and b >= peak - 3
                if not line:
                    expected.append((row, column))
        assert len(expected) > 5
        assert list(zip(*peaks(image, min_heights=12), strict=True)) == expected


class TestKeypoints:
    def test_posts_on_tilted_ground(self):
        # A grid of ground, and posts that stand on it, moved in space.
        across = np.arange(-10.25, 10.3, 0.25)
        x, y = (values.ravel() for values in np.meshgrid(across, across))
        ground = np.stack([x, y, np.full(len(x), 0.05)], axis=1)
        posts = {(1.0, 2.5): (0.1, 1.9), (-6.0, -4.0): (0.1, 3.5)}
        wall = [post(7.0, k, 0.1, 3.0) for k in np.arange(-9.0, 9.0, 0.2)]
        points = np.concatenate(
            [ground, *wall, *(post(*at, *z) for at, z in posts.items())]
        )
        R = rotation([2.0, 1.0, -1.0], 0.3)
        center = np.array([5.0, -8.0, 2.0])
        axes = LEVEL @ R.T
        image = draw(points @ R.T + center, center, axes)
        found = find_keypoints(image, center, axes, min_heights=10)
        local = (found.positions - center) @ R
        # The wall is a line except at its ends.
        inner = np.abs(local[:, 1]) < 8.0
        assert np.count_nonzero(inner) == 2
        for at, (low, high) in posts.items():
            distance = np.linalg.norm(local - [*at, 0.0], axis=1)
            nearest = distance.argmin()
            assert distance[nearest] < 0.25
            layers = range(round((low + 1) * 10), round((high + 1) * 10))
            assert found.heights[nearest] == bits(10, *layers)
        np.testing.assert_allclose(local[:, 2], 0.0, atol=1e-9)

    def make(self, positions, numbers):
        heights = np.array([(1 << n) - 1 for n in numbers], dtype=np.int64)
        return Keypoints(np.asarray(positions, float), heights)

    def test_suppression_brute_force(self):
        rng = np.random.default_rng(44)
        positions = rng.uniform(0.0, 20.0, (150, 3)) * [1.0, 1.0, 0.0]
        numbers = rng.integers(10, 40, 150)
        distances = np.linalg.norm(positions[:, None] - positions, axis=2)
        expected = [
            i
            for i in range(150)
            if not any(
                j != i and distances[i, j] < 2.0 and numbers[j] >= numbers[i]
                for j in range(150)
            )
        ]
        kept = suppress(self.make(positions, numbers), 2.0, 500)
        np.testing.assert_array_equal(kept.positions, positions[expected])

    @pytest.mark.parametrize(
        ("number", "left"),
        [(4, [4, 1, 3, 2]), (5, [4, 1, 3, 2, 5]), (6, [0, 1, 2, 3, 4, 5])],
    )
    def test_at_most(self, number, left):
        positions = np.array([[10.0 * k, 0.0, 0.0] for k in range(6)])
        keypoints = self.make(positions, (11, 15, 12, 15, 20, 12))
        kept = suppress(keypoints, 2.0, number)
        np.testing.assert_array_equal(kept.positions, positions[left])

    def test_none(self):
        nothing = self.make(np.empty((0, 3)), [])
        assert len(suppress(nothing, 2.0, 500)) == 0
