"""Cities that change, driven and recorded by simulated LiDAR in Drake.

The public names are in `__all__`. A name is imported when it is first used.
"""

import importlib
from typing import TYPE_CHECKING, Any

from cns_drake.base.version import __version__

if TYPE_CHECKING:
    from cns_drake.base.errors import InputError
    from cns_drake.command_line.drive_script import run_drive, run_script
    from cns_drake.motion.vehicle_motion import VehicleMotion
    from cns_drake.pictures.static_page import save_meshcat_page
    from cns_drake.recording.bag_writer import BagWriter
    from cns_drake.recording.mcap_recorder import McapRecorder
    from cns_drake.recording.recorded_topics import recording_topics
    from cns_drake.scenarios.planning import plan_drive
    from cns_drake.scenarios.scenario import Scenario
    from cns_drake.scenarios.scenario_files import load_scenario, make_scenario
    from cns_drake.scene.world import World, load_world
    from cns_drake.sensors.drake_configs import (
        ApplyImuConfig,
        ApplyLidarConfig,
        ApplyOdometryConfig,
        ImuConfig,
        LidarConfig,
        OdometryConfig,
    )
    from cns_drake.sensors.imu.imu import Imu, add_imu
    from cns_drake.sensors.imu.noise import ImuNoise
    from cns_drake.sensors.lidar.adding import add_lidar, add_lidar_view
    from cns_drake.sensors.lidar.lidar import Lidar
    from cns_drake.sensors.lidar.livox_patterns import (
        NoddingPattern,
        RosettePattern,
    )
    from cns_drake.sensors.lidar.measurement import MeasurementModel
    from cns_drake.sensors.lidar.patterns import (
        BeamPattern,
        DirectionPattern,
        SpinningPattern,
        make_flash_pattern,
    )
    from cns_drake.sensors.lidar.presets import LIDAR_PRESETS, make_beam_pattern
    from cns_drake.sensors.odometry.odometry import Odometry, add_odometry
    from cns_drake.sensors.returns.calibrated import CalibratedReturns
    from cns_drake.sensors.returns.weather import Weather
    from cns_drake.simulation.loaded_drive import plan_scenario_traffic
    from cns_drake.simulation.sensor_recording import add_mcap_recorder
    from cns_drake.simulation.simulation import Run, simulate
    from cns_drake.simulation.station import make_station
    from cns_drake.traffic.traffic_adding import add_traffic

__all__ = [
    "LIDAR_PRESETS",
    "ApplyImuConfig",
    "ApplyLidarConfig",
    "ApplyOdometryConfig",
    "BagWriter",
    "BeamPattern",
    "CalibratedReturns",
    "DirectionPattern",
    "Imu",
    "ImuConfig",
    "ImuNoise",
    "InputError",
    "Lidar",
    "LidarConfig",
    "McapRecorder",
    "MeasurementModel",
    "NoddingPattern",
    "Odometry",
    "OdometryConfig",
    "RosettePattern",
    "Run",
    "Scenario",
    "SpinningPattern",
    "VehicleMotion",
    "Weather",
    "World",
    "__version__",
    "add_imu",
    "add_lidar",
    "add_lidar_view",
    "add_mcap_recorder",
    "add_odometry",
    "add_traffic",
    "load_scenario",
    "load_world",
    "make_beam_pattern",
    "make_flash_pattern",
    "make_scenario",
    "make_station",
    "plan_drive",
    "plan_scenario_traffic",
    "recording_topics",
    "run_drive",
    "run_script",
    "save_meshcat_page",
    "simulate",
]

# Module -> the public names it defines.
_HOMES = {
    "cns_drake.base.errors": ("InputError",),
    "cns_drake.command_line.drive_script": ("run_drive", "run_script"),
    "cns_drake.motion.vehicle_motion": ("VehicleMotion",),
    "cns_drake.pictures.static_page": ("save_meshcat_page",),
    "cns_drake.recording.bag_writer": ("BagWriter",),
    "cns_drake.recording.mcap_recorder": ("McapRecorder",),
    "cns_drake.recording.recorded_topics": ("recording_topics",),
    "cns_drake.scenarios.planning": ("plan_drive",),
    "cns_drake.scenarios.scenario": ("Scenario",),
    "cns_drake.scenarios.scenario_files": ("load_scenario", "make_scenario"),
    "cns_drake.scene.world": ("load_world", "World"),
    "cns_drake.sensors.drake_configs": (
        "ApplyImuConfig",
        "ApplyLidarConfig",
        "ApplyOdometryConfig",
        "ImuConfig",
        "LidarConfig",
        "OdometryConfig",
    ),
    "cns_drake.sensors.imu.imu": ("add_imu", "Imu"),
    "cns_drake.sensors.imu.noise": ("ImuNoise",),
    "cns_drake.sensors.lidar.adding": ("add_lidar", "add_lidar_view"),
    "cns_drake.sensors.lidar.lidar": ("Lidar",),
    "cns_drake.sensors.lidar.livox_patterns": (
        "NoddingPattern",
        "RosettePattern",
    ),
    "cns_drake.sensors.lidar.measurement": ("MeasurementModel",),
    "cns_drake.sensors.lidar.patterns": (
        "BeamPattern",
        "DirectionPattern",
        "make_flash_pattern",
        "SpinningPattern",
    ),
    "cns_drake.sensors.lidar.presets": ("LIDAR_PRESETS", "make_beam_pattern"),
    "cns_drake.sensors.odometry.odometry": ("add_odometry", "Odometry"),
    "cns_drake.sensors.returns.calibrated": ("CalibratedReturns",),
    "cns_drake.sensors.returns.weather": ("Weather",),
    "cns_drake.simulation.loaded_drive": ("plan_scenario_traffic",),
    "cns_drake.simulation.sensor_recording": ("add_mcap_recorder",),
    "cns_drake.simulation.simulation": ("Run", "simulate"),
    "cns_drake.simulation.station": ("make_station",),
    "cns_drake.traffic.traffic_adding": ("add_traffic",),
}


def __getattr__(name: str) -> Any:
    for home, names in _HOMES.items():
        if name in names:
            module = importlib.import_module(home)
            return getattr(module, name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted(__all__)
