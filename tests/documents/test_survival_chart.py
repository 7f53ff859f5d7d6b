"""The README's chart shows the verdicts on the shipped and fresh cities."""

from docs import chart_pictures, result_tables
from evaluation.results import SURVIVES, SURVIVES_NOT, judge_survival, title


def test_the_title_names_the_methods_that_survive(tmp_path):
    finding = chart_pictures.survival(tmp_path / "chart.png").lower()
    survivors, others = finding.split("\n")
    for one in judge_survival(result_tables.kept_in_cities(True)):
        name = title(one.method).lower()
        assert (name in survivors) == (one.verdict == SURVIVES)
        assert (name in others) == (one.verdict == SURVIVES_NOT)
