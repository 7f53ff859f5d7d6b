"""Controls: drives on exactly the same route through a city."""

from helpers.small_towns import ROUTES, drive
import pytest

from evaluation.drives import driven_way
from evaluation.study import drives_by_map, find_recordings

LEGS = ROUTES["a"]


def find_city(folder, **more):
    """Records two stages, and in the later one a drive on route a."""
    drive(folder / "town_01", "01", "a", city="town")
    drive(folder / "town_04", "04", "b", city="town")
    drive(folder / "town_walk", "04", "a", city="town", more=more)
    (city,) = drives_by_map(find_recordings(folder))
    return city


def test_a_drive_on_the_same_way_is_a_control(tmp_path):
    city = find_city(tmp_path, aside=0.0, u_turns=False, seed=7)
    (pair,) = city.change_pairs()
    database, query = city.unchanged_pair(*pair)
    assert (database.name, query.name) == ("town_walk", "town_04")


@pytest.mark.parametrize("more", [{"aside": 1.0}, {"u_turns": True}])
def test_a_drive_beside_the_way_is_no_control(tmp_path, more):
    city = find_city(tmp_path, **more)
    (pair,) = city.change_pairs()
    assert city.unchanged_pair(*pair) is None


@pytest.mark.parametrize(
    "stages",
    [("2", "9", "10"), ("v9", "v10"), ("2012-2-4", "2012-10-28")],
)
def test_the_last_stage_is_that_with_the_greatest_number(tmp_path, stages):
    for stage in stages:
        drive(tmp_path / f"town_{stage}", stage, "a", city="town")
    (found,) = drives_by_map(find_recordings(tmp_path))
    *earlier, last = stages
    pairs = [(a.stage, b.stage) for a, b in found.recognition_pairs()]
    back = [(last, one) for one in earlier] if len(earlier) == 1 else []
    assert pairs == [(one, last) for one in earlier] + back


def test_fields_without_effect_make_no_other_way():
    way = driven_way({"route": LEGS})
    assert way is not None
    assert way == driven_way({"route": LEGS, "aside": 0.0, "waypoints": None})
    assert way != driven_way({"route": LEGS, "aside": -1.0})
    assert way != driven_way({"waypoints": "way.csv"})
    assert driven_way({"map": "town", "aside": 1.0}) is None
    assert driven_way(None) is None
