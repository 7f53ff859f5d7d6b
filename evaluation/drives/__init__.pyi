from .data_set import DataSet as DataSet
from .data_set_check import check_data_set as check_data_set
from .data_set_check import data_set_checks as data_set_checks
from .drive_views import NOT_FINITE as NOT_FINITE
from .drive_views import CountedDrive as CountedDrive
from .drive_views import MovedDrive as MovedDrive
from .drive_views import RecentScans as RecentScans
from .joined_drive import JoinedDrive as JoinedDrive
from .opening import Drive as Drive
from .opening import InputError as InputError
from .opening import Reading as Reading
from .opening import data_sets as data_sets
from .opening import find_data_sets as find_data_sets
from .opening import open_drive as open_drive
from .opening import register_data_set as register_data_set
from .query_sensor import QuerySensor as QuerySensor
from .sampling import sample_frames as sample_frames
from .sampling import travelled as travelled
from .scan_clouds import cloud_at as cloud_at
from .scan_clouds import cropped as cropped
from .scan_clouds import (
    cropped_with_fields as cropped_with_fields,
)
from .scan_clouds import within_cube as within_cube
from .scan_files import FileDrive as FileDrive
from .trajectories import read_poses as read_poses
from .trajectories import read_quaternions as read_quaternions
