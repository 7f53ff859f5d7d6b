"""The speed limit that OpenStreetMap's tags give a street.

https://wiki.openstreetmap.org/wiki/Key:maxspeed
"""

from collections.abc import Mapping
import re

from cns_drake.imports.faults import ImportFaults
from cns_drake.imports.openstreetmap.tags import TABLES, tag_value

# Speeds of 1 km/h and 1 mile/h [m/s].
_KM_H = 1.0 / 3.6
_MILES_H = 0.44704
# Greatest plausible speed limit [m/s].
_FASTEST = 60.0
_WALKING_PACE = 7.0 * _KM_H
# Speed limit of links, such as ramps [km/h].
_LINK_LIMIT_KM_H = 50.0
_SPEED = re.compile(r"(?:zone)?\s*(\d{1,3})(?:\s*(km/h|kmh|kph|mph))?")
# Tags that give a limit by a rule.
_SPEED_RULES = ("zone:maxspeed", "maxspeed:type")
# Countries whose rules are in miles per hour.
_IN_MILES = ("gb", "uk", "us")


def speed_limit(
    tags: Mapping[str, str],
    is_forward: bool = True,
    where: tuple[str, ImportFaults] | None = None,
) -> float:
    """Returns the speed limit on a street [m/s].

    Without a tag, the result is the usual limit for the kind of street.

    Args:
        tags: tags of the street.
        is_forward: whether the limit is for travel along the street's line;
            otherwise it is for travel against the line.
        where: id of the street, and the counts to which tags that cannot be
            read are added. By default such tags are not counted.
    """
    side = "forward" if is_forward else "backward"
    for key in (f"maxspeed:{side}", "maxspeed", *_SPEED_RULES):
        limit = tag_value(tags, key, _parsed_speed, _FASTEST, where)
        if limit is not None:
            return limit
    kind = tags.get("highway", "")
    return _KM_H * float(TABLES["limits"].get(kind, _LINK_LIMIT_KM_H))


def _parsed_speed(text: str) -> float | None:
    """Returns the lowest speed in a tag's value [m/s]; None if it has none.

    A country may precede a speed or the name of a rule, as in `FR:80`.
    """
    speeds = []
    for part in text.lower().split(";"):
        country, _, rule = part.strip().rpartition(":")
        match = _SPEED.fullmatch(rule)
        if match:
            unit = match[2] or ("mph" if country.startswith(_IN_MILES) else "")
            scale = _MILES_H if unit == "mph" else _KM_H
            speeds.append(int(match[1]) * scale)
        elif rule == "walk":
            speeds.append(_WALKING_PACE)
        elif rule in TABLES["rules"]:
            speeds.append(TABLES["rules"][rule] * _KM_H)
    valid = [speed for speed in speeds if 0.0 < speed <= _FASTEST]
    return min(valid, default=None)
