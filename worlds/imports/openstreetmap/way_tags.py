"""What OpenStreetMap's tags say about a way: width, directions, sidewalks.

https://wiki.openstreetmap.org/wiki/Key:highway
"""

from collections.abc import Mapping

from worlds.imports.faults import ImportFaults
from worlds.imports.openstreetmap.tags import (
    TABLES,
    count,
    has_tag,
    length,
    tag_value,
)

# Width of a street per lane, and in addition at its edges together [m].
LANE_WIDTH = 3.0
_EDGE_WIDTH = 0.5
# Share of the usual width of a street that a one-way street has.
_ONE_WAY_SHARE = 0.6
# Least width of a one-way street [m].
_LEAST_ONE_WAY = 3.5
# Least width on which two cars can pass each other [m].
_LEAST_PASSING_WIDTH = 5.0
# Greatest plausible width of a way [m], and number of lanes.
_WIDEST = 60.0
_MOST_STREET_LANES = 16
# Values of the tag `railway` of tracks.
_RAILS = ("rail", "light_rail", "tram")
# Width that a single track needs [m].
_TRACK_WIDTH = 3.5


def is_tunnel(tags: Mapping[str, str]) -> bool:
    """Returns whether a way is below the ground or in a mountain.

    Passages through buildings are no tunnels.
    """
    is_below = tags.get("layer", "").startswith("-")
    return has_tag(tags, "tunnel") and (
        tags["tunnel"] != "building_passage" or is_below
    )


def is_railway(tags: Mapping[str, str]) -> bool:
    """Returns whether a way is the track of a railway or tram."""
    return tags.get("railway") in _RAILS


def street_width(
    tags: Mapping[str, str], where: tuple[str, ImportFaults] | None = None
) -> float | None:
    """Returns the width of a street's carriageway [m]; None for other ways.

    Without a tag for the width, the width follows from the number of lanes or
    the kind of street.

    Args:
        tags: tags of the street.
        where: id of the street, and the counts to which faults of its tags are
            added. By default such faults are not counted.
    """
    kind = tags.get("highway", "").removesuffix("_link")
    usual: float | None = TABLES["streets"].get(kind)
    if usual is None:
        return None
    width = tag_value(tags, "width", length, _WIDEST, where)
    if width:
        return width
    lanes = _num_lanes(tags, where)
    if lanes:
        return LANE_WIDTH * lanes + _EDGE_WIDTH
    is_one_way = not all(driven_directions(tags))
    if is_one_way:
        return max(_ONE_WAY_SHARE * usual, _LEAST_ONE_WAY)
    return usual


def _num_lanes(
    tags: Mapping[str, str], where: tuple[str, ImportFaults] | None
) -> float | None:
    """Returns the number of lanes of a street; None if it is unknown.

    Without a tag for the whole street, the lanes of both directions and those
    in the middle count; a direction without a tag has one lane.
    """
    lanes = tag_value(tags, "lanes", count, _MOST_STREET_LANES, where)
    if lanes:
        return lanes
    forward, backward, middle = (
        tag_value(tags, f"lanes:{side}", count, _MOST_STREET_LANES, where)
        for side in ("forward", "backward", "both_ways")
    )
    if not (forward or backward or middle):
        return None
    is_driven = driven_directions(tags)
    return (middle or 0.0) + sum(
        lanes or 1.0
        for lanes, is_open in zip((forward, backward), is_driven, strict=True)
        if lanes or is_open
    )


def driven_directions(tags: Mapping[str, str]) -> tuple[bool, bool]:
    """Returns whether cars may drive along a street, and against it.

    The first result is for the direction of the street's line, the second for
    the opposite direction.
    """
    # The most specific tag counts.
    keys = ("motorcar", "motor_vehicle", "vehicle", "access")
    access = next((tags[key] for key in keys if key in tags), "yes")
    if access in ("no", "private", "bus", "agricultural"):
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
    """Returns the distance of the outermost lane from the street's middle [m].

    The distance is to the middle of the lane. On a two-way street on which two
    cars cannot pass each other, the distance is 0, because cars keep to the
    middle. `width` is the width of the carriageway [m].
    """
    is_two_way = all(driven_directions(tags))
    if is_two_way and width < _LEAST_PASSING_WIDTH:
        return 0.0
    lanes = _num_lanes(tags, None)
    if not lanes:
        lanes = 2.0 if is_two_way else 1.0
    return width / 2.0 * (1.0 - 1.0 / max(lanes, 1.0))


def path_width(
    tags: Mapping[str, str], where: tuple[str, ImportFaults] | None = None
) -> float | None:
    """Returns the width of a path for people [m]; None for other ways.

    Without a tag for the width, the width follows from the kind of path. The
    arguments are as for `street_width`.
    """
    usual: float | None = TABLES["paths"].get(tags.get("highway", ""))
    if usual is None:
        return None
    return tag_value(tags, "width", length, _WIDEST, where) or usual


def way_width(tags: Mapping[str, str]) -> float | None:
    """Returns the width of a street, path or track [m]; None for others."""
    if is_railway(tags):
        return _TRACK_WIDTH
    return street_width(tags) or path_width(tags)


def sidewalk_sides(tags: Mapping[str, str]) -> tuple[bool, bool]:
    """Returns whether a street has a sidewalk on its left, and on its right."""

    def has(side: str) -> bool:
        return tags.get("sidewalk") in ("both", side) or "yes" in (
            tags.get("sidewalk:both"),
            tags.get(f"sidewalk:{side}"),
        )

    return has("left"), has("right")
