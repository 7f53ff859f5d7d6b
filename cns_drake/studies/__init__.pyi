from .cause_check import causes as causes
from .cause_check import register_cause as register_cause
from .chosen_drives import named_drives as named_drives
from .drives.changed_drives import Losses as Losses
from .drives.sampled_drives import DrawnRoute as DrawnRoute
from .drives.sampled_drives import Fleet as Fleet
from .drives.viewpoints import with_lidars_moved as with_lidars_moved
from .maps.redrawing import marked_yaml as marked_yaml
from .maps.redrawing import redrawn_inputs as redrawn_inputs
from .maps.turned_inputs import turned_content as turned_content
from .recording import is_recorded as is_recorded
from .recording import record_all as record_all
from .reproduction import (
    reproduce_maps as reproduce_maps,
)
from .study import TASKS as TASKS
from .study import run_study as run_study
from .study import study_drives as study_drives
