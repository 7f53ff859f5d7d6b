"""The least set of a LiDAR: what a distribution of its own would ship."""

from pathlib import Path
import subprocess
import sys

import pytest

ROOT = Path(__file__).parents[2]
# Packages of ours, and single modules, that the distribution would ship.
SHIPPED = (
    "evaluation.base",
    "cns_drake.ray_casting",
    "cns_drake.scene",
    "cns_drake.sensors.lidar",
)
SINGLE = {
    "cns_drake",
    "cns_drake.sensors",
    "cns_drake.sensors.noise_draws",
    "evaluation",
}
WITHOUT = """
import sys

class Absent:
    def find_spec(self, name, path=None, target=None):
        if name.partition(".")[0] in ABSENT or name.startswith(OURS):
            raise ModuleNotFoundError(f"no {name} here", name=name)

ABSENT = {"pydantic", "yaml", "open3d", "shapely", "osmium", "mcap", "rosbags",
    "typer", "jinja2", "matplotlib", "PIL", "distributed", "small_gicp"}
OURS = ("evaluation.drives", "evaluation.lidar_sheets", "worlds",
    "cns_drake.scenarios", "cns_drake.recording", "evaluation.methods")
sys.meta_path.insert(0, Absent())
import numpy as np
from pydrake.geometry import Box
from pydrake.math import RigidTransform
from pydrake.multibody.plant import AddMultibodyPlantSceneGraph
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder
before = set(sys.modules)
"""
SCAN = """
from cns_drake import DirectionPattern, Lidar, MeasurementModel
builder = DiagramBuilder()
plant, scene_graph = AddMultibodyPlantSceneGraph(builder, 0.01)
plant.RegisterVisualGeometry(
    plant.world_body(), RigidTransform([5.5, 0, 0]), Box(1, 1, 1), "box",
    np.ones(4))
plant.Finalize()
pattern = DirectionPattern(
    [[1, 0, 0]], min_range=0.1, max_range=90.0, period=0.1)
lidar = builder.AddSystem(Lidar(
    scene_graph.world_frame_id(), RigidTransform(), pattern, rate=10,
    measurement=MeasurementModel(range_noise=1e-9)))
builder.Connect(
    scene_graph.get_query_output_port(), lidar.query_object_input_port())
simulator = Simulator(builder.Build())
simulator.AdvanceTo(0.15)
context = lidar.GetMyContextFromRoot(simulator.get_context())
x = lidar.scan_output_port().Eval(context)["x"]
assert abs(x - 5.0) < 1e-5, x
"""
# The rules of sensors' names are those of recorded drives.
ADD = """
OURS = tuple(one for one in OURS if one != "evaluation.drives")
from cns_drake import SpinningPattern, add_lidar, add_lidar_view
add_lidar.__name__
"""


def modules_after(code: str) -> set[str]:
    """Returns the modules that code imports beyond Drake and NumPy."""
    done = subprocess.run(
        [
            sys.executable,
            "-c",
            f"{WITHOUT}{code}print(*sorted(set(sys.modules) - before))",
        ],
        cwd=ROOT,
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stderr
    return set(done.stdout.split())


@pytest.mark.slow
def test_a_lidar_scans_with_its_least_set():
    loaded = modules_after(SCAN)
    ours = {
        name
        for name in loaded
        if name.partition(".")[0] in ("cns_drake", "evaluation", "worlds")
    }
    beyond = {
        name
        for name in ours - SINGLE
        if not any(f"{name}.".startswith(f"{one}.") for one in SHIPPED)
    }
    assert not beyond
    # Of scenes, only what reads geometry.
    assert ours.isdisjoint(
        f"cns_drake.scene.{name}" for name in ("world", "sdf_worlds")
    )
    assert "cns_drake.sensors.lidar.lidar" in ours


@pytest.mark.slow
def test_add_lidar_needs_no_data_sheets():
    """Names of presets and files do; patterns of the user's own don't."""
    loaded = modules_after(ADD)
    assert "cns_drake.sensors.lidar_adding" in loaded
    assert not {n for n in loaded if n.startswith("evaluation.drives.mcap")}
