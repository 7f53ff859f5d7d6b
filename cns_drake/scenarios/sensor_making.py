"""Makes the models of a scenario's sensors."""

from __future__ import annotations

import math

from pydrake.math import RigidTransform, RollPitchYaw

from cns_drake.scenarios.lidar_config import LidarConfig
from cns_drake.scenarios.mount import Mount
from cns_drake.scenarios.weather_config import WeatherConfig
from cns_drake.sensors.beam_pattern import BeamPattern
from cns_drake.sensors.lidar_presets import make_beam_pattern
from cns_drake.sensors.measurement import MeasurementModel
from cns_drake.sensors.returns.calibrated import CalibratedReturns


def sensor_pose(mount: Mount) -> RigidTransform:
    """Returns the pose X_BS of a sensor in base_link."""
    roll, pitch, yaw = map(math.radians, mount.rpy_deg)
    return RigidTransform(RollPitchYaw(roll, pitch, yaw), mount.xyz)


def make_pattern(config: LidarConfig) -> BeamPattern:
    """Returns the beams of one turn."""
    return make_beam_pattern(
        config.preset,
        1.0 / config.rate,
        num_columns=config.columns,
        min_range=config.min_range,
        max_range=config.max_range,
    )


def make_returns(
    config: LidarConfig, weather: WeatherConfig, name: str, seed: int
) -> CalibratedReturns | None:
    """Returns the model of a LiDAR's calibrated returns; None for ideal ones.

    Args:
        config: the LiDAR.
        weather: of the drive.
        name: its name.
        seed: of the scenario.
    """
    if config.returns == "ideal":
        return None
    return CalibratedReturns.of_preset(
        config.preset,
        echoes=config.echoes,
        weather=weather.weather(),
        seed=seed,
        sensor_name=name,
    )


def make_measurement(
    config: LidarConfig, name: str, seed: int
) -> MeasurementModel:
    """Returns the model of a LiDAR's measurement of true ranges.

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
