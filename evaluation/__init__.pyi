from cns_drake.base.errors import InputError as InputError
from cns_drake.drives.drive import Drive as Drive
from evaluation.change.tcr import TemporalChange as TemporalChange
from evaluation.change.tcr import covered as covered
from evaluation.change.tcr import temporal_change as temporal_change
from evaluation.drives import open_drive as open_drive
from evaluation.drives.comparison import compare_drives as compare_drives
from evaluation.maps.voxel_maps import VoxelMap as VoxelMap
from evaluation.maps.voxel_maps import map_drive as map_drive
from evaluation.maps.voxel_maps import voxelise as voxelise
from evaluation.methods import Method as Method
from evaluation.methods import MethodConfig as MethodConfig
from evaluation.methods import known_methods as known_methods
from evaluation.methods import make_method as make_method
from evaluation.methods import register as register
from evaluation.recognition.bootstrap import route_blocks as route_blocks
from evaluation.recognition.metrics import (
    PlaceRecognitionMetrics as PlaceRecognitionMetrics,
)
from evaluation.recognition.metrics import evaluate as evaluate
from evaluation.recognition.overlap_truth import (
    compared_frames as compared_frames,
)
from evaluation.recognition.protocol import (
    RetrievalProtocol as RetrievalProtocol,
)
from evaluation.recognition.query_outcomes import QueryOutcomes as QueryOutcomes
from evaluation.recognition.query_outcomes import judge as judge
from evaluation.recognition.retrieval import Retrieval as Retrieval
from evaluation.recognition.retrieval import retrieve as retrieve
from evaluation.results.summaries import means as means
from evaluation.results.table import QueryRows as QueryRows
from evaluation.results.table import Results as Results
