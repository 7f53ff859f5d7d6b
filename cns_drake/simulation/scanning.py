"""A single scan of any SDF world from any pose."""

from typing import Any

import numpy as np
from pydrake.math import RigidTransform
from pydrake.systems.framework import Context, DiagramBuilder
from pydrake.systems.primitives import ConstantVectorSource
from pydrake.systems.rendering import MultibodyPositionToGeometryPose

from cns_drake.ray_casting import RayCastingScene
from cns_drake.scene import World
from cns_drake.sensors import BeamPattern, Lidar, connect_lidar


def scan_world(
    world: World,
    X_WS: RigidTransform,
    pattern: BeamPattern,
    **options: Any,
) -> np.ndarray:
    """Returns one LiDAR scan of a world in its initial state.

    Args:
        world: the world.
        X_WS: pose of the LiDAR in the world.
        pattern: directions and ranges of the LiDAR's beams.
        options: further fields of `LidarOptions`.

    Returns:
        Structured array (N,) of `POINT_DTYPE`, in the LiDAR's frame S.
    """
    lidar, context = _stationary_lidar(world, X_WS, pattern, **options)
    return lidar.GetOutputPort("scan").Eval(context)


def still_scene(
    world: World, X_WS: RigidTransform, pattern: BeamPattern
) -> RayCastingScene:
    """Returns a scene for ray casting: a world in its initial state.

    Args:
        world: the world.
        X_WS: pose in the world near which rays will start. Rays must start
            within a few kilometres of this pose.
        pattern: directions and ranges of a LiDAR's beams.
    """
    lidar, context = _stationary_lidar(world, X_WS, pattern)
    return lidar.EvalScene(context)


def _stationary_lidar(
    world: World,
    X_WS: RigidTransform,
    pattern: BeamPattern,
    **options: Any,
) -> tuple[Lidar, Context]:
    """Returns a LiDAR at a fixed pose in a world, and its Context."""
    lidar = Lidar(
        world.scene_graph.world_frame_id(),
        X_WS,
        pattern,
        structures=world.structures,
        anchored_frames=world.anchored_frames(),
        **options,
    )
    plant = world.plant
    builder = DiagramBuilder()
    scene_graph = builder.AddNamedSystem("scene_graph", world.scene_graph)
    # The models keep their initial state.
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
    context = builder.Build().CreateDefaultContext()
    return lidar, lidar.GetMyContextFromRoot(context)
