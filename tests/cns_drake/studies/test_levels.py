"""The frozen levels, and the check of others' results on them."""

import csv

import pytest

from cns_drake.base.errors import InputError
from cns_drake.studies.levels import (
    frozen_levels,
    level_table,
    planned_levels,
    read_results,
)

LEVELS = {("town", 0): "a", ("town", 1): "b", ("city", 0): "c"}
LEVELS |= {("city", 1): "d"}
HEADER = (
    *("map", "cause", "level", "method", "gate", "drives"),
    *("auc", "auc_low", "auc_high"),
)


def rows(method, auc):
    """Complete results; `auc` maps map and level to AUC."""
    return [
        [
            *(name, "all" if level else "none", level, method, told, drives),
            *(auc[name, level], auc[name, level] - 0.01, 1.0),
        ]
        for (name, level), drives in LEVELS.items()
        for told in (0, 1)
    ]


def write(path, table):
    with path.open("w", newline="") as stream:
        csv.writer(stream).writerows([HEADER, *table])
    return path


EASY = dict.fromkeys(LEVELS, 0.995)
HARD = {("town", 0): 0.9, ("town", 1): 0.2, ("city", 0): 0.7, ("city", 1): 0.4}


def test_the_levels_are_as_they_were_frozen():
    assert planned_levels() == frozen_levels()
    assert {level for _, level in frozen_levels()} == {0, 1, 2, 3, 4}


def test_maps_and_solved_levels(tmp_path):
    ours = write(tmp_path / "ours.csv", rows("solid", HARD))
    easy = EASY | {("city", 1): 0.985}
    theirs = write(tmp_path / "theirs.csv", rows("theirs", easy))
    table = level_table(read_results([ours, theirs], LEVELS))
    header = ("map", "method", "gate", "level 0", "level 1")
    assert table.header == header
    assert table.rows == (
        ("city", "SOLiD", "no", 0.7, 0.4),
        ("city", "SOLiD", "yes", 0.7, 0.4),
        ("city", "theirs", "no", 0.995, 0.985),
        ("city", "theirs", "yes", 0.995, 0.985),
        # The interval begins at 0.975.
        ("city", "solved", "no", "yes", "no"),
        ("town", "SOLiD", "no", 0.9, 0.2),
        ("town", "SOLiD", "yes", 0.9, 0.2),
        ("town", "theirs", "no", 0.995, 0.995),
        ("town", "theirs", "yes", 0.995, 0.995),
        ("town", "solved", "no", "yes", "yes"),
    )


def test_one_map_is_enough(tmp_path):
    kept = [row for row in rows("solid", HARD) if row[0] == "city"]
    found = read_results([write(tmp_path / "city.csv", kept)], LEVELS)
    assert [row[0] for row in level_table(found).rows] == ["city"] * 3
    path = write(tmp_path / "less.csv", kept[:-1])
    with pytest.raises(InputError, match="level 1 of city, gate 1: 0"):
        read_results([path], LEVELS)


def test_a_method_in_two_tables_must_be_equal(tmp_path):
    one = write(tmp_path / "one.csv", rows("solid", HARD))
    same = write(tmp_path / "same.csv", rows("solid", HARD))
    other = write(tmp_path / "other.csv", rows("solid", EASY))
    assert read_results([one, same], LEVELS) == read_results([one], LEVELS)
    with pytest.raises(InputError, match=r"solid on town: differs from"):
        read_results([one, other], LEVELS)


@pytest.mark.parametrize(
    ("row", "column", "value", "fault"),
    [
        (
            0,
            5,
            "other",
            "line 2: drives: they are not those of level 0 of town",
        ),
        (1, 2, "7", "line 3: drives: they are not those of level 7"),
        (2, 6, "1.2", "line 4: auc"),
        (2, 7, "0.2499", None),
        (2, 7, "0.2501", "line 4: auc"),
        (2, 8, "0.1501", "line 4: auc"),
        (1, 4, "7", "line 3: gate: 7 is not 0 or 1"),
        (1, 3, "\x1b[31mred", "line 3: a control character"),
        (2, 7, "1.5", "line 4: auc"),
        (3, 6, "good", "line 5: not a number"),
        (4, 4, "1", "level 0 of city, gate 0: 0 rows instead of 1"),
        (5, 1, "snow", "level 0 of city, gate 1: 0 rows"),
    ],
)
def test_faults_are_named(tmp_path, row, column, value, fault):
    table = rows("solid", HARD)
    table[row][column] = value
    path = write(tmp_path / "results.csv", table)
    if fault is None:
        read_results([path], LEVELS)
        return
    with pytest.raises(InputError, match=fault):
        read_results([path], LEVELS)
