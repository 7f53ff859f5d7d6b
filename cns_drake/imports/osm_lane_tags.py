"""Lanes and speed limits in the tags of OpenStreetMap's streets.

https://wiki.openstreetmap.org/wiki/Key:lanes,
https://wiki.openstreetmap.org/wiki/Key:maxspeed
"""

from __future__ import annotations

from collections.abc import Mapping
import re
from typing import NamedTuple

from cns_drake.imports.osm_lengths import count
from cns_drake.imports.osm_tags import driven_ways, tag_value

# Least width of a lane that carries any vehicle, the width that drivers use,
# and the width of street for each lane where the file gives no number [m].
_LEAST, _USED, _USUAL = 2.75, 3.25, 3.5
_MOST_LANES = 8
_KM_H = 1.0 / 3.6
_MILES_H = 0.44704
_FASTEST = 60.0  # [m/s]
_WALKING_PACE = 7.0 * _KM_H
# Limits of streets without a tag for it, and of the values that name a rule of
# a country, such as `DE:urban` [km/h].
_BY_CLASS = {
    "motorway": 120.0,
    "trunk": 80.0,
    "primary": 50.0,
    "secondary": 50.0,
    "tertiary": 50.0,
    "unclassified": 50.0,
    "residential": 30.0,
    "living_street": 7.0,
    "service": 20.0,
}
_LINKS = 50.0
_BY_RULE = {
    "motorway": 120.0,
    "trunk": 80.0,
    "rural": 90.0,
    "urban": 50.0,
    "zone30": 30.0,
    "zone:30": 30.0,
    "living_street": 7.0,
    "bicycle_road": 30.0,
}
_SPEED = re.compile(r"(\d{1,3})(?:\s*(km/h|kmh|kph|mph))?")


class LaneLayout(NamedTuple):
    """Lanes of a street.

    Attributes:
        forward, backward: number of lanes along its line, and against it.
        width: of each [m].
    """

    forward: int
    backward: int
    width: float

    def offset(self, is_forward: bool, number: int) -> float:
        """Returns the place of a lane, from the middle of the street [m].

        To the side on which traffic keeps, in the lane's own direction.

        Args:
            is_forward: whether it leads along the street's line.
            number: of the lane in its direction, 0 for the innermost one.
        """
        same, other = self.forward, self.backward
        if not is_forward:
            same, other = other, same
        return self.width * (number + (1 + other - same) / 2.0)


def lane_layout(tags: Mapping[str, str], width: float) -> LaneLayout:
    """Returns the lanes of a street; none where vehicles cannot pass.

    Args:
        tags: of the street.
        width: of its carriageway [m].
    """
    is_along, is_against = driven_ways(tags)
    directions = is_along + is_against
    most = int(width / _LEAST)
    if directions == 0 or most < directions:
        return LaneLayout(0, 0, 0.0)

    def number(key: str) -> int | None:
        value = tag_value(tags, key, count, _MOST_LANES, None, 1.0)
        return None if value is None else int(value)

    total = number("lanes") or directions * int(
        max(1.0, width / directions / _USUAL)
    )
    if directions == 1:
        forward = min(total, most) * is_along
        backward = min(total, most) * is_against
    else:
        # A middle lane of both directions stays empty.
        there, back = number("lanes:forward"), number("lanes:backward")
        forward = there or max(1, total - back if back else total // 2)
        backward = back or max(1, total - there if there else total // 2)
        while forward + backward > most:
            if forward >= backward:
                forward -= 1
            else:
                backward -= 1
    return LaneLayout(
        forward, backward, min(_USED, width / (forward + backward))
    )


def speed_limit(tags: Mapping[str, str], is_forward: bool = True) -> float:
    """Returns the speed limit of a street [m/s].

    Args:
        tags: of the street.
        is_forward: whether along its line.
    """
    side = "forward" if is_forward else "backward"
    for key in (f"maxspeed:{side}", "maxspeed", "maxspeed:type"):
        found = _speed(tags.get(key, ""))
        if found is not None:
            return found
    kind = tags.get("highway", "")
    return _KM_H * _BY_CLASS.get(kind, _LINKS)


def _speed(text: str) -> float | None:
    """Returns the lowest speed of a value [m/s]; None if it has none."""
    speeds = []
    for part in text.lower().split(";"):
        found = _SPEED.fullmatch(part.strip())
        rule = part.strip().partition(":")[2]
        if found:
            unit = _MILES_H if found[2] == "mph" else _KM_H
            speeds.append(int(found[1]) * unit)
        elif part.strip() == "walk":
            speeds.append(_WALKING_PACE)
        elif rule in _BY_RULE:
            speeds.append(_BY_RULE[rule] * _KM_H)
    valid = [one for one in speeds if 0.0 < one <= _FASTEST]
    return min(valid, default=None)
