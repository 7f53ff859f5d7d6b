"""What the types of lanes are, for cars and for the eye."""

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
    """Returns the semantic class of a lane, None for a lane of nothing."""
    return None if kind == "none" else _CLASSES.get(kind, "road")


def is_raised(kind: str, height: float) -> bool:
    """Tells whether a lane stands a kerb above the road.

    Args:
        kind: its type.
        height: of its inner edge above the road, as the file tells [m].
    """
    return kind in _RAISED or height >= _LEAST_KERB
