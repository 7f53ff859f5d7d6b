from evaluation.drives.data_set import DataSet as DataSet
from evaluation.drives.data_set_check import check_data_set as check_data_set
from evaluation.drives.data_set_check import data_set_checks as data_set_checks
from evaluation.drives.drive_views import NOT_FINITE as NOT_FINITE
from evaluation.drives.drive_views import CountedDrive as CountedDrive
from evaluation.drives.drive_views import DriveView as DriveView
from evaluation.drives.drive_views import MovedDrive as MovedDrive
from evaluation.drives.drive_views import RecentScans as RecentScans
from evaluation.drives.joined_drive import JoinedDrive as JoinedDrive
from evaluation.drives.opening import data_sets as data_sets
from evaluation.drives.opening import find_data_sets as find_data_sets
from evaluation.drives.opening import open_drive as open_drive
from evaluation.drives.opening import register_data_set as register_data_set
from evaluation.drives.query_sensor import QuerySensor as QuerySensor
from evaluation.drives.sampling import sample_frames as sample_frames
from evaluation.drives.sampling import travelled as travelled
from evaluation.drives.scan_clouds import cloud_at as cloud_at
from evaluation.drives.scan_clouds import cropped as cropped
from evaluation.drives.scan_clouds import (
    cropped_with_fields as cropped_with_fields,
)
from evaluation.drives.scan_clouds import within_cube as within_cube
from evaluation.drives.scan_files import FileDrive as FileDrive
from evaluation.drives.text_tables import parse_seconds as parse_seconds
from evaluation.drives.trajectories import read_poses as read_poses
from evaluation.drives.trajectories import read_quaternions as read_quaternions
