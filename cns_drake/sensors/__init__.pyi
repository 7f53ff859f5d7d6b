from .camera.camera import add_cameras as add_cameras
from .camera.camera import optical_pose as optical_pose
from .camera.camera_scene import CameraScene as CameraScene
from .camera.config import CameraSection as CameraSection
from .camera.renderer import check_renderer as check_renderer
from .carriers import sensor_pose as sensor_pose
from .drake_configs import ApplyImuConfig as ApplyImuConfig
from .drake_configs import ApplyLidarConfig as ApplyLidarConfig
from .drake_configs import (
    ApplyOdometryConfig as ApplyOdometryConfig,
)
from .drake_configs import ImuConfig as ImuConfig
from .drake_configs import LidarConfig as LidarConfig
from .drake_configs import OdometryConfig as OdometryConfig
from .imu.config import KALIBR_FILE as KALIBR_FILE
from .imu.config import ImuSection as ImuSection
from .imu.imu import Imu as Imu
from .imu.imu import add_imu as add_imu
from .imu.noise import ImuErrors as ImuErrors
from .imu.noise import ImuNoise as ImuNoise
from .imu.vehicle_imu import (
    add_described_imu as add_described_imu,
)
from .lidar.beam_coverage import BeamCoverage as BeamCoverage
from .lidar.beams import HIGHEST_RATE as HIGHEST_RATE
from .lidar.beams import BeamPattern as BeamPattern
from .lidar.lidar import Lidar as Lidar
from .lidar.lidar import LidarOptions as LidarOptions
from .lidar.measurement import Echoes as Echoes
from .lidar.measurement import (
    MeasurementModel as MeasurementModel,
)
from .lidar.patterns import (
    DirectionPattern as DirectionPattern,
)
from .lidar.patterns import NoddingPattern as NoddingPattern
from .lidar.patterns import RosettePattern as RosettePattern
from .lidar.patterns import SpinningPattern as SpinningPattern
from .lidar.patterns import (
    make_flash_pattern as make_flash_pattern,
)
from .lidar.ray_queries import RayHits as RayHits
from .lidar.scan_assembly import POINT_DTYPE as POINT_DTYPE
from .lidar_adding import add_lidar as add_lidar
from .lidar_adding import add_lidar_view as add_lidar_view
from .lidar_adding import connect_lidar as connect_lidar
from .lidar_config import LidarSection as LidarSection
from .lidar_config import WeatherConfig as WeatherConfig
from .lidar_config import describe_unit as describe_unit
from .lidar_config import (
    make_lidar_config as make_lidar_config,
)
from .lidar_config import make_lidar_model as make_lidar_model
from .lidar_config import make_pattern as make_pattern
from .noise_draws import noise_generator as noise_generator
from .odometry import Odometry as Odometry
from .odometry import OdometrySensor as OdometrySensor
from .odometry import add_odometry as add_odometry
from .odometry_config import (
    OdometrySection as OdometrySection,
)
from .returns.calibrated import (
    CalibratedReturns as CalibratedReturns,
)
from .returns.weather import Weather as Weather
from .sensor_config import SensorConfig as SensorConfig
from .sensor_config import Triple as Triple
from .sensor_config import check_rate as check_rate
from .sensor_config import (
    field_off_by_default as field_off_by_default,
)
from .sheet_patterns import (
    make_beam_pattern as make_beam_pattern,
)
from .system_names import (
    check_unused_names as check_unused_names,
)
