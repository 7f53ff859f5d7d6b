from evaluation.map_update.baselines import BASELINES as BASELINES
from evaluation.map_update.baselines import run_baseline as run_baseline
from evaluation.map_update.labels import SIDES as SIDES
from evaluation.map_update.labels import Label as Label
from evaluation.map_update.labels import PairLabels as PairLabels
from evaluation.map_update.nearest_points import (
    nearest_distances as nearest_distances,
)
from evaluation.map_update.scores import score as score
from evaluation.map_update.sessions import SPACING as SPACING
from evaluation.map_update.sessions import Session as Session
from evaluation.map_update.sessions import SessionPair as SessionPair
from evaluation.map_update.sessions import read_labels as read_labels
from evaluation.map_update.sessions import read_pair as read_pair
from evaluation.map_update.sessions import read_session as read_session
from evaluation.map_update.sessions import read_truth as read_truth
from evaluation.map_update.sessions import write_labels as write_labels
from evaluation.map_update.sessions import write_session as write_session
from evaluation.map_update.structures import StructureChange as StructureChange
from evaluation.map_update.structures import class_names as class_names
from evaluation.map_update.structures import (
    structure_changes as structure_changes,
)
from evaluation.map_update.structures import (
    write_structures as write_structures,
)
from evaluation.map_update.upkeep import MAINTAINERS as MAINTAINERS
from evaluation.map_update.upkeep import NOT_MAINTAINED as NOT_MAINTAINED
from evaluation.map_update.upkeep import TRUTH as TRUTH
from evaluation.map_update.upkeep import Updates as Updates
from evaluation.map_update.upkeep import UpkeptMap as UpkeptMap
from evaluation.map_update.upkept_drive import UpkeptDrive as UpkeptDrive
