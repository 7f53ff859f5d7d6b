"""A drone, gravity off, flies a Livox Mid-360 along a street of Downtown."""

from pathlib import Path

from matplotlib.cm import turbo
import numpy as np
from pydrake.geometry import Meshcat, MeshcatVisualizer
from pydrake.math import RigidTransform, RollPitchYaw
from pydrake.multibody.math import SpatialVelocity
from pydrake.multibody.parsing import Parser
from pydrake.multibody.plant import AddMultibodyPlantSceneGraph
from pydrake.perception import BaseField, Fields, PointCloud
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder
import typer

from cns_drake import add_lidar, save_meshcat_page

ROOT = Path(__file__).parents[1]
MODELS = "worlds/downtown/stage_04.sdf", "diagrams/models/drone.sdf"
X_WB = RigidTransform(RollPitchYaw(0.0, 0.1, 0.0), [-110.0, 0.0, 15.0])
X_PB = RigidTransform(RollPitchYaw(np.pi, 0, 0), [0, 0, -0.1])  # Head down.
_FIELDS = Fields(BaseField.kXYZs | BaseField.kRGBs)
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
    lidar = add_lidar(builder, scene_graph, body, X_PB, "mid-360", **options)
    MeshcatVisualizer.AddToBuilder(builder, scene_graph, meshcat := Meshcat())
    context = (simulator := Simulator(builder.Build())).get_mutable_context()
    of_plant = plant.GetMyMutableContextFromRoot(context)
    plant.SetFreeBodyPose(of_plant, body, X_WB)
    plant.SetFreeBodySpatialVelocity(of_plant, body, V_WB)
    port = lidar.GetOutputPort("point_cloud_W")
    frames = []
    while context.get_time() < duration - 1e-6:
        simulator.AdvanceTo(context.get_time() + lidar.pattern.period)
        cloud = port.Eval(lidar.GetMyContextFromRoot(context))
        frames.append(cloud.xyzs().copy())
    points = np.concatenate(frames, axis=1)
    cloud = PointCloud((shown := points[:, ::5]).shape[1], _FIELDS)
    cloud.mutable_xyzs()[:] = shown  # Fewer, for a small page.
    cloud.mutable_rgbs()[:] = turbo(shown[2] / 30.0, bytes=True)[:, :3].T
    meshcat.SetObject("cloud", cloud, point_size=0.12)
    X_WE = body.EvalPoseInWorld(of_plant)  # End of the flight.
    meshcat.SetCameraPose(X_WE @ [-5, -3, 2.5], X_WE.translation())
    print(f"{points.shape[1]} returns")
    save_meshcat_page(meshcat, page)


if __name__ == "__main__":
    typer.run(main)
