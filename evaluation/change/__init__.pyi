from .drive_change import ChangeReport as ChangeReport
from .drive_change import change_of_maps as change_of_maps
from .drive_change import (
    registered_change as registered_change,
)
from .drive_change import (
    same_stage_partner as same_stage_partner,
)
from .drive_change import (
    spread_over_grids as spread_over_grids,
)
from .drive_maps import DriveMap as DriveMap
from .drive_maps import map_source as map_source
from .drive_maps import read_map as read_map
from .tcr import COVERAGE_RADIUS as COVERAGE_RADIUS
from .tcr import TemporalChange as TemporalChange
from .tcr import covered as covered
from .tcr import lacks_counterpart as lacks_counterpart
from .tcr import temporal_change as temporal_change
