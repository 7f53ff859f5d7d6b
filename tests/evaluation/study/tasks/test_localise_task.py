"""Scans that are localised in a study, beside those of a single call."""

import numpy as np
import pytest

from evaluation.base import Reporter
from evaluation.drives import RecordingSource, open_drive
from evaluation.localisation import (
    QUERY,
    Localised,
    Localiser,
    Starts,
    default_settings,
    localise,
    make_estimator,
    make_map,
    measure_localisation,
    read_queries,
)
from evaluation.recognition import numbers_of
from evaluation.study import LocaliseTask

STARTS = (Starts(0.5, 5.0), Starts(2.0, 10.0))


@pytest.fixture(scope="module")
def found(towns):
    """The results of two methods from two starts each."""
    sources = (RecordingSource(towns / f"town_0{i}") for i in (2, 1))
    return measure_localisation(
        Reporter(), *sources, ("plane-icp", "gicp"), STARTS, 10.0
    )


def test_a_pair_is_localised_as_each_scan_alone(towns, found):
    assert len(found) == 4
    mapped, asked = (open_drive(towns / f"town_0{i}") for i in (2, 1))
    settings = default_settings("gicp")
    place = make_map(mapped, settings)
    found_alone = Localiser(place, make_estimator("gicp", settings), settings)
    queries = read_queries(asked, range(8))
    (alone,) = localise([found_alone], queries, STARTS[1:], asked.name, 8)
    for name in QUERY.names:
        if name != "seconds":
            assert np.array_equal(found[3][name], alone[name])


def test_numbers_of_a_pair(found):
    task = LocaliseTask(
        {"methods": ["plane-icp", "gicp"], "starts": [[0.5, 5], [2, 10]]},
        "mine.yaml",
    )
    numbers = list(task.numbers(found, None, {}))
    names = [f"{m} from {r} m" for m in ("plane-icp", "gicp") for r in (0.5, 2)]
    assert list(dict.fromkeys(n.method for n in numbers)) == names
    for name, rows in zip(names, found, strict=True):
        mine = {n.metric: n.value for n in numbers if n.method == name}
        alone = numbers_of("localise", Localised(rows))
        assert repr(mine) == repr({n.metric: n.value for n in alone})
        assert {n.n for n in numbers if n.method == name} == {8}
    # Half of the scans are right that were right before.
    worse = [rows.copy() for rows in found]
    for rows in worse:
        rows["translation_error"] = np.where(np.arange(8) < 4, 0.1, 3.0)
        rows["rotation_error_deg"] = 0.5
    better = [rows.copy() for rows in worse]
    for rows in better:
        rows["translation_error"] = 0.1
    kept = [
        n
        for n in task.numbers(worse, better, {})
        if n.metric == "relative_success"
    ]
    assert [n.value for n in kept] == [0.5] * 4
    ((_, _, columns), *_) = task.answers(worse)
    assert [*columns["correct"]] == [True] * 4 + [False] * 4


def test_one_start_needs_no_name(found):
    task = LocaliseTask({"methods": "gicp"}, "mine.yaml")
    assert {n.method for n in task.numbers(found[2:3], None, {})} == {"gicp"}


def test_a_query_far_from_the_map_is_not_localised(towns):
    mapped = RecordingSource(towns / "town_02")

    def far():
        drive = open_drive(towns / "town_01")
        drive.X_WS[:, 0, 3] += 1e4
        return drive

    notes = []
    reporter = Reporter(
        lambda kind, *values: kind == "note" and notes.extend(values)
    )
    found = measure_localisation(reporter, mapped, far, ("gicp",), STARTS, 10.0)
    assert found == []
    (note,) = notes
    assert note.endswith(": not localised")
    task = LocaliseTask({}, "mine.yaml")
    assert (
        list(task.numbers(found, None, {})) == list(task.answers(found)) == []
    )
