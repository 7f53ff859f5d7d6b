import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from cns_drake.base import poses
from evaluation.alignment.anchor_search import FIXED, Ties, optimise

EYE = np.eye(4)


def random_poses(rng, number, turn=1.0, move=10.0):
    R = Rotation.from_rotvec(rng.normal(scale=turn, size=(number, 3)))
    return poses.make_pose(
        R.as_matrix(), rng.normal(scale=move, size=(number, 3))
    )


def ties(i, j, Z, *, A=None, B=None, sigma=0.1, is_doubtful=False):
    number = len(j)
    eyes = np.tile(EYE, (number, 1, 1))
    return Ties(
        i=np.array(i),
        j=np.array(j),
        A=eyes if A is None else A,
        B=eyes if B is None else B,
        Z=Z,
        covariance=np.tile(sigma**2 * np.eye(6), (number, 1, 1)),
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
    hold = ties([FIXED], [0], EYE[None], A=X[:1])
    start = X @ random_poses(rng, 6, turn=0.2, move=1.0)
    found = optimise(start, [hold, ties(i, j, relative(X, i, j))])
    distance, angle = apart(X, found)
    assert distance < 1e-8
    assert angle < 1e-8


def test_offsets_on_either_side():
    """Z = inverse(V_i A) V_j B, with no identity among these poses."""
    rng = np.random.default_rng(2)
    X = random_poses(rng, 3)
    i, j = np.array([0, 1, 0]), np.array([1, 2, 2])
    A, B = random_poses(rng, 3), random_poses(rng, 3)
    Z = poses.inverse(X[i] @ A) @ X[j] @ B
    hold = ties([FIXED], [0], EYE[None], A=X[:1])
    start = X @ random_poses(rng, 3, turn=0.1, move=0.5)
    found = optimise(start, [hold, ties(i, j, Z, A=A, B=B)])
    distance, angle = apart(X, found)
    assert distance < 1e-7
    assert angle < 1e-8


def test_disagreement_is_shared_by_precision():
    """A pose is measured at 0 and at 1, the latter with triple precision."""
    A = np.tile(EYE, (2, 1, 1))
    A[1, 0, 3] = 1.0
    unsure = ties([FIXED], [0], EYE[None], A=A[:1], sigma=0.3)
    sure = ties([FIXED], [0], EYE[None], A=A[1:], sigma=0.1)
    found = optimise(EYE[None], [unsure, sure])
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
    hold = ties([FIXED], [0], EYE[None], sigma=1e-4)
    found = optimise(start, [hold, chain, loop])
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
    seen = ties(
        np.full(number, FIXED),
        j,
        np.tile(EYE, (number, 1, 1)),
        A=A,
        sigma=0.05,
        is_doubtful=True,
    )
    start = random_poses(rng, 1, 0.1, 3.0)[0] @ X
    distance, angle = apart(X, optimise(start, [seen, chain]))
    assert distance < 0.1
    assert angle < 0.02
    # With equal weights they would pull the poses away.
    believed = ties(seen.i, j, seen.Z, A=A, sigma=0.05)
    assert apart(X, optimise(start, [believed, chain]))[0] > 2.0 * distance
