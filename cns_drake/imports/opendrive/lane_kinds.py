"""Types of lanes: whether cars drive on them, and their classes."""

from __future__ import annotations

# Cars drive on them, each in one direction.
DRIVEN = frozenset(
    (
        "driving",
        "entry",
        "exit",
        "onRamp",
        "offRamp",
        "connectingRamp",
        "slipLane",
    )
)
# Type -> class; all others are road.
_CLASSES = {
    "parking": "parking",
    "sidewalk": "sidewalk",
    "walking": "sidewalk",
    "curb": "sidewalk",
    "biking": "sidewalk",
    "median": "other-ground",
    "border": "other-ground",
    "restricted": "other-ground",
    "tram": "other-ground",
    "rail": "other-ground",
}
_RAISED = frozenset({"sidewalk", "walking", "curb"})
# From this height on a lane has a kerb [m].
_LEAST_KERB = 0.03


def lane_class(kind: str) -> str | None:
    """Returns the semantic class of a lane, None for type none."""
    return None if kind == "none" else _CLASSES.get(kind, "road")


def is_raised(kind: str, height: float) -> bool:
    """Returns whether a lane is a kerb above the road.

    Args:
        kind: its type.
        height: of its inner edge above the road in the file [m].
    """
    return kind in _RAISED or height >= _LEAST_KERB
