from .drive_table import DriveRow as DriveRow
from .drive_table import check_table as check_table
from .drive_table import drive_rows as drive_rows
from .drive_table import write_table as write_table
from .planning import DrivePlan as DrivePlan
from .planning import count_frames as count_frames
from .planning import ground_notes as ground_notes
from .planning import plan_drive as plan_drive
from .provenance import INPUTS_KEY as INPUTS_KEY
from .provenance import (
    SIMULATION_VERSION as SIMULATION_VERSION,
)
from .provenance import combined_digest as combined_digest
from .provenance import (
    dependency_versions as dependency_versions,
)
from .provenance import digest_file as digest_file
from .provenance import digest_inputs as digest_inputs
from .provenance import (
    recording_fingerprint as recording_fingerprint,
)
from .scenario import SUMO_INSTEAD as SUMO_INSTEAD
from .scenario import DriverConfig as DriverConfig
from .scenario import RideConfig as RideConfig
from .scenario import Scenario as Scenario
from .scenario import TrafficConfig as TrafficConfig
from .scenario import TransientConfig as TransientConfig
from .scenario_files import check_files as check_files
from .scenario_files import (
    check_written_scenarios as check_written_scenarios,
)
from .scenario_files import (
    describe_scenario as describe_scenario,
)
from .scenario_files import load_scenario as load_scenario
from .scenario_files import (
    make_paths_absolute as make_paths_absolute,
)
from .scenario_files import make_scenario as make_scenario
from .scenario_files import set_fields as set_fields
from .scenario_files import (
    write_scenarios as write_scenarios,
)
from .shipped import recordable_drives as recordable_drives
from .shipped import recordable_map as recordable_map
from .shipped import recordable_maps as recordable_maps
from .shipped import shipped_cities as shipped_cities
from .shipped import shipped_drives as shipped_drives
from .shipped import shipped_maps as shipped_maps
from .shipped import vehicle_file as vehicle_file
from .shipped import worlds_folder as worlds_folder
