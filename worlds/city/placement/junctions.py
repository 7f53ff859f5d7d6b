"""Places traffic lights and signs where roads meet."""

import math

from numpy.random import Generator
import shapely

from worlds.city.placement.draft import Draft
from worlds.roads import Arm, Junction, Road, RoadNetwork
from worlds.shapes import OBJECTS, Direction

# Distance of posts from the kerb [m].
_FROM_KERB = 0.7
# At a road with at most this many lanes, a stop sign replaces the traffic
# lights.
_SMALL_ROAD_LANES = 2
# Traffic lights stand this far from the junction, beside the stop line [m].
_LIGHT_DISTANCE = 4.8
# A traffic light on the other side stands this far from the junction [m].
_POST_DISTANCE = 1.5
# A stop sign stands this far from the junction [m].
_STOP_DISTANCE = 1.0
# The sign with the street's name stands this far from the junction [m].
_NAME_DISTANCE = 0.2
# Least distance of all these objects from other objects [m].
_CLEARANCE = 0.1
# Signs stand this far from the junction [m].
_SIGN_DISTANCE = 9.0
_SIGNS = ("sign_round", "sign_rectangular", "sign_triangular")


def furnish_junctions(draft: Draft, network: RoadNetwork) -> None:
    """Places traffic lights and signs where three or more roads meet."""
    for junction in network.junctions.values():
        # Other junctions, too, begin a new range of numbers for names.
        rng = draft.task("junction", junction.name)
        if len(junction.arms) < 3:
            continue
        for arm in junction.arms:
            _furnish_arm(draft, network.roads[arm.road], junction, arm, rng)


def _furnish_arm(
    draft: Draft, road: Road, junction: Junction, arm: Arm, rng: Generator
) -> None:
    """Places the lights and signs of one arm of a junction."""
    carriageway = draft.areas.carriageway
    starts = arm.end == "start"
    incoming: Direction = "backward" if starts else "forward"
    outgoing: Direction = "forward" if starts else "backward"

    def place(
        object_kind: str, distance: float, side: int, turn: float
    ) -> None:
        """Places an object beside the arm, `distance` from the junction [m].

        `side` is 1 for the left side of the arm, looking away from the
        junction, and -1 for the right side. `turn` is the heading of the object
        relative to the direction away from the junction [rad].
        """
        outwards = 1 if starts else -1
        edge = road.first_station if starts else road.last_station
        # Behind the parking bays, if there are any.
        for width in (road.half_width, road.half_width + road.parking):
            x, y, _, heading = road.evaluate(
                [edge + outwards * distance],
                side * outwards * (width + _FROM_KERB),
            )[0]
            if not shapely.contains_xy(carriageway, x, y):
                break
        yaw = (heading if starts else heading + math.pi) + turn
        tags = ("junction", junction.name)
        model = OBJECTS[object_kind].build(rng)
        draft.place(object_kind, model, (x, y), yaw, tags, clearance=_CLEARANCE)

    if road.lanes[incoming]:
        if sum(road.lanes.values()) <= _SMALL_ROAD_LANES:
            # It faces the traffic that comes along the arm.
            place("sign_stop", _STOP_DISTANCE, 1, 0.0)
        else:
            place("traffic_light", _LIGHT_DISTANCE, 1, -math.pi / 2)
            place("traffic_light_post", _POST_DISTANCE, -1, -math.pi / 2)
        place("sign_street_name", _NAME_DISTANCE, 1, 0.0)
    if road.lanes[outgoing] and road.length > 2 * _SIGN_DISTANCE:
        sign = _SIGNS[int(rng.integers(len(_SIGNS)))]
        # It faces the traffic that comes out of the junction.
        place(sign, _SIGN_DISTANCE, -1, math.pi)
