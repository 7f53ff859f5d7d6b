"""What OpenStreetMap's tags say about a building: heights, kind, existence.

https://wiki.openstreetmap.org/wiki/Key:building:levels
"""

from collections.abc import Mapping
import re
from typing import NamedTuple

from worlds.imports.faults import ImportFaults
from worlds.imports.openstreetmap.tags import TABLES, count, length, tag_value

STOREY_HEIGHT = 3.0  # [m]
# Number of levels of a building of unknown kind.
_USUAL_LEVELS = 3
# Larger than any building or street: the tallest tower is 828 m high.
_TALLEST = 850.0  # [m]
_LOWEST = 0.1  # [m]
_MOST_LEVELS = 170
# Least number of levels that is plausible; half a level is a low building.
_LEAST_LEVELS = 0.5
# Least height of a building's highest point above the ground [m].
_LEAST_HIGH = 1.0
# Least height of a building from its lowest to its highest point [m].
_LEAST_HEIGHT = 0.5
# Greatest height of a roof without `roof:height`, as a share of the building's.
_MOST_ROOF = 0.5
# Least height of the walls below a roof [m].
LEAST_WALL = 0.1
# Values of `building` and `building:part` for a roof on posts.
_OPEN = ("roof", "carport")


class BuildingHeights(NamedTuple):
    """Heights of a building [m].

    Attributes:
        low: height of the lowest point above the ground.
        high: height of the highest point above the ground.
        roof: height of the roof, from its eaves to its highest point.
    """

    low: float
    high: float
    roof: float


def heights(
    tags: Mapping[str, str], where: tuple[str, ImportFaults] | None = None
) -> BuildingHeights:
    """Returns the heights of a building, from the building's tags.

    Heights without a tag are estimated, for example from the number of levels.

    Args:
        tags: tags of the building.
        where: id of the building, and the counts to which faults of its tags
            are added. By default such faults are not counted.
    """

    def metres(key: str, least: float = 0.0) -> float | None:
        return tag_value(tags, key, length, _TALLEST, where, least)

    def number(key: str, least: float = 0.0) -> float | None:
        return tag_value(tags, key, count, _MOST_LEVELS, where, least)

    roof_levels = number("roof:levels")
    # A building may have no levels of its own if its roof has some.
    levels = number("building:levels", 0.0 if roof_levels else _LEAST_LEVELS)
    roof = metres("roof:height")
    is_guessed = roof is None
    if roof is None:
        roof = STOREY_HEIGHT * (roof_levels or 1.0)
        if tags.get("roof:shape", "flat") == "flat":
            roof = 0.0
    high = (
        metres("height", _LOWEST)
        or metres("building:height", _LOWEST)
        or metres("est_height", _LOWEST)
    )
    if high is None:
        if levels is None:
            levels = TABLES["levels"].get(
                tags.get("building", ""), _USUAL_LEVELS
            )
            work = TABLES["works"].get(tags.get("man_made", ""))
            if work is not None and "building" not in tags:
                levels = work[0] / STOREY_HEIGHT
        high = STOREY_HEIGHT * levels + (
            roof or STOREY_HEIGHT * (roof_levels or 0.0)
        )
    high = max(high, _LEAST_HIGH)
    low = metres("min_height")
    if low is None and "building:min_level" in tags:
        low = STOREY_HEIGHT * (number("building:min_level") or 0.0)
    if low is None:
        low = 0.0
        if is_open_below(tags):
            # The slab is no higher than the least building.
            low = max(high - roof - _LEAST_HEIGHT, 0.0)
    if low >= high and where is not None:
        name, faults = where
        faults.add("building that begins above its top, lowered", name)
    low = min(low, high - _LEAST_HEIGHT)
    if is_guessed:
        # No house is only a roof that stands on the ground.
        roof = min(roof, _MOST_ROOF * (high - low))
    return BuildingHeights(low, high, min(roof, high - low - LEAST_WALL))


def is_open_below(tags: Mapping[str, str]) -> bool:
    """Returns whether a building is a roof on posts, without walls."""
    kinds = tags.get("building"), tags.get("building:part")
    return tags.get("wall") == "no" or any(kind in _OPEN for kind in kinds)


def why_absent(tags: Mapping[str, str]) -> str | None:
    """Returns the reason why a building is left out, such as `underground`.

    The reason follows from the building's tags. The result is None if the
    building is not left out.
    """
    known = tags.keys() & {"building", "building:part"}
    if not known and tags.get("man_made") not in TABLES["works"]:
        return "demolished"
    kinds = [tags.get("building", ""), tags.get("building:part", "")]
    reasons: dict[str, str] = TABLES["absent"]
    kinds += [key for key in reasons if tags.get(key) == "yes"]
    for kind in kinds:
        if kind in reasons:
            return reasons[kind]
    layer = tags.get("layer", "")
    if (
        tags.get("location") in ("underground", "underwater")
        or tags.get("tunnel", "no") not in ("no", "building_passage")
        or re.fullmatch(r"-\d+(\.\d+)?", layer)
        or (
            tags.get("building:levels") == "0"
            and count(tags.get("building:levels:underground"))
            and not count(tags.get("roof:levels"))
        )
    ):
        return "underground"
    return None


def building_kind(tags: Mapping[str, str]) -> str:
    """Returns the kind of a building, such as `church`.

    It is `building` if the tags state no kind.
    """
    for kind, values_of_keys in TABLES["buildings"].items():
        if any(
            tags.get(key) in values.split()
            for key, values in values_of_keys.items()
        ):
            return str(kind)
    value = tags.get("building", "yes")
    return "building" if value == "yes" else value
