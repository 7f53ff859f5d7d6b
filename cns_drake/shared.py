"""What users of the simulator need of `evaluation`: a wall to its doors."""

from evaluation.base import InputError as InputError
from evaluation.base import __version__ as __version__
from evaluation.lidar_sheets import LIDAR_PRESETS as LIDAR_PRESETS
