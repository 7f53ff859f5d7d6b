from cns_drake.sensors.camera.camera import add_cameras as add_cameras
from cns_drake.sensors.camera.camera import optical_pose as optical_pose
from cns_drake.sensors.camera.camera_scene import CameraScene as CameraScene
from cns_drake.sensors.camera.config import CameraSection as CameraSection
from cns_drake.sensors.camera.renderer import check_renderer as check_renderer
from cns_drake.sensors.carriers import sensor_pose as sensor_pose
from cns_drake.sensors.drake_configs import ApplyImuConfig as ApplyImuConfig
from cns_drake.sensors.drake_configs import ApplyLidarConfig as ApplyLidarConfig
from cns_drake.sensors.drake_configs import (
    ApplyOdometryConfig as ApplyOdometryConfig,
)
from cns_drake.sensors.drake_configs import ImuConfig as ImuConfig
from cns_drake.sensors.drake_configs import LidarConfig as LidarConfig
from cns_drake.sensors.drake_configs import OdometryConfig as OdometryConfig
from cns_drake.sensors.imu.config import KALIBR_FILE as KALIBR_FILE
from cns_drake.sensors.imu.config import ImuSection as ImuSection
from cns_drake.sensors.imu.imu import Imu as Imu
from cns_drake.sensors.imu.imu import add_imu as add_imu
from cns_drake.sensors.imu.noise import ImuErrors as ImuErrors
from cns_drake.sensors.imu.noise import ImuNoise as ImuNoise
from cns_drake.sensors.imu.vehicle_imu import (
    add_described_imu as add_described_imu,
)
from cns_drake.sensors.lidar.beam_coverage import BeamCoverage as BeamCoverage
from cns_drake.sensors.lidar.beams import HIGHEST_RATE as HIGHEST_RATE
from cns_drake.sensors.lidar.beams import BeamPattern as BeamPattern
from cns_drake.sensors.lidar.lidar import Lidar as Lidar
from cns_drake.sensors.lidar.lidar import LidarOptions as LidarOptions
from cns_drake.sensors.lidar.measurement import Echoes as Echoes
from cns_drake.sensors.lidar.measurement import (
    MeasurementModel as MeasurementModel,
)
from cns_drake.sensors.lidar.patterns import (
    DirectionPattern as DirectionPattern,
)
from cns_drake.sensors.lidar.patterns import NoddingPattern as NoddingPattern
from cns_drake.sensors.lidar.patterns import RosettePattern as RosettePattern
from cns_drake.sensors.lidar.patterns import SpinningPattern as SpinningPattern
from cns_drake.sensors.lidar.patterns import (
    make_flash_pattern as make_flash_pattern,
)
from cns_drake.sensors.lidar.ray_queries import RayHits as RayHits
from cns_drake.sensors.lidar.scan_assembly import POINT_DTYPE as POINT_DTYPE
from cns_drake.sensors.lidar_adding import add_lidar as add_lidar
from cns_drake.sensors.lidar_adding import add_lidar_view as add_lidar_view
from cns_drake.sensors.lidar_adding import connect_lidar as connect_lidar
from cns_drake.sensors.lidar_config import LidarSection as LidarSection
from cns_drake.sensors.lidar_config import WeatherConfig as WeatherConfig
from cns_drake.sensors.lidar_config import describe_unit as describe_unit
from cns_drake.sensors.lidar_config import (
    make_lidar_config as make_lidar_config,
)
from cns_drake.sensors.lidar_config import make_lidar_model as make_lidar_model
from cns_drake.sensors.lidar_config import make_pattern as make_pattern
from cns_drake.sensors.noise_draws import noise_generator as noise_generator
from cns_drake.sensors.odometry import Odometry as Odometry
from cns_drake.sensors.odometry import OdometrySensor as OdometrySensor
from cns_drake.sensors.odometry import add_odometry as add_odometry
from cns_drake.sensors.odometry_config import (
    OdometrySection as OdometrySection,
)
from cns_drake.sensors.returns.calibrated import (
    CalibratedReturns as CalibratedReturns,
)
from cns_drake.sensors.returns.weather import Weather as Weather
from cns_drake.sensors.sensor_config import Section as Section
from cns_drake.sensors.sensor_config import SensorConfig as SensorConfig
from cns_drake.sensors.sensor_config import Triple as Triple
from cns_drake.sensors.sensor_config import check_rate as check_rate
from cns_drake.sensors.sensor_config import (
    field_off_by_default as field_off_by_default,
)
from cns_drake.sensors.sheet_patterns import (
    make_beam_pattern as make_beam_pattern,
)
from cns_drake.sensors.system_names import (
    check_unused_names as check_unused_names,
)
