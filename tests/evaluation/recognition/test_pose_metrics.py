"""Pose errors against given turns and moves."""

import numpy as np
import pytest

from evaluation.recognition import METRICS, QueryOutcomes, numbers_of


def outcomes_of(scores, right, matched, translation, rotation_deg):
    ranks = np.where(right, 1.0, np.inf)
    columns = {
        "translation_error": np.array(translation),
        "rotation_error_deg": np.array(rotation_deg),
    }
    return QueryOutcomes(
        np.array(scores),
        np.array(right),
        np.array(matched),
        ranks,
        9,
        columns=columns,
    )


def poses_of(*columns):
    return {
        n.metric: n.value for n in numbers_of("pose", outcomes_of(*columns))
    }


def test_metrics_of_hand_made_queries():
    # At the greatest F1 the best four are accepted; one of these is wrong.
    outcomes = outcomes_of(
        [0.9, 0.8, 0.7, 0.6, 0.1, np.nan],
        [True, True, False, True, False, False],
        [True, True, False, True, True, True],
        [2.0, 2.0 + 1e-9, 9.0, 1.0, 0.5, np.nan],
        [5.0, 1.0, 90.0, 5.0 + 1e-9, 1.0, np.nan],
    )
    found = {n.metric: n.value for n in numbers_of("pose", outcomes)}
    assert METRICS["f1_max_true_positives"].of(outcomes) == 3
    assert found["translation_median"] == pytest.approx(2.0)
    assert found["translation_90"] == pytest.approx(2.0)
    assert found["rotation_median_deg"] == pytest.approx(5.0)
    # The first and the fifth of five with a match are within both limits.
    assert found["pose_success"] == pytest.approx(2 / 5)
    precise = METRICS["recall_at_full_precision"]
    assert precise.of(outcomes) == pytest.approx(2 / 5)


def test_quantiles_of_accepted_poses():
    # Of 0 to 10 m, the median is 5 m, and nine tenths are within 9 m.
    right = np.ones(11, dtype=bool)
    values = np.random.default_rng(0).permutation(11) + 0.0
    found = poses_of(np.arange(11.0), right, right, values, 3.0 * values)
    assert (found["translation_median"], found["translation_90"]) == (5.0, 9.0)
    assert found["rotation_median_deg"] == 15.0
    assert found["rotation_90_deg"] == 27.0


def test_errors_are_those_of_right_answers():
    """Thirty queries without a match, and one wrong place, do not count."""
    right = np.arange(41) < 10
    far = np.where(right, 0.1, 50.0)
    far[0] = np.nan
    outcomes = outcomes_of(
        np.linspace(1.0, 0.5, 41), right, np.arange(41) < 11, far, 2.0 * far
    )
    found = {n.metric: (n.value, n.n) for n in numbers_of("pose", outcomes)}
    assert found == {
        "pose_success": (9 / 11, 11),
        "translation_median": (0.1, 9),
        "translation_90": (0.1, 9),
        "rotation_median_deg": (0.2, 9),
        "rotation_90_deg": (0.2, 9),
    }


def test_a_method_without_poses_has_no_numbers_of_them():
    unknown = [np.nan]
    assert poses_of([0.9], [True], [True], unknown, unknown) == {}
