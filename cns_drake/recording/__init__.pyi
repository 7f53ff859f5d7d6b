from cns_drake.recording.bag_writer import BagWriter as BagWriter
from cns_drake.recording.bag_writer import RecordingFolder as RecordingFolder
from cns_drake.recording.mcap_recorder import (
    BackgroundWriter as BackgroundWriter,
)
from cns_drake.recording.mcap_recorder import McapRecorder as McapRecorder
from cns_drake.recording.mcap_recorder import RecordedCamera as RecordedCamera
from cns_drake.recording.mcap_recorder import RecordedSensor as RecordedSensor
from cns_drake.recording.messages import ENCODINGS as ENCODINGS
from cns_drake.recording.messages import (
    encode_point_cloud as encode_point_cloud,
)
from cns_drake.recording.messages import make_camera_info as make_camera_info
from cns_drake.recording.messages import (
    make_compressed_image as make_compressed_image,
)
from cns_drake.recording.messages import make_header as make_header
from cns_drake.recording.messages import make_image as make_image
from cns_drake.recording.messages import make_imu as make_imu
from cns_drake.recording.messages import to_quat_xyzw as to_quat_xyzw
from cns_drake.recording.object_messages import (
    RecordedObjects as RecordedObjects,
)
from cns_drake.recording.recorded_topics import IMU_TOPIC as IMU_TOPIC
from cns_drake.recording.recorded_topics import OBJECT_TOPICS as OBJECT_TOPICS
from cns_drake.recording.recorded_topics import ODOMETRY_TOPIC as ODOMETRY_TOPIC
from cns_drake.recording.recorded_topics import TF_TOPIC as TF_TOPIC
from cns_drake.recording.recorded_topics import camera_topic as camera_topic
from cns_drake.recording.recorded_topics import (
    depth_info_topic as depth_info_topic,
)
from cns_drake.recording.recorded_topics import labels_topic as labels_topic
from cns_drake.recording.recorded_topics import (
    make_calibration as make_calibration,
)
from cns_drake.recording.recorded_topics import points_topic as points_topic
from cns_drake.recording.recorded_topics import (
    recording_topics as recording_topics,
)
from cns_drake.recording.rosbag2_metadata import Topic as Topic
from cns_drake.recording.rosbag2_metadata import to_yaml as to_yaml
from cns_drake.recording.schedule import FRAME_PERIOD as FRAME_PERIOD
from cns_drake.recording.schedule import START_NS as START_NS
from cns_drake.recording.schedule import Schedule as Schedule
from cns_drake.recording.schedule import frame_stamp_ns as frame_stamp_ns
from cns_drake.recording.schedule import frames_within as frames_within
from cns_drake.recording.schedule import make_schedule as make_schedule
