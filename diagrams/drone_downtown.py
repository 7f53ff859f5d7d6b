"""A drone, gravity off, flies a Livox Mid-360 along a street of Downtown."""

from pathlib import Path

import numpy as np
from pydrake.geometry import Meshcat, Rgba
from pydrake.math import RigidTransform, RollPitchYaw
from pydrake.multibody.math import SpatialVelocity
from pydrake.multibody.parsing import Parser
from pydrake.multibody.plant import AddMultibodyPlantSceneGraph
from pydrake.perception import PointCloud
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder
import typer

from cns_drake import add_lidar, save_meshcat_page

ROOT, MODELS = (
    Path(__file__).parents[1],
    ("worlds/downtown/stage_04.sdf", "diagrams/models/drone.sdf"),
)
X_WB = RigidTransform(RollPitchYaw(0.0, 0.1, 0.0), [-110.0, 0.0, 15.0])
X_BS = RigidTransform(RollPitchYaw(np.pi, 0, 0), [0, 0, -0.1])  # Head down.
V_WB = SpatialVelocity(w=[0.0, 0.0, 0.2], v=[15.0, 0.0, 0.0])


def main(page: Path = Path("drone.html"), duration: float = 6.0) -> None:
    builder = DiagramBuilder()
    plant, scene_graph = AddMultibodyPlantSceneGraph(builder, 0.01)
    for model in MODELS:
        (instance,) = Parser(plant).AddModels(str(ROOT / model))
    plant.set_gravity_enabled(instance, False)
    plant.Finalize()
    body = plant.GetBodyByName("body")
    lidar = add_lidar(
        builder, scene_graph, body, X_BS, "mid-360", motion_distortion=True
    )
    simulator = Simulator(builder.Build())
    context = simulator.get_mutable_context()
    of_plant = plant.GetMyMutableContextFromRoot(context)
    plant.SetFreeBodyPose(of_plant, body, X_WB)
    plant.SetFreeBodySpatialVelocity(of_plant, body, V_WB)
    port, frames = lidar.GetOutputPort("point_cloud_W"), []
    while context.get_time() < duration - 1e-6:
        simulator.AdvanceTo(context.get_time() + lidar.pattern.period)
        cloud = port.Eval(lidar.GetMyContextFromRoot(context))
        frames.append(cloud.xyzs().copy())
    points = np.concatenate(frames, axis=1)
    cloud = PointCloud(points.shape[1])
    cloud.mutable_xyzs()[:] = points
    meshcat = Meshcat()
    meshcat.SetObject("cloud", cloud, 0.12, Rgba(0.1, 0.3, 0.6))
    meshcat.SetCameraPose([-125.0, -25.0, 45.0], [-60.0, 0.0, 5.0])
    print(f"{points.shape[1]} returns")
    save_meshcat_page(meshcat, page)


if __name__ == "__main__":
    typer.run(main)
