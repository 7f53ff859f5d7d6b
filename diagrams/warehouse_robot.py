"""A robot with an Ouster OS0 drives through a warehouse and pushes a crate."""

from pathlib import Path

import numpy as np
from pydrake.geometry import Meshcat, MeshcatVisualizer
from pydrake.math import RigidTransform
from pydrake.multibody.parsing import Parser
from pydrake.multibody.plant import AddMultibodyPlantSceneGraph
from pydrake.multibody.tree import PdControllerGains
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.primitives import ConstantVectorSource
import typer

from cns_drake import add_lidar, add_lidar_view, save_meshcat_page

MODELS = Path(__file__).parent / "models"


def main(page: Path = Path("warehouse.html"), duration: float = 6.0) -> None:
    builder = DiagramBuilder()
    plant, scene_graph = AddMultibodyPlantSceneGraph(builder, time_step=0.002)
    parser = Parser(plant)
    parser.package_map().AddPackageXml(str(MODELS / "package.xml"))
    parser.AddModels(str(MODELS / "warehouse.sdf"))
    robot = parser.AddModels(str(MODELS / "robot.sdf"))[0]
    gains = PdControllerGains(p=0.0, d=5.0)
    for name in ("left_joint", "right_joint"):
        plant.GetJointActuatorByName(name).set_controller_gains(gains)
    plant.Finalize()
    base, mast = (plant.GetBodyByName(name) for name in ("base", "mast"))
    plant.SetDefaultFloatingBaseBodyPose(base, RigidTransform([-6, 0, 0.001]))

    # With p = 0 angles do not count; wheel speeds, left and right [rad/s].
    wheels = builder.AddSystem(ConstantVectorSource([0.0, 0.0, 9.0, 9.0]))
    target = plant.get_desired_state_input_port(robot)
    builder.Connect(wheels.get_output_port(), target)
    X_PB = RigidTransform([0.0, 0.0, 0.25])
    lidar = add_lidar(builder, scene_graph, mast, X_PB, "os0-128")
    meshcat = Meshcat()
    meshcat.SetCameraPose([-9.0, -6.0, 6.0], [-1.0, 0.0, 0.0])
    MeshcatVisualizer.AddToBuilder(builder, scene_graph, meshcat)
    add_lidar_view(builder, lidar, meshcat, period=0.5, point_size=0.02)

    simulator = Simulator(builder.Build())
    simulator.AdvanceTo(duration)
    context = simulator.get_context()
    seen = lidar.GetMyContextFromRoot(context)
    scan = lidar.GetOutputPort("scan").Eval(seen)
    X_WB = plant.EvalBodyPoseInWorld(plant.GetMyContextFromRoot(context), base)
    print(f"{len(scan)} returns at {np.round(X_WB.translation(), 2)}")
    save_meshcat_page(meshcat, page)


if __name__ == "__main__":
    typer.run(main)
