from helpers.towns import rigid
import numpy as np
import pytest

from cns_drake.base import yaw_pose
from evaluation.alignment.pose_guesses import Candidates, find_guesses


def make_candidates(X_TS, right, wrong, seed=1, drift=0.0):
    """Returns candidates; the first ones are right to the size of a cell."""
    rng = np.random.default_rng([seed, right, wrong])
    number = right + wrong
    p_S = rng.uniform([-150, -100, 0], [150, 100, 5], (number, 3))
    turn = np.full(number, np.arctan2(X_TS[1, 0], X_TS[0, 0]))
    p_T = p_S @ X_TS[:3, :3].T + X_TS[:3, 3]
    p_T[:, 0] += drift * p_S[:, 0]
    p_T[:, :2] += rng.uniform(-3, 3, (number, 2))
    turn += rng.uniform(-0.09, 0.09, number)
    p_T[right:] = rng.uniform([-200, -200, 0], [200, 200, 5], (wrong, 3))
    turn[right:] = rng.uniform(-np.pi, np.pi, wrong)
    keyframes = np.arange(number)
    return Candidates(keyframes, keyframes, p_S, p_T, turn)


@pytest.mark.parametrize("yaw", [0.0, 97.0, 179.0, -100.0])
@pytest.mark.parametrize("wrong", [0, 160])
def test_finds_what_few_agree_on(yaw, wrong):
    X_TS = rigid([60.0, -45.0, 12.0], yaw)
    candidates = make_candidates(X_TS, 40, wrong)
    best = find_guesses(candidates)[0]
    off = best.X_TS[:3, 3] - X_TS[:3, 3]
    assert np.linalg.norm(off[:2]) < 2.0
    assert abs(off[2]) < 0.5
    cosine = (best.X_TS[:2, :2] * X_TS[:2, :2]).sum() / 2.0
    assert np.degrees(np.arccos(min(cosine, 1.0))) < 1.5
    assert np.count_nonzero(best.pairs < 40) >= 38
    # Wrong candidates agree by chance only.
    assert np.count_nonzero(best.pairs >= 40) <= 3


def test_some_drift_is_forgiven():
    X_TS = rigid([10.0, 20.0, 0.0], -30.0)
    candidates = make_candidates(X_TS, 60, 60, drift=0.02)
    best = find_guesses(candidates)[0]
    assert np.count_nonzero(best.pairs < 60) >= 55


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("seed", [100, 170, 173])
def test_a_refined_guess_with_which_nothing_agrees(seed):
    """All candidates are wrong, and agree by chance only."""
    rng = np.random.default_rng(seed)
    number = int(rng.integers(3, 80))
    zeros = np.zeros(number)
    p_S, p_T = (
        np.column_stack([rng.uniform(-60, 60, (number, 2)), zeros])
        for _ in range(2)
    )
    turn = rng.uniform(-0.4, 0.4, number)
    keyframes = np.arange(number)
    for guess in find_guesses(Candidates(keyframes, keyframes, p_S, p_T, turn)):
        assert np.isfinite(guess.X_TS).all()
        assert len(guess.pairs)


def test_guesses_come_in_the_order_of_their_votes():
    first, second = (
        rigid([50.0, 0.0, 0.0], 10.0),
        rigid([0.0, 90.0, 0.0], 140.0),
    )
    parts = [make_candidates(first, 30, 0), make_candidates(second, 50, 0)]
    joined = Candidates(
        np.arange(80),
        np.arange(80),
        *(
            np.concatenate([getattr(part, name) for part in parts])
            for name in ("p_S", "p_T", "turn")
        ),
    )
    guesses = find_guesses(joined)
    for guess, X_TS in zip(guesses, (second, first), strict=False):
        np.testing.assert_allclose(guess.X_TS, X_TS, atol=2.0)


def test_one_place_votes_once():
    """A place that is proposed many times counts once."""
    X_TS = rigid([5.0, 5.0, 0.0], 45.0)
    few = make_candidates(X_TS, 12, 0)
    other = make_candidates(rigid([99.0, 0.0, 0.0], -80.0), 5, 0, seed=2)
    repeated = np.repeat(np.arange(5), 6)
    joined = Candidates(
        np.concatenate([few.source, 100 + repeated]),
        np.concatenate([few.target, 100 + repeated]),
        np.concatenate([few.p_S, other.p_S[repeated]]),
        np.concatenate([few.p_T, other.p_T[repeated]]),
        np.concatenate([few.turn, other.turn[repeated]]),
    )
    np.testing.assert_allclose(find_guesses(joined)[0].X_TS, X_TS, atol=2.0)


@pytest.mark.parametrize("number", [0, 1])
def test_too_few_to_agree(number):
    assert find_guesses(make_candidates(np.eye(4), number, 0)) == []


def test_upright():
    X = yaw_pose(np.pi / 2, 1.0, 2.0, 3.0)
    np.testing.assert_allclose(X, rigid([1.0, 2.0, 3.0], 90.0), atol=1e-15)
