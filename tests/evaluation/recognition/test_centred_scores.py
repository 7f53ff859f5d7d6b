"""Scores from which each place's mean score is subtracted."""

import numpy as np
import pytest

from evaluation import make_method, open_drive, retrieve
from evaluation.base import InputError


@pytest.mark.parametrize(
    "name", ["solid", pytest.param("btc", marks=pytest.mark.slow)]
)
def test_each_place_has_the_mean_score_zero_if_scores_are_centred(towns, name):
    drives = [open_drive(towns / f"town_0{k}") for k in (1, 2)]
    alone = retrieve(*drives, make_method(name, {}))
    found = retrieve(*drives, make_method(name, {"center_scores": True}))
    np.testing.assert_array_equal(
        np.isnan(found.scores), np.isnan(alone.scores)
    )
    for of_place, before in zip(found.scores.T, alone.scores.T, strict=True):
        is_scored = ~np.isnan(of_place)
        if is_scored.any():
            shift = (before - of_place)[is_scored]
            np.testing.assert_allclose(shift, before[is_scored].mean())


def test_a_method_with_a_second_stage_cannot_centre_its_scores():
    class TwoStages(type(make_method("solid", {}))):
        rerank_best = 5

    with pytest.raises(InputError, match="solid: center_scores: its second"):
        TwoStages(TwoStages.Config(center_scores=True))
