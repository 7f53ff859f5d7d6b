"""What the drives of a database notice of the change of a city."""

import math

from helpers.small_map import write_town
import numpy as np
import pytest

from cns_drake.base import Cluster, InputError, Reporter
from cns_drake.scenarios import load_scenario
from cns_drake.simulation import SimulationSource
from cns_drake.studies import Experiment, ExperimentRun
from cns_drake.studies.study import plan_study
from cns_drake.studies.tasks.seen_task import (
    SeenTask,
    Sighting,
    Sightings,
    changes_until,
    noticed_changes,
    sight_structures,
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


def test_the_first_drive_alone_notices_nothing():
    found = noticed_changes(DRIVES[:1], sighting(LAST), CAME, WENT)
    assert not found.is_noticed.any()
    # Nor is there something to notice if nothing changed.
    assert noticed_changes(DRIVES, sighting(FIRST), CAME, WENT).names == []


def test_numbers_of_all_changes_and_of_those_that_the_query_sees():
    query = sighting(LAST, {"house"}, {"elm"})
    every, by_query = (
        noticed_changes(some, query, CAME, WENT)
        for some in (DRIVES, [DRIVES[0], (9, query)])
    )
    task = SeenTask({}, "mine.yaml")
    sightings = Sightings(every, every.chosen(by_query.is_noticed))
    numbers = task.numbers(sightings, None)
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


def test_years_of_a_history(tmp_path):
    town = write_town(tmp_path / "town", {"01": "metropolis_04"}, 3)
    source = SimulationSource(load_scenario(town / "sequence_01.yaml"))
    assert changes_until(Reporter(), source) == ({}, {})
    (town / "history.csv").write_text(
        "year,event,structure,successor,detail\n"
        "1,site,house_1,site_1,\n"
        "2,felled,tree_1,,\n"
        "3,built,house_1,,\n"
        "3,taken_down,site_1,,\n"
        "4,planted,tree_1,tree_1_004y,2 m\n"
        "5,grown,tree_1_004y,,3 m\n"
        "6,furniture,bin,bin_006y,\n"
    )
    came, went = changes_until(Reporter(), source)
    assert came == {"site_1": 1, "house_1": 3, "tree_1_004y": 4, "bin_006y": 6}
    assert went == {"tree_1": 2, "site_1": 3, "bin": 6}
    (town / "history.csv").write_text("year,event\n1,built\n")
    with pytest.raises(InputError, match=r"history\.csv"):
        changes_until(Reporter(), source)


@pytest.mark.slow
def test_a_drive_gets_returns_of_what_stands_there(tmp_path):
    town = write_town(tmp_path / "town", {"01": "metropolis_04"}, 20)
    drive = load_scenario(town / "sequence_01.yaml")
    source = SimulationSource(drive)
    found = sight_structures(Reporter(), source, source, 5.0)
    assert set(found.returned) < set(found.present)
    assert found.before == found.returned
    gone = found.returned[0]
    left = SimulationSource(drive.replaced(without=(gone,)))
    found = sight_structures(Reporter(), left, source, 5.0)
    assert gone not in {*found.present, *found.returned}


def test_a_city_that_does_not_age_has_no_such_numbers(tmp_path):
    town = write_town(tmp_path / "town", {"01": "metropolis_04"}, 3)
    wanted = Experiment.model_validate(
        {"name": "mine", "maps": [str(town)], "tasks": ["seen"]}
    )
    run = ExperimentRun(wanted, tmp_path / "out", "mine.yaml", Cluster())
    with pytest.raises(InputError, match="no condition that can be measured"):
        plan_study(run)
