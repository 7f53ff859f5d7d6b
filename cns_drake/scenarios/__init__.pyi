from cns_drake.scenarios.drive_table import DriveRow as DriveRow
from cns_drake.scenarios.drive_table import check_table as check_table
from cns_drake.scenarios.drive_table import drive_rows as drive_rows
from cns_drake.scenarios.drive_table import write_table as write_table
from cns_drake.scenarios.planning import DrivePlan as DrivePlan
from cns_drake.scenarios.planning import count_frames as count_frames
from cns_drake.scenarios.planning import ground_notes as ground_notes
from cns_drake.scenarios.planning import plan_drive as plan_drive
from cns_drake.scenarios.provenance import INPUTS_KEY as INPUTS_KEY
from cns_drake.scenarios.provenance import (
    SIMULATION_VERSION as SIMULATION_VERSION,
)
from cns_drake.scenarios.provenance import combined_digest as combined_digest
from cns_drake.scenarios.provenance import (
    dependency_versions as dependency_versions,
)
from cns_drake.scenarios.provenance import digest_file as digest_file
from cns_drake.scenarios.provenance import digest_inputs as digest_inputs
from cns_drake.scenarios.provenance import (
    recording_fingerprint as recording_fingerprint,
)
from cns_drake.scenarios.scenario import SUMO_INSTEAD as SUMO_INSTEAD
from cns_drake.scenarios.scenario import DriverConfig as DriverConfig
from cns_drake.scenarios.scenario import Name as Name
from cns_drake.scenarios.scenario import RideConfig as RideConfig
from cns_drake.scenarios.scenario import Scenario as Scenario
from cns_drake.scenarios.scenario import TrafficConfig as TrafficConfig
from cns_drake.scenarios.scenario import TransientConfig as TransientConfig
from cns_drake.scenarios.scenario_files import check_files as check_files
from cns_drake.scenarios.scenario_files import (
    check_written_scenarios as check_written_scenarios,
)
from cns_drake.scenarios.scenario_files import (
    describe_scenario as describe_scenario,
)
from cns_drake.scenarios.scenario_files import load_scenario as load_scenario
from cns_drake.scenarios.scenario_files import (
    make_paths_absolute as make_paths_absolute,
)
from cns_drake.scenarios.scenario_files import make_scenario as make_scenario
from cns_drake.scenarios.scenario_files import set_fields as set_fields
from cns_drake.scenarios.scenario_files import (
    write_scenarios as write_scenarios,
)
from cns_drake.scenarios.shipped import recordable_drives as recordable_drives
from cns_drake.scenarios.shipped import recordable_map as recordable_map
from cns_drake.scenarios.shipped import recordable_maps as recordable_maps
from cns_drake.scenarios.shipped import shipped_cities as shipped_cities
from cns_drake.scenarios.shipped import shipped_drives as shipped_drives
from cns_drake.scenarios.shipped import shipped_maps as shipped_maps
from cns_drake.scenarios.shipped import vehicle_file as vehicle_file
from cns_drake.scenarios.shipped import worlds_folder as worlds_folder
