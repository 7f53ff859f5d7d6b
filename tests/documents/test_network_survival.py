"""Verdicts by road networks: closed forms, simulation, another reader."""

from benchmarks.network_verdicts import (
    Counts,
    Effects,
    fitted,
    jackknife,
    read_counts,
    share,
    table_rows,
)
import numpy as np
import pytest
from scipy.special import expit
from scipy.stats import t

from docs.fill_numbers import csv_rows


def test_the_mean_of_a_share():
    """Exact without spread, and where the odds are even; else simulated."""
    assert share(1.3, 0.0) == pytest.approx(expit(1.3), abs=1e-12)
    assert share(0.0, 4.0) == pytest.approx(0.5, abs=1e-12)
    drawn = np.random.default_rng(1).normal(2.0, 1.5, 400_000)
    assert share(2.0, 2.25) == pytest.approx(expit(drawn).mean(), abs=2e-3)


def test_the_jackknife_of_a_mean_is_its_t_interval():
    values = np.random.default_rng(2).normal(size=15)
    without = (values.sum() - values) / 14
    low, high = jackknife(values.mean(), without)
    wanted = t.interval(
        0.95, 14, values.mean(), values.std(ddof=1) / np.sqrt(15)
    )
    assert (low, high) == pytest.approx(wanted, abs=1e-12)


@pytest.mark.parametrize("loss", [0.0, 0.1, 0.6])
def test_effects_of_a_loss(loss):
    effects = Effects(np.array([2.0, -1.0]), np.array([1.0, 0.3, 0.0, 0.0]))
    assert effects.of_loss(loss).loss() == pytest.approx(loss, abs=1e-9)


def alike(networks, queries):
    """Counts of two cities on each of some networks, without answers."""
    names = np.repeat(np.arange(networks), 2)
    cities = np.arange(2 * networks)
    none = np.zeros((2 * networks, 2), dtype=int)
    return Counts(names, cities, np.full(2 * networks, queries), none)


EFFECTS = Effects(np.array([2.5, -1.2]), np.array([0.6, 0.3, 0.8, 0.4]))


def test_made_up_answers_have_the_loss_of_their_effects():
    drawn = EFFECTS.made_up(alike(4000, 50), np.random.default_rng(3))
    before, after = drawn.right.sum(axis=0)
    assert 1.0 - after / before == pytest.approx(EFFECTS.loss(), abs=0.01)


def test_the_model_finds_the_effects_of_made_up_answers():
    drawn = EFFECTS.made_up(alike(300, 60), np.random.default_rng(4))
    found = fitted(drawn)
    assert found.fixed == pytest.approx(EFFECTS.fixed, abs=0.2)
    assert found.variances == pytest.approx(EFFECTS.variances, abs=0.25)
    assert found.loss() == pytest.approx(EFFECTS.loss(), abs=0.03)


def test_counts_are_those_of_the_tables():
    """Of Town 03, 41 queries: all right without the change, 25 with it."""
    counts = read_counts(table_rows())["first", "1", "layered-overlap"]
    (town,) = np.flatnonzero(counts.networks == "town03")
    assert counts.queries[town] == 41
    assert counts.right[town].tolist() == [41, 25]
    assert not {"i5", "northgate"} & set(counts.networks), "nothing changes"
    assert len(set(counts.cities)) == len(counts.cities) == 23
    # Nearly whole numbers: AUC strict is the share of right answers.
    for row in csv_rows("new_plans.csv"):
        if row["metric"] == "auc_strict" and row["method"] == "btc":
            right = float(row["value"]) * int(row["n"])
            assert row["verified"] == "0" or abs(right - round(right)) < 0.02


def test_the_published_verdicts_are_those_of_the_published_intervals():
    rows = csv_rows("network_survival.csv")
    networks = {
        (row["verified"], row["method"], row["network"]): float(row["loss"])
        for row in rows
        if row["part"] == "network"
    }
    found = [row for row in rows if row["part"] == "found"]
    assert found
    for row in found:
        low, loss, high = (float(row[name]) for name in ("low", "loss", "high"))
        assert low < loss < high
        wanted = "cannot show"
        if high < 0.1:
            wanted = "survives"
        elif low > 0.1:
            wanted = "does not survive"
        assert row["verdict"] == wanted
        if row["pairs"] == "first":
            over = [
                value > 0.1
                for key, value in networks.items()
                if key[:2] == (row["verified"], row["method"])
            ]
            assert len(over) == int(row["networks"])
            assert sum(over) == int(row["networks_over_a_tenth"])
