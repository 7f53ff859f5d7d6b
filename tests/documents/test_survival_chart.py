"""The README's chart shows the verdicts on the shipped and fresh cities."""

from docs import chart_pictures, result_tables
from evaluation.results import SURVIVES, judge_survival, title


def test_the_title_names_the_methods_that_survive(tmp_path):
    finding = chart_pictures.survival(tmp_path / "chart.png").lower()
    for gate in (False, True):
        for one in judge_survival(result_tables.kept_in_cities(gate)):
            if one.verdict == SURVIVES:
                assert title(one.method).lower() in finding
    assert "geometric verification" in finding
