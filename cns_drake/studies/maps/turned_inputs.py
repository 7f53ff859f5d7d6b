"""Input files of a city that is rotated as a whole."""

from collections.abc import Mapping, Sequence
import math
from typing import Any

# Fields of inputs that hold a place, and lists of places.
_PLACES = frozenset({"position", "at", "block", "start", "end"})
_LISTS_OF_PLACES = frozenset({"via", "area", "line", "within", "points"})


def turned_content(values: Any, turn_deg: float) -> Any:
    """Returns the content of `roads.yaml` or `city.yaml` for a rotated city.

    Args:
        values: the content of the file.
        turn_deg: angle by which all positions and headings are rotated
            anticlockwise about the world's origin [deg].
    """
    if isinstance(values, list):
        return [turned_content(one, turn_deg) for one in values]
    if not isinstance(values, Mapping):
        return values
    result: dict[str, Any] = {}
    for name, value in values.items():
        if name in _PLACES and isinstance(value, list):
            result[name] = _turned_place(value, turn_deg)
        elif name in _LISTS_OF_PLACES and isinstance(value, list):
            result[name] = [_turned_place(one, turn_deg) for one in value]
        else:
            result[name] = turned_content(value, turn_deg)
    if "at" in values:
        result["yaw_deg"] = values.get("yaw_deg", 0.0) + turn_deg
    return result


def turned_bounds(bounds: Sequence[float], turn_deg: float) -> list[float]:
    """Returns the axis-aligned bounding box of a rotated box.

    Args:
        bounds: least x, least y, greatest x and greatest y of the box [m].
        turn_deg: angle by which the box is rotated about the origin [deg].

    Returns:
        Least x, least y, greatest x and greatest y of the bounding box [m].
    """
    x0, y0, x1, y1 = bounds
    corners = [
        _turned_place((x, y), turn_deg) for x in (x0, x1) for y in (y0, y1)
    ]
    return [*map(min, *corners), *map(max, *corners)]


def _turned_place(place: Sequence[float], turn_deg: float) -> list[float]:
    """Returns a place whose first two coordinates, x and y, are turned."""
    x, y, *others = place
    c, s = math.cos(math.radians(turn_deg)), math.sin(math.radians(turn_deg))
    return [round(c * x - s * y, 6), round(s * x + c * y, 6), *others]
