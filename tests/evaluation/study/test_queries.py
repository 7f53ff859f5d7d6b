"""Each number of the tables, recomputed from the rows of the queries."""

from collections import defaultdict
import csv
import math

from helpers.internal import studies
from helpers.small_towns import drive
import numpy as np
import pytest

from evaluation import QueryRows, Results
from evaluation.recognition import choose_methods, route_blocks
from evaluation.results import OWN, STAGE

pytestmark = pytest.mark.slow

# The paper measured two of them.
METHODS = ("scan-context++", "solid", "layered-overlap")


@pytest.fixture(scope="module")
def report(tmp_path_factory):
    """A city with a control that the paper compares in both directions."""
    folder = tmp_path_factory.mktemp("recordings")
    drive(folder / "riverside_01", "01", "a", city="riverside")
    drive(folder / "riverside_02", "02", "b", city="riverside")
    drive(folder / "riverside_01_stage_02", "02", "a", city="riverside")
    output = tmp_path_factory.mktemp("report")
    with pytest.MonkeyPatch.context() as patch:
        studies.leave_figures_unrendered(patch)
        studies.report(folder, output, choose_methods(METHODS))
    return output


def read(path):
    with path.open(newline="") as stream:
        return list(csv.DictReader(stream))


KEY = ("database", "query", "method", "verified", "both.stage")


def answers(folder):
    """Returns key -> rows of the queries of the task `place`."""
    groups = defaultdict(list)
    for row in read(folder / "queries.csv"):
        if row["task"] == "place":
            groups[tuple(row[name] for name in KEY)].append(row)
    return groups


def numbers(folder, task):
    """Returns key -> metric -> value of a task."""
    found = defaultdict(dict)
    for row in read(folder / "results.csv"):
        if row["task"] == task:
            key = tuple(row[name] for name in KEY)
            found[key][row["metric"]] = float(row["value"] or "nan")
    return found


def count(rows, threshold):
    """Returns TP, FP and FN."""
    accepted = [r for r in rows if r["score"] and score(r) >= threshold]
    tp = sum(r["correct"] == "1" for r in accepted)
    with_match = sum(r["has_match"] == "1" for r in rows)
    found = sum(r["has_match"] == "1" for r in accepted)
    return tp, len(accepted) - tp, with_match - found


def score(row):
    return float(row["score"])


def area(rows):
    total = 0.0
    at = None
    for threshold in sorted({score(r) for r in rows if r["score"]})[::-1]:
        tp, fp, fn = count(rows, threshold)
        precision, recall = tp / (tp + fp), tp / max(tp + fn, 1)
        last, height = at or (0.0, precision)
        total += (recall - last) * (height + precision) / 2.0
        at = recall, precision
    return total


def recall_at(rows, rank):
    ranks = [
        float(r["first_right_rank"] or "inf")
        for r in rows
        if r["has_match"] == "1"
    ]
    return sum(one <= rank for one in ranks) / len(ranks)


def test_place_recognition(report):
    groups = answers(report)
    table = numbers(report, "place")
    assert groups.keys() == table.keys()
    # Both ways, without and with verification, in both conditions.
    assert len(groups) == 8 * len(METHODS)
    some_lost = False
    for key, rows in groups.items():
        found = table[key]
        before = groups[(*key[:-1], "last")]
        area_before = area(before)
        kept = area(rows) / area_before if area_before else math.nan
        some_lost |= kept < 0.9
        expected = {
            "auc": area(rows),
            "r1": recall_at(rows, 1),
            "with_match": sum(r["has_match"] == "1" for r in rows),
            "relative_auc": kept,
            "recall_at_full_precision": max(
                (
                    tp / max(tp + fn, 1)
                    for tp, fp, fn in (
                        count(rows, score(r)) for r in rows if r["score"]
                    )
                    if fp == 0
                ),
                default=0.0,
            ),
        }
        for name, value in expected.items():
            assert found[name] == pytest.approx(
                value, abs=1e-12, nan_ok=True
            ), name
    assert some_lost


def test_pose_success(report):
    groups = answers(report)
    table = numbers(report, "pose")
    assert table
    for key, found in table.items():
        asked = [r for r in groups[key] if r["has_match"] == "1"]
        near = [
            r["translation_error"] != ""
            and float(r["translation_error"]) <= 2.0
            and float(r["rotation_error_deg"]) <= 5.0
            for r in asked
        ]
        assert found["pose_success"] == pytest.approx(np.mean(near))


def test_the_control_takes_the_place_of_the_earlier_drive(report):
    control = {"riverside_01": "riverside_01_stage_02"}
    for key, rows in answers(report).items():
        drives = {r["match_drive"] for r in rows} - {""}
        name = key[0]
        if key[-1] == "last":
            name = control.get(name, name)
        assert drives <= {name}


def test_where_and_when(report):
    found = 0
    for row in read(report / "queries.csv"):
        sign = -1.0 if row["query"].endswith("02") else 1.0
        if row["both.stage"] == "last":
            continue
        frame = int(row["query_frame"])
        assert float(row["query_x"]) == pytest.approx(10.0 * frame)
        assert float(row["query_y"]) == pytest.approx(sign * 2.0)
        if not row["score"]:
            assert row["match_frame"] == row["distance"] == ""
            assert row["correct"] == "0"
            continue
        found += 1
        # The places are 4 m beside the queries, 10 m apart.
        along = 10.0 * (int(row["match_frame"]) - frame)
        away = math.hypot(along, 4.0)
        assert float(row["distance"]) == pytest.approx(away)
        assert row["correct"] == str(int(away <= 7.5))
    assert found > 20


def test_a_report_is_read_as_a_study(report):
    """The answers have the keys of the results, and give the same AUC."""
    rows = Results.read(report).where({STAGE: OWN}, metric="auc").rows
    results = {row.identity: row.value for row in rows}
    found = {one.identity: one for one in QueryRows.read(report).answers}
    assert set(results) <= set(found)
    for key, value in results.items():
        assert found[key].outcomes.curve.auc == pytest.approx(value)
        columns = found[key].columns
        places = np.stack([columns[f"query_{axis}"] for axis in "xyz"], axis=1)
        # The drives begin at their first query, and do not turn.
        expected = route_blocks(places, np.arange(len(places)))
        np.testing.assert_array_equal(columns["block"], expected)
