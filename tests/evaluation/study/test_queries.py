"""Each number of the tables, recomputed from the rows of the queries."""

from collections import defaultdict
import csv
import math

from helpers import studies
from helpers.small_towns import drive
import numpy as np
import pytest

from evaluation import QueryRows, Results
from evaluation.recognition.bootstrap import route_blocks
from evaluation.recognition.precision_recall import pr_curve
from evaluation.results.keys import OWN, STAGE
from evaluation.study.chosen_methods import choose_methods

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


def key_of(row):
    names = "map", "db", "query", "method", "protocol"
    return tuple(row[name] for name in names)


def read_queries(path):
    """Returns (map, db, query, method, protocol) -> its rows."""
    groups = defaultdict(list)
    for row in read(path):
        groups[key_of(row)].append(row)
    return groups


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


def best_f1(rows):
    values = [0.0]
    for row in rows:
        if row["score"]:
            tp, fp, fn = count(rows, score(row))
            values.append(2 * tp / (2 * tp + fp + fn))
    return max(values)


def test_place_recognition(report):
    groups = read_queries(report / "query_details.csv")
    table = read(report / "place_recognition.csv")
    # Two modes; two pairs by each method, and the paper's own by its protocol.
    of_paper = [key for key in groups if key[-1] == "paper"]
    assert {key[3] for key in of_paper} == set(METHODS) - {"layered-overlap"}
    assert len(table) == 2 * len(groups)
    assert len(groups) - len(of_paper) == 2 * len(METHODS)
    for row in table:
        pair = row["DB → query"].split(" → ")
        rows = groups[(row["map"], *pair, row["method"], row["protocol"])]
        assert len(rows) == int(row["queries"])
        counted = rows
        if row["mode"] == "filtered":
            counted = [r for r in rows if r["has_match"] == "1"]
        places = int(rows[0]["places"])
        expected = {
            "AUC": area(counted),
            "F1max": best_f1(counted),
            "R@1": recall_at(rows, 1),
            "R@5": recall_at(rows, 5),
            "R@25": recall_at(rows, 25),
            "R@1%": recall_at(rows, max(1, round(places / 100))),
            "N (with a match)": sum(r["has_match"] == "1" for r in rows),
            "TP of R@1": sum(r["correct"] == "1" for r in rows),
        }
        for name, value in expected.items():
            assert float(row[name]) == pytest.approx(value, abs=1e-12), name


def test_survival(report):
    changed = read_queries(report / "query_details.csv")
    unchanged = read_queries(report / "query_details_unchanged.csv")
    table = read(report / "survival.csv")
    assert {key for key in changed if key[-1] == "fair"} == unchanged.keys()
    assert len(table) == len(unchanged)
    some_lost = False
    for row in table:
        key = key_of(row)
        for rows, when in ((unchanged, "unchanged"), (changed, "changed")):
            expected = pytest.approx(area(rows[key]), abs=1e-12)
            assert float(row[f"auc_{when}"]) == expected
            expected = pytest.approx(recall_at(rows[key], 1), abs=1e-12)
            assert float(row[f"r1_{when}"]) == expected
        before = area(unchanged[key])
        if before == 0.0:
            assert row["kept"] == row["kept_low"] == ""
            continue
        kept = float(row["kept"])
        assert kept == pytest.approx(area(changed[key]) / before, abs=1e-12)
        assert float(row["kept_low"]) <= kept <= float(row["kept_high"])
        some_lost |= kept < 0.9
    assert some_lost


def test_poses(report):
    groups = read_queries(report / "query_details.csv")
    table = read(report / "poses.csv")
    assert len(table) == sum(key[-1] == "fair" for key in groups)
    some = 0
    for row in table:
        rows = groups[key_of(row)]
        curve = [(count(rows, score(r)), score(r)) for r in rows if r["score"]]
        values = [2 * tp / (2 * tp + fp + fn) for (tp, fp, fn), _ in curve]
        pure = [tp / max(tp + fn, 1) for (tp, fp, fn), _ in curve if fp == 0]
        recall = float(row["recall_at_full_precision"])
        assert recall == pytest.approx(max(pure, default=0.0))
        # The greatest score counts among equal values.
        best = max(values, default=0.0)
        least = max(
            (s for (_, s), v in zip(curve, values, strict=True) if v == best),
            default=math.inf,
        )
        accepted = [
            r
            for r in rows
            if r["correct"] == "1" and r["score"] and score(r) >= least
        ]
        assert int(row["accepted_matches"]) == len(accepted)
        for name in ("translation", "rotation"):
            unit = "_deg" if name == "rotation" else ""
            errors = [
                float(r[f"{name}_error{unit}"])
                for r in accepted
                if r[f"{name}_error{unit}"]
            ]
            if not errors:
                assert row[f"{name}_median{unit}"] == ""
                continue
            some += 1
            for part, q in (("median", 50), ("90", 90)):
                value = float(row[f"{name}_{part}{unit}"])
                assert value == pytest.approx(np.percentile(errors, q))
        asked = [r for r in rows if r["has_match"] == "1"]
        near = [
            r["translation_error"] != ""
            and float(r["translation_error"]) <= 2.0
            and float(r["rotation_error_deg"]) <= 5.0
            for r in asked
        ]
        assert float(row["success"]) == pytest.approx(np.mean(near))
    assert some > 8


def test_the_protocol_stands_in_every_row(report):
    for name in ("query_details", "poses", "place_recognition"):
        for row in read(report / f"{name}.csv"):
            assert row["radius"] == "7.5"
            number = "10" if row["method"] == "btc" else "1"
            assert row["scans_per_place"] == number
            assert row["exclude_recent"] == ""


def test_the_control_takes_the_place_of_the_earlier_drive(report):
    for key, rows in read_queries(
        report / "query_details_unchanged.csv"
    ).items():
        drives = {(r["match_drive"], r["query_drive"]) for r in rows}
        control = ("riverside_01_stage_02", "riverside_02")
        assert drives == {control if key[1] == "01" else control[::-1]}


def test_where_and_when(report):
    found = 0
    for row in read(report / "query_details.csv"):
        sign = -1.0 if row["query"] == "02" else 1.0
        frame = int(row["query_frame"])
        assert float(row["query_x"]) == pytest.approx(10.0 * frame)
        assert float(row["query_y"]) == pytest.approx(sign * 2.0)
        # The drives look 0.05 rad to the left.
        turn = [float(row[f"query_q{axis}"]) for axis in "xyzw"]
        expected = [0.0, 0.0, math.sin(0.025), math.cos(0.025)]
        assert turn == pytest.approx(expected)
        if not row["score"]:
            assert row["match_frame"] == row["distance"] == ""
            assert row["correct"] == "0"
            continue
        found += 1
        away = math.dist(
            *(
                [float(row[f"{what}_{axis}"]) for axis in "xyz"]
                for what in ("query", "match")
            )
        )
        assert float(row["distance"]) == pytest.approx(away)
        assert row["correct"] == str(int(away <= 7.5))
        span = int(row["match_stamp_ns"]) - int(row["query_stamp_ns"])
        frames = int(row["match_frame"]) - frame
        assert span == frames * 50_000_000
    assert found > 20


def test_a_report_is_read_as_a_study(report):
    """The answers have the keys of the results, and give the same AUC."""
    rows = Results.read(report).where({STAGE: OWN}, metric="auc").rows
    results = {row.identity: row.value for row in rows}
    found = {one.identity: one for one in QueryRows.read(report).answers}
    assert set(results) <= set(found)
    for key, value in results.items():
        assert pr_curve(found[key].outcomes).auc == pytest.approx(value)
        columns = found[key].columns
        places = np.stack([columns[f"query_{axis}"] for axis in "xyz"], axis=1)
        # The drives begin at their first query, and do not turn.
        expected = route_blocks(places, np.arange(len(places)))
        np.testing.assert_array_equal(columns["block"], expected)
