from evaluation.methods.layered_overlap import LayeredOverlap as LayeredOverlap
from evaluation.methods.layered_overlap import (
    LayeredOverlapConfig as LayeredOverlapConfig,
)
from evaluation.methods.learned import FEATURES as FEATURES
from evaluation.methods.learned import FREQUENCIES as FREQUENCIES
from evaluation.methods.learned import HEADINGS as HEADINGS
from evaluation.methods.learned import LAYERS as LAYERS
from evaluation.methods.learned import SECTORS as SECTORS
from evaluation.methods.learned import SEEN_SHARES as SEEN_SHARES
from evaluation.methods.learned import TURNS as TURNS
from evaluation.methods.learned import WEIGHTS_VERSION as WEIGHTS_VERSION
from evaluation.methods.learned import polar_image as polar_image
from evaluation.methods.method import Method as Method
from evaluation.methods.method import MethodConfig as MethodConfig
from evaluation.methods.method import PlaceScan as PlaceScan
from evaluation.methods.method import check_number as check_number
from evaluation.methods.method import checked_pose as checked_pose
from evaluation.methods.method import checked_scores as checked_scores
from evaluation.methods.method_check import check_method as check_method
from evaluation.methods.method_check import method_checks as method_checks
from evaluation.methods.own_files import as_users_code as as_users_code
from evaluation.methods.own_files import load_method as load_method
from evaluation.methods.own_files import run_module as run_module
from evaluation.methods.registry import METHODS as METHODS
from evaluation.methods.registry import find_method as find_method
from evaluation.methods.registry import known_methods as known_methods
from evaluation.methods.registry import make_method as make_method
from evaluation.methods.registry import optional_methods as optional_methods
from evaluation.methods.registry import register as register
from evaluation.methods.registry import shipped_methods as shipped_methods
from evaluation.methods.scan_context import ScanContext as ScanContext
