"""Fresh versions of cities: frozen, turned as a whole, with their stages."""

from collections import Counter
from dataclasses import replace

from helpers.small_city import write_small_city
import numpy as np
import pytest
import yaml

from cns_drake.base import Cluster, InputError, Reporter
from cns_drake.roads import load_road_network
from cns_drake.scenarios import load_scenario, shipped_cities
from cns_drake.scene import MapFolder
from cns_drake.studies.maps import map_step
from cns_drake.studies.maps.frozen_redraws import (
    RedrawFrozen,
    frozen_redraws,
    kept_names,
    redraw_frozen,
)
from cns_drake.studies.maps.turned_inputs import turned_content


def test_five_versions_of_each_map_of_which_two_are_off_the_axes():
    versions = frozen_redraws()
    # The city of Metropolis's version 1, with the map's present stages.
    *_, last = [one for one in versions if one.map_name == "metropolis"]
    first = next(one for one in versions if one.map_name == "metropolis")
    assert first.stages == "metropolis_cleared"
    assert last == replace(first, number=6, stages="metropolis")
    versions.remove(last)
    assert Counter(one.map_name for one in versions) == dict.fromkeys(
        shipped_cities(), 5
    )
    assert len({one.seed for one in versions}) == 20
    for name in shipped_cities():
        of_map = [one for one in versions if one.map_name == name]
        assert [one.number for one in of_map] == [1, 2, 3, 4, 5]
        turns = np.array([one.turn_deg for one in of_map])
        off = np.abs((turns + 22.5) % 45.0 - 22.5)
        assert np.count_nonzero(off >= 10.0) == 2


def test_a_quarter_turn():
    plan = {
        "bounds": [0, 0, 4, 2],
        "districts": [
            {
                "area": [[1, 2], [3, 4]],
                "buildings": [{"at": [1, 0], "size": [5, 6], "yaw_deg": 20}],
                "lines": [{"points": [[0, 1], [2, 1]], "yaw_deg": 90}],
                "parking": [{"start": [1, 1], "end": [2, 1]}],
            }
        ],
        "roads": {"a": {"start": "west", "via": [[3, 1, 10.5]]}},
    }
    district = turned_content(plan, 90)["districts"][0]
    assert district["area"] == [[-2, 1], [-4, 3]]
    building = {"at": [0, 1], "size": [5, 6], "yaw_deg": 110}
    assert district["buildings"] == [building]
    # A line's objects turn with it.
    assert district["lines"] == [{"points": [[-1, 0], [-1, 2]], "yaw_deg": 90}]
    assert district["parking"] == [{"start": [-1, 1], "end": [-1, 2]}]
    road = turned_content(plan, 90)["roads"]["a"]
    assert road == {"start": "west", "via": [[-1, 3, 10.5]]}
    assert turned_content(plan, 360.0)["roads"] == plan["roads"]


def test_stages_keep_what_a_city_has():
    stages = {
        "stages": {
            "01": {
                "story": "old",
                "absent": {"a": ["house_001", "house_009"], "b": ["tower_1"]},
                "lower": {
                    "low": {"height": 4, "structures": ["h*"], "but": ["x"]},
                    "gone": {"height": 4, "structures": ["mill_*"]},
                },
            },
            "02": {"story": "new"},
        }
    }
    kept = kept_names(stages, ["house_001", "house_002"])
    assert kept["stages"] == {
        "01": {
            "story": "old",
            "absent": {"a": ["house_001"]},
            "lower": {"low": {"height": 4, "structures": ["h*"]}},
        },
        "02": {"story": "new"},
    }


@pytest.mark.slow
@pytest.mark.parametrize(
    "turn_deg", [pytest.param(0.0, marks=pytest.mark.night), 30.0]
)
def test_a_version_of_a_small_city(tmp_path, turn_deg):
    town = write_small_city(tmp_path / "town")
    roads = load_road_network(town / "roads.yaml")
    name = next(iter(roads.roads))
    drive = {
        "map": ".",
        "stage": "02",
        "speeds": {
            "cruise": 8.0,
            "longitudinal_acceleration": 2.0,
            "lateral_acceleration": 3.0,
        },
        "route": [{"road": name, "direction": "forward", "lane": 1}],
    }
    (town / "sequence_02.yaml").write_text(yaml.safe_dump(drive))
    step = RedrawFrozen(
        tmp_path / "out" / "town_f01", town, "02", 5, turn_deg, town
    )
    step.folder.parent.mkdir()
    assert not step.is_done()
    step.run(Reporter())
    assert step.is_done()
    found = MapFolder(step.folder)
    assert list(found.stages()) == ["01", "02"]
    scenario = load_scenario(found.drive("02"))
    assert (scenario.name, scenario.map) == ("town_f01_02", str(step.folder))
    assert scenario.driver.wander == 0.35
    road, before = (
        network.roads[name].centreline()
        for network in (load_road_network(found.roads), roads)
    )
    c, s = np.cos(np.radians(turn_deg)), np.sin(np.radians(turn_deg))
    x, y = before[:, :2].T
    expected = np.stack([c * x - s * y, s * x + c * y], axis=1)
    np.testing.assert_allclose(road[:, :2], expected, atol=1e-4)
    # Another seed or turn is another city.
    other = RedrawFrozen(step.folder, town, "02", 6, turn_deg, town)
    assert not other.is_done()


def test_versions_that_are_none(tmp_path):
    for maps, numbers, fault in (
        (("atlantis",), (), "map: no frozen redraw 'atlantis'"),
        ((), (7,), "mine: both.redraw.frozen of downtown: no frozen redraw 7"),
        (("metropolis", "suburbia"), (6,), "of suburbia: no frozen redraw 6"),
    ):
        with pytest.raises(InputError, match=fault):
            redraw_frozen(maps, numbers, tmp_path / "out", Cluster(), "mine")
    assert not (tmp_path / "out").exists()


def test_only_what_is_asked_for_is_drawn(tmp_path, monkeypatch):
    drawn = []
    monkeypatch.setattr(
        map_step, "run_jobs", lambda jobs, cluster, unit="": drawn.extend(jobs)
    )
    folders = redraw_frozen(["suburbia"], [2, 4], tmp_path, Cluster(), "mine")
    assert [folder.name for folder in folders] == [
        "suburbia_f02",
        "suburbia_f04",
    ]
    assert [job.step.folder for job in drawn] == folders
    assert all(job.step.turn_deg for job in drawn)
