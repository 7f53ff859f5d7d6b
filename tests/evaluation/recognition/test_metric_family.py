"""Metrics: each number of a table says what it is, and which values it has."""

import csv
import math
from pathlib import Path

import numpy as np
import pytest

from evaluation.base import InputError
from evaluation.recognition import (
    METRICS,
    choose_metrics,
    judge,
    load_metrics,
    metric_named,
    register_metric,
)
from evaluation.results import Results, Row, rank_methods

OWN = """
import numpy as np
from evaluation import register_metric


@register_metric(
    "mean_rank", "mean rank of the first match", least=1.0, better="less"
)
def mean_rank(outcomes):
    return np.mean(outcomes.first_right_ranks[outcomes.has_match])
"""


@pytest.fixture(autouse=True)
def only_shipped():
    """Forgets the metrics of a test's files."""
    known = dict(METRICS._members)
    yield
    METRICS._members = known


def outcomes(number=40, seed=0):
    rng = np.random.default_rng(seed)
    scores = rng.random((number, 7))
    return judge(scores, rng.random((number, 7)) < 0.4, np.arange(number) // 5)


def row(value, metric, method="m", **changes):
    values = {
        "experiment": "e",
        "map": "town",
        "database": "a",
        "query": "b",
        "seed": 1,
        "factors": {},
        "task": "map",
        "method": method,
        "verified": False,
        "protocol": "random-yaw",
    }
    return Row(**{**values, **changes}, metric=metric, value=value)


def test_each_metric_says_what_it_is():
    for name, metric in METRICS.items():
        assert metric.name == name
        assert metric.title
        assert metric.over_queries
        assert metric.compute
        assert metric.tasks
        assert metric.least < metric.greatest
        assert metric.label == (
            f"{metric.title} [{metric.unit}]" if metric.unit else metric.title
        )
        # What a share is of is a metric, too.
        assert not metric.share_of or metric.share_of in METRICS
    titles = [metric.title for metric in METRICS.values()]
    assert len(set(titles)) == len(titles)


def test_the_tables_of_the_documents_have_known_metrics():
    found = set()
    for path in Path("docs").rglob("*.csv"):
        with path.open(newline="") as stream:
            reader = csv.DictReader(stream)
            if {"metric", "value"} <= {*(reader.fieldnames or ())}:
                found |= {line["metric"] for line in reader}
    assert len(found) > 20
    assert found <= METRICS.keys()


def test_values_of_the_outcomes_lie_in_the_range():
    for seed in range(5):
        some = outcomes(seed=seed)
        for metric in METRICS.values():
            if "place" not in metric.tasks or metric.is_compared:
                continue
            value = metric.value(some)
            if value is None:  # It needs what a hand-made outcome lacks.
                continue
            if math.isnan(value):
                assert metric.undefined
                continue
            assert metric.checked(value) == value
            interval = metric.interval(some)
            if metric.has_interval:
                assert interval.low <= value <= interval.high
            else:
                assert math.isnan(interval.low)


def test_rounding_is_cut_off_and_no_more():
    auc = METRICS["auc"]
    assert auc.checked(1.0 + 2e-16) == 1.0
    assert auc.checked(-9e-10) == 0.0
    assert auc.checked(1.0 - 2e-16) == 1.0 - 2e-16
    assert math.isnan(auc.checked(math.nan))
    for name, value in (
        ("auc", 1.0 + 2e-9),
        ("auc", -2.0),
        ("relative_auc", -1e-6),
        ("auc", math.inf),
        ("with_match", 7.5),
        ("visible_change", -1.1),
    ):
        with pytest.raises(InputError, match=f"^{name}: .* cannot be"):
            METRICS[name].checked(value)


@pytest.mark.parametrize("end", ["value", "low", "high"])
def test_results_are_not_written_with_what_cannot_be(tmp_path, end):
    numbers = {"value": 0.5, "low": 0.25, "high": 0.75, end: 1.5}
    one = row(metric="miou", **numbers)
    path = tmp_path / "results.csv"
    with pytest.raises(InputError, match=r"results\.csv: miou: 1\.5 cannot be"):
        Results.of([one]).write_csv(path)
    assert not path.exists()


@pytest.mark.parametrize(
    "name", ["p", "r1_bits", "precision_bits", "database.years", "kept_warm"]
)
def test_a_name_like_a_metric_is_none(name):
    metric = metric_named(name)
    assert name not in METRICS
    assert metric.checked(1e9) == 1e9
    assert metric.checked(-1e9) == -1e9


@pytest.mark.parametrize(
    ("metric", "best"), [("miou", "high"), ("memory", "low"), ("mine", "high")]
)
def test_a_ranking_asks_for_the_direction(metric, best):
    rows = [row(0.2, metric, "low"), row(0.9, metric, "high")]
    ranked = rank_methods(rows)
    assert ranked[0].method == best


def test_a_file_adds_a_metric(tmp_path):
    path = tmp_path / "ranks.py"
    path.write_text(OWN)
    r1, own = choose_metrics(["r1", str(path)])
    assert (r1.name, own.name) == ("r1", "mean_rank")
    assert METRICS["mean_rank"] == own == metric_named("mean_rank")
    some = outcomes()
    ranks = some.first_right_ranks[some.has_match]
    assert own.of(some) == pytest.approx(ranks.mean())
    # Without a greatest value there is no interval.
    assert math.isnan(own.interval(some).low)
    weights = np.zeros((1, len(some)))
    weights[0, :5] = 3.0
    first = some.subset(np.arange(len(some)) < 5)
    assert own.weighted(some, weights)[0] == pytest.approx(own.of(first))
    # The same file may be read again, another with this name not.
    assert load_metrics(path)[0].title == own.title
    other = tmp_path / "other.py"
    other.write_text(OWN)
    with pytest.raises(
        InputError, match=r"other\.py: .*there is another metric"
    ):
        load_metrics(other)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "registers no metric"),
        (OWN.replace("mean_rank", "auc"), "there is another metric 'auc'"),
        (OWN.replace("less", "lower"), "better: 'lower'"),
        (OWN.replace("least=", "lowest="), "lowest"),
        (OWN.replace('"mean_rank"', "7"), "7 is no name of a metric"),
        (OWN.replace("1.0", "1.0, greatest=0.0"), "least: 1 is not below"),
        (
            OWN + OWN.replace("def mean", "def other"),
            "there is another metric 'mean_rank'",
        ),
        ("1 / 0", "line 1: ZeroDivisionError"),
    ],
)
def test_a_file_that_adds_none(tmp_path, text, words):
    path = tmp_path / "own.py"
    path.write_text(text)
    with pytest.raises(InputError, match=words) as raised:
        load_metrics(path)
    assert str(raised.value).startswith(f"{path}: ")
    assert "\n" not in str(raised.value)


@pytest.mark.parametrize(
    ("line", "words"),
    [
        ("return 'high'", "mean_rank: 'high' is no number"),
        ("return '2.5'", "mean_rank: '2.5' is no number"),
        ("return None", "mean_rank: None is no number"),
        ("return 1j", "mean_rank: 1j is no number"),
        ("return np.ones(3)", "an array of shape .3,. is no number"),
        ("return np.ones((1, 1))", "an array of shape .1, 1. is no number"),
        ("return np.nan", "undefined .NaN.; say when that is in `undefined`"),
        ("return 1 + np.random.default_rng().random()", "of the same outcomes"),
        ("outcomes.is_right[:] = True", "read-only"),
        ("return -3.0", "mean_rank: -3 cannot be: it is a number from 1 on"),
        ("raise KeyError('x')", "KeyError"),
    ],
)
def test_a_wrong_value_names_the_file_before_any_job(tmp_path, line, words):
    path = tmp_path / "own.py"
    path.write_text(OWN.partition("    return")[0] + f"    {line}\n")
    with pytest.raises(InputError, match=words) as raised:
        load_metrics(path)
    assert str(raised.value).startswith(str(path))


def test_a_value_that_is_undefined_later_names_the_file(tmp_path):
    path = tmp_path / "own.py"
    path.write_text(OWN)
    (own,) = load_metrics(path)
    none = judge(np.zeros((3, 2)), np.zeros((3, 2), bool))
    with pytest.raises(InputError, match=r"own\.py: mean_rank: .*`undefined`"):
        own.of(none)
    path.write_text(OWN.replace("least=1.0", "undefined='no match', least=1.0"))
    (own,) = load_metrics(path)
    assert math.isnan(own.of(none))


def test_a_metric_of_a_user_has_its_unit_and_an_interval():
    @register_metric("far", "score", "m", least=0.0, greatest=1.0)
    def mean_score(outcomes):
        return float(outcomes.best_scores.mean())

    assert mean_score.label == "score [m]"
    found = mean_score.interval(outcomes())
    assert 0.0 < found.low < mean_score.of(outcomes()) < found.high < 1.0


def test_an_unknown_metric_is_refused_with_all_names():
    with pytest.raises(InputError, match=r"no metric 'acu'.*auc_strict"):
        choose_metrics(["r1", "acu"])
    with pytest.raises(ValueError, match="no name"):
        register_metric(" ")
    with pytest.raises(ValueError, match=r"far: no field 'last'.*mean least"):
        register_metric("far", last=0.0)
