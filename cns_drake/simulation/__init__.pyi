from cns_drake.simulation.film import make_film as make_film
from cns_drake.simulation.film import with_some_traffic as with_some_traffic
from cns_drake.simulation.loaded_drive import load_drive as load_drive
from cns_drake.simulation.scan_files import check_ending as check_ending
from cns_drake.simulation.scan_files import save_scan as save_scan
from cns_drake.simulation.scanning import scan_world as scan_world
from cns_drake.simulation.scanning import still_scene as still_scene
from cns_drake.simulation.scenario_traffic import (
    plan_scenario_traffic as plan_scenario_traffic,
)
from cns_drake.simulation.scenario_traffic import (
    recorded_traffic as recorded_traffic,
)
from cns_drake.simulation.sensor_recording import (
    add_mcap_recorder as add_mcap_recorder,
)
from cns_drake.simulation.simulated_drive import (
    SimulatedDrive as SimulatedDrive,
)
from cns_drake.simulation.simulated_drive import (
    SimulationSource as SimulationSource,
)
from cns_drake.simulation.simulation import (
    FinishedSimulation as FinishedSimulation,
)
from cns_drake.simulation.simulation import simulate as simulate
from cns_drake.simulation.stage_loading import load_stage as load_stage
from cns_drake.simulation.station import make_station as make_station
