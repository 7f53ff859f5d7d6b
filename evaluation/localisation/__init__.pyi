from evaluation.localisation.estimators import make_estimator as make_estimator
from evaluation.localisation.initial_poses import InitialPose as InitialPose
from evaluation.localisation.initial_poses import Starts as Starts
from evaluation.localisation.localisation_map import (
    FEWEST_POINTS as FEWEST_POINTS,
)
from evaluation.localisation.localisation_map import (
    LocalisationMap as LocalisationMap,
)
from evaluation.localisation.localisation_map import make_map as make_map
from evaluation.localisation.localisation_map import map_frames as map_frames
from evaluation.localisation.localisation_map import map_of as map_of
from evaluation.localisation.localiser import NEAR as NEAR
from evaluation.localisation.localiser import Localiser as Localiser
from evaluation.localisation.localiser import Query as Query
from evaluation.localisation.localiser import localise as localise
from evaluation.localisation.localiser import mapped_frames as mapped_frames
from evaluation.localisation.localiser import path_axes as path_axes
from evaluation.localisation.localiser import query_frames as query_frames
from evaluation.localisation.localiser import read_queries as read_queries
from evaluation.localisation.one_scan import OneScan as OneScan
from evaluation.localisation.results import COLUMNS as COLUMNS
from evaluation.localisation.results import QUERY as QUERY
from evaluation.localisation.results import (
    RIGHT_TRANSLATION as RIGHT_TRANSLATION,
)
from evaluation.localisation.results import Localised as Localised
from evaluation.localisation.results import (
    localisation_columns as localisation_columns,
)
from evaluation.localisation.results import note_sparse as note_sparse
from evaluation.localisation.results import write_rows as write_rows
from evaluation.localisation.settings import KISS_MATCHER as KISS_MATCHER
from evaluation.localisation.settings import METHODS as METHODS
from evaluation.localisation.settings import Settings as Settings
from evaluation.localisation.settings import (
    default_settings as default_settings,
)
from evaluation.localisation.tracking import LOST as LOST
from evaluation.localisation.tracking import Tracked as Tracked
from evaluation.localisation.tracking import localised as localised
from evaluation.localisation.tracking import track_drive as track_drive
