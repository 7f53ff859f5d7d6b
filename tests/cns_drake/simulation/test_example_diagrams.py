"""The examples in `diagrams`, shortened, as a user would run them.

A few towers stand in place of Downtown, which takes long to load and to show.
"""

import os
from pathlib import Path
import re
import shutil
import subprocess
import sys

from helpers.meshcat_pages import objects, read_commands
import pytest

DIAGRAMS = Path(__file__).parents[3] / "diagrams"
STAGE = Path("worlds/downtown/stage_04.sdf")
pytestmark = pytest.mark.slow
# Name -> its duration, the path of the points on its page, and their least
# number.
EXAMPLES = {
    "warehouse_robot": (0.5, "/drake/lidar", 50_000),
    "wrist_scanner": (0.2, "/drake/cloud", 3_000),
    "drone_downtown": (0.3, "/drake/cloud", 20_000),
}


@pytest.mark.parametrize(
    "name",
    [
        "drone_downtown",
        *(
            pytest.param(one, marks=pytest.mark.night)
            for one in EXAMPLES
            if one != "drone_downtown"
        ),
    ],
)
def test_an_example_runs_and_shows_its_points(name, small_map, tmp_path):
    duration, path, least = EXAMPLES[name]
    script = tmp_path / "diagrams" / f"{name}.py"
    shutil.copytree(DIAGRAMS, script.parent)
    assert (DIAGRAMS.parent / STAGE).is_file()
    (tmp_path / STAGE).parent.mkdir(parents=True)
    shutil.copy(small_map / "stage_04.sdf", tmp_path / STAGE)
    page = tmp_path / "page.html"
    done = subprocess.run(
        [sys.executable, script, "--page", page, "--duration", str(duration)],
        capture_output=True,
        text=True,
        check=True,
        cwd=tmp_path,
    )
    (count,) = re.findall(r"(\d+) returns", done.stdout)
    assert int(count) > least
    points = objects(read_commands(page.read_text()))
    assert any(key.startswith(path) for key in points)


@pytest.mark.night
def test_a_scenario_file_runs_and_publishes_its_scans():
    """In a process of its own, where messages stay."""
    code = """
import sys

from drake import lcmt_point_cloud
from pydrake.common.yaml import yaml_load_typed

sys.path.insert(0, sys.argv[1])
import hardware_scenario

scenario = yaml_load_typed(
    schema=hardware_scenario.Scenario,
    data=open(sys.argv[2]).read(),
    defaults=hardware_scenario.Scenario(),
)
simulator = hardware_scenario.make_simulator(scenario)
simulator.set_target_realtime_rate(0.0)
simulator.AdvanceTo(0.5)
diagram, root = simulator.get_system(), simulator.get_context()
for name in ("roof", "mast"):
    lidar = diagram.GetSubsystemByName(name)
    context = lidar.GetMyContextFromRoot(root)
    p_WS = lidar.GetOutputPort("X_WS").Eval(context).translation()
    print(name, len(lidar.GetOutputPort("scan").Eval(context)), *p_WS)
"""
    file = DIAGRAMS / "scenarios" / "robot_and_car.yaml"
    done = subprocess.run(
        [sys.executable, "-c", code, DIAGRAMS, file],
        capture_output=True,
        text=True,
        check=True,
        env=os.environ | {"LCM_DEFAULT_URL": "memq://"},
    )
    rows = dict(line.split(" ", 1) for line in done.stdout.splitlines())
    count, x, y, z = map(float, rows["roof"].split())
    assert count > 20_000
    # The car stands still, 1.6 m below its LiDAR.
    assert [x, y, z] == pytest.approx([1.0, 3.0, 1.6], abs=0.01)
    count, x, y, z = map(float, rows["mast"].split())
    assert count > 50_000
    # The robot speeds up to 9 rad/s of its wheels, 1.08 m/s, along x.
    assert -6.0 + 0.05 < x < -6.0 + 0.54
    assert [y, z] == pytest.approx([0.0, 0.8], abs=0.02)
