from evaluation.study.chosen_methods import STANDARD as STANDARD
from evaluation.study.chosen_methods import MethodChoice as MethodChoice
from evaluation.study.chosen_methods import choose_method as choose_method
from evaluation.study.chosen_methods import choose_methods as choose_methods
from evaluation.study.chosen_methods import expanded_names as expanded_names
from evaluation.study.chosen_methods import method_settings as method_settings
from evaluation.study.engine import Engine as Engine
from evaluation.study.engine import made_tasks as made_tasks
from evaluation.study.feature_extraction import (
    extract_features as extract_features,
)
from evaluation.study.parts import LongList as LongList
from evaluation.study.parts import MakePart as MakePart
from evaluation.study.parts import Part as Part
from evaluation.study.place_measurements import (
    DescribedSource as DescribedSource,
)
from evaluation.study.place_measurements import (
    PlaceComparison as PlaceComparison,
)
from evaluation.study.place_measurements import measure_places as measure_places
from evaluation.study.recorded_city import ShownCity as ShownCity
from evaluation.study.recorded_city import add_city as add_city
from evaluation.study.recorded_study import (
    recorded_sections as recorded_sections,
)
from evaluation.study.recorded_study import study_recordings as study_recordings
from evaluation.study.recordings import STAGES_FILE as STAGES_FILE
from evaluation.study.recordings.map_drives import MapDrives as MapDrives
from evaluation.study.recordings.map_drives import (
    RecordingInfo as RecordingInfo,
)
from evaluation.study.recordings.map_drives import (
    drives_by_map as drives_by_map,
)
from evaluation.study.recordings.recorded_pairs import (
    RecordedCondition as RecordedCondition,
)
from evaluation.study.recordings.recorded_pairs import (
    chosen_recordings as chosen_recordings,
)
from evaluation.study.recordings.recorded_pairs import (
    recorded_pairs as recorded_pairs,
)
from evaluation.study.recordings.recording_search import (
    find_recordings as find_recordings,
)
from evaluation.study.sources import DriveSource as DriveSource
from evaluation.study.sources import RecordingSource as RecordingSource
from evaluation.study.study_files import StudyFiles as StudyFiles
from evaluation.study.tasks.change import ChangeTask as ChangeTask
from evaluation.study.tasks.jobs import OPENING_COST as OPENING_COST
from evaluation.study.tasks.jobs import SCAN_COST as SCAN_COST
from evaluation.study.tasks.jobs import Jobs as Jobs
from evaluation.study.tasks.jobs import job_name as job_name
from evaluation.study.tasks.localise import NOT_LOCALISED as NOT_LOCALISED
from evaluation.study.tasks.localise import SHIPPED as SHIPPED
from evaluation.study.tasks.localise import LocaliseTask as LocaliseTask
from evaluation.study.tasks.localise import (
    measure_localisation as measure_localisation,
)
from evaluation.study.tasks.map_scores import GIVEN as GIVEN
from evaluation.study.tasks.map_scores import TRUTH as TRUTH
from evaluation.study.tasks.map_scores import MapScores as MapScores
from evaluation.study.tasks.map_scores import MapTask as MapTask
from evaluation.study.tasks.map_scores import score_methods as score_methods
from evaluation.study.tasks.pair import USUAL_LENGTH as USUAL_LENGTH
from evaluation.study.tasks.pair import NamedDrive as NamedDrive
from evaluation.study.tasks.pair import Pair as Pair
from evaluation.study.tasks.pair import Result as Result
from evaluation.study.tasks.place import CostTask as CostTask
from evaluation.study.tasks.place import PlaceTask as PlaceTask
from evaluation.study.tasks.place import PoseTask as PoseTask
from evaluation.study.tasks.task import Task as Task
from evaluation.study.tasks.task import check_positive as check_positive
