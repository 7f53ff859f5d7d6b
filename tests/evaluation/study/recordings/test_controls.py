"""Controls: drives on exactly the same route through a city."""

from helpers.drive_files import T0_NS, make_scan, write_recording, yaw_pose
from helpers.small_towns import ROUTES, drive
import numpy as np
import pytest

from evaluation.base import InputError
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


@pytest.mark.parametrize(("later_s", "is_split"), [(4.9, True), (5.1, False)])
def test_files_of_one_recording_are_no_two_drives(tmp_path, later_s, is_split):
    poses = [yaw_pose(3.0 * k, 0.0, 0.0, 0.0) for k in range(4)]
    for k in range(2):
        # From the last scan of one to the first of the next.
        start = T0_NS + k * (3 * 10**6 + round(later_s * 1e9))
        stamps = start + np.arange(4) * 10**6
        path = write_recording(
            tmp_path / f"{k}",
            [make_scan(np.ones((5, 3)))] * 4,
            poses,
            stamps_ns=stamps.tolist(),
        )
        (tmp_path / "all").mkdir(exist_ok=True)
        path.rename(tmp_path / "all" / f"town_0{k}.mcap")
    if is_split:
        with pytest.raises(InputError, match=r"01\.mcap continues town_00"):
            find_recordings(tmp_path / "all")
    else:
        assert len(find_recordings(tmp_path / "all")) == 2
