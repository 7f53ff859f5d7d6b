"""Semantic classes of structures, with SemanticKITTI's names and ids."""

# Name -> id of SemanticKITTI's published label table, so that tools and
# networks for that dataset can use our labels unchanged.
CLASS_IDS = {
    "unlabeled": 0,
    "outlier": 1,
    "car": 10,
    "bicycle": 11,
    "bus": 13,
    "motorcycle": 15,
    "truck": 18,
    "other-vehicle": 20,
    "person": 30,
    "bicyclist": 31,
    "motorcyclist": 32,
    "road": 40,
    "parking": 44,
    "sidewalk": 48,
    "other-ground": 49,
    "building": 50,
    "fence": 51,
    "other-structure": 52,
    "vegetation": 70,
    "trunk": 71,
    "terrain": 72,
    "pole": 80,
    "traffic-sign": 81,
    "other-object": 99,
}

# SemanticKITTI's ids of moving objects, by our class; a class without a moving
# kind gets its "moving-other-vehicle".
MOVING_IDS = {
    "car": 252,
    "bicyclist": 253,
    "person": 254,
    "motorcyclist": 255,
    "bus": 257,
    "truck": 258,
}
OTHER_MOVING_ID = 259


def moving_id(semantic_class: str) -> int:
    """Returns SemanticKITTI's id of a class that moves."""
    return MOVING_IDS.get(semantic_class, OTHER_MOVING_ID)


# Colours by class for pictures and the 3-D page, chosen to differ in
# lightness as well as in hue.
CLASS_RGB = {
    "unlabeled": (0.55, 0.55, 0.55),
    "outlier": (0.75, 0.78, 0.82),
    "car": (0.30, 0.45, 0.75),
    "bicycle": (0.35, 0.60, 0.80),
    "bus": (0.30, 0.45, 0.75),
    "motorcycle": (0.45, 0.40, 0.70),
    "truck": (0.30, 0.45, 0.75),
    "other-vehicle": (0.30, 0.45, 0.75),
    "person": (0.85, 0.35, 0.25),
    "bicyclist": (0.75, 0.30, 0.45),
    "motorcyclist": (0.65, 0.25, 0.55),
    "road": (0.33, 0.33, 0.36),
    "parking": (0.42, 0.40, 0.44),
    "sidewalk": (0.68, 0.66, 0.63),
    "other-ground": (0.60, 0.57, 0.52),
    "building": (0.83, 0.76, 0.66),
    "fence": (0.55, 0.42, 0.30),
    "other-structure": (0.72, 0.60, 0.52),
    "vegetation": (0.35, 0.55, 0.27),
    "trunk": (0.45, 0.33, 0.22),
    "terrain": (0.56, 0.62, 0.42),
    "pole": (0.50, 0.52, 0.55),
    "traffic-sign": (0.85, 0.65, 0.20),
    "other-object": (0.60, 0.45, 0.55),
}
