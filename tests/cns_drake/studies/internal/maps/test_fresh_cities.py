"""Fresh versions of cities: frozen, turned as a whole, with their stages."""

from helpers.small_city import write_small_city
import numpy as np
import pytest
import yaml

from cns_drake.scenarios import load_scenario
from cns_drake.studies.maps.frozen_redraws import RedrawFrozen
from cns_drake.studies.maps.turned_inputs import turned_content
from evaluation.base import Reporter
from worlds.maps import MapFolder
from worlds.roads import load_road_network


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
        network.roads[name].evaluate(network.roads[name].stations())
        for network in (load_road_network(found.roads), roads)
    )
    c, s = np.cos(np.radians(turn_deg)), np.sin(np.radians(turn_deg))
    x, y = before[:, :2].T
    expected = np.stack([c * x - s * y, s * x + c * y], axis=1)
    np.testing.assert_allclose(road[:, :2], expected, atol=1e-4)
    # Another seed or turn is another city.
    other = RedrawFrozen(step.folder, town, "02", 6, turn_deg, town)
    assert not other.is_done()
