from .film import make_film as make_film
from .film import with_some_traffic as with_some_traffic
from .loaded_drive import load_drive as load_drive
from .scanning import scan as scan
from .scanning import scan_world as scan_world
from .scanning import still_scene as still_scene
from .scenario_traffic import (
    plan_scenario_traffic as plan_scenario_traffic,
)
from .scenario_traffic import (
    recorded_traffic as recorded_traffic,
)
from .sensor_recording import (
    add_mcap_recorder as add_mcap_recorder,
)
from .simulated_drive import (
    SimulatedDrive as SimulatedDrive,
)
from .simulated_drive import (
    SimulationSource as SimulationSource,
)
from .simulation import (
    FinishedSimulation as FinishedSimulation,
)
from .simulation import simulate as simulate
from .stage_loading import load_stage as load_stage
from .station import make_station as make_station
