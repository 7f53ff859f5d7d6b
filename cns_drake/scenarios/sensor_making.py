"""From the sensors that a scenario describes to what simulates them."""

from __future__ import annotations

import math

from pydrake.math import RigidTransform, RollPitchYaw

from cns_drake.recording.frame_clock import FRAME_PERIOD
from cns_drake.scenarios.lidar_config import LidarConfig
from cns_drake.scenarios.mount import Mount
from cns_drake.sensors.beam_pattern import BeamPattern
from cns_drake.sensors.lidar_presets import make_beam_pattern
from cns_drake.sensors.measurement import MeasurementModel


def sensor_pose(mount: Mount) -> RigidTransform:
    """Returns the pose X_BS of a sensor in base_link."""
    roll, pitch, yaw = map(math.radians, mount.rpy_deg)
    return RigidTransform(RollPitchYaw(roll, pitch, yaw), mount.xyz)


def make_pattern(config: LidarConfig) -> BeamPattern:
    """Returns the beams of one turn, which takes one frame."""
    return make_beam_pattern(
        config.preset,
        FRAME_PERIOD,
        num_columns=config.columns,
        min_range=config.min_range,
        max_range=config.max_range,
    )


def make_measurement(
    config: LidarConfig, name: str, seed: int
) -> MeasurementModel:
    """Returns what a LiDAR makes of true ranges.

    Args:
        config: the LiDAR.
        name: its name.
        seed: of the scenario.
    """
    return MeasurementModel(
        resolution=config.resolution,
        range_noise=config.range_noise,
        dropout=config.dropout,
        faint_dropout=config.faint_dropout,
        seed=seed,
        sensor_name=name,
    )
