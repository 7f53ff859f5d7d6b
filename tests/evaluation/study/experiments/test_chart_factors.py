"""Charts of an experiment name its factors, as the columns do."""

import pytest

from evaluation.base import InputError
from evaluation.study import load_experiment, shipped_experiments

TEXT = """
database: {aside: [0, 10]}
query: {transient: {snow: [0, 0.2]}}
cases: {lost: {query: {aside: [0.1, 0.2]}}}
methods: {solid: {ranges: [20, 40]}, norms.py: {order: [1, 2]}}
charts:
"""
NAMES = (
    "cause, level, database.aside, query.transient.snow, methods.solid.ranges,"
    " methods.norms.order"
)


@pytest.mark.parametrize("name", [*NAMES.split(", "), "map", "query", "method"])
def test_a_chart_is_over_a_factor_or_a_column(read, name):
    text = f"{TEXT}  - {{kind: matrix, over: {name}, metric: auc}}"
    assert read(text).charts[0]["over"] == name


@pytest.mark.parametrize(
    "chart",
    [
        "{kind: lines, over: years, metric: auc}",
        "{kind: lines, over: solid.ranges, metric: auc}",
        "{kind: matrix, over: cause, strips: snow, metric: relative_auc}",
        "{kind: scatter, x: yeers, y: auc}",
        "{kind: lines, over: level, metric: auc, query.yeers: 0}",
    ],
)
def test_other_names_are_refused_with_all_factors(read, chart):
    with pytest.raises(InputError, match=r"mine\.yaml: charts: ") as raised:
        read(f"{TEXT}  - {chart}")
    assert f"(the experiment varies: {NAMES})" in str(raised.value)


@pytest.mark.parametrize(
    ("selected", "fault"),
    [
        ("task: pose", "task: 'pose' is none of place, cost"),
        ("task: [place, map]", "task: 'map' is none of place, cost"),
        ("database.aside: 5", "database.aside: 5 is none of 0, 10"),
        ("cause: found", "cause: 'found' is none of none, lost"),
    ],
)
def test_rows_that_no_table_has_are_refused(read, selected, fault):
    chart = "  - {kind: lines, over: query.transient.snow, metric: auc, %s}"
    with pytest.raises(InputError, match=rf"yaml: charts: lines: {fault}"):
        read(TEXT + chart % selected)


def test_lines_are_over_numbers(read):
    chart = "  - {kind: lines, over: cause, metric: auc}"
    with pytest.raises(InputError, match="lines: over: cause: 'none' is no nu"):
        read(TEXT + chart)


def test_values_that_quick_or_an_option_leaves_out_are_known(read):
    chart = (
        "  - {kind: lines, over: query.transient.snow, metric: auc,"
        " database.aside: 10, task: place}\nquick: {database: {aside: [0]}}"
    )
    read(TEXT + chart)
    read(TEXT + chart, "database.aside=[0, 20]", "tasks=[pose]")


def test_a_factor_that_an_option_fixes_is_known(read):
    text = f"{TEXT}  - {{kind: lines, over: database.aside, metric: auc}}"
    found = read(text, "database.aside=10")
    assert "database.aside" not in found.factor_names
    with pytest.raises(InputError, match=r"no factor 'database\.asid'"):
        read(text.replace("aside,", "asid,"), "database.aside=10")


def test_a_metric_of_the_user_is_checked_later(read):
    chart = "  - {kind: scatter, x: mean_rank, y: auc}\n"
    read(f"{TEXT}{chart}metrics: [ranks.py]")
    with pytest.raises(InputError, match="no factor 'mean_rank'"):
        read(TEXT + chart)


@pytest.mark.parametrize("name", shipped_experiments())
@pytest.mark.parametrize("quick", [False, True])
def test_charts_of_shipped_experiments_name_factors(name, quick):
    found = load_experiment(name)
    if found.quick or not quick:
        assert load_experiment(name, quick=quick).charts == found.charts
