"""Conclusions of the pages, each held against all tables that bear on it."""

from collections import defaultdict
from statistics import fmean

from helpers import documents
import pytest
from scipy.stats import spearmanr

from docs.fill_numbers import csv_rows

LIMITS = (documents.ROOT / "docs/limits.md").read_text()


def means(name, *keys, value="value", **conditions):
    """Returns the means of a column by its keys, of rows that meet all."""
    found = defaultdict(list)
    for row in csv_rows(name):
        if row[value] and all(row[k] == v for k, v in conditions.items()):
            found[tuple(row[key] for key in keys)].append(float(row[value]))
    return {key: fmean(some) for key, some in found.items()}


def verdicts():
    return {
        row["method"]: row["verdict"]
        for row in csv_rows("network_survival.csv")
        if (row["part"], row["pairs"], row["verified"])
        == ("found", "first", "1")
    }


def season_beside_age():
    """Method -> what 40 years cost, and what another season costs then."""
    kept = means(
        "ageing.csv",
        "method",
        "season",
        value="relative_auc_strict",
        turned="1",
        furniture="2 m",
        years="40",
    )
    return {
        method: (1.0 - kept[method, "same"], kept[method, "same"] - other)
        for (method, season), other in kept.items()
        if season == "other"
    }


def correlations_over_pairs():
    """Method -> rank correlations of its loss with both measures."""
    path = "evaluation/results/baselines/stages.csv"
    keys = "method", "map", "database", "query"
    conditions = {"both.stage": "own", "verified": "0"}
    kept = means(path, *keys, metric="relative_auc_strict", **conditions)
    seen = means(path, *keys, metric="visible_change", **conditions)
    tcr = {
        (row["map"], frozenset([row["sequence_a"], row["sequence_b"]])): float(
            row["simulated"]
        )
        for row in csv_rows("evaluation/paper/tcr.csv")
        if row["simulated"]
    }
    found = {}
    for method in {key[0] for key in kept} - {"bevplace"}:
        pairs = [key for key in kept if key[0] == method]
        of_pairs = [
            tcr[map_, frozenset([first[-2:], second[-2:]])]
            for _, map_, first, second in pairs
        ]
        loss = [1.0 - kept[key] for key in pairs]
        found[method] = (
            spearmanr(loss, [seen[key] for key in pairs]).statistic,
            spearmanr(loss, of_pairs).statistic,
        )
    return found


def test_no_method_survives_by_networks():
    assert "No method is shown to survive" in LIMITS
    found = verdicts()
    assert "survives" not in found.values()
    fail = {name for name, one in found.items() if one == "does not survive"}
    assert fail == {"ring++", "scan-context++", "solid"}


def test_a_season_costs_more_than_age_for_the_method_that_is_named():
    row = "Another season costs RING++ more than 40 years, but not BTC and"
    assert row in LIMITS
    assert {
        method for method, (age, season) in season_beside_age().items()
        if season > age
    } == {"ring++"}  # fmt: skip


def test_tcr_sym_is_as_good_over_the_ten_pairs():
    assert "TCR_sym is as good or better for four of six methods" in LIMITS
    found = correlations_over_pairs()
    assert len(found) == 6
    assert sum(tcr >= seen for seen, tcr in found.values()) == 4


@pytest.mark.parametrize(("method", "helps"), [("btc", True), ("solid", False)])
def test_merging_helps_one_method(method, helps):
    assert "Merging helps BTC, not SOLiD; updating helps none" in LIMITS
    found = means(
        "upkeep.csv",
        "condition",
        experiment="maintenance",
        metric="auc_strict",
        verified="0",
        method=method,
    )
    newest, merged = found["1",], found["20, 10, 1: none",]
    assert (merged > newest) == helps
    # An update by exact labels adds less than a hundredth.
    assert found["20, 10, 1: truth",] < merged + 0.01


def test_kind_and_amount_of_change_are_mixed():
    assert "kind and amount of change are mixed" in LIMITS
    seen = means("what_changes.csv", "map", "cause", metric="visible_change")
    cities = {city for city, _ in seen}
    more = {
        cause: [seen[city, cause] - seen[city, "none"] for city in cities]
        for cause in ("missing", "scattered")
    }
    assert min(more["missing"]) > 0.145
    assert max(more["missing"]) < 0.235
    assert min(more["scattered"]) > 0.005
    assert max(more["scattered"]) < 0.035


@pytest.mark.parametrize("level", range(5))
def test_levels_tell_methods_apart_where_something_changes(level):
    found = means(
        "levels.csv", "verified", "method", metric="auc", level=str(level)
    )
    for verified in "01":
        between = sum(
            0.05 <= auc <= 0.95
            for (key, _), auc in found.items()
            if key == verified
        )
        assert (between >= 3) == (level > 0)


def test_predictions_that_hold_are_counted():
    rows = [
        row
        for row in csv_rows("outside.csv")
        if row["declared"] and row["found"]
    ]
    hold = [
        row
        for row in rows
        if float(row["predicted_low"])
        <= float(row["found"])
        <= float(row["predicted_high"])
    ]
    text = " ".join((documents.ROOT / "README.md").read_text().split())
    assert (
        f"Of {len(rows)} predictions of public results, {len(hold)} hold"
        in text
    )
    forests = [row for row in hold if "Wild-Places" in row["source"]]
    names = [row["quantity"].partition(":")[2] for row in forests]
    assert len(set(names)) == len(names), "none holds in both forests"


@pytest.mark.parametrize("candidates", ["25", "50"])
@pytest.mark.parametrize("sector", ["hidden_60", "hidden_120"])
def test_the_number_of_shifts_decides_with_a_hidden_sector(candidates, sector):
    found = means(
        "forest_task.csv",
        "cause",
        "search_ratio",
        value="r1",
        candidates=candidates,
    )
    assert found[f"{sector}_against", "0.1"] < 0.05
    assert found[f"{sector}_against", "1.0"] > 0.5
    assert min(found[sector, "0.1"], found["against", "0.1"]) > 0.95
