"""A LiDAR in a world in which nothing moves but the LiDAR."""

from __future__ import annotations

from pydrake.systems.framework import Diagram, DiagramBuilder
from pydrake.systems.primitives import ConstantVectorSource
from pydrake.systems.rendering import MultibodyPositionToGeometryPose

from cns_drake.scene.world import World
from cns_drake.sensors.lidar import Lidar
from cns_drake.sensors.lidar_adding import connect_lidar


def make_still_world(world: World, lidar: Lidar) -> Diagram:
    """Makes the Diagram of a world whose models stay as they start.

    What does not move need not be computed anew for every scan: for the
    SceneGraph, thousands of visuals of a city's models are no fixed ones.

    Args:
        world: the stage; its SceneGraph passes to the Diagram.
        lidar: in it; what is not connected of it can be fixed.
    """
    plant = world.plant
    builder = DiagramBuilder()
    scene_graph = builder.AddNamedSystem("scene_graph", world.scene_graph)
    positions = plant.GetPositions(plant.CreateDefaultContext())
    source = builder.AddNamedSystem("position", ConstantVectorSource(positions))
    to_pose = builder.AddNamedSystem(
        "geometry_pose", MultibodyPositionToGeometryPose(plant)
    )
    builder.AddNamedSystem("lidar", lidar)
    builder.Connect(source.get_output_port(), to_pose.get_input_port())
    builder.Connect(
        to_pose.get_output_port(),
        scene_graph.get_source_pose_port(plant.get_source_id()),
    )
    connect_lidar(builder, scene_graph, lidar)
    return builder.Build()
