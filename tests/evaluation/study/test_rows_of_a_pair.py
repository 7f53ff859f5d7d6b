"""Commands of one pair beside a report of it: the same rows."""

import re

from helpers import documents
from helpers.internal import studies
from helpers.internal.eval_program import run
import numpy as np
import pytest

from evaluation.recognition import choose_methods
from evaluation.results import QueryRows, Results

pytestmark = pytest.mark.slow
METHODS = ("solid", "ring++")


@pytest.fixture(scope="module")
def report(towns, tmp_path_factory):
    """The folder of a report on two recordings."""
    output = tmp_path_factory.mktemp("report")
    with pytest.MonkeyPatch.context() as patch:
        studies.leave_figures_unrendered(patch)
        studies.report(towns, output, choose_methods(METHODS))
    return output


def measured(rows):
    """Where and what was measured -> its numbers.

    A report takes the name of the map from the name of the drive; a command of
    one pair takes that of the world frame.
    """
    return {
        (*row.without("experiment", "map", "seed", "both.stage"), row.metric): (
            row.value,
            row.low,
            row.high,
            row.n,
        )
        for row in rows
    }


def own_rows(folder, **columns):
    """The rows of town_01 > town_02 that compare with no baseline."""
    table = Results.read(folder)
    if "both.stage" in table.factors:
        table = table.where({"both.stage": "own"})
    named = {"database": "town_01", "query": "town_02", **columns}
    return measured(table.where(**named).rows)


@pytest.mark.parametrize("method", METHODS)
def test_pr_has_the_rows_of_a_report(capsys, towns, report, tmp_path, method):
    both = towns / "town_01", towns / "town_02"
    words = ["pr", *both, "--method", method, "--seed", 0]
    assert run(capsys, *words, "--output", tmp_path)[0] == 0
    expected = own_rows(report, task=("place", "pose"), method=method)
    found = own_rows(tmp_path)
    assert found
    for key, numbers in found.items():
        np.testing.assert_equal(numbers, expected[key])
    answers = {
        (one.method, one.verified): one.columns
        for one in QueryRows.read(report).answers
        if (one.database, one["both.stage"]) == ("town_01", "own")
    }
    for one in QueryRows.read(tmp_path).answers:
        of_report = answers[one.method, one.verified]
        assert one.columns.keys() == of_report.keys()
        for name, values in one.columns.items():
            np.testing.assert_array_equal(values, of_report[name])


def test_tcr_has_the_rows_of_a_report(capsys, towns, report, tmp_path):
    words = ["tcr", towns / "town_01", towns / "town_02", "--output", tmp_path]
    assert run(capsys, *words)[0] == 0
    found = own_rows(tmp_path)
    expected = own_rows(report, task="change")
    # The command measures the context of the change, too.
    assert len(expected) == 6 < len(found)
    for key, numbers in expected.items():
        np.testing.assert_equal(numbers, found[key])


def test_both_tables_are_written_in_one_place():
    users = {
        path.as_posix()
        for package in ("evaluation", "worlds", "cns_drake")
        for path in (documents.ROOT / package).rglob("*.py")
        if {"RESULTS", "QUERIES", "write_csv"}
        <= set(re.findall(r"\w+", path.read_text()))
    }
    root = documents.ROOT / "evaluation"
    assert users == {
        (root / "results/output_files.py").as_posix(),
        (root / "results/table.py").as_posix(),
    }
