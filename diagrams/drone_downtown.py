"""A drone, gravity off, flies a Livox Mid-360 along a street of Downtown."""

from pathlib import Path

import numpy as np
from pydrake.geometry import Meshcat
from pydrake.math import RigidTransform, RollPitchYaw
from pydrake.multibody.math import SpatialVelocity
from pydrake.multibody.parsing import Parser
from pydrake.multibody.plant import AddMultibodyPlantSceneGraph
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder
import typer

from cns_drake import add_lidar, save_meshcat_page
from cns_drake.pictures.daylight import set_view
from cns_drake.pictures.meshcat_drawing import draw_body, draw_points
from cns_drake.scene.perception_geometry import read_perception_geometry

ROOT = Path(__file__).parents[1]
MODELS = "worlds/downtown/stage_04.sdf", "diagrams/models/drone.sdf"
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
    options = {"motion_distortion": True}
    lidar = add_lidar(builder, scene_graph, body, X_BS, "mid-360", **options)
    context = (simulator := Simulator(builder.Build())).get_mutable_context()
    of_plant = plant.GetMyMutableContextFromRoot(context)
    plant.SetFreeBodyPose(of_plant, body, X_WB)
    plant.SetFreeBodySpatialVelocity(of_plant, body, V_WB)
    port, frames = lidar.GetOutputPort("point_cloud_W"), []
    while context.get_time() < duration - 1e-6:
        simulator.AdvanceTo(context.get_time() + lidar.pattern.period)
        cloud = port.Eval(lidar.GetMyContextFromRoot(context))
        frames.append(cloud.xyzs().T.copy())
    print(f"{len(points := np.concatenate(frames))} returns")
    meshcat, inspector = Meshcat(), scene_graph.model_inspector()
    own = plant.GetBodyFrameIdOrThrow(body.index())
    for path, wanted in (("drone", own.__eq__), ("city", own.__ne__)):
        draw_body(meshcat, path, read_perception_geometry(inspector, wanted))
    draw_points(meshcat, "cloud", points)  # Coloured by height.
    meshcat.SetTransform("drone", X := body.EvalPoseInWorld(of_plant))
    set_view(meshcat, points.min(axis=0), points.max(axis=0))
    meshcat.SetCameraPose(X @ [-5, -3, 2.5], X.translation())
    save_meshcat_page(meshcat, page)


if __name__ == "__main__":
    typer.run(main)
