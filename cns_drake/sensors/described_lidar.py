"""Adding a LiDAR that a scenario describes to a diagram."""

from __future__ import annotations

from collections.abc import Collection, Mapping

from pydrake.geometry import FrameId, GeometryId, Role, SceneGraph
from pydrake.math import RigidTransform
from pydrake.multibody.tree import Frame, RigidBody
from pydrake.systems.framework import DiagramBuilder

from cns_drake.sensors.lidar.lidar import Lidar
from cns_drake.sensors.lidar.measurement import MeasurementModel
from cns_drake.sensors.lidar.seen_geometry import Structures
from cns_drake.sensors.lidar_adding import add_lidar
from cns_drake.sensors.lidar_config import (
    LidarSection,
    WeatherConfig,
    make_pattern,
    make_returns,
)

_CLEAR = WeatherConfig()


def add_described_lidar(
    config: LidarSection,
    builder: DiagramBuilder,
    scene_graph: SceneGraph,
    body: RigidBody | Frame,
    X_PB: RigidTransform,
    *,
    name: str = "lidar",
    seed: int = 0,
    weather: WeatherConfig = _CLEAR,
    period: float | None = None,
    unseen: Collection[RigidBody | Frame | GeometryId] | None = None,
    motion_distortion: bool = False,
    structures: Structures | None = None,
    anchored_frames: Collection[FrameId] | None = None,
    moving_bodies: Mapping[FrameId, int] | None = None,
    num_threads: int = 1,
    causal: bool = False,
    role: Role = Role.kPerception,
    rate: float | None = None,
    capture_offset: float = 0.0,
) -> Lidar:
    """Adds a LiDAR to a diagram, given its description in a scenario.

    Args:
        config: the description, a section of a scenario.
        builder: builder of a diagram with `scene_graph`.
        scene_graph: the SceneGraph to scan.
        body: the carrier P: a body of a finalized plant, or a frame that is
            fixed on such a body.
        X_PB: pose of the sensor's body B in P.
        name: name of the system.
        seed: seed of noise and returns.
        weather: weather of calibrated returns.
        period: duration of a revolution [s]; by default it follows from the
            rate in the description.
        unseen: what the LiDAR does not see. This argument and all further
            arguments are the same as for `add_lidar`.
        motion_distortion: whether the bodies of the LiDAR's plant keep moving
            during a revolution. A recorded drive connects a `Sweep` instead of
            setting this argument.
        structures: table of the structures.
        anchored_frames: frames that never move.
        moving_bodies: frames that move during a revolution.
        num_threads: number of threads that share the LiDAR's rays.
        causal: whether a scan is the revolution that ends at the time of the
            output.
        role: role of the geometry that the LiDAR sees.
        rate: scans per second of a discrete LiDAR; by default the LiDAR is
            continuous, whatever the rate of its revolutions.
        capture_offset: time of a discrete LiDAR's first scan [s].
    """
    return add_lidar(
        builder,
        scene_graph,
        body,
        X_PB,
        make_pattern(config, period),
        name=name,
        measurement=MeasurementModel(
            resolution=config.resolution,
            range_noise=config.range_noise,
            dropout=config.dropout,
            faint_dropout=config.faint_dropout,
            seed=seed,
            sensor_name=name,
        ),
        returns=make_returns(config, weather, name, seed) or "ideal",
        unseen=unseen,
        motion_distortion=motion_distortion,
        structures=structures,
        anchored_frames=anchored_frames,
        moving_bodies=moving_bodies,
        num_threads=num_threads,
        causal=causal,
        role=role,
        rate=rate,
        capture_offset=capture_offset,
    )
