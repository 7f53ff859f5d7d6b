"""A LiDAR in a world where only the LiDAR and traffic move."""

from __future__ import annotations

from pydrake.systems.framework import Diagram, DiagramBuilder
from pydrake.systems.primitives import ConstantVectorSource
from pydrake.systems.rendering import MultibodyPositionToGeometryPose

from cns_drake.scene.world import World
from cns_drake.sensors.lidar import Lidar
from cns_drake.sensors.lidar_adding import connect_lidar
from cns_drake.traffic.traffic_adding import connect_traffic, place_traffic
from cns_drake.traffic.traffic_motion import TrafficMotion


def make_still_world(
    world: World,
    lidar: Lidar,
    traffic: TrafficMotion | None = None,
) -> Diagram:
    """Makes the Diagram of a world whose models keep their initial state.

    Static geometry need not be computed anew for every scan. To the SceneGraph,
    the thousands of visuals of a city's models are not fixed.

    Args:
        world: the stage; its SceneGraph passes to the Diagram.
        lidar: in it; inputs that are not connected can be fixed.
        traffic: other moving objects, with their geometry in the world.
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
    if traffic is not None:
        place_traffic(builder, scene_graph, traffic)
        goes_on = lidar.HasInputPort("body_spatial_velocities")
        connect_traffic(builder, traffic, lidar, goes_on)
    return builder.Build()
