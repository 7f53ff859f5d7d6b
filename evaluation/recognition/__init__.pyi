from evaluation.recognition.costs import NUM_TRIALS as NUM_TRIALS
from evaluation.recognition.costs import Cost as Cost
from evaluation.recognition.costs import QueryCost as QueryCost
from evaluation.recognition.costs import measure_cost as measure_cost
from evaluation.recognition.costs import measure_search as measure_search
from evaluation.recognition.costs import query_ms as query_ms
from evaluation.recognition.describing import Request as Request
from evaluation.recognition.describing import Role as Role
from evaluation.recognition.describing import describe_drive as describe_drive
from evaluation.recognition.descriptors import DescribedScans as DescribedScans
from evaluation.recognition.descriptors import (
    DriveDescriptors as DriveDescriptors,
)
from evaluation.recognition.descriptors import joined_scans as joined_scans
from evaluation.recognition.faults import FAULTS as FAULTS
from evaluation.recognition.metrics import METRICS as METRICS
from evaluation.recognition.metrics import Metric as Metric
from evaluation.recognition.metrics import Mode as Mode
from evaluation.recognition.metrics import choose_metrics as choose_metrics
from evaluation.recognition.metrics import kept_share as kept_share
from evaluation.recognition.metrics import load_metrics as load_metrics
from evaluation.recognition.metrics import metric_named as metric_named
from evaluation.recognition.metrics import numbers_of as numbers_of
from evaluation.recognition.metrics import register_metric as register_metric
from evaluation.recognition.overlap_truth import (
    compared_frames as compared_frames,
)
from evaluation.recognition.overlap_truth import (
    overlap_matrix as overlap_matrix,
)
from evaluation.recognition.overlap_truth import (
    overlaps_with_best_match as overlaps_with_best_match,
)
from evaluation.recognition.overlap_truth import read_overlaps as read_overlaps
from evaluation.recognition.overlap_truth import (
    write_overlaps as write_overlaps,
)
from evaluation.recognition.pair_scores import (
    PlaceRecognitionMetrics as PlaceRecognitionMetrics,
)
from evaluation.recognition.pair_scores import evaluate as evaluate
from evaluation.recognition.place_outcome import PlaceOutcome as PlaceOutcome
from evaluation.recognition.place_outcome import QueryDrive as QueryDrive
from evaluation.recognition.place_outcome import (
    check_has_match as check_has_match,
)
from evaluation.recognition.place_selection import KEEP_ALL as KEEP_ALL
from evaluation.recognition.place_selection import checked_keep as checked_keep
from evaluation.recognition.place_selection import kept_places as kept_places
from evaluation.recognition.pose_errors import PoseErrors as PoseErrors
from evaluation.recognition.pose_errors import pose_error as pose_error
from evaluation.recognition.precision_recall import pr_curve as pr_curve
from evaluation.recognition.precision_recall import (
    weighted_metrics as weighted_metrics,
)
from evaluation.recognition.protocol import PAPER_PROTOCOL as PAPER_PROTOCOL
from evaluation.recognition.protocol import PROTOCOL_NAMES as PROTOCOL_NAMES
from evaluation.recognition.protocol import PROTOCOLS as PROTOCOLS
from evaluation.recognition.protocol import (
    RANDOM_YAW_PROTOCOL as RANDOM_YAW_PROTOCOL,
)
from evaluation.recognition.protocol import (
    RECORDED_PROTOCOL as RECORDED_PROTOCOL,
)
from evaluation.recognition.protocol import (
    ProtocolFieldError as ProtocolFieldError,
)
from evaluation.recognition.protocol import (
    RetrievalProtocol as RetrievalProtocol,
)
from evaluation.recognition.protocol_options import (
    with_protocol as with_protocol,
)
from evaluation.recognition.protocol_options import (
    with_protocols as with_protocols,
)
from evaluation.recognition.query_outcomes import QueryOutcomes as QueryOutcomes
from evaluation.recognition.query_outcomes import auroc as auroc
from evaluation.recognition.query_outcomes import common_blocks as common_blocks
from evaluation.recognition.query_outcomes import judge as judge
from evaluation.recognition.result_number import Number as Number
from evaluation.recognition.retrieval import Retrieval as Retrieval
from evaluation.recognition.retrieval import (
    compare_at_radii as compare_at_radii,
)
from evaluation.recognition.retrieval import (
    matches_within_radius as matches_within_radius,
)
from evaluation.recognition.retrieval import query_batches as query_batches
from evaluation.recognition.retrieval import retrieve as retrieve
from evaluation.recognition.scan_folders import write_scores as write_scores
from evaluation.recognition.scoring import score_places as score_places
from evaluation.recognition.search import Search as Search
from evaluation.recognition.seen_surfaces import TOLERANCE as TOLERANCE
from evaluation.recognition.seen_surfaces import SeenSurfaces as SeenSurfaces
from evaluation.recognition.sign_flips import LEAST_CITIES as LEAST_CITIES
from evaluation.recognition.sign_flips import SIGNIFICANT as SIGNIFICANT
from evaluation.recognition.sign_flips import UNKNOWN as UNKNOWN
from evaluation.recognition.sign_flips import Difference as Difference
from evaluation.recognition.sign_flips import Interval as Interval
from evaluation.recognition.sign_flips import city_interval as city_interval
from evaluation.recognition.sign_flips import (
    compared_by_right_answers as compared_by_right_answers,
)
from evaluation.recognition.sign_flips import (
    jackknife_interval as jackknife_interval,
)
from evaluation.recognition.sign_flips import leave_one_out as leave_one_out
from evaluation.recognition.sign_flips import route_blocks as route_blocks
from evaluation.recognition.sign_flips import (
    sign_flip_test as sign_flip_test,
)
from evaluation.recognition.stored_places import MOST_BYTES as MOST_BYTES
from evaluation.recognition.stored_places import StoredDrives as StoredDrives
