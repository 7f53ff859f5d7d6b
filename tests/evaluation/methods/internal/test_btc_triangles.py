import itertools

import numpy as np
import pytest

from evaluation.methods.btc import Triangles, make_table, make_triangles, match
from evaluation.methods.btc_keypoints import Keypoints


def keypoints(*positions):
    """Returns keypoints on the ground, identified by their heights."""
    positions = np.asarray(positions, float).reshape(-1, 2)
    return Keypoints(
        np.column_stack([positions, np.full(len(positions), 0.5)]),
        1 << np.arange(len(positions)),
    )


def scattered(seed, number, width):
    rng = np.random.default_rng([seed, 51])
    return keypoints(*rng.uniform(-width, width, (number, 2)))


def triangles(points, num_neighbours=10, side_range=(2.0, 50.0)):
    return make_triangles(points, num_neighbours, side_range)


def random_triangles(seed, number, low=4.0, high=6.0):
    """Returns triangles of which many share a descriptor."""
    rng = np.random.default_rng([seed, 52])
    words = rng.integers(1, 1 << 12, 6)
    return Triangles(
        np.sort(rng.uniform(low, high, (number, 3)), axis=1),
        rng.uniform(-50.0, 50.0, (number, 3, 3)),
        words[rng.integers(0, 6, (number, 3))],
    )


def dice(one, other):
    common = bin(one & other).count("1")
    return 2.0 * common / (bin(one).count("1") + bin(other).count("1"))


def same_descriptors(number):
    return np.full((number, 3), 0b1011)


class TestMakeTriangles:
    def test_equal_sides_once(self):
        # The second triangle's sides are those of the first, to 1 mm.
        first = [[0, 0], [6.0003, 0], [0, 8.0003]]
        second = [[500, 0], [506.0004, 0], [500, 8.0004]]
        found = triangles(keypoints(*first, *second))
        np.testing.assert_allclose(found.sides, [[6.0, 8.0, 10.0]], atol=1e-3)
        assert found.heights.tolist() == [[1, 2, 4]]
        third = [[500, 0], [506.002, 0], [500, 8.002]]
        assert len(triangles(keypoints(*first, *third))) == 2

    @pytest.mark.parametrize("seed", range(3))
    def test_brute_force(self, seed):
        points = scattered(seed, 30, 20.0)
        positions = points.positions
        distances = np.linalg.norm(positions[:, None] - positions, axis=2)
        expected = {}
        for i in range(30):
            near = np.argsort(distances[i])[:6]
            assert near[0] == i
            for j, k in itertools.combinations(near[1:], 2):
                sides = sorted(
                    [
                        (distances[i, j], {i, j}),
                        (distances[i, k], {i, k}),
                        (distances[j, k], {j, k}),
                    ],
                    key=lambda side: side[0],
                )
                (a, ends_a), (b, ends_b), (c, ends_c) = sides
                if a < 4.0 or c > 15.0 or a + b - c < 0.2:
                    continue
                key = tuple(int(1000.0 * length) for length in (a, b, c))
                expected.setdefault(
                    key,
                    (
                        *(ends_a & ends_b),
                        *(ends_a & ends_c),
                        *(ends_b & ends_c),
                    ),
                )
        found = triangles(points, 6, (4.0, 15.0))
        assert len(found) == len(expected) > 30
        np.testing.assert_allclose(
            found.sides, np.array(list(expected)) / 1000.0, atol=1e-3
        )
        vertices = list(expected.values())
        np.testing.assert_array_equal(found.positions, positions[vertices])
        np.testing.assert_array_equal(found.heights, points.heights[vertices])

    @pytest.mark.parametrize("number", [0, 1, 2])
    def test_too_few_keypoints(self, number):
        found = triangles(scattered(0, number, 20.0))
        assert len(found) == 0
        assert found.positions.shape == (0, 3, 3)

    def test_fewer_keypoints_than_neighbours(self):
        found = triangles(keypoints([0, 0], [7, 1], [1, 9], [12, 13]))
        assert len(found) == 4


class TestMatch:
    @pytest.mark.parametrize("seed", range(3))
    def test_brute_force(self, seed):
        query = random_triangles(seed, 80)
        clouds = [random_triangles([seed, k], 300) for k in range(3)]
        table = make_table(clouds, 0.2)
        # The definition, with a table of cells.
        cells = {}
        for cloud, one in enumerate(clouds):
            for t, sides in enumerate(one.sides):
                cell = tuple(int(5.0 * side + 0.5) for side in sides)
                cells.setdefault(cell, []).append((cloud, t))
        expected = []
        for i, sides in enumerate(query.sides / 0.2):
            for step in itertools.product((-1, 0, 1), repeat=3):
                cell = tuple(
                    int(s + d) for s, d in zip(sides, step, strict=True)
                )
                if np.linalg.norm(np.array(cell) + 0.5 - sides) >= 1.5:
                    continue
                for cloud, t in cells.get(cell, ()):
                    one = clouds[cloud]
                    off = np.linalg.norm(one.sides[t] / 0.2 - sides)
                    alike = [
                        dice(int(a), int(b))
                        for a, b in zip(
                            query.heights[i], one.heights[t], strict=True
                        )
                    ]
                    if (
                        off < 0.03 * np.linalg.norm(sides)
                        and np.mean(alike) > 0.551
                    ):
                        expected.append((i, cloud, *one.sides[t]))
        of_query, of_table = match(query, table, 0.03, 0.551)
        found = np.column_stack(
            [
                of_query,
                table.clouds[of_table],
                table.triangles.sides[of_table],
            ]
        )
        assert len(expected) > 100
        np.testing.assert_array_equal(found, expected)

    def one(self, sides, heights):
        return Triangles(
            np.array([sides]), np.zeros((1, 3, 3)), np.array([heights])
        )

    def number(self, query, place):
        return len(match(query, make_table([place], 0.2), 0.01, 0.7)[0])

    def test_large_triangles_must_be_near(self):
        # 0.6 m of 40 m is within the tolerance, but three cells away.
        heights = [0b1, 0b11, 0b101]
        query = self.one([40.1, 40.3, 40.5], heights)
        near = self.one([40.1, 40.3, 40.65], heights)
        far = self.one([40.1, 40.3, 41.1], heights)
        assert self.number(query, near) == 1
        assert self.number(query, far) == 0

    def test_more_matches_than_first_thought(self):
        number = 70
        same = Triangles(
            np.full((number, 3), 5.0),
            np.zeros((number, 3, 3)),
            same_descriptors(number),
        )
        of_query, of_table = match(same, make_table([same], 0.2), 0.01, 0.7)
        np.testing.assert_array_equal(
            of_query, np.repeat(np.arange(number), number)
        )
        np.testing.assert_array_equal(
            of_table, np.tile(np.arange(number), number)
        )

    def test_nothing(self):
        nothing = triangles(keypoints())
        some = random_triangles(0, 10)
        for query, place in ((nothing, some), (some, nothing)):
            of_query, of_table = match(
                query, make_table([place, nothing], 0.2), 0.01, 0.7
            )
            assert len(of_query) == len(of_table) == 0


class TestTable:
    def test_sorted_by_cell_ties_in_order(self):
        sides = np.array([[5.0, 5.0, 5.0], [3.0, 4.0, 5.0], [3.0, 4.0, 5.0]])
        clouds = [
            Triangles(
                sides + 0.01 * k, np.zeros((3, 3, 3)), same_descriptors(3)
            )
            for k in range(2)
        ]
        table = make_table(clouds, 0.2)
        assert table.clouds.tolist() == [0, 0, 1, 1, 0, 1]
        cells = np.rint(table.triangles.sides / 0.2).astype(int).tolist()
        assert cells == sorted(cells)
        assert len({tuple(cell) for cell in cells}) == 2
        np.testing.assert_allclose(
            table.triangles.sides[:, 0], [3.0, 3.0, 3.01, 3.01, 5.0, 5.01]
        )
