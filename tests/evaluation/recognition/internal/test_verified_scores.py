"""Geometric verification, by poses that are made by hand."""

from helpers.drive_files import yaw_pose
import numpy as np
import pytest

from evaluation.base import InputError
from evaluation.methods import Method, MethodConfig
from evaluation.recognition.geometric_verification import (
    NUM_VERIFIED,
    SOFTNESS,
    verification_weight,
    verified_scores,
)

RADIUS = 8.0
# Up to this distance, a place has the full weight [m].
FULL = (1.0 - SOFTNESS) * RADIUS
# From this distance on, it has none [m].
NONE = (1.0 + SOFTNESS) * RADIUS


class Far(Method):
    """Has places at the distances in its database; None is no pose."""

    name = "far"
    Config = MethodConfig

    def describe(self, points):
        return points

    def build_database(self, places):
        return places

    def score(self, query, database, *, exhaustive=False):
        raise NotImplementedError

    def relative_pose(self, query, database, place):
        if database[place] is None:
            return None
        turn = 0.3 * place
        along = database[place] * np.array([np.cos(turn), np.sin(turn)])
        return yaw_pose(*along, 0.0, 2.0 * place)


def after(scores, distances):
    return verified_scores(
        Far(), None, distances, np.array(scores, float), RADIUS
    )


def test_the_ramp():
    eps = 1e-9
    distances = [0.0, FULL - eps, FULL + eps, RADIUS, NONE - eps, NONE, 99.0]
    weight = verification_weight(np.array(distances), RADIUS)
    assert weight[:2].tolist() == [1.0, 1.0]
    assert 1.0 - 1e-8 < weight[2] < 1.0
    assert weight[3] == pytest.approx(0.5)
    assert 0.0 < weight[4] < 1e-8
    assert weight[5:].tolist() == [0.0, 0.0]
    # The weight falls linearly: a quarter of the way takes a quarter.
    assert verification_weight(
        FULL + 0.25 * (NONE - FULL), RADIUS
    ) == pytest.approx(0.75)
    # Other units of length change nothing.
    np.testing.assert_allclose(
        verification_weight(1e3 * np.array(distances), 1e3 * RADIUS),
        weight,
        atol=1e-9,
    )


def test_rejected_and_ranked_anew():
    middle = 0.5 * (FULL + RADIUS)
    found = after([0.9, 0.8, 0.7, np.nan], [NONE, middle, 1.0, 1.0])
    assert np.isnan(found[[0, 3]]).all()
    assert found[1] == pytest.approx(0.75 * 0.8)
    assert found[2] == 0.7
    assert np.nanargmax(found) == 2


def test_without_poses_nothing_changes():
    scores = np.random.default_rng(0).normal(size=NUM_VERIFIED + 20)
    scores[3] = np.nan
    found = after(scores, [None] * len(scores))
    np.testing.assert_array_equal(found, scores)
    assert np.isnan(after([np.nan, np.nan], [0.0, 0.0])).all()


@pytest.mark.parametrize("pose", [np.eye(3), np.full((4, 4), np.nan), "x"])
def test_what_is_no_pose_is_refused(pose):
    class Wrong(Far):
        def relative_pose(self, query, database, place):
            return pose

    with pytest.raises(InputError, match="far: relative_pose returned"):
        verified_scores(Wrong(), None, [1.0], np.array([0.5]), RADIUS)
