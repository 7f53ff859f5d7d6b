from .layered_overlap import LayeredOverlap as LayeredOverlap
from .layered_overlap import (
    LayeredOverlapConfig as LayeredOverlapConfig,
)
from .learned import FEATURES as FEATURES
from .learned import FREQUENCIES as FREQUENCIES
from .learned import HEADINGS as HEADINGS
from .learned import LAYERS as LAYERS
from .learned import SECTORS as SECTORS
from .learned import SEEN_SHARES as SEEN_SHARES
from .learned import TURNS as TURNS
from .learned import WEIGHTS_VERSION as WEIGHTS_VERSION
from .learned import polar_image as polar_image
from .method import Method as Method
from .method import MethodConfig as MethodConfig
from .method import PlaceScan as PlaceScan
from .method import check_number as check_number
from .method import checked_pose as checked_pose
from .method import checked_scores as checked_scores
from .method_check import check_method as check_method
from .method_check import method_checks as method_checks
from .own_files import as_users_code as as_users_code
from .own_files import load_method as load_method
from .own_files import run_module as run_module
from .registry import METHODS as METHODS
from .registry import find_method as find_method
from .registry import known_methods as known_methods
from .registry import make_method as make_method
from .registry import optional_methods as optional_methods
from .registry import register as register
from .registry import shipped_methods as shipped_methods
from .scan_context import ScanContext as ScanContext
