from evaluation.change.drive_change import ChangeReport as ChangeReport
from evaluation.change.drive_change import change_of_maps as change_of_maps
from evaluation.change.drive_change import (
    registered_change as registered_change,
)
from evaluation.change.drive_change import (
    same_stage_partner as same_stage_partner,
)
from evaluation.change.drive_change import (
    spread_over_grids as spread_over_grids,
)
from evaluation.change.drive_maps import DriveMap as DriveMap
from evaluation.change.drive_maps import maps_in_one_world as maps_in_one_world
from evaluation.change.drive_maps import open_source as open_source
from evaluation.change.drive_maps import read_map as read_map
from evaluation.change.tcr import COVERAGE_RADIUS as COVERAGE_RADIUS
from evaluation.change.tcr import TemporalChange as TemporalChange
from evaluation.change.tcr import covered as covered
from evaluation.change.tcr import lacks_counterpart as lacks_counterpart
from evaluation.change.tcr import temporal_change as temporal_change
