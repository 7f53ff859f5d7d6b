from .estimators import make_estimator as make_estimator
from .initial_poses import InitialPose as InitialPose
from .initial_poses import Starts as Starts
from .localisation_map import (
    FEWEST_POINTS as FEWEST_POINTS,
)
from .localisation_map import (
    LocalisationMap as LocalisationMap,
)
from .localisation_map import make_map as make_map
from .localisation_map import map_of as map_of
from .localiser import Localiser as Localiser
from .localiser import Query as Query
from .localiser import localise as localise
from .localiser import mapped_frames as mapped_frames
from .localiser import query_frames as query_frames
from .localiser import read_queries as read_queries
from .one_scan import OneScan as OneScan
from .results import QUERY as QUERY
from .results import (
    RIGHT_TRANSLATION as RIGHT_TRANSLATION,
)
from .results import Localised as Localised
from .results import (
    localisation_columns as localisation_columns,
)
from .results import note_sparse as note_sparse
from .results import write_rows as write_rows
from .settings import KISS_MATCHER as KISS_MATCHER
from .settings import METHODS as METHODS
from .settings import Settings as Settings
from .settings import (
    default_settings as default_settings,
)
from .tracking import LOST as LOST
from .tracking import localised as localised
from .tracking import track_drive as track_drive
