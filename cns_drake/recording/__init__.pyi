from .bag_writer import BagWriter as BagWriter
from .bag_writer import RecordingFolder as RecordingFolder
from .mcap_recorder import (
    BackgroundWriter as BackgroundWriter,
)
from .mcap_recorder import McapRecorder as McapRecorder
from .mcap_recorder import RecordedCamera as RecordedCamera
from .mcap_recorder import RecordedSensor as RecordedSensor
from .messages import ENCODINGS as ENCODINGS
from .messages import make_camera_info as make_camera_info
from .messages import (
    make_compressed_image as make_compressed_image,
)
from .messages import make_header as make_header
from .messages import make_image as make_image
from .messages import to_quat_xyzw as to_quat_xyzw
from .object_messages import (
    RecordedObjects as RecordedObjects,
)
from .recorded_topics import IMU_TOPIC as IMU_TOPIC
from .recorded_topics import OBJECT_TOPICS as OBJECT_TOPICS
from .recorded_topics import ODOMETRY_TOPIC as ODOMETRY_TOPIC
from .recorded_topics import TF_TOPIC as TF_TOPIC
from .recorded_topics import camera_topic as camera_topic
from .recorded_topics import (
    depth_info_topic as depth_info_topic,
)
from .recorded_topics import labels_topic as labels_topic
from .recorded_topics import (
    make_calibration as make_calibration,
)
from .recorded_topics import points_topic as points_topic
from .recorded_topics import (
    recording_topics as recording_topics,
)
from .rosbag2_metadata import Topic as Topic
from .rosbag2_metadata import to_yaml as to_yaml
from .schedule import FRAME_PERIOD as FRAME_PERIOD
from .schedule import START_NS as START_NS
from .schedule import Schedule as Schedule
from .schedule import frame_stamp_ns as frame_stamp_ns
from .schedule import frames_within as frames_within
from .schedule import make_schedule as make_schedule
