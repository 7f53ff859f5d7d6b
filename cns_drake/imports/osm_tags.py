"""What tags of OpenStreetMap say: heights, widths, classes.

https://wiki.openstreetmap.org/wiki/Map_features
"""

from __future__ import annotations

from collections.abc import Mapping
import re

STOREY = 3.0  # [m]
LANE = 3.0  # [m]
# Two cars pass each other from this width on [m].
_TWO_CARS = 5.0
# Levels of buildings that tell neither height nor levels.
_USUAL_LEVELS = {
    "garage": 1,
    "garages": 1,
    "shed": 1,
    "hut": 1,
    "roof": 1,
    "carport": 1,
    "kiosk": 1,
    "service": 1,
    "house": 2,
    "detached": 2,
    "terrace": 2,
    "church": 4,
    "apartments": 5,
}
_LEVELS = 3
# Width of streets that tell neither width nor lanes [m].
_STREETS = {
    "motorway": 12.0,
    "trunk": 12.0,
    "primary": 11.0,
    "secondary": 10.0,
    "tertiary": 8.0,
    "unclassified": 6.5,
    "residential": 6.5,
    "living_street": 5.5,
    "service": 4.5,
    "track": 3.5,
}
_PATHS = {
    "pedestrian": 6.0,
    "footway": 2.0,
    "path": 2.0,
    "cycleway": 2.5,
    "steps": 2.0,
}
_FEET = re.compile(r"\s*(\d+(?:\.\d+)?)'(?:\s*(\d+(?:\.\d+)?)\")?\s*$")
_METRES = re.compile(r"\s*(-?\d+(?:[.,]\d+)?)\s*(?:m|metres?|meters?)?\s*$")
# No building is taller, no street wider [m].
_MOST = 1000.0


def length(text: str | None) -> float | None:
    """Returns a length in metres; None if it is not told or is no length."""
    if text is None:
        return None
    feet = _FEET.match(text)
    if feet:
        return 0.3048 * (float(feet[1]) + float(feet[2] or 0.0) / 12.0)
    metres = _METRES.match(text)
    if metres is None:
        return None
    value = float(metres[1].replace(",", "."))
    return value if 0.0 <= value <= _MOST else None


def heights(tags: Mapping[str, str]) -> tuple[float, float, float]:
    """Returns lowest and highest point of a building, and its roof's height.

    All from the ground [m].
    """
    levels = length(tags.get("building:levels"))
    roof = length(tags.get("roof:height"))
    if roof is None:
        storeys = length(tags.get("roof:levels")) or 1.0
        roof = STOREY * storeys
        if tags.get("roof:shape", "flat") == "flat":
            roof = 0.0
    high = length(tags.get("height"))
    if high is None:
        if levels is None:
            levels = _USUAL_LEVELS.get(tags.get("building", ""), _LEVELS)
        high = STOREY * levels + roof
    low = length(tags.get("min_height"))
    if low is None:
        low = STOREY * (length(tags.get("building:min_level")) or 0.0)
    high = max(high, 1.0)
    low = min(low, high - 0.5)
    return low, high, min(roof, high - low - 0.1)


def street_width(tags: Mapping[str, str]) -> float | None:
    """Returns the width of a street for cars; None if it is none [m]."""
    kind = tags.get("highway", "").removesuffix("_link")
    if kind not in _STREETS:
        return None
    width = length(tags.get("width"))
    if width:
        return width
    lanes = length(tags.get("lanes"))
    if lanes:
        return LANE * lanes + 0.5
    usual = _STREETS[kind]
    is_one_way = not all(driven_ways(tags))
    return max(0.6 * usual, 3.5) if is_one_way else usual


def driven_ways(tags: Mapping[str, str]) -> tuple[bool, bool]:
    """Returns whether cars may drive along a street's line, and against it."""
    if any(
        tags.get(key) in ("no", "private", "bus", "agricultural")
        for key in ("motor_vehicle", "motorcar", "vehicle")
    ) or tags.get("access") in ("no", "private"):
        return False, False
    one_way = tags.get("oneway", "")
    if one_way in ("-1", "reverse"):
        return False, True
    kind = tags.get("highway", "")
    is_round = tags.get("junction") in ("roundabout", "circular")
    usual = is_round or kind in ("motorway", "motorway_link")
    if one_way in ("yes", "1", "true") or (usual and one_way != "no"):
        return True, False
    return True, True


def lanes_beside(tags: Mapping[str, str], width: float) -> float:
    """Returns how far the outermost lane lies from a street's middle [m].

    Args:
        tags: of the street.
        width: of its carriageway [m].
    """
    lanes = length(tags.get("lanes"))
    if not lanes:
        lanes = 2.0 if all(driven_ways(tags)) else 1.0
    # Where two cars cannot pass, both keep to the middle.
    if width < _TWO_CARS and all(driven_ways(tags)):
        return 0.0
    return width / 2.0 * (1.0 - 1.0 / max(lanes, 1.0))


def is_marked(tags: Mapping[str, str]) -> bool:
    """Tells whether a crossing has stripes."""
    markings = tags.get("crossing:markings")
    if markings is not None:
        return markings.startswith("zebra") or markings == "yes"
    return (
        tags.get("crossing") in ("zebra", "marked", "uncontrolled")
        or tags.get("crossing_ref") == "zebra"
    )


def path_width(tags: Mapping[str, str]) -> float | None:
    """Returns the width of a way for people; None if it is none [m]."""
    usual = _PATHS.get(tags.get("highway", ""))
    if usual is None:
        return None
    return length(tags.get("width")) or usual


def sidewalk_sides(tags: Mapping[str, str]) -> tuple[bool, bool]:
    """Returns whether a street has a sidewalk on its left and right."""
    both = tags.get("sidewalk:both") == "yes"
    told = tags.get("sidewalk", "")
    left = (
        both or told in ("both", "left") or tags.get("sidewalk:left") == "yes"
    )
    right = (
        both or told in ("both", "right") or tags.get("sidewalk:right") == "yes"
    )
    return left, right


def area_kind(tags: Mapping[str, str]) -> tuple[str, str] | None:
    """Returns kind and class of an area on the ground; None for others."""
    if tags.get("natural") == "water" or tags.get("waterway") in (
        "riverbank",
        "dock",
    ):
        return "WaterBody", "other-ground"
    if tags.get("amenity") == "parking":
        return "Parking", "parking"
    if tags.get("highway") == "pedestrian" or tags.get("place") == "square":
        return "Square", "other-ground"
    if (
        tags.get("landuse")
        in (
            "grass",
            "forest",
            "meadow",
            "farmland",
            "flowerbed",
            "cemetery",
            "village_green",
            "orchard",
            "allotments",
        )
        or tags.get("leisure") in ("park", "garden", "pitch", "playground")
        or tags.get("natural") in ("grassland", "scrub", "wood", "heath")
    ):
        return "LandUse", "terrain"
    return None
