"""Traffic of a scenario: what its map has, and where it stands."""

import re

from helpers.recorded_traffic import write_rounds
from helpers.small_city import ROADS
from helpers.small_map import box_visual, world_text, write_small_map
from helpers.tiny_drive import tiny_scenario, write_scenario
import numpy as np
import pytest

from cns_drake.scenarios import (
    DrivePlan,
    TrafficConfig,
    load_scenario,
    plan_drive,
)
from cns_drake.scene import read_perception_geometry
from cns_drake.simulation import load_drive, plan_scenario_traffic
from evaluation.base import InputError
from worlds.maps import LocalMetres


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


SUMO = "give a trace of SUMO instead, with traffic: {fcd: FILE}"


def test_a_map_without_recorded_traffic_or_roads(town):
    scenario = scenario_of(town)
    (town / "traffic.npz").unlink()
    assert fault(scenario, walkers=1) == (
        f"tiny_01: traffic: no recorded traffic, traffic.npz, in {town}: {SUMO}"
    )
    (town / "roads.yaml").unlink()
    assert fault(scenario, queues=True) == (
        f"tiny_01: traffic: queues: no roads.yaml in {town}: {SUMO}"
    )


@pytest.mark.parametrize(("who", "most"), [("vehicles", 20), ("walkers", 60)])
def test_more_than_was_recorded(town, who, most):
    """The number that the line offers is accepted."""
    write_rounds(town / "traffic.npz")
    scenario = scenario_of(town)
    assert fault(scenario, **{who: most + 1}) == (
        f"tiny_01: traffic: {who}: {most + 1} are too many; the recorded"
        f" traffic of the map has {most}: {SUMO}"
    )
    scenario = scenario_of(town, **{who: most})
    plan = plan_scenario_traffic(scenario, plan_drive(scenario))
    count = len(plan.kinds) + plan.walkers.values.shape[1]
    assert count + plan.left_out == most
    assert count > most // 2


def test_a_drive_that_is_longer_than_the_recording(town):
    write_rounds(town / "traffic.npz", seconds=1.0)
    scenario = scenario_of(town).replaced(frames=22)
    assert re.fullmatch(
        "tiny_01: traffic: the recorded traffic of the map takes 1 s, but the"
        rf" drive takes 1.05 s: lower frames, or {re.escape(SUMO)}",
        fault(scenario, walkers=3),
    )
    short = scenario_of(town, walkers=3).replaced(frames=21)
    plan = plan_scenario_traffic(short, plan_drive(short))
    assert plan.walkers.duration == 1.0


# Height of the street [m], and where its city lies [deg].
STREET = 0.25
NORTH = 52.5
EAST = 13.4


def write_street(folder):
    """A street along y = 0 between lawns, with two parked cars."""
    folder.mkdir()
    visuals = [
        box_visual("lawn/plate", (0, 0, -0.5, 0, 0, 0), (300, 300, 1)),
        box_visual("street/plate", (0, 0, STREET - 0.5, 0, 0, 0), (300, 9, 1)),
        box_visual("in_lane/body", (40, -1, 1, 0, 0, 0), (4, 2, 1.5)),
        box_visual("in_bay/body", (40, -4, 1, 0, 0, 0), (4, 2, 1.5)),
    ]
    (folder / "stage_01.sdf").write_text(world_text(visuals))
    (folder / "structures.csv").write_text(
        "instance,name,class\n1,lawn,terrain\n2,street,road\n"
        "3,in_lane,car\n4,in_bay,car\n"
    )
    (folder / "import.yaml").write_text(
        f"reference_system: WGS 84\norigin: [{NORTH}, {EAST}]\n"
    )
    return folder


def write_fcd(path, scale=(1.0, 1.0), origin=(0.0, 0.0)):
    """A car of SUMO that drives along the street at 20 m/s."""
    rows = "".join(
        f'<timestep time="{t:.1f}"><vehicle id="a" angle="90" speed="20"'
        f' x="{(20.0 * t + 10.0) / scale[0] + origin[0]:.9f}"'
        f' y="{-1.0 / scale[1] + origin[1]:.9f}"/></timestep>'
        for t in np.arange(0.0, 3.05, 0.1)
    )
    path.write_text(f"<fcd-export>{rows}</fcd-export>")
    return {"fcd": str(path)}


@pytest.mark.parametrize("in_degrees", [False, True])
def test_a_trace_stands_on_the_ground_of_the_world(tmp_path, in_degrees):
    """And of the parked cars, only the one in its way is left out."""
    street = write_street(tmp_path / "street")
    scale, origin = (1.0, 1.0), (0.0, 0.0)
    if in_degrees:
        origin = EAST, NORTH
        per_degree = LocalMetres(*origin).metres(np.ones(2))
        scale = tuple(per_degree)
    place = {"world": None, "map": str(street), "stage": "01", "frames": 2}
    fcd = write_fcd(tmp_path / "trace.xml", scale, origin)
    drive = load_drive(DrivePlan(tiny_scenario(tmp_path, traffic=fcd, **place)))
    assert drive.traffic.left_out == 0
    rows = drive.traffic.vehicles.values[:, 0]
    half = drive.traffic.kinds[0].size[0] / 2
    x = 20.0 * np.arange(0.0, 3.05, 0.1) + 10.0 - half
    np.testing.assert_allclose(rows[:, 0], x, atol=1e-3)
    np.testing.assert_allclose(
        rows[:, 1:], [[-1, STREET, 0, 0]] * 31, atol=1e-3
    )
    assert "traffic: 1 things in its way left out" in drive.world.notes
    names = {structure["name"] for structure in drive.structures}
    assert {"street", "in_bay"} < names
    boxes = read_perception_geometry(drive.world.scene_graph.model_inspector())
    seen = {geometry.structure for geometry in boxes}
    assert "in_bay" in seen
    assert "in_lane" not in seen


def test_a_trace_in_degrees_needs_to_know_where_the_map_lies(tmp_path):
    street = write_street(tmp_path / "street")
    (street / "import.yaml").unlink()
    place = {"world": None, "map": str(street), "stage": "01", "frames": 2}
    path = tmp_path / "trace.xml"
    fcd = write_fcd(path, (7e4, 1e5), (EAST, NORTH))
    scenario = tiny_scenario(tmp_path, **place)
    assert fault(scenario, **fcd) == (
        f"{path}: its places are longitudes and latitudes: {street}: no"
        " import.yaml tells where it lies"
    )
