from helpers.towns import rigid
import numpy as np
import pytest

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
