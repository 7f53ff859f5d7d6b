from . import commands as commands
from . import points as points
from . import poses as poses
from . import program as program
from . import shared_options as shared_options
from . import terminal as terminal
from .changes import merged as merged
from .changes import nested as nested
from .changes import parse_changes as parse_changes
from .commands import example as example
from .commands import with_options as with_options
from .compilation import compiled as compiled
from .compilation import (
    compiled_callback as compiled_callback,
)
from .complete_files import (
    check_folder_writable as check_folder_writable,
)
from .complete_files import check_new_folder as check_new_folder
from .complete_files import check_writable as check_writable
from .complete_files import complete_part as complete_part
from .complete_files import completing as completing
from .complete_files import draft_folder as draft_folder
from .complete_files import part_path as part_path
from .complete_files import remove_folder as remove_folder
from .complete_files import sole_writer as sole_writer
from .complete_files import write_part as write_part
from .complete_files import write_text as write_text
from .csv_files import check_separator as check_separator
from .csv_files import csv_text as csv_text
from .csv_files import quoted_cell as quoted_cell
from .csv_files import read_records as read_records
from .csv_files import read_rows as read_rows
from .csv_files import unquoted_cell as unquoted_cell
from .csv_files import write_csv as write_csv
from .elementary import arcsin as arcsin
from .elementary import arctan2 as arctan2
from .elementary import cos as cos
from .elementary import exp as exp
from .elementary import log as log
from .elementary import power as power
from .elementary import product as product
from .elementary import rotated as rotated
from .elementary import sin as sin
from .elementary import smooth_step as smooth_step
from .elementary import tan as tan
from .elementary import turns as turns
from .errors import InputError as InputError
from .errors import (
    describe_validation_error as describe_validation_error,
)
from .errors import did_you_mean as did_you_mean
from .errors import errors_at as errors_at
from .errors import errors_at_option as errors_at_option
from .errors import one_line as one_line
from .errors import validated as validated
from .errors import value_errors as value_errors
from .families import Family as Family
from .families import import_modules as import_modules
from .figures import GONE_RGB as GONE_RGB
from .figures import NEW_RGB as NEW_RGB
from .figures import UNSEEN_RGB as UNSEEN_RGB
from .figures import figure_style as figure_style
from .figures import save_figure as save_figure
from .file_locks import lock_file as lock_file
from .files import cache_folder as cache_folder
from .files import check_regular as check_regular
from .files import decode_text as decode_text
from .files import file_name as file_name
from .files import is_there as is_there
from .files import listed as listed
from .files import make_folder as make_folder
from .files import natural_key as natural_key
from .files import read_bytes as read_bytes
from .files import read_text as read_text
from .files import user_errors as user_errors
from .images import open_image as open_image
from .images import to_jpeg as to_jpeg
from .input_models import InputModel as InputModel
from .interrupts import (
    ended_by_interrupts as ended_by_interrupts,
)
from .interrupts import interrupts_wait as interrupts_wait
from .interrupts import uninterrupted as uninterrupted
from .jobs.digests import file_digests as file_digests
from .jobs.digests import fingerprint as fingerprint
from .jobs.forecast import Space as Space
from .jobs.forecast import forecast as forecast
from .jobs.processes import ALLOCATION as ALLOCATION
from .jobs.processes import JobError as JobError
from .jobs.processes import ProcessDiedError as ProcessDiedError
from .jobs.processes import nothing_left as nothing_left
from .jobs.processes import run_process as run_process
from .jobs.running import Cluster as Cluster
from .jobs.running import Job as Job
from .jobs.running import choose_cluster as choose_cluster
from .jobs.running import run_jobs as run_jobs
from .jobs.step import Reporter as Reporter
from .jobs.step import Step as Step
from .jobs.step import Steps as Steps
from .json_text import json_values as json_values
from .json_text import parse_json as parse_json
from .launch import start as start
from .npz_archives import read_npz as read_npz
from .number_format import is_number as is_number
from .number_format import number_within as number_within
from .number_format import other_separator as other_separator
from .number_format import parse_rows as parse_rows
from .number_format import to_number as to_number
from .number_format import whole_number as whole_number
from .points import FARTHEST_RETURN as FARTHEST_RETURN
from .points import check_range as check_range
from .points import encode_bin as encode_bin
from .points import encode_pcd as encode_pcd
from .points import from_xyz as from_xyz
from .points import read_only as read_only
from .points import to_xyzi as to_xyzi
from .points import xyz as xyz
from .polylines import distances_along as distances_along
from .polylines import length_of as length_of
from .polylines import step_lengths as step_lengths
from .process import (
    collect_garbage_seldom as collect_garbage_seldom,
)
from .process import num_cores as num_cores
from .progress import doing as doing
from .progress import track as track
from .progress_display import show_progress as show_progress
from .repetitions import repeated as repeated
from .round_shapes import revolved as revolved
from .system_libraries import missing_library as missing_library
from .terminal import next_command as next_command
from .terminal import next_page as next_page
from .terminal import note as note
from .terminal import number_text as number_text
from .terminal import resumable as resumable
from .terminal import show as show
from .units import NS_PER_S as NS_PER_S
from .units import wrapped as wrapped
from .version import __version__ as __version__
from .version import installed_versions as installed_versions
from .working_folder import leave_out_folder as leave_out_folder
from .working_folder import start_python as start_python
from .xml_elements import Element as Element
from .xml_elements import read_elements as read_elements
from .xml_elements import readable_xml as readable_xml
from .yaml_files import MarkedYamlLoader as MarkedYamlLoader
from .yaml_files import YamlLoader as YamlLoader
from .yaml_files import parse_yaml as parse_yaml
from .yaml_files import read_yaml as read_yaml
