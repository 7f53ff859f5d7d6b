from cns_drake.base import InputError as InputError
from cns_drake.drives import Drive as Drive
from evaluation.change import TemporalChange as TemporalChange
from evaluation.change import covered as covered
from evaluation.change import temporal_change as temporal_change
from evaluation.drives import DataSet as DataSet
from evaluation.drives import check_data_set as check_data_set
from evaluation.drives import data_set_checks as data_set_checks
from evaluation.drives import open_drive as open_drive
from evaluation.drives import register_data_set as register_data_set
from evaluation.maps import VoxelMap as VoxelMap
from evaluation.maps import map_drive as map_drive
from evaluation.maps import voxelise as voxelise
from evaluation.methods import Method as Method
from evaluation.methods import MethodConfig as MethodConfig
from evaluation.methods import check_method as check_method
from evaluation.methods import known_methods as known_methods
from evaluation.methods import make_method as make_method
from evaluation.methods import method_checks as method_checks
from evaluation.methods import register as register
from evaluation.recognition import Metric as Metric
from evaluation.recognition import (
    PlaceRecognitionMetrics as PlaceRecognitionMetrics,
)
from evaluation.recognition import QueryOutcomes as QueryOutcomes
from evaluation.recognition import Retrieval as Retrieval
from evaluation.recognition import RetrievalProtocol as RetrievalProtocol
from evaluation.recognition import compared_frames as compared_frames
from evaluation.recognition import evaluate as evaluate
from evaluation.recognition import judge as judge
from evaluation.recognition import register_metric as register_metric
from evaluation.recognition import retrieve as retrieve
from evaluation.recognition import route_blocks as route_blocks
from evaluation.results import QueryRows as QueryRows
from evaluation.results import Results as Results
from evaluation.results import means as means
