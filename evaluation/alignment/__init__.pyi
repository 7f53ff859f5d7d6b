from evaluation.alignment.align import AlignmentReport as AlignmentReport
from evaluation.alignment.align import When as When
from evaluation.alignment.align import in_one_world as in_one_world
from evaluation.alignment.estimated_trajectories import (
    segment_errors as segment_errors,
)
from evaluation.alignment.estimated_trajectories import (
    trajectory_errors as trajectory_errors,
)
from evaluation.alignment.registration import NUM_NEIGHBOURS as NUM_NEIGHBOURS
from evaluation.alignment.registration import Surface as Surface
from evaluation.alignment.registration import covariances as covariances
from evaluation.alignment.registration import make_surface as make_surface
from evaluation.alignment.registration import register as register
from evaluation.alignment.registration import registration_at as registration_at
