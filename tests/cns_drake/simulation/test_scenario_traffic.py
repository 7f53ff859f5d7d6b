"""More traffic in a scenario than its map can hold."""

import re

from helpers.small_city import ROADS
from helpers.small_map import write_small_map
from helpers.tiny_drive import tiny_scenario, write_scenario
import pytest

from cns_drake.base import InputError
from cns_drake.scenarios import (
    DrivePlan,
    TrafficConfig,
    load_scenario,
    plan_drive,
)
from cns_drake.simulation import load_drive, plan_scenario_traffic


@pytest.fixture
def town(tmp_path):
    folder = write_small_map(tmp_path / "town")
    (folder / "roads.yaml").write_text(ROADS)
    return folder


def scenario_of(town, **traffic):
    place = {"world": None, "map": str(town), "stage": "04"}
    return tiny_scenario(town.parent, traffic=traffic, frames=2, **place)


def fault(scenario, **traffic):
    """Returns the one line that refuses so much traffic."""
    wanted = TrafficConfig(**traffic)
    with pytest.raises(InputError) as error:
        load_drive(DrivePlan(scenario.model_copy(update={"traffic": wanted})))
    assert "\n" not in str(error.value)
    return str(error.value)


def test_a_world_has_no_roads(tmp_path):
    scenario = tiny_scenario(tmp_path)
    expected = "tiny_01: traffic: a world has no roads; give a map with some"
    assert fault(scenario, vehicles=1) == expected
    # This holds even with a file of that name beside the world.
    (tmp_path / "roads.yaml").write_text(ROADS)
    assert fault(scenario, vehicles=1) == expected
    with pytest.raises(InputError, match=re.escape(expected)):
        plan_scenario_traffic(scenario.with_traffic(1), plan_drive(scenario))
    # A file is refused when it is read.
    file = write_scenario(scenario.with_traffic(1), tmp_path)
    with pytest.raises(InputError, match=f"{file}: traffic: a world has no"):
        load_scenario(file)


def test_a_map_without_roads(town):
    scenario = scenario_of(town)
    roads = town / "roads.yaml"
    roads.unlink()
    assert fault(scenario, walkers=1) == (
        "tiny_01: traffic: the map has no roads: neither roads.yaml nor "
        f"lanes.json in {town}"
    )


def test_a_map_without_sidewalks(town):
    (town / "roads.yaml").write_text(
        ROADS.replace("sidewalk: 3.0", "sidewalk: 0.5")
    )
    assert fault(scenario_of(town), walkers=1) == (
        "tiny_01: traffic: walkers: the map has no sidewalks; leave walkers out"
    )


@pytest.mark.sampled(1)
@pytest.mark.slow
@pytest.mark.parametrize(
    ("who", "where"), [("vehicles", "roads"), ("walkers", "sidewalks")]
)
def test_too_many_and_as_many_as_possible(town, who, where):
    """The numbers that the line offers are accepted."""
    text = fault(scenario_of(town), **{who: 2000})
    found = re.fullmatch(
        rf"tiny_01: traffic: {who}: 2000 are too many; the {where} hold (\d+)",
        text,
    )
    room = int(found[1])
    assert f" {room + 1} are too many" in fault(
        scenario_of(town), **{who: room + 1}
    )
    scenario = scenario_of(town, **{who: room})
    plan = plan_scenario_traffic(scenario, plan_drive(scenario))
    count = len(plan.kinds) + plan.walkers.values.shape[1]
    assert count + plan.left_out == room
    assert count > room // 2
