from .baselines import BASELINES as BASELINES
from .baselines import run_baseline as run_baseline
from .labels import SIDES as SIDES
from .labels import Label as Label
from .labels import PairLabels as PairLabels
from .nearest_points import (
    nearest_distances as nearest_distances,
)
from .scores import score as score
from .sessions import SPACING as SPACING
from .sessions import Session as Session
from .sessions import SessionPair as SessionPair
from .sessions import read_labels as read_labels
from .sessions import read_pair as read_pair
from .sessions import read_session as read_session
from .sessions import read_truth as read_truth
from .sessions import write_labels as write_labels
from .sessions import write_session as write_session
from .sessions import write_sessions as write_sessions
from .structures import StructureChange as StructureChange
from .structures import class_names as class_names
from .structures import (
    structure_changes as structure_changes,
)
from .structures import (
    write_structures as write_structures,
)
from .upkeep import MAINTAINERS as MAINTAINERS
from .upkeep import NOT_MAINTAINED as NOT_MAINTAINED
from .upkeep import TRUTH as TRUTH
from .upkeep import Updates as Updates
from .upkeep import UpkeptMap as UpkeptMap
from .upkept_drive import UpkeptDrive as UpkeptDrive
