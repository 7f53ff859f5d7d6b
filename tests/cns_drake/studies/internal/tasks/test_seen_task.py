"""What the drives of a database notice of the change of a city."""

import math

import numpy as np
import pytest

from cns_drake.studies.tasks.seen_task import (
    SeenTask,
    Sighting,
    Sightings,
    noticed_changes,
)


def sighting(present, returned=(), before=()):
    return Sighting(*map(sorted, (present, returned, before)))


# Trees fall in the years 2 and 5, houses come in the years 3 and 4. There are
# drives in the years 0, 3, 6 and 6; the query is in the year 9.
FIRST = {"oak", "elm", "old"}
LAST = {"old", "house", "shed"}
DRIVES = [
    (0, sighting(FIRST, FIRST, FIRST)),
    (3, sighting({"elm", "old", "house"}, {"old"}, {"elm"})),
    (6, sighting(LAST, {"house"}, {"oak", "old"})),
    (6, sighting(LAST, {"house"}, {"old"})),
]
CAME = {"house": 3, "shed": 4}
WENT = {"oak": 2, "elm": 5}


def test_who_notices_what_and_when():
    found = noticed_changes(DRIVES, sighting(LAST), CAME, WENT)
    assert found.names == ["elm", "house", "oak", "shed"]
    # The elm still stood when a drive passed it.
    assert found.is_noticed.tolist() == [False, True, True, False]
    np.testing.assert_array_equal(found.delay, [math.nan, 3.0, 4.0, math.nan])
    # A change of an unknown year is noticed after an unknown time.
    found = noticed_changes(DRIVES, sighting(LAST), {}, {})
    assert found.is_noticed.sum() == 2
    assert np.isnan(found.delay).all()


def test_numbers_of_all_changes_and_of_those_that_the_query_sees():
    query = sighting(LAST, {"house"}, {"elm"})
    every, by_query = (
        noticed_changes(some, query, CAME, WENT)
        for some in (DRIVES, [DRIVES[0], (9, query)])
    )
    task = SeenTask({}, "mine.yaml")
    sightings = Sightings(every, every.chosen(by_query.is_noticed))
    numbers = task.numbers(sightings, None, {})
    found = {one.metric: (one.value, one.n) for one in numbers}
    assert found == {
        "changed": (4.0, 4),
        "seen": (0.5, 4),
        "delay_median": (3.5, 2),
        "delay_95": (pytest.approx(3.95), 2),
        # The query sees the house, and that the elm is gone.
        "changed_here": (2.0, 2),
        "seen_here": (0.5, 2),
        "delay_median_here": (3.0, 1),
        "delay_95_here": (3.0, 1),
    }
