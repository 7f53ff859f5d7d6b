"""Adds a scenario's LiDAR to a Diagram."""

from __future__ import annotations

from pydrake.systems.framework import DiagramBuilder

from cns_drake.motion.sweep import VehicleSweep
from cns_drake.motion.trajectory import Trajectory
from cns_drake.scenarios.lidar_config import LidarConfig
from cns_drake.scenarios.sensor_making import (
    make_measurement,
    make_pattern,
    make_returns,
    sensor_pose,
)
from cns_drake.scenarios.weather_config import WeatherConfig
from cns_drake.scene.world import World
from cns_drake.sensors.frame_poses import FramePoses
from cns_drake.sensors.lidar import Lidar
from cns_drake.sensors.lidar_adding import add_lidar
from cns_drake.traffic.traffic_adding import connect_traffic
from cns_drake.traffic.traffic_motion import TrafficMotion

CLEAR = WeatherConfig()


def apply_lidar_config(
    config: LidarConfig,
    builder: DiagramBuilder,
    world: World,
    trajectory: Trajectory,
    poses: FramePoses,
    *,
    name: str,
    weather: WeatherConfig = CLEAR,
    traffic: TrafficMotion | None = None,
    seed: int = 0,
    num_threads: int = 1,
) -> Lidar:
    """Adds the LiDAR that a configuration describes to the vehicle.

    With motion distortion, a system `<name>_sweep` gives its poses.

    Args:
        config: the LiDAR.
        builder: of the Diagram that holds the world's SceneGraph.
        world: the stage with the vehicle.
        trajectory: of the vehicle.
        poses: of all frames that have geometry.
        name: of the LiDAR.
        weather: of the drive.
        traffic: other moving objects.
        seed: of its noise.
        num_threads: number of threads that cast its rays.
    """
    plant = world.plant
    pattern = make_pattern(config)
    distorts = config.motion_distortion
    moving = None
    if traffic is not None and distorts:
        # They keep moving during a turn.
        moving = traffic.moving_frames
    lidar = add_lidar(
        builder,
        world.scene_graph,
        plant.GetBodyByName("base_link", world.vehicle),
        sensor_pose(config),
        pattern,
        name=name,
        measurement=make_measurement(config, name, seed),
        returns=make_returns(config, weather, name, seed) or "ideal",
        unseen=[plant.get_body(k) for k in plant.GetBodyIndices(world.vehicle)],
        with_sweep=distorts,
        moving_bodies=moving,
        posed_frames=poses.rows,
        structures=world.structures,
        anchored_frames=world.anchored_frames(),
        num_threads=num_threads,
    )
    builder.Connect(poses.get_output_port(), lidar.GetInputPort("frame_poses"))
    if traffic is not None:
        connect_traffic(builder, traffic, lidar, distorts)
    if distorts:
        sweep = builder.AddNamedSystem(
            f"{name}_sweep",
            VehicleSweep(trajectory, pattern.column_t_ns * 1e-9),
        )
        builder.Connect(
            sweep.GetOutputPort("sweep"), lidar.GetInputPort("sweep")
        )
    return lidar
