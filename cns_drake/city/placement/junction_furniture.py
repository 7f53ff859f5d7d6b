"""Traffic lights and signs, where the roads of a network meet."""

from __future__ import annotations

import math

import numpy as np

from cns_drake.city.placement.draft import Draft
from cns_drake.city.placement.objects import OBJECTS
from cns_drake.roads.network import Arm, Junction, RoadNetwork
from cns_drake.roads.road import Direction, Road

# Distance of posts from the kerb [m].
_FROM_KERB = 0.7
# Where a small road meets others, a stop sign takes the lights' place.
_SMALL_ROAD_LANES = 2
# Lights stand this far behind a junction, beside the stop line [m].
_LIGHT_DISTANCE = 4.8
# Signs stand this far behind a junction [m].
_SIGN_DISTANCE = 9.0
_SIGNS = ("sign_round", "sign_rectangular", "sign_triangular")


def furnish_junctions(draft: Draft, network: RoadNetwork) -> None:
    """Places lights, stop signs and name signs at all arms, then signs."""
    for junction in network.junctions.values():
        draft.open_range()
        rng = draft.rng("junction", junction.name)
        for arm in junction.arms:
            _furnish_arm(draft, network.roads[arm.road], junction, arm, rng)


def _furnish_arm(
    draft: Draft,
    road: Road,
    junction: Junction,
    arm: Arm,
    rng: np.random.Generator,
) -> None:
    starts = arm.end == "start"
    incoming: Direction = "backward" if starts else "forward"
    outgoing: Direction = "forward" if starts else "backward"
    if len(junction.arms) < 3:
        return

    def place(name: str, distance: float, side: int, turn: float) -> None:
        """Places an object beside the arm.

        Args:
            name: of the object.
            distance: from the junction's edge along the arm [m].
            side: 1: to the left seen from the junction (incoming traffic has
                it on the right), -1: to the right.
            turn: heading of the object against the arm's outward direction.
        """
        outwards = 1 if starts else -1
        edge = road.first_station if starts else road.last_station
        offset = side * outwards * (road.half_width + _FROM_KERB)
        x, y, _, heading = road.evaluate([edge + outwards * distance], offset)[
            0
        ]
        yaw = (heading if starts else heading + math.pi) + turn
        tags, model = ("junction", junction.name), OBJECTS[name].build(rng)
        draft.place(name, model, (x, y), yaw, tags, clearance=0.1)

    if road.lanes[incoming]:
        if sum(road.lanes.values()) <= _SMALL_ROAD_LANES:
            # The object faces the traffic that comes along the arm.
            place("sign_stop", 1.0, 1, 0.0)
        else:
            place("traffic_light", _LIGHT_DISTANCE, 1, -math.pi / 2)
            place("traffic_light_post", 1.5, -1, -math.pi / 2)
        place("sign_street_name", 0.2, 1, 0.0)
    if road.lanes[outgoing] and road.length > 2 * _SIGN_DISTANCE:
        sign = _SIGNS[int(rng.integers(len(_SIGNS)))]
        # The object faces the traffic that comes out of the junction.
        place(sign, _SIGN_DISTANCE, -1, math.pi)
