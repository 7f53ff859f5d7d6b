from .deskewing import deskew as deskew
from .deskewing import deskewed_notes as deskewed_notes
from .deskewing import deskewed_scan as deskewed_scan
from .drive import IMU_DTYPE as IMU_DTYPE
from .drive import Drive as Drive
from .drive import ImuSamples as ImuSamples
from .drive import as_given as as_given
from .drive import index_instances as index_instances
from .drive_scenario import SCENARIO as SCENARIO
from .drive_scenario import driven_way as driven_way
from .drive_scenario import read_scenario as read_scenario
from .lidar_fields import LidarField as LidarField
from .lidar_fields import lidar_field as lidar_field
from .mcap_drive import McapDrive as McapDrive
from .mcap_drive import holds_mcap as holds_mcap
from .mcap_messages import STAMPED_RECORD as STAMPED_RECORD
from .mcap_messages import read_stamp as read_stamp
from .mulran_frames import ORIGIN as ORIGIN
from .mulran_frames import X_BS as X_BS
from .point_cloud2 import (
    point_field_datatype as point_field_datatype,
)
from .point_cloud2 import to_points as to_points
from .point_layouts import LayoutName as LayoutName
from .point_layouts import to_labels as to_labels
from .point_layouts import to_layout as to_layout
from .ros_types import COMPRESSED_IMAGE as COMPRESSED_IMAGE
from .ros_types import DETECTIONS_3D as DETECTIONS_3D
from .ros_types import IMU as IMU
from .ros_types import ODOMETRY as ODOMETRY
from .ros_types import POINT_CLOUD as POINT_CLOUD
from .ros_types import SCENE_UPDATE as SCENE_UPDATE
from .ros_types import TF as TF
from .ros_types import deserialize as deserialize
from .ros_types import make_message as make_message
from .ros_types import message_class as message_class
from .ros_types import message_definition as message_definition
from .ros_types import message_hash as message_hash
from .ros_types import serialize as serialize
from .same_world import check_same_map as check_same_map
from .same_world import check_same_world as check_same_world
from .sensor_names import BASE_FRAME as BASE_FRAME
from .sensor_names import IMU_FRAME as IMU_FRAME
from .sensor_names import MAP_FRAME as MAP_FRAME
from .sensor_names import check_sensor_name as check_sensor_name
from .sensor_names import (
    check_sensor_names as check_sensor_names,
)
from .stamped_poses import StampedPoses as StampedPoses
