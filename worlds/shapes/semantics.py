"""Semantic classes of structures, with SemanticKITTI's names and ids."""

from evaluation.base import OTHER_MOVING_ID

# Name -> id in SemanticKITTI's published label table, so that tools and
# networks for that data set can use these labels unchanged; and the colour in
# pictures and on the 3-D page. The colours differ in lightness as well as in
# hue.
_CLASSES = {
    "unlabeled": (0, (0.55, 0.55, 0.55)),
    "outlier": (1, (0.75, 0.78, 0.82)),
    "car": (10, (0.30, 0.45, 0.75)),
    "bicycle": (11, (0.35, 0.60, 0.80)),
    "bus": (13, (0.30, 0.45, 0.75)),
    "motorcycle": (15, (0.45, 0.40, 0.70)),
    "truck": (18, (0.30, 0.45, 0.75)),
    "other-vehicle": (20, (0.30, 0.45, 0.75)),
    "person": (30, (0.85, 0.35, 0.25)),
    "bicyclist": (31, (0.75, 0.30, 0.45)),
    "motorcyclist": (32, (0.65, 0.25, 0.55)),
    "road": (40, (0.33, 0.33, 0.36)),
    "parking": (44, (0.42, 0.40, 0.44)),
    "sidewalk": (48, (0.68, 0.66, 0.63)),
    "other-ground": (49, (0.60, 0.57, 0.52)),
    "building": (50, (0.83, 0.76, 0.66)),
    "fence": (51, (0.55, 0.42, 0.30)),
    "other-structure": (52, (0.72, 0.60, 0.52)),
    "vegetation": (70, (0.35, 0.55, 0.27)),
    "trunk": (71, (0.45, 0.33, 0.22)),
    "terrain": (72, (0.56, 0.62, 0.42)),
    "pole": (80, (0.50, 0.52, 0.55)),
    "traffic-sign": (81, (0.85, 0.65, 0.20)),
    "other-object": (99, (0.60, 0.45, 0.55)),
}
CLASS_IDS = {name: number for name, (number, _) in _CLASSES.items()}
CLASS_RGB = {name: rgb for name, (_, rgb) in _CLASSES.items()}
# Classes of the ground on which other objects stand.
GROUND_CLASSES = frozenset(
    {"road", "parking", "sidewalk", "other-ground", "terrain"}
)

# Class -> SemanticKITTI's id while it moves. A class without a moving
# counterpart gets "moving-other-vehicle".
MOVING_IDS = {
    "car": 252,
    "bicyclist": 253,
    "person": 254,
    "motorcyclist": 255,
    "bus": 257,
    "truck": 258,
}


def moving_id(semantic_class: str) -> int:
    """Returns SemanticKITTI's id for a class while its objects move.

    Classes without such an id get the id of SemanticKITTI's
    `moving-other-vehicle`.
    """
    return MOVING_IDS.get(semantic_class, OTHER_MOVING_ID)
