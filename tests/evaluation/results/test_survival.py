"""Survival: non-inferiority over cities, from made-up retained shares."""

from dataclasses import replace
from importlib import resources
import math
from pathlib import Path

import pytest

from evaluation.results import (
    FROZEN_REDRAW,
    Results,
    Row,
    cities_section,
    compare_tables,
    judge_survival,
    largest_loss_shown,
    rank_methods,
)


def shipped_results():
    """Returns the table of the shipped cities."""
    folder = resources.files("evaluation.results") / "baselines"
    return Results.read(Path(str(folder)) / "stages.csv")


def rows(shares, method="solid"):
    """Returns rows of retained shares: a list of pairs for each city."""
    return [
        Row(
            experiment="e",
            map=f"city {city}",
            database=f"drive {pair}",
            query="query",
            seed=1,
            factors={},
            task="place",
            method=method,
            verified=False,
            protocol="own",
            metric="relative_auc_strict",
            value=share,
        )
        for city, of_city in enumerate(shares)
        for pair, share in enumerate(of_city)
    ]


def test_cities_decide_and_not_their_pairs():
    """A city with many good pairs counts once; a gain makes up for nothing."""
    shares = [[1.0]] * 7 + [[0.2, 0.2]] + [[1.0] * 20] + [[1.5]]
    (found,) = judge_survival(rows(shares))
    assert found.cities == 10
    assert found.loss == pytest.approx(0.08)
    assert found.verdict == "cannot show"


@pytest.mark.parametrize(
    ("shares", "verdict"),
    [
        ([0.99, 0.97, 0.98, 1.0, 0.96, 0.99, 0.98, 0.97], "survives"),
        ([0.5, 0.6, 0.55, 0.4, 0.5, 0.6, 0.45, 0.5], "does not survive"),
        ([0.99, 0.8, 0.98, 1.0, 0.96, 0.7, 0.98, 0.97], "cannot show"),
        # Seven cities cannot show even that nothing is lost.
        ([1.0] * 7, "cannot show"),
        ([1.0] * 8, "survives"),
        ([0.0] * 4, "cannot show"),
    ],
)
def test_verdicts(shares, verdict):
    (found,) = judge_survival(rows([[share] for share in shares]))
    assert found.verdict == found.to_json()["verdict"] == verdict


def test_what_is_retained_and_what_is_lost_have_one_interval():
    """Unless a city retains more than all: then this is a gain."""
    shares = [0.22, 0.18, 0.2, 0.46, 0.06, 0.06, 0.8, 0.9, 0.9, 0.15, 0.56]
    some = rows([[share] for share in shares])
    (kept,), (lost,) = rank_methods(some), judge_survival(some)
    assert kept.value == pytest.approx(1.0 - lost.loss)
    assert kept.interval.low == pytest.approx(1.0 - lost.interval.high)
    assert kept.interval.high == pytest.approx(1.0 - lost.interval.low)
    some += rows([*[[]] * len(shares), [1.5]])
    (kept,), (lost,) = rank_methods(some), judge_survival(some)
    assert kept.interval.high > 1.0 - lost.interval.low


def test_only_conditions_of_all_methods_count():
    some = rows([[0.9]] * 9) + rows([[0.95]] * 8, "btc")
    found = judge_survival(some)
    assert [(one.method, one.cities) for one in found] == [
        ("btc", 8),
        ("solid", 8),
    ]
    assert judge_survival([]) == []


def test_power_grows_with_cities_and_falls_with_their_spread():
    assert math.isnan(largest_loss_shown(7, 0.01))
    few, many = (largest_loss_shown(number, 0.02) for number in (8, 20))
    assert 0.0 < few < many < 0.1
    assert many < largest_loss_shown(20, 0.01)
    # Eight cities that differ this much cannot show even a loss of nothing.
    assert math.isnan(largest_loss_shown(8, 0.1))


def test_a_page_says_which_shipped_city_was_measured():
    """By its results, and not by its name."""
    shipped = shipped_results().where(map="metropolis")
    section = cities_section(shipped)
    assert "<h2>Metropolis: 1 of 12 cities</h2>" in section.body
    renamed = [replace(row, map="elsewhere") for row in shipped.rows]
    other = [replace(row, value=row.value - 0.1) for row in shipped.rows]
    for some in (renamed, other):
        assert cities_section(Results.of(some)) is None


def test_a_redraw_is_a_city_of_its_own():
    some = rows([[0.9]] * 4)
    some += [replace(row, factors={FROZEN_REDRAW: 1}) for row in some]
    (found,) = judge_survival(some)
    assert set(found.of_cities) == {
        f"city {number}{end}"
        for number in range(4)
        for end in ("", ", fresh 1")
    }


def test_shipped_tables_are_compared_alone():
    found = compare_tables([], "relative_auc_strict", verified=True)
    assert {one.cities for one in found.survival} == {12}
    wanted = judge_survival(
        row
        for row in shipped_results().where(metric="relative_auc_strict").rows
        if row.method == "btc" and row.verified and row["both.stage"] == "own"
    )
    (btc,) = (one for one in found.survival if one.method == "btc")
    for city, loss in wanted[0].of_cities.items():
        assert btc.of_cities[city] == pytest.approx(loss)
