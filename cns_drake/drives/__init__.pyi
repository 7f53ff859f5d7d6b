from cns_drake.drives.deskewing import deskew as deskew
from cns_drake.drives.deskewing import deskewed_notes as deskewed_notes
from cns_drake.drives.deskewing import deskewed_scan as deskewed_scan
from cns_drake.drives.drive import IMU_DTYPE as IMU_DTYPE
from cns_drake.drives.drive import Drive as Drive
from cns_drake.drives.drive import ImuSamples as ImuSamples
from cns_drake.drives.drive import as_given as as_given
from cns_drake.drives.drive import index_instances as index_instances
from cns_drake.drives.drive_scenario import SCENARIO as SCENARIO
from cns_drake.drives.drive_scenario import driven_way as driven_way
from cns_drake.drives.drive_scenario import read_scenario as read_scenario
from cns_drake.drives.lidar_fields import LidarField as LidarField
from cns_drake.drives.lidar_fields import lidar_field as lidar_field
from cns_drake.drives.mcap_drive import McapDrive as McapDrive
from cns_drake.drives.mcap_drive import holds_mcap as holds_mcap
from cns_drake.drives.mcap_messages import STAMPED_RECORD as STAMPED_RECORD
from cns_drake.drives.mcap_messages import read_stamp as read_stamp
from cns_drake.drives.mulran_frames import ORIGIN as ORIGIN
from cns_drake.drives.mulran_frames import X_BS as X_BS
from cns_drake.drives.point_cloud2 import (
    point_field_datatype as point_field_datatype,
)
from cns_drake.drives.point_cloud2 import to_points as to_points
from cns_drake.drives.point_cloud2 import to_records as to_records
from cns_drake.drives.point_layouts import LayoutName as LayoutName
from cns_drake.drives.point_layouts import from_layout as from_layout
from cns_drake.drives.point_layouts import to_labels as to_labels
from cns_drake.drives.point_layouts import to_layout as to_layout
from cns_drake.drives.ros_types import COMPRESSED_IMAGE as COMPRESSED_IMAGE
from cns_drake.drives.ros_types import DETECTIONS_3D as DETECTIONS_3D
from cns_drake.drives.ros_types import IMU as IMU
from cns_drake.drives.ros_types import ODOMETRY as ODOMETRY
from cns_drake.drives.ros_types import POINT_CLOUD as POINT_CLOUD
from cns_drake.drives.ros_types import SCENE_UPDATE as SCENE_UPDATE
from cns_drake.drives.ros_types import TF as TF
from cns_drake.drives.ros_types import deserialize as deserialize
from cns_drake.drives.ros_types import make_message as make_message
from cns_drake.drives.ros_types import message_class as message_class
from cns_drake.drives.ros_types import message_definition as message_definition
from cns_drake.drives.ros_types import message_hash as message_hash
from cns_drake.drives.ros_types import serialize as serialize
from cns_drake.drives.same_world import DriveNames as DriveNames
from cns_drake.drives.same_world import Placed as Placed
from cns_drake.drives.same_world import check_same_map as check_same_map
from cns_drake.drives.same_world import check_same_world as check_same_world
from cns_drake.drives.sensor_names import BASE_FRAME as BASE_FRAME
from cns_drake.drives.sensor_names import IMU_FRAME as IMU_FRAME
from cns_drake.drives.sensor_names import MAP_FRAME as MAP_FRAME
from cns_drake.drives.sensor_names import check_sensor_name as check_sensor_name
from cns_drake.drives.sensor_names import (
    check_sensor_names as check_sensor_names,
)
