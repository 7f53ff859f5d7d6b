from cns_drake.base import commands as commands
from cns_drake.base import points as points
from cns_drake.base import poses as poses
from cns_drake.base import program as program
from cns_drake.base import shared_options as shared_options
from cns_drake.base import terminal as terminal
from cns_drake.base.changes import merged as merged
from cns_drake.base.changes import nested as nested
from cns_drake.base.changes import parse_changes as parse_changes
from cns_drake.base.commands import example as example
from cns_drake.base.commands import with_options as with_options
from cns_drake.base.compilation import compiled as compiled
from cns_drake.base.compilation import (
    compiled_callback as compiled_callback,
)
from cns_drake.base.complete_files import (
    check_folder_writable as check_folder_writable,
)
from cns_drake.base.complete_files import check_new_folder as check_new_folder
from cns_drake.base.complete_files import check_writable as check_writable
from cns_drake.base.complete_files import complete_part as complete_part
from cns_drake.base.complete_files import completing as completing
from cns_drake.base.complete_files import draft_folder as draft_folder
from cns_drake.base.complete_files import part_path as part_path
from cns_drake.base.complete_files import remove_folder as remove_folder
from cns_drake.base.complete_files import sole_writer as sole_writer
from cns_drake.base.complete_files import write_part as write_part
from cns_drake.base.complete_files import write_text as write_text
from cns_drake.base.csv_files import check_separator as check_separator
from cns_drake.base.csv_files import csv_text as csv_text
from cns_drake.base.csv_files import quoted_cell as quoted_cell
from cns_drake.base.csv_files import read_records as read_records
from cns_drake.base.csv_files import read_rows as read_rows
from cns_drake.base.csv_files import unquoted_cell as unquoted_cell
from cns_drake.base.csv_files import write_csv as write_csv
from cns_drake.base.elementary import arcsin as arcsin
from cns_drake.base.elementary import arctan2 as arctan2
from cns_drake.base.elementary import cos as cos
from cns_drake.base.elementary import exp as exp
from cns_drake.base.elementary import log as log
from cns_drake.base.elementary import power as power
from cns_drake.base.elementary import product as product
from cns_drake.base.elementary import rotated as rotated
from cns_drake.base.elementary import sin as sin
from cns_drake.base.elementary import smooth_step as smooth_step
from cns_drake.base.elementary import tan as tan
from cns_drake.base.elementary import turns as turns
from cns_drake.base.errors import InputError as InputError
from cns_drake.base.errors import (
    describe_validation_error as describe_validation_error,
)
from cns_drake.base.errors import did_you_mean as did_you_mean
from cns_drake.base.errors import errors_at as errors_at
from cns_drake.base.errors import errors_at_option as errors_at_option
from cns_drake.base.errors import one_line as one_line
from cns_drake.base.errors import validated as validated
from cns_drake.base.errors import value_errors as value_errors
from cns_drake.base.families import Family as Family
from cns_drake.base.families import import_modules as import_modules
from cns_drake.base.figures import GONE_RGB as GONE_RGB
from cns_drake.base.figures import NEW_RGB as NEW_RGB
from cns_drake.base.figures import UNSEEN_RGB as UNSEEN_RGB
from cns_drake.base.figures import figure_style as figure_style
from cns_drake.base.figures import save_figure as save_figure
from cns_drake.base.file_locks import lock_file as lock_file
from cns_drake.base.files import cache_folder as cache_folder
from cns_drake.base.files import check_regular as check_regular
from cns_drake.base.files import decode_text as decode_text
from cns_drake.base.files import file_name as file_name
from cns_drake.base.files import is_there as is_there
from cns_drake.base.files import listed as listed
from cns_drake.base.files import make_folder as make_folder
from cns_drake.base.files import natural_key as natural_key
from cns_drake.base.files import read_bytes as read_bytes
from cns_drake.base.files import read_text as read_text
from cns_drake.base.files import user_errors as user_errors
from cns_drake.base.images import open_image as open_image
from cns_drake.base.images import to_jpeg as to_jpeg
from cns_drake.base.input_models import InputModel as InputModel
from cns_drake.base.interrupts import (
    ended_by_interrupts as ended_by_interrupts,
)
from cns_drake.base.interrupts import interrupts_wait as interrupts_wait
from cns_drake.base.interrupts import uninterrupted as uninterrupted
from cns_drake.base.jobs.cluster import Cluster as Cluster
from cns_drake.base.jobs.cluster import choose_cluster as choose_cluster
from cns_drake.base.jobs.digests import file_digests as file_digests
from cns_drake.base.jobs.digests import fingerprint as fingerprint
from cns_drake.base.jobs.forecast import Space as Space
from cns_drake.base.jobs.forecast import forecast as forecast
from cns_drake.base.jobs.processes import ALLOCATION as ALLOCATION
from cns_drake.base.jobs.processes import JobError as JobError
from cns_drake.base.jobs.processes import ProcessDiedError as ProcessDiedError
from cns_drake.base.jobs.processes import nothing_left as nothing_left
from cns_drake.base.jobs.processes import run_process as run_process
from cns_drake.base.jobs.running import Job as Job
from cns_drake.base.jobs.running import run_jobs as run_jobs
from cns_drake.base.jobs.step import Reporter as Reporter
from cns_drake.base.jobs.step import Step as Step
from cns_drake.base.jobs.step import Steps as Steps
from cns_drake.base.json_text import json_values as json_values
from cns_drake.base.json_text import parse_json as parse_json
from cns_drake.base.launch import start as start
from cns_drake.base.npz_archives import read_npz as read_npz
from cns_drake.base.number_format import is_number as is_number
from cns_drake.base.number_format import number_within as number_within
from cns_drake.base.number_format import other_separator as other_separator
from cns_drake.base.number_format import parse_rows as parse_rows
from cns_drake.base.number_format import to_number as to_number
from cns_drake.base.number_format import whole_number as whole_number
from cns_drake.base.points import FARTHEST_RETURN as FARTHEST_RETURN
from cns_drake.base.points import check_range as check_range
from cns_drake.base.points import encode_bin as encode_bin
from cns_drake.base.points import encode_pcd as encode_pcd
from cns_drake.base.points import from_xyz as from_xyz
from cns_drake.base.points import read_only as read_only
from cns_drake.base.points import to_xyzi as to_xyzi
from cns_drake.base.points import xyz as xyz
from cns_drake.base.polylines import distances_along as distances_along
from cns_drake.base.polylines import length_of as length_of
from cns_drake.base.polylines import step_lengths as step_lengths
from cns_drake.base.process import (
    collect_garbage_seldom as collect_garbage_seldom,
)
from cns_drake.base.process import num_cores as num_cores
from cns_drake.base.progress import doing as doing
from cns_drake.base.progress import track as track
from cns_drake.base.progress_display import show_progress as show_progress
from cns_drake.base.public_names import attach as attach
from cns_drake.base.repetitions import repeated as repeated
from cns_drake.base.round_shapes import revolved as revolved
from cns_drake.base.system_libraries import missing_library as missing_library
from cns_drake.base.terminal import next_command as next_command
from cns_drake.base.terminal import next_page as next_page
from cns_drake.base.terminal import note as note
from cns_drake.base.terminal import number_text as number_text
from cns_drake.base.terminal import resumable as resumable
from cns_drake.base.terminal import show as show
from cns_drake.base.units import NS_PER_S as NS_PER_S
from cns_drake.base.units import wrapped as wrapped
from cns_drake.base.version import __version__ as __version__
from cns_drake.base.version import installed_versions as installed_versions
from cns_drake.base.working_folder import leave_out_folder as leave_out_folder
from cns_drake.base.working_folder import start_python as start_python
from cns_drake.base.xml_elements import Element as Element
from cns_drake.base.xml_elements import read_elements as read_elements
from cns_drake.base.xml_elements import readable_xml as readable_xml
from cns_drake.base.yaml_files import MarkedYamlLoader as MarkedYamlLoader
from cns_drake.base.yaml_files import YamlLoader as YamlLoader
from cns_drake.base.yaml_files import parse_yaml as parse_yaml
from cns_drake.base.yaml_files import read_yaml as read_yaml
