from .chosen_methods import MethodChoice as MethodChoice
from .chosen_methods import choose_method as choose_method
from .chosen_methods import choose_methods as choose_methods
from .chosen_methods import expanded_names as expanded_names
from .chosen_methods import method_settings as method_settings
from .experiments.cause_files import Cause as Cause
from .experiments.cause_files import causes as causes
from .experiments.cause_files import register_cause as register_cause
from .experiments.cause_files import source_of_cause as source_of_cause
from .experiments.conditions import Condition as Condition
from .experiments.conditions import (
    condition_protocol as condition_protocol,
)
from .experiments.conditions import (
    protocol_from_fields as protocol_from_fields,
)
from .experiments.experiment import Experiment as Experiment
from .experiments.experiment import MadeMap as MadeMap
from .experiments.experiment import named_programs as named_programs
from .experiments.experiment_files import experiment_text as experiment_text
from .experiments.experiment_files import load_experiment as load_experiment
from .experiments.experiment_files import (
    shipped_experiments as shipped_experiments,
)
from .experiments.factors import FLEET as FLEET
from .experiments.factors import SESSIONS as SESSIONS
from .experiments.factors import Case as Case
from .experiments.factors import Changes as Changes
from .features import (
    extract_features as extract_features,
)
from .parts import LongList as LongList
from .parts import MakePart as MakePart
from .parts import Part as Part
from .place_measurements import (
    PlaceComparison as PlaceComparison,
)
from .place_measurements import measure_places as measure_places
from .recorded_city import ShownCity as ShownCity
from .recorded_city import add_city as add_city
from .recorded_study import (
    recorded_sections as recorded_sections,
)
from .recorded_study import study_recordings as study_recordings
from .recordings.map_drives import MapDrives as MapDrives
from .recordings.map_drives import (
    RecordingInfo as RecordingInfo,
)
from .recordings.map_drives import (
    drives_by_map as drives_by_map,
)
from .recordings.map_drives import (
    scenario_digest as scenario_digest,
)
from .recordings.recorded_pairs import (
    recorded_pairs as recorded_pairs,
)
from .recordings.recording_search import (
    find_recordings as find_recordings,
)
from .sources import DriveSource as DriveSource
from .sources import RecordingSource as RecordingSource
from .study import Study as Study
from .study_files import StudyFiles as StudyFiles
from .tasks.change import ChangeTask as ChangeTask
from .tasks.jobs import OPENING_COST as OPENING_COST
from .tasks.jobs import SCAN_COST as SCAN_COST
from .tasks.jobs import Jobs as Jobs
from .tasks.jobs import job_name as job_name
from .tasks.localise import NOT_LOCALISED as NOT_LOCALISED
from .tasks.localise import LocaliseTask as LocaliseTask
from .tasks.localise import (
    measure_localisation as measure_localisation,
)
from .tasks.map_scores import GIVEN as GIVEN
from .tasks.map_scores import TRUTH as TRUTH
from .tasks.map_scores import MapScores as MapScores
from .tasks.map_scores import MapTask as MapTask
from .tasks.map_scores import score_methods as score_methods
from .tasks.pair import USUAL_LENGTH as USUAL_LENGTH
from .tasks.pair import NamedDrive as NamedDrive
from .tasks.pair import Pair as Pair
from .tasks.pair import Result as Result
from .tasks.pair import factors_in_words as factors_in_words
from .tasks.place import CostTask as CostTask
from .tasks.place import PlaceTask as PlaceTask
from .tasks.place import PoseTask as PoseTask
from .tasks.task import Task as Task
from .tasks.task import check_positive as check_positive
