from .costs import NUM_TRIALS as NUM_TRIALS
from .costs import Cost as Cost
from .costs import QueryCost as QueryCost
from .costs import measure_cost as measure_cost
from .costs import measure_search as measure_search
from .costs import query_ms as query_ms
from .describing import Request as Request
from .describing import Role as Role
from .describing import describe_drive as describe_drive
from .descriptors import DescribedScans as DescribedScans
from .descriptors import (
    DriveDescriptors as DriveDescriptors,
)
from .descriptors import joined_scans as joined_scans
from .faults import FAULTS as FAULTS
from .metrics import METRICS as METRICS
from .metrics import Metric as Metric
from .metrics import Mode as Mode
from .metrics import choose_metrics as choose_metrics
from .metrics import kept_share as kept_share
from .metrics import load_metrics as load_metrics
from .metrics import metric_named as metric_named
from .metrics import numbers_of as numbers_of
from .metrics import register_metric as register_metric
from .overlap_truth import (
    compared_frames as compared_frames,
)
from .overlap_truth import (
    overlap_matrix as overlap_matrix,
)
from .overlap_truth import (
    overlaps_with_best_match as overlaps_with_best_match,
)
from .overlap_truth import read_overlaps as read_overlaps
from .overlap_truth import (
    write_overlaps as write_overlaps,
)
from .pair_scores import (
    PlaceRecognitionMetrics as PlaceRecognitionMetrics,
)
from .pair_scores import evaluate as evaluate
from .place_outcome import PlaceOutcome as PlaceOutcome
from .place_outcome import QueryDrive as QueryDrive
from .place_outcome import (
    check_has_match as check_has_match,
)
from .place_selection import KEEP_ALL as KEEP_ALL
from .place_selection import checked_keep as checked_keep
from .place_selection import kept_places as kept_places
from .pose_errors import PoseErrors as PoseErrors
from .pose_errors import pose_error as pose_error
from .precision_recall import pr_curve as pr_curve
from .precision_recall import (
    weighted_metrics as weighted_metrics,
)
from .protocol import PAPER_PROTOCOL as PAPER_PROTOCOL
from .protocol import PROTOCOL_NAMES as PROTOCOL_NAMES
from .protocol import PROTOCOLS as PROTOCOLS
from .protocol import (
    RANDOM_YAW_PROTOCOL as RANDOM_YAW_PROTOCOL,
)
from .protocol import (
    RECORDED_PROTOCOL as RECORDED_PROTOCOL,
)
from .protocol import (
    ProtocolFieldError as ProtocolFieldError,
)
from .protocol import (
    RetrievalProtocol as RetrievalProtocol,
)
from .protocol_options import (
    with_protocol as with_protocol,
)
from .protocol_options import (
    with_protocols as with_protocols,
)
from .query_outcomes import QueryOutcomes as QueryOutcomes
from .query_outcomes import auroc as auroc
from .query_outcomes import common_blocks as common_blocks
from .query_outcomes import judge as judge
from .result_number import Number as Number
from .retrieval import Retrieval as Retrieval
from .retrieval import (
    compare_at_radii as compare_at_radii,
)
from .retrieval import (
    matches_within_radius as matches_within_radius,
)
from .retrieval import query_batches as query_batches
from .retrieval import retrieve as retrieve
from .scan_folders import write_scores as write_scores
from .search import Search as Search
from .seen_surfaces import TOLERANCE as TOLERANCE
from .seen_surfaces import SeenSurfaces as SeenSurfaces
from .sign_flips import LEAST_CITIES as LEAST_CITIES
from .sign_flips import SIGNIFICANT as SIGNIFICANT
from .sign_flips import UNKNOWN as UNKNOWN
from .sign_flips import Difference as Difference
from .sign_flips import Interval as Interval
from .sign_flips import city_interval as city_interval
from .sign_flips import (
    compared_by_right_answers as compared_by_right_answers,
)
from .sign_flips import (
    jackknife_interval as jackknife_interval,
)
from .sign_flips import leave_one_out as leave_one_out
from .sign_flips import route_blocks as route_blocks
from .sign_flips import (
    sign_flip_test as sign_flip_test,
)
from .stored_places import MOST_BYTES as MOST_BYTES
from .stored_places import StoredDrives as StoredDrives
