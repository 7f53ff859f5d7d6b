from cns_drake.base.errors import InputError as InputError
from cns_drake.base.version import __version__ as __version__
from cns_drake.command_line.drive_script import run_drive as run_drive
from cns_drake.command_line.drive_script import run_script as run_script
from cns_drake.motion.vehicle_motion import VehicleMotion as VehicleMotion
from cns_drake.pictures.static_page import (
    save_meshcat_page as save_meshcat_page,
)
from cns_drake.recording.bag_writer import BagWriter as BagWriter
from cns_drake.recording.mcap_recorder import McapRecorder as McapRecorder
from cns_drake.recording.recorded_topics import (
    recording_topics as recording_topics,
)
from cns_drake.scenarios.planning import plan_drive as plan_drive
from cns_drake.scenarios.scenario import Scenario as Scenario
from cns_drake.scenarios.scenario_files import load_scenario as load_scenario
from cns_drake.scenarios.scenario_files import make_scenario as make_scenario
from cns_drake.scene.world import World as World
from cns_drake.scene.world import load_world as load_world
from cns_drake.sensors.drake_configs import ApplyImuConfig as ApplyImuConfig
from cns_drake.sensors.drake_configs import ApplyLidarConfig as ApplyLidarConfig
from cns_drake.sensors.drake_configs import (
    ApplyOdometryConfig as ApplyOdometryConfig,
)
from cns_drake.sensors.drake_configs import ImuConfig as ImuConfig
from cns_drake.sensors.drake_configs import LidarConfig as LidarConfig
from cns_drake.sensors.drake_configs import OdometryConfig as OdometryConfig
from cns_drake.sensors.imu.imu import Imu as Imu
from cns_drake.sensors.imu.imu import add_imu as add_imu
from cns_drake.sensors.imu.noise import ImuNoise as ImuNoise
from cns_drake.sensors.lidar.adding import add_lidar as add_lidar
from cns_drake.sensors.lidar.adding import add_lidar_view as add_lidar_view
from cns_drake.sensors.lidar.beams import BeamPattern as BeamPattern
from cns_drake.sensors.lidar.lidar import Lidar as Lidar
from cns_drake.sensors.lidar.measurement import (
    MeasurementModel as MeasurementModel,
)
from cns_drake.sensors.lidar.nonrepeating_patterns import (
    NoddingPattern as NoddingPattern,
)
from cns_drake.sensors.lidar.nonrepeating_patterns import (
    RosettePattern as RosettePattern,
)
from cns_drake.sensors.lidar.patterns import (
    DirectionPattern as DirectionPattern,
)
from cns_drake.sensors.lidar.patterns import SpinningPattern as SpinningPattern
from cns_drake.sensors.lidar.patterns import (
    make_flash_pattern as make_flash_pattern,
)
from cns_drake.sensors.lidar.presets import LIDAR_PRESETS as LIDAR_PRESETS
from cns_drake.sensors.lidar.presets import (
    make_beam_pattern as make_beam_pattern,
)
from cns_drake.sensors.lidar.ray_queries import RayHits as RayHits
from cns_drake.sensors.odometry.odometry import Odometry as Odometry
from cns_drake.sensors.odometry.odometry import OdometrySensor as OdometrySensor
from cns_drake.sensors.odometry.odometry import add_odometry as add_odometry
from cns_drake.sensors.returns.calibrated import (
    CalibratedReturns as CalibratedReturns,
)
from cns_drake.sensors.returns.weather import Weather as Weather
from cns_drake.simulation.scenario_traffic import (
    plan_scenario_traffic as plan_scenario_traffic,
)
from cns_drake.simulation.sensor_recording import (
    add_mcap_recorder as add_mcap_recorder,
)
from cns_drake.simulation.simulation import (
    FinishedSimulation as FinishedSimulation,
)
from cns_drake.simulation.simulation import simulate as simulate
from cns_drake.simulation.station import make_station as make_station
from cns_drake.traffic.traffic_motion import add_traffic as add_traffic
