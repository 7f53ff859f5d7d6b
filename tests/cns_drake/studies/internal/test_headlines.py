"""What the charts of experiments vary has words for their pages' headlines."""

import pytest

from cns_drake.studies import load_experiment, shipped_experiments
from evaluation.results.charts.words import change_words, end_words


def varied(experiment):
    """Returns the factors that the charts of an experiment show."""
    return {
        chart[key]
        for chart in experiment.charts
        for key in ("over", "x", "strips")
        if key in chart
    }


@pytest.mark.parametrize("name", shipped_experiments())
def test_factors_of_shipped_experiments_have_words(name):
    for factor in varied(load_experiment(name)):
        assert change_words(factor, 0, 4)
        assert all(end_words(factor, 0, 4))
