"""A page shows the user's method beside the shipped results."""

from dataclasses import replace
import html
from pathlib import Path
import re

from helpers.result_keys import place_key
import numpy as np
import pytest

from evaluation.results import (
    OWN,
    STAGE,
    Answers,
    QueryRows,
    Results,
    draw_chart,
    write_page,
)

STAGES = Path("evaluation/results/baselines/stages.csv")
METRIC = "auc_strict"
CHOSEN = {"task": "place", "verified": False, "map": "suburbia"}


@pytest.fixture(scope="module")
def shipped():
    return Results.read(STAGES).where(CHOSEN, metric=METRIC)


def mine(shipped, factor=1.0, **changes):
    """BTC's results times a factor, as those of the user's method."""
    return Results.of(
        replace(
            row,
            method="mine",
            **{n: factor * getattr(row, n) for n in ("value", "low", "high")},
            **changes,
        )
        for row in shipped.where(method="btc").rows
    )


def page(results, folder, queries=None, own=("mine",)):
    notes = []
    path = write_page(
        results,
        queries,
        folder,
        title="stages",
        own_methods=own,
        on_note=notes.append,
    )
    text = path.read_text("utf-8").replace("&nbsp;", " ")
    return html.unescape(re.sub(r"[ \n]+", " ", text)), notes


def test_the_method_stands_among_the_shipped_ones(shipped, tmp_path):
    text, notes = page(mine(shipped, 0.9), tmp_path)
    assert notes == []
    changed = shipped.where({STAGE: OWN})
    means = {
        name: np.mean([row.value for row in changed.where(method=name).rows])
        for name in changed.distinct("method")
    }
    own = 0.9 * means["btc"]
    place = 1 + sum(value > own for value in means.values())
    assert f"mine: {place} of {len(means) + 1} by AUC strict" in text
    cells = re.search(r"BTC</td>(.*?)</tr>", text).group(1)
    values = [cell.strip() for cell in re.findall(r"<td>(.*?)</td>", cells)]
    # With a true minus.
    difference = f"\N{MINUS SIGN}{means['btc'] - own:.2f}"
    assert values[1:] == [difference, "0 of 2", "0 better, 0 worse"]
    assert (tmp_path / "beside.pdf").is_file()
    # Only the own method has a colour.
    colours = {*re.findall(r"#[0-9a-f]{6}", text[text.index("<main>") :])}
    assert {"#d81b60", "#7a8594"} <= colours
    chart = {"kind": "lines", "over": "seed", "metric": METRIC}
    others = draw_chart(chart, changed).legend.values()
    assert "#d55e00" in {one.colour.lower() for one in others}
    assert "#d55e00" not in colours


def test_what_lies_beyond_the_intervals_is_surely_better(shipped, tmp_path):
    best = Results.of(
        replace(row, value=1.0, low=0.999, high=1.0)
        for row in mine(shipped).rows
    )
    text, _ = page(best, tmp_path)
    assert "mine: 1 of 8 by AUC strict" in text
    surely = [
        row.method
        for row in shipped.where({STAGE: OWN}).rows
        if row.high < 0.999
    ]
    assert surely.count("solid") == 2
    better = re.search(r"Better than (.*?) in all of them", text).group(1)
    assert "SOLiD" in better
    assert better.count(",") + better.count(" and ") + 1 == sum(
        surely.count(name) == 2 for name in {*surely}
    )
    assert "Worse than" not in text


@pytest.mark.parametrize(
    ("changes", "why"),
    [
        ({"n": 7}, "not the same queries: 148 (btc), 7 (mine)"),
        ({"version": "9.0.0"}, "measured by versions 4.0.0, 9.0.0"),
        ({"protocol_digest": "abc"}, "protocol_digest: abc in this study"),
        ({"experiment": "else"}, "experiment: else in this study"),
        ({"metric": "mrr"}, "auc_strict was not measured"),
    ],
)
def test_other_conditions_are_not_shown(shipped, tmp_path, changes, why):
    text, (note,) = page(mine(shipped, **changes), tmp_path)
    assert note.startswith("Shipped results are not shown: ")
    assert why in note
    assert note in text
    assert 'id="beside"' not in text


def test_without_an_own_method_nothing_is_shown(shipped, tmp_path):
    text, notes = page(mine(shipped), tmp_path, own=())
    assert notes == []
    assert 'id="beside"' not in text


def test_queries_that_one_of_two_methods_answers(shipped, tmp_path):
    answers = [
        Answers(
            **place_key(factors={STAGE: stage}, **{"method": name}),
            columns={"correct": np.array(right, dtype=bool)},
        )
        for name, stage, right in (
            ("mine", OWN, [1, 1, 0, 0, 1]),
            ("btc", OWN, [0, 1, 1, 0, 0]),
            # Controls do not count.
            ("mine", "last", [1, 1, 1, 1, 1]),
            ("btc", "last", [0, 0, 0, 0, 0]),
        )
    ]
    text, _ = page(mine(shipped), tmp_path, QueryRows.of(answers))
    row = re.search(r"mine, BTC</td>(.*?)</tr>", text).group(1)
    assert re.findall(r"<td>(\d+)</td>", row) == ["2", "1", "5"]
