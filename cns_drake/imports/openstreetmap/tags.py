"""Values of OpenStreetMap's tags: heights, widths, classes, lanes, limits.

https://wiki.openstreetmap.org/wiki/Map_features,
https://wiki.openstreetmap.org/wiki/Map_features/Units,
https://wiki.openstreetmap.org/wiki/Key:building:levels,
https://wiki.openstreetmap.org/wiki/Key:lanes,
https://wiki.openstreetmap.org/wiki/Key:maxspeed"""

from collections.abc import Callable, Mapping
from pathlib import Path
import re
from typing import NamedTuple

from cns_drake.base.yaml_files import parse_yaml
from cns_drake.imports.options import ImportFaults

TABLES = parse_yaml(Path(__file__).with_name("tags.yaml").read_bytes())
_NUMBER = r"(\d+(?:[.,]\d+)?|[.,]\d+)"
_LENGTH = re.compile(rf"{_NUMBER}\s*([a-z]*|'|\")")
_COUNT = re.compile(_NUMBER)
_FEET_AND_INCHES = re.compile(
    rf"{_NUMBER}\s*(?:'|ft|feet|foot)\s*{_NUMBER}\s*(?:\"|in|'')?"
)
# Separators in lists and in ranges.
_BETWEEN = re.compile(r"\s*;\s*|(?<=[^\s;])\s*(?:-|–|\bto\b)\s*(?=[\d.,])")
_ABOUT = re.compile(r"^\s*(?:~|≈|ca\.?|about|approx\.?)\s*")
_QUOTES = str.maketrans({"’": "'", "′": "'", "”": '"', "″": '"'})
STOREY = 3.0  # [m]
LANE = 3.0  # [m]
# Least width on which two cars can pass each other [m].
_TWO_CARS = 5.0
# Number of levels of a building of unknown kind.
_LEVELS = 3
# Larger than any building or street: the tallest tower is 828 m high.
_TALLEST = 850.0  # [m]
_LOWEST = 0.1  # [m]
_MOST_LEVELS = 170
_WIDEST = 60.0  # [m]
_LANES_OF_STREET = 16
# Values of the tag `railway` of tracks.
_RAILS = ("rail", "light_rail", "tram")
# Width that a single track needs [m].
_TRACK_WIDTH = 3.5
# Least width of a lane that carries vehicles [m].
_LEAST_LANE_WIDTH = 2.75
# Greatest width that drivers use per lane if the file gives no number of lanes
# [m].
_USED_LANE_WIDTH = 3.25
# Width of street per lane if the file gives no number of lanes [m].
_USUAL_LANE_WIDTH = 3.5
_MOST_LANES = 8
_KM_H = 1.0 / 3.6
_MILES_H = 0.44704
_FASTEST = 60.0  # [m/s]
_WALKING_PACE = 7.0 * _KM_H
# Speed limit of links, such as ramps [km/h].
_LINKS = 50.0
_SPEED = re.compile(r"(?:zone)?\s*(\d{1,3})(?:\s*(km/h|kmh|kph|mph))?")
# Tags that give a limit by a rule.
_SPEED_RULES = ("zone:maxspeed", "maxspeed:type")
# Countries whose rules are in miles per hour.
_IN_MILES = ("gb", "uk", "us")


def length(text: str | None) -> float | None:
    """Returns the length [m] that a text states, or None.

    If the text contains a list or a range, the greatest length is returned.
    """
    return _greatest(text, _length)


def count(text: str | None) -> float | None:
    """Returns the number that a text states, such as a number of levels.

    If the text contains a list or a range, the greatest number is returned. The
    result is None if the text states no number.
    """
    return _greatest(
        text, lambda part: _decimal(part) if _COUNT.fullmatch(part) else None
    )


def _greatest(
    text: str | None, read: Callable[[str], float | None]
) -> float | None:
    """Returns the greatest value in a text; None unless all can be read."""
    if text is None or len(text) > 255:  # OpenStreetMap allows no more.
        return None
    plain = _ABOUT.sub("", text.translate(_QUOTES).lower())
    parts = [part for part in _BETWEEN.split(plain) if part.strip()]
    values = [read(_ABOUT.sub("", part).strip()) for part in parts]
    known = [value for value in values if value is not None]
    return max(known) if known and len(known) == len(values) else None


def _length(text: str) -> float | None:
    both = _FEET_AND_INCHES.fullmatch(text)
    if both:
        feet, inches = map(_decimal, both.groups())
        return 0.3048 * (feet + inches / 12.0)
    match = _LENGTH.fullmatch(text)
    if match is None or match[2] not in TABLES["units"]:
        return None
    return _decimal(match[1]) * float(TABLES["units"][match[2]])


def _decimal(text: str) -> float:
    return float(text.replace(",", "."))


def tag_value(
    tags: Mapping[str, str],
    key: str,
    read: Callable[[str], float | None],
    most: float,
    where: tuple[str, ImportFaults] | None,
    least: float = 0.0,
) -> float | None:
    """Returns the value of a tag; None if the tag has no valid value.

    Args:
        tags: tags of an element.
        key: key of the tag.
        read: function that converts the text of the tag to its value; it
            returns None for a text that it cannot convert.
        most: greatest plausible value. A greater value counts as a fault, as
            does a text that `read` cannot convert.
        where: id of the element, and the faults to add to; None if faults are
            not counted.
        least: least plausible value. A smaller value counts as a fault.
    """
    text = tags.get(key)
    if text is None:
        return None
    value = read(text)
    if value is not None and least <= value <= most:
        return value
    if where is not None:
        name, faults = where
        kind = f"{key} unreadable or implausible, the usual one taken"
        faults.add(kind, name)
    return None


def heights(
    tags: Mapping[str, str], where: tuple[str, ImportFaults] | None = None
) -> tuple[float, float, float]:
    """Returns three heights of a building, from its tags [m].

    The results are the heights of the building's lowest and highest points
    above the ground, and the height of the roof only. Heights without a tag are
    estimated, for example from the number of levels.
    """

    def metres(key: str, least: float = 0.0) -> float | None:
        return tag_value(tags, key, length, _TALLEST, where, least)

    def number(key: str, least: float = 0.0) -> float | None:
        return tag_value(tags, key, count, _MOST_LEVELS, where, least)

    roof_levels = number("roof:levels")
    # A building may have no levels of its own if its roof has some.
    levels = number("building:levels", 0.0 if roof_levels else 0.5)
    roof = metres("roof:height")
    if roof is None:
        roof = STOREY * (roof_levels or 1.0)
        if tags.get("roof:shape", "flat") == "flat":
            roof = 0.0
    high = (
        metres("height", _LOWEST)
        or metres("building:height", _LOWEST)
        or metres("est_height", _LOWEST)
    )
    if high is None:
        if levels is None:
            levels = TABLES["levels"].get(tags.get("building", ""), _LEVELS)
        high = STOREY * levels + (roof or STOREY * (roof_levels or 0.0))
    low = metres("min_height")
    if low is None:
        low = STOREY * (number("building:min_level") or 0.0)
    high = max(high, 1.0)
    if low >= high and where is not None:
        name, faults = where
        faults.add("building that begins above its top, lowered", name)
    low = min(low, high - 0.5)
    return low, high, min(roof, high - low - 0.1)


def why_absent(tags: Mapping[str, str]) -> str | None:
    """Returns why a building is left out, such as `underground`, from its tags.

    The result is None if the building is not left out.
    """
    if not ("building" in tags or "building:part" in tags):
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


def has_tag(tags: Mapping[str, str], name: str) -> bool:
    """Returns whether a tag exists and its value is not `no`."""
    return tags.get(name, "no") != "no"


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


def is_inside(tags: Mapping[str, str]) -> bool:
    """Returns whether an object is inside a building or below the ground."""
    below = [tags.get(key, "").startswith("-") for key in ("layer", "level")]
    return (
        any(below)
        or tags.get("indoor", "no") != "no"
        or tags.get("location") in ("indoor", "underground", "underwater")
    )


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
    lanes = tag_value(tags, "lanes", count, _LANES_OF_STREET, where)
    if lanes:
        return LANE * lanes + 0.5
    is_one_way = not all(driven_directions(tags))
    return max(0.6 * usual, 3.5) if is_one_way else usual


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
    lanes = tag_value(tags, "lanes", count, _LANES_OF_STREET, None)
    if not lanes:
        lanes = 2.0 if all(driven_directions(tags)) else 1.0
    # If two cars cannot pass each other, both directions keep to the middle.
    if width < _TWO_CARS and all(driven_directions(tags)):
        return 0.0
    return width / 2.0 * (1.0 - 1.0 / max(lanes, 1.0))


def is_marked(tags: Mapping[str, str]) -> bool:
    """Returns whether a crossing is marked by stripes."""
    markings = tags.get("crossing:markings")
    if markings is not None:
        return markings.startswith("zebra") or markings == "yes"
    return (
        tags.get("crossing") in ("zebra", "marked", "uncontrolled")
        or tags.get("crossing_ref") == "zebra"
    )


def path_width(tags: Mapping[str, str]) -> float | None:
    """Returns the width of a path for people [m]; None for other ways.

    Without a tag for the width, the width follows from the kind of path.
    """
    usual: float | None = TABLES["paths"].get(tags.get("highway", ""))
    if usual is None:
        return None
    return tag_value(tags, "width", length, _WIDEST, None) or usual


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


def area_kind(tags: Mapping[str, str]) -> tuple[str, str] | None:
    """Returns the kind and the semantic class of an area on the ground.

    The result is None for tags of anything else.
    """
    if tags.get("natural") == "water" or tags.get("waterway") in (
        "riverbank",
        "dock",
    ):
        return "WaterBody", "other-ground"
    if tags.get("amenity") == "parking":
        return "Parking", "parking"
    if tags.get("highway") == "pedestrian" or tags.get("place") == "square":
        return "Square", "other-ground"
    if green_kind(tags):
        return "LandUse", "terrain"
    return None


def green_kind(tags: Mapping[str, str]) -> str:
    """Returns the kind of green land, such as `park`; "" if there is none."""
    return next(
        (
            tags[key]
            for key, values in TABLES["green"].items()
            if tags.get(key) in values.split()
        ),
        "",
    )


def building_kind(tags: Mapping[str, str]) -> str:
    """Returns the kind of a building, such as `church`.

    It is `building` if the tags state no kind.
    """
    for kind, found in TABLES["buildings"].items():
        if any(tags.get(key) in one.split() for key, one in found.items()):
            return str(kind)
    value = tags.get("building", "yes")
    return "building" if value == "yes" else value


class LaneLayout(NamedTuple):
    """The lanes of a street.

    Attributes:
        forward: number of lanes in the direction of the street's line.
        backward: number of lanes in the opposite direction.
        width: width of each lane [m].
        total: number of all lanes, including the empty lanes in the middle
            that belong to neither direction.
    """

    forward: int
    backward: int
    width: float
    total: int

    def offset(self, is_forward: bool, number: int) -> float:
        """Returns the distance of a lane from the middle of the street [m].

        The distance is positive towards the side on which traffic keeps.

        Args:
            is_forward: whether the lane is in the direction of the street's
                line.
            number: number of the lane in this direction; 0 is the innermost
                lane.
        """
        same = self.forward if is_forward else self.backward
        return self.width * (number + (1 + self.total) / 2.0 - same)


def lane_layout(tags: Mapping[str, str], width: float) -> LaneLayout:
    """Returns the lanes of a street, from its tags.

    There are no lanes if cars may not use the street, or if it is too narrow.
    `width` is the width of the carriageway [m].
    """
    is_along, is_against = driven_directions(tags)
    directions = is_along + is_against
    most = int(width / _LEAST_LANE_WIDTH)
    if directions == 0 or most < directions:
        return LaneLayout(0, 0, 0.0, 0)

    def number(key: str) -> int | None:
        value = tag_value(tags, key, count, _MOST_LANES, None, 1.0)
        return None if value is None else int(value)

    tagged = number("lanes")
    total = tagged or directions * int(
        max(1.0, width / directions / _USUAL_LANE_WIDTH)
    )
    if directions == 1:
        forward = min(total, most) * is_along
        backward = min(total, most) * is_against
    else:
        # A middle lane for both directions stays empty.
        there, back = number("lanes:forward"), number("lanes:backward")
        forward = there or max(1, total - back if back else total // 2)
        backward = back or max(1, total - there if there else total // 2)
        while forward + backward > most:
            if forward >= backward:
                forward -= 1
            else:
                backward -= 1
    total = max(forward + backward, min(tagged or 0, most))
    most_used = width if tagged == total else _USED_LANE_WIDTH
    return LaneLayout(forward, backward, min(most_used, width / total), total)


def speed_limit(
    tags: Mapping[str, str],
    is_forward: bool = True,
    where: tuple[str, ImportFaults] | None = None,
) -> float:
    """Returns the speed limit on a street [m/s].

    Without a tag, the result is the usual limit for the kind of street.

    Args:
        tags: tags of the street.
        is_forward: direction of travel: along the street's line, or against it.
        where: id of the street, and the counts to which tags that cannot be
            read are added. By default such tags are not counted.
    """
    side = "forward" if is_forward else "backward"
    for key in (f"maxspeed:{side}", "maxspeed", *_SPEED_RULES):
        found = tag_value(tags, key, _speed, _FASTEST, where)
        if found is not None:
            return found
    kind = tags.get("highway", "")
    return _KM_H * float(TABLES["limits"].get(kind, _LINKS))


def _speed(text: str) -> float | None:
    """Returns the lowest speed in a tag's value [m/s]; None if it has none.

    A country may precede a speed or the name of a rule, as in `FR:80`.
    """
    speeds = []
    for part in text.lower().split(";"):
        country, _, rule = part.strip().rpartition(":")
        found = _SPEED.fullmatch(rule)
        if found:
            unit = found[2] or ("mph" if country.startswith(_IN_MILES) else "")
            scale = _MILES_H if unit == "mph" else _KM_H
            speeds.append(int(found[1]) * scale)
        elif rule == "walk":
            speeds.append(_WALKING_PACE)
        elif rule in TABLES["rules"]:
            speeds.append(TABLES["rules"][rule] * _KM_H)
    valid = [one for one in speeds if 0.0 < one <= _FASTEST]
    return min(valid, default=None)
