import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from evaluation.alignment.pose_graph import Ties, optimise
from evaluation.base import poses

EYE = np.eye(4)


def random_poses(rng, number, turn=1.0, move=10.0):
    R = Rotation.from_rotvec(rng.normal(scale=turn, size=(number, 3)))
    return poses.make_pose(
        R.as_matrix(), rng.normal(scale=move, size=(number, 3))
    )


def ties(i, j, Z, *, sigma=0.1, is_doubtful=False):
    return Ties(
        i=np.array(i),
        j=np.array(j),
        Z=Z,
        covariance=np.tile(sigma**2 * np.eye(6), (len(j), 1, 1)),
        is_doubtful=is_doubtful,
    )


def relative(X, i, j):
    return poses.inverse(X[i]) @ X[j]


def apart(X, Y):
    E = poses.inverse(X) @ Y
    angles = Rotation.from_matrix(E[:, :3, :3]).magnitude()
    return np.linalg.norm(E[:, :3, 3], axis=1).max(), angles.max()


def test_consistent_ties_are_kept_exactly():
    rng = np.random.default_rng(1)
    X = random_poses(rng, 6)
    i, j = np.array([0, 1, 2, 3, 4, 1, 0]), np.array([1, 2, 3, 4, 5, 4, 5])
    start = X @ random_poses(rng, 6, turn=0.2, move=1.0)
    start[5] = X[5]
    found = optimise(start, [ties(i, j, relative(X, i, j))], num_held=1)
    np.testing.assert_array_equal(found[5], X[5])
    distance, angle = apart(X, found)
    assert distance < 1e-8
    assert angle < 1e-8


def test_disagreement_is_shared_by_precision():
    """A pose is measured at 0 and at 1, the latter with triple precision."""
    V = np.tile(EYE, (3, 1, 1))
    V[2, 0, 3] = 1.0
    unsure = ties([1], [0], EYE[None], sigma=0.3)
    sure = ties([2], [0], EYE[None], sigma=0.1)
    found = optimise(V, [unsure, sure], num_held=2)
    np.testing.assert_array_equal(found[1:], V[1:])
    np.testing.assert_allclose(found[0, :3, 3], [0.9, 0.0, 0.0], atol=1e-9)
    np.testing.assert_allclose(found[0, :3, :3], np.eye(3), atol=1e-9)


def test_a_loop_spreads_its_error_over_the_chain():
    """Ten steps of 1 m and a loop of 11 m give a tenth to each step."""
    number = 11
    start = np.tile(EYE, (number, 1, 1))
    start[:, 0, 3] = np.arange(number)
    i = np.arange(number - 1)
    chain = ties(i, i + 1, relative(start, i, i + 1))
    Z = EYE[None].copy()
    Z[0, 0, 3] = 11.0
    loop = ties([0], [number - 1], Z, sigma=1e-4)
    hold = ties([number], [0], EYE[None], sigma=1e-4)
    start = np.concatenate([start, EYE[None]])
    found = optimise(start, [hold, chain, loop], num_held=1)[:number]
    np.testing.assert_allclose(
        found[:, 0, 3], 1.1 * np.arange(number), atol=1e-4
    )


@pytest.mark.parametrize("part", [0.1, 0.4])
def test_wrong_ties_are_outvoted(part):
    rng = np.random.default_rng(3)
    X = random_poses(rng, 40, turn=0.3)
    number = 200
    j = np.arange(number) % 40
    noise = random_poses(rng, number, turn=0.002, move=0.02)
    A = X[j] @ noise
    is_wrong = rng.random(number) < part
    A[is_wrong] = A[is_wrong] @ random_poses(rng, is_wrong.sum(), 0.5, 8.0)
    i = np.arange(39)
    chain = ties(
        i,
        i + 1,
        relative(X, i, i + 1) @ random_poses(rng, 39, 0.002, 0.02),
        sigma=0.02,
    )
    eyes = np.tile(EYE, (number, 1, 1))
    held = 40 + np.arange(number)
    seen = ties(held, j, eyes, sigma=0.05, is_doubtful=True)
    start = random_poses(rng, 1, 0.1, 3.0)[0] @ X
    start = np.concatenate([start, A])

    def error(seen):
        found = optimise(start, [seen, chain], num_held=number)
        return apart(X, found[:40])

    distance, angle = error(seen)
    assert distance < 0.1
    assert angle < 0.02
    # With equal weights they would pull the poses away.
    believed = ties(held, j, eyes, sigma=0.05)
    assert error(believed)[0] > 2.0 * distance
