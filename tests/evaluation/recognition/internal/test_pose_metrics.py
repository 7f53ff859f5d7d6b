"""Pose errors against given turns and moves."""

import numpy as np
import pytest

from evaluation.recognition import (
    PoseErrors,
    QueryOutcomes,
    evaluate,
)
from evaluation.recognition.pose_errors import pose_metrics


def make_outcomes(scores, right, matched):
    ranks = np.where(right, 1.0, np.inf)
    return QueryOutcomes(
        np.array(scores), np.array(right), np.array(matched), ranks, 9
    )


def test_metrics_of_hand_made_queries():
    # At the greatest F1 the best four are accepted; one of these is wrong.
    outcomes = make_outcomes(
        [0.9, 0.8, 0.7, 0.6, 0.1, np.nan],
        [True, True, False, True, False, False],
        [True, True, False, True, True, True],
    )
    metrics = evaluate(outcomes)
    errors = PoseErrors(
        np.array([2.0, 2.0 + 1e-9, 9.0, 1.0, 0.5, np.nan]),
        np.array([5.0, 1.0, 90.0, 5.0 + 1e-9, 1.0, np.nan]),
    )
    found = pose_metrics(errors, outcomes)
    assert found.num_accepted == 3
    assert found.translation_median == pytest.approx(2.0)
    assert found.translation_90 == pytest.approx(2.0)
    assert found.rotation_median_deg == pytest.approx(5.0)
    # The first and the fifth of five with a match are within both limits.
    assert found.success == pytest.approx(2 / 5)
    assert metrics.curve.recall_at_full_precision == pytest.approx(2 / 5)


def test_quantiles_of_accepted_poses():
    # Of 0 to 10 m, the median is 5 m, and nine tenths are within 9 m.
    right = np.ones(11, dtype=bool)
    outcomes = make_outcomes(np.arange(11.0), right, right)
    values = np.random.default_rng(0).permutation(11) + 0.0
    found = pose_metrics(PoseErrors(values, 3.0 * values), outcomes)
    assert (found.translation_median, found.translation_90) == (5.0, 9.0)
    assert (found.rotation_median_deg, found.rotation_90_deg) == (15.0, 27.0)
