"""The lanes that OpenStreetMap's tags give a street.

https://wiki.openstreetmap.org/wiki/Key:lanes
"""

from collections.abc import Mapping
from typing import NamedTuple

from cns_drake.imports.openstreetmap.tags import count, tag_value
from cns_drake.imports.openstreetmap.way_tags import driven_directions

# Least width of a lane that carries vehicles [m].
_LEAST_LANE_WIDTH = 2.75
# Greatest width that drivers use per lane if the file gives no number of lanes
# [m].
_USED_LANE_WIDTH = 3.25
# Width of street per lane if the file gives no number of lanes [m].
_USUAL_LANE_WIDTH = 3.5
_MOST_LANES = 8


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

        Seen in the lane's direction, the distance is positive to the right if
        traffic drives on the right, and to the left if it drives on the left.

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
