"""Without a baseline, a page says who found how many places."""

import re

from helpers.result_keys import place_key
import numpy as np
import pytest

from evaluation.results import (
    LAST,
    OWN,
    STAGE,
    Answers,
    QueryRows,
    Results,
    Row,
    found_lines,
    write_page,
)

CHART = {"kind": "dumbbell", "over": STAGE, "metric": "auc"}
# Method, drive of the queries -> which of four queries are answered.
RIGHT = {
    ("btc", "02"): [1, 0, 0, 0],
    ("ring++", "02"): [1, 1, 1, 0],
    ("btc", "03"): [0, 1, 0, 0],
    ("ring++", "03"): [0, 0, 0, 0],
}


def tables(stages=(OWN,), has_match=(1, 1, 1, 0)):
    rows, answers = [], []
    for (method, query), right in RIGHT.items():
        for stage in stages:
            key = place_key(factors={STAGE: stage}, method=method)
            key |= {"query": query, "database": "01"}
            rows.append(Row(**key, metric="auc", value=0.5))
            columns = {
                "correct": np.array(right, bool) & np.array(has_match, bool),
                "has_match": np.array(has_match, bool),
            }
            answers.append(Answers(**key, columns=columns))
            # Verified answers do not count.
            key["verified"] = True
            columns = {
                "correct": np.ones(4, bool),
                "has_match": np.ones(4, bool),
            }
            answers.append(Answers(**key, columns=columns))
    return Results.of(rows), QueryRows.of(answers)


def written(folder, *options):
    notes = []
    path = write_page(
        *tables(*options),
        folder,
        title="stages",
        charts=[CHART],
        on_note=notes.append,
    )
    return re.sub(r"\s+|&nbsp;", " ", path.read_text("utf-8")), notes


def test_who_found_how_many(tmp_path):
    text, notes = written(tmp_path)
    assert notes == []
    assert "RING++ found 3 of 6 places" in text
    (table,) = re.findall('id="found">.*?</table>', text)
    rows = re.findall(r"<tr>(.*?)</tr>", table)
    cells = [re.findall(r"<t[dh][^>]*>(.*?)</t[dh]>", row) for row in rows]
    assert cells == [
        ["method", "found", "share", "02 in 01", "03 in 01"],
        ["RING++", "3 of 6", "50 %", "3 of 3", "0 of 3"],
        ["BTC", "2 of 6", "33 %", "1 of 3", "1 of 3"],
    ]


def test_lines_for_a_terminal():
    assert [*found_lines(tables()[1])] == [
        "Places found, of 6",
        "RING++  3",
        "BTC     2",
        "",
    ]


@pytest.mark.parametrize("stages", [(LAST, OWN), (None,)])
def test_with_a_baseline_the_change_is_shown(tmp_path, stages):
    """So it is in an experiment without stages."""
    text, notes = written(tmp_path, stages)
    assert 'id="found"' not in text
    assert len(notes) == (stages == (None,))


def test_drives_that_do_not_meet(tmp_path):
    text, _ = written(tmp_path, (OWN,), (0, 0, 0, 0))
    assert "No place to be found" in text
    assert "0 of 0" not in text
