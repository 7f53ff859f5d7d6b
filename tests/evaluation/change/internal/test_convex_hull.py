import numpy as np
import pytest

from evaluation.change.tcr import in_convex_hull

CUBE = np.array(
    [[x, y, z] for x in (0.0, 1.0) for y in (0.0, 2.0) for z in (0.0, 3.0)]
)
NO_POINTS = np.empty((0, 3))


def rotation(seed=0):
    q, _ = np.linalg.qr(np.random.default_rng(seed).normal(size=(3, 3)))
    return q


@pytest.mark.parametrize("scale", [1.0, 1e4])
@pytest.mark.parametrize(
    "offset", [np.zeros(3), np.array([352_345.0, 4_026_780.0, 40.0])]
)
def test_box_to_within_the_tolerance(scale, offset):
    R = rotation()
    hull = scale * CUBE @ R.T + offset
    # The tolerance is 1e-9 of the extent; UTM leaves some 1e-9 m.
    epsilon = 1e-8 * scale + 1e-8
    inside = np.array(
        [[0.5, 1.0, 1.5], [0.0, 0.0, 0.0], [1.0, 2.0, 3.0], [0.0, 1.0, 1.0]]
    )
    steps = np.array([[-1.0, 0, 0], [0, 1.0, 0], [0, 0, 1.0], [-1, -1, -1]])
    edge = np.array([[0.0, 1, 1], [0.5, 2, 1], [0.5, 1, 3], [0, 0, 0]])
    outside = scale * edge + epsilon * steps
    barely_inside = scale * edge - epsilon * steps
    assert in_convex_hull(scale * inside @ R.T + offset, hull).all()
    assert in_convex_hull(barely_inside @ R.T + offset, hull).all()
    assert not in_convex_hull(outside @ R.T + offset, hull).any()


def test_agrees_with_linear_programming():
    from scipy.optimize import linprog

    rng = np.random.default_rng(2)
    cloud = rng.normal(size=(30, 3))
    queries = rng.normal(size=(60, 3))
    expected = []
    for q in queries:
        # A convex combination of the cloud that gives q.
        solution = linprog(
            np.zeros(len(cloud)),
            A_eq=np.vstack([cloud.T, np.ones(len(cloud))]),
            b_eq=[*q, 1.0],
            method="highs",
        )
        expected.append(solution.status == 0)
    assert 5 < sum(expected) < 55
    assert in_convex_hull(queries, cloud).tolist() == expected


@pytest.mark.parametrize("seed", range(5))
def test_every_point_lies_in_its_own_hull(seed):
    rng = np.random.default_rng(seed)
    cloud = rng.uniform(-300, 300, (2000, 3)) + np.array([3e5, 4e6, 0])
    assert in_convex_hull(cloud, cloud).all()


def test_nothing_lies_in_the_hull_of_nothing():
    assert in_convex_hull(CUBE, NO_POINTS).tolist() == [False] * 8
    assert in_convex_hull(NO_POINTS, CUBE).shape == (0,)
    assert in_convex_hull(NO_POINTS, NO_POINTS).shape == (0,)


@pytest.mark.parametrize(
    "offset", [np.zeros(3), np.array([352_345.0, 4_026_780.0, 40.0])]
)
@pytest.mark.parametrize("seed", range(3))
class TestFlatClouds:
    """Hulls without a volume, turned anywhere."""

    def check(self, cloud, inside, outside, offset, seed):
        R = rotation(seed)

        def place(points):
            return np.asarray(points, dtype=float) @ R.T + offset

        assert in_convex_hull(place(cloud), place(cloud)).all()
        assert in_convex_hull(place(inside), place(cloud)).all()
        assert not in_convex_hull(place(outside), place(cloud)).any()

    def test_plane(self, offset, seed):
        square = [[0, 0, 0], [100, 0, 0], [0, 100, 0], [100, 100, 0]]
        inside = [[50, 50, 0], [0, 50, 0], [99.9, 99.9, 0]]
        outside = [[50, 50, 0.01], [100.01, 50, 0], [-0.01, 0, 0]]
        self.check(square, inside, outside, offset, seed)

    def test_line(self, offset, seed):
        line = [[0, 0, 0], [100, 0, 0], [30, 0, 0]]
        inside = [[50, 0, 0], [99.99, 0, 0]]
        outside = [[100.01, 0, 0], [-0.01, 0, 0], [50, 0.01, 0]]
        self.check(line, inside, outside, offset, seed)

    def test_point(self, offset, seed):
        self.check(
            [[1, 2, 3]] * 3,
            [[1, 2, 3]],
            [[1.01, 2, 3], [1, 2, 2.99]],
            offset,
            seed,
        )


@pytest.mark.parametrize("thickness", 10.0 ** np.arange(-16, 0))
def test_nearly_flat_clouds_have_a_hull(thickness):
    rng = np.random.default_rng(4)
    cloud = rng.uniform(-100, 100, (50, 3))
    cloud[:, 2] = rng.uniform(-thickness, thickness, 50)
    R = rotation(7)
    assert in_convex_hull(cloud @ R.T, cloud @ R.T).all()
    above = np.array([[0.0, 0.0, 1.0]]) @ R.T
    assert not in_convex_hull(above, cloud @ R.T).any()


@pytest.mark.parametrize("flat", [False, True])
def test_a_margin_moves_each_face(flat):
    R = rotation(3)
    offset = np.array([352_345.0, 4_026_780.0, 40.0])
    cube = CUBE[CUBE[:, 2] == 0.0] if flat else CUBE
    top = 0.0 if flat else 3.0
    at = np.array([[0.5, 1.0, top + 0.5], [1.5, 1.0, 0.0], [0.5, 2.5, 0.0]])
    outwards = np.array([[0.0, 0, 1], [1, 0, 0], [0, 1, 0]])
    for by, expected in ((-1e-6, True), (1e-6, False)):
        points = (at + by * outwards) @ R.T + offset
        found = in_convex_hull(points, cube @ R.T + offset, 0.5)
        assert found.tolist() == [expected] * 3
