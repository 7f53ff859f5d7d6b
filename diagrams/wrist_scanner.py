"""An arm sweeps a 2-D scanner on its wrist over a table, row by row."""

from pathlib import Path

import numpy as np
from pydrake.geometry import Meshcat, MeshcatVisualizer, Rgba
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.multibody.parsing import Parser
from pydrake.multibody.plant import AddMultibodyPlantSceneGraph
from pydrake.multibody.tree import PdControllerGains
from pydrake.perception import PointCloud
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.primitives import ConstantVectorSource
import typer

from cns_drake import add_lidar, save_meshcat_page

CELL = Path(__file__).parent / "models" / "arm_cell.sdf"
JOINTS = ("pan_joint", "lift_joint", "elbow_joint", "pitch_joint")
# Angles of the joints at the start and at the end [rad].
START = [-0.9, 0.1, 1.2, 0.5]
END = [0.9, 0.1, 1.2, 0.5]


def main(page: Path = Path("wrist.html"), duration: float = 4.0) -> None:
    builder = DiagramBuilder()
    plant, scene_graph = AddMultibodyPlantSceneGraph(builder, time_step=0.002)
    arm = Parser(plant).AddModels(str(CELL))[0]
    gains = PdControllerGains(p=60.0, d=45.0)
    for joint in JOINTS:
        plant.GetJointActuatorByName(joint).set_controller_gains(gains)
    plant.Finalize()
    plant.SetDefaultPositions(arm, START)
    goal = builder.AddSystem(ConstantVectorSource([*END, *4 * [0.0]]))
    target = plant.get_desired_state_input_port(arm)
    builder.Connect(goal.get_output_port(), target)
    # x of the sensor is z of the wrist; its row of beams is across the sweep.
    wrist = plant.GetBodyByName("pitch")
    X_PB = RigidTransform(RotationMatrix(np.eye(3)[:, [2, 0, 1]]), [0, 0, 0.17])
    lidar = add_lidar(builder, scene_graph, wrist, X_PB, "hokuyo-ust-20lx")
    meshcat = Meshcat()
    meshcat.SetCameraPose([-0.6, -1.8, 1.8], [0.9, 0.0, 0.5])
    MeshcatVisualizer.AddToBuilder(builder, scene_graph, meshcat)
    simulator = Simulator(builder.Build())
    port = lidar.GetOutputPort("point_cloud_W")
    context = simulator.get_context()
    rows = []
    while context.get_time() < duration - 1e-6:
        simulator.AdvanceTo(context.get_time() + lidar.pattern.period)
        cloud = port.Eval(lidar.GetMyContextFromRoot(context))
        rows.append(cloud.xyzs().copy())
    points = np.concatenate(rows, axis=1)
    cloud = PointCloud(points.shape[1])
    cloud.mutable_xyzs()[:] = points
    meshcat.SetObject("cloud", cloud, point_size=0.01, rgba=Rgba(0.9, 0.1, 0.1))
    print(f"{points.shape[1]} returns in {len(rows)} rows")
    save_meshcat_page(meshcat, page)


if __name__ == "__main__":
    typer.run(main)
