import numpy as np
import pytest

from evaluation.recognition.query_outcomes import ranked_places

NAN = np.nan


@pytest.mark.parametrize("number", [5, 1999, 2000, 5000])
@pytest.mark.parametrize("most", [1, 30])
def test_the_best_places_are_those_of_a_full_sort(number, most):
    """With equal scores, with few candidates, and with none."""
    rng = np.random.default_rng(number)
    scores = rng.integers(0, 40, (4, number)).astype(float)
    scores[1, rng.random(number) < 0.5] = NAN
    scores[2, 3:] = NAN
    scores[3] = NAN
    full = np.argsort(-scores, axis=1, kind="stable")[:, :most]
    found = ranked_places(scores, most)
    np.testing.assert_array_equal(found, full)
    np.testing.assert_array_equal(ranked_places(scores[0], most), full[0])
