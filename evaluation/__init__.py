"""Structural change and place recognition on LiDAR drives.

Independent of the simulator: this package imports neither Drake nor any part of
`cns_drake` except `cns_drake.base`.

The public names are in `__all__`; a name is imported when it is first used.
`evaluation.drives` and `evaluation.methods` are public as well.
"""

import importlib
from pkgutil import extend_path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from cns_drake.base.errors import InputError
    from evaluation.change.tcr import TemporalChange, covered, temporal_change
    from evaluation.drives import Drive, open_drive
    from evaluation.drives.comparison import compare_drives
    from evaluation.maps.voxel_maps import VoxelMap, map_drive, voxelise
    from evaluation.methods import (
        Method,
        MethodConfig,
        known_methods,
        make_method,
        register,
    )
    from evaluation.recognition.metrics import PlaceRecognitionMetrics, evaluate
    from evaluation.recognition.protocol import RetrievalProtocol
    from evaluation.recognition.query_outcomes import QueryOutcomes, judge
    from evaluation.recognition.retrieval import Retrieval, retrieve

__all__ = [
    "Drive",
    "InputError",
    "Method",
    "MethodConfig",
    "PlaceRecognitionMetrics",
    "QueryOutcomes",
    "Retrieval",
    "RetrievalProtocol",
    "TemporalChange",
    "VoxelMap",
    "compare_drives",
    "covered",
    "evaluate",
    "judge",
    "known_methods",
    "make_method",
    "map_drive",
    "open_drive",
    "register",
    "retrieve",
    "temporal_change",
    "voxelise",
]

# Module -> the public names it defines.
_HOMES = {
    "cns_drake.base.errors": ("InputError",),
    "evaluation.change.tcr": ("TemporalChange", "covered", "temporal_change"),
    "evaluation.maps.voxel_maps": ("VoxelMap", "map_drive", "voxelise"),
    "evaluation.methods": (
        "Method",
        "MethodConfig",
        "known_methods",
        "make_method",
        "register",
    ),
    "evaluation.recognition.metrics": ("PlaceRecognitionMetrics", "evaluate"),
    "evaluation.recognition.protocol": ("RetrievalProtocol",),
    "evaluation.recognition.query_outcomes": ("QueryOutcomes", "judge"),
    "evaluation.recognition.retrieval": ("Retrieval", "retrieve"),
    "evaluation.drives": ("Drive", "open_drive"),
    "evaluation.drives.comparison": ("compare_drives",),
}

# Python prefers a package to a folder without `__init__`. A user's folder of
# the same name stays importable behind ours.
__path__ = extend_path(__path__, __name__)


def __getattr__(name: str) -> Any:
    for home, names in _HOMES.items():
        if name in names:
            module = importlib.import_module(home)
            return getattr(module, name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted(__all__)
