"""Traffic lights and signs, where the roads of a network meet."""

from __future__ import annotations

import math

import numpy as np

from cns_drake.city.placement.draft import Draft
from cns_drake.city.placement.naming import name_stem
from cns_drake.city.placement.objects import OBJECTS
from cns_drake.roads.network import Arm, Junction
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


def furnish_junctions(draft: Draft) -> None:
    """Places lights, stop signs and name signs at all arms, then signs."""
    for junction in draft.network.junctions.values():
        draft.open_range()
        rng = draft.rng("junction", junction.name)
        for arm in junction.arms:
            _furnish_arm(draft, junction, arm, rng)


def _furnish_arm(
    draft: Draft, junction: Junction, arm: Arm, rng: np.random.Generator
) -> None:
    road = draft.network.roads[arm.road]
    incoming: Direction = "forward" if arm.end == "end" else "backward"
    outgoing: Direction = "backward" if arm.end == "end" else "forward"
    tags = ("junction", junction.name)
    if len(junction.arms) < 3:
        return
    if road.lanes[incoming]:
        if sum(road.lanes.values()) <= _SMALL_ROAD_LANES:
            # Facing the traffic that comes along the arm.
            _place(draft, "sign_stop", road, arm, 1.0, 1, 0.0, rng, tags)
        else:
            half_turn = -math.pi / 2
            _place(
                draft,
                "traffic_light",
                road,
                arm,
                _LIGHT_DISTANCE,
                1,
                half_turn,
                rng,
                tags,
            )
            _place(
                draft,
                "traffic_light_post",
                road,
                arm,
                1.5,
                -1,
                half_turn,
                rng,
                tags,
            )
        _place(draft, "sign_street_name", road, arm, 0.2, 1, 0.0, rng, tags)
    if road.lanes[outgoing] and road.length > 2 * _SIGN_DISTANCE:
        sign = _SIGNS[int(rng.integers(len(_SIGNS)))]
        # Facing the traffic that comes out of the junction.
        _place(draft, sign, road, arm, _SIGN_DISTANCE, -1, math.pi, rng, tags)


def _place(
    draft: Draft,
    name: str,
    road: Road,
    arm: Arm,
    distance: float,
    side: int,
    turn: float,
    rng: np.random.Generator,
    tags: tuple[str, ...],
) -> None:
    """Places an object beside an arm.

    Args:
        draft: the city so far.
        name: of the object.
        road: the arm's road.
        arm: of the junction.
        distance: from the junction's edge along the arm [m].
        side: 1: to the left seen from the junction (incoming traffic has
            it on the right), -1: to the right.
        turn: heading of the object against the arm's outward direction.
        rng: the junction's generator.
        tags: of the structure.
    """
    outwards = 1 if arm.end == "start" else -1
    station = (
        road.first_station + distance
        if arm.end == "start"
        else road.last_station - distance
    )
    offset = side * outwards * (road.half_width + _FROM_KERB)
    x, y, _, heading = road.evaluate([station], offset)[0]
    away = heading if arm.end == "start" else heading + math.pi
    builder = OBJECTS[name]
    draft.place(
        name_stem(name),
        builder.semantic_class,
        builder.build(rng),
        (x, y),
        away + turn,
        tags,
        clearance=0.1,
    )
