"""Places objects along the streets: lights, signs, lamps, trees, cars."""

from collections.abc import Sequence
import math

import numpy as np
from numpy.random import Generator
import shapely
from shapely.geometry import LineString, Polygon
from shapely.geometry.base import BaseGeometry

from cns_drake.city.ground.districts import District
from cns_drake.city.placement.draft import Draft
from cns_drake.city.placement.frontage import Station, lines_along, station_at
from cns_drake.city.placement.objects import OBJECTS, pick_key
from cns_drake.city.placement.open_ground import place_car
from cns_drake.city.plan.city_plan import StreetPlan
from cns_drake.roads.network import RoadNetwork
from cns_drake.roads.road import Arm, Direction, Junction, Road

# Distance of posts from the kerb [m].
_FROM_KERB = 0.7
# At a road with at most this many lanes, a stop sign replaces the traffic
# lights.
_SMALL_ROAD_LANES = 2
# Traffic lights stand this far from the junction, beside the stop line [m].
_LIGHT_DISTANCE = 4.8
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
    carriageway = draft.areas.carriageway
    starts = arm.end == "start"
    incoming: Direction = "backward" if starts else "forward"
    outgoing: Direction = "forward" if starts else "backward"

    def place(name: str, distance: float, side: int, turn: float) -> None:
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
        model = OBJECTS[name].build(rng)
        draft.place(name, model, (x, y), yaw, tags, clearance=0.1)

    if road.lanes[incoming]:
        if sum(road.lanes.values()) <= _SMALL_ROAD_LANES:
            # It faces the traffic that comes along the arm.
            place("sign_stop", 1.0, 1, 0.0)
        else:
            place("traffic_light", _LIGHT_DISTANCE, 1, -math.pi / 2)
            place("traffic_light_post", 1.5, -1, -math.pi / 2)
        place("sign_street_name", 0.2, 1, 0.0)
    if road.lanes[outgoing] and road.length > 2 * _SIGN_DISTANCE:
        sign = _SIGNS[int(rng.integers(len(_SIGNS)))]
        # It faces the traffic that comes out of the junction.
        place(sign, _SIGN_DISTANCE, -1, math.pi)


# Distance from the kerb to an object's nearest point [m].
_FROM_KERB_OF = {"lamp": 0.45, "tree": 0.9, "furniture": 0.6}
# Within this distance of a junction, only the junction's own objects may stand
# [m].
_JUNCTION_CLEARANCE = {"lamp": 1.0, "tree": 5.0, "furniture": 3.0}
# Least distance between two objects, and from objects to lanes [m].
_CLEARANCE = 0.4
_CROWN_PART = 0.85
# Length of a parking bay along the street, least and greatest [m].
_BAY_LENGTH = (5.6, 7.0)
_BAY_FILL = 0.72
# Cars are parked a little closer to the kerb than to the lane [m].
_TO_KERB = 0.08


def furnish_sidewalks(
    draft: Draft, districts: Sequence[District], junctions: BaseGeometry
) -> None:
    """Places street lamps, trees and then furniture on all sidewalks.

    `junctions` is the area of all junctions in W [m], which is kept clear.
    """
    for task, distance in _FROM_KERB_OF.items():
        keep_off = junctions.buffer(_JUNCTION_CLEARANCE[task])
        lines = lines_along(
            draft.areas.carriageway, draft.areas.sidewalks, distance
        )
        for index, line in enumerate(lines):
            rng = draft.task("sidewalk", task, index)
            _furnish_sidewalk(draft, districts, task, line, keep_off, rng)


def park_along_streets(draft: Draft, network: RoadNetwork) -> None:
    """Parks cars in the parking bays along the roads, where there is room."""
    for (name, side), bay in network.areas.parking_bays.items():
        road = network.roads[name]
        rng = draft.task("bays", name, side)
        sign = 1 if side == "left" else -1
        offset = sign * (road.half_width + road.parking / 2 + _TO_KERB)
        s = road.first_station + float(rng.uniform(2.0, 5.0))
        while s < road.last_station:
            x, y, _, heading = road.evaluate([s], offset)[0]
            if shapely.contains_xy(bay, x, y) and rng.uniform() < _BAY_FILL:
                # On the left of the direction `forward`, traffic runs the other
                # way.
                yaw = heading + (math.pi if side == "left" else 0.0)
                yaw += float(rng.uniform(-0.03, 0.03))
                tags = ("bay", name)
                place_car(draft, draft.plan.cars, (x, y), yaw, rng, tags)
            s += float(rng.uniform(*_BAY_LENGTH))


def plant_medians(draft: Draft) -> None:
    """Places trees on the medians of roads.

    Kinds and spacing of these trees come from the plan's field `medians` or,
    without `medians`, from the plan's field `street`.
    """
    plan = draft.plan.medians or draft.plan.street
    if not plan.trees:
        return
    for index, median in enumerate(draft.areas.medians.geoms):
        rng = draft.task("median", index)
        line = _middle_line(median)
        s = float(rng.uniform(1.0, 3.0))
        while s < line.length - 1.0:
            at = station_at(line, s)
            name = pick_key(plan.trees, rng)
            _place_along(draft, name, at, rng, ("median",))
            s += float(rng.uniform(*plan.tree_spacing))


def _middle_line(median: Polygon) -> LineString:
    """Returns the long axis of a strip, without its round ends."""
    corners = shapely.get_coordinates(median.minimum_rotated_rectangle)[:4]
    sides = np.roll(corners, -1, axis=0) - corners
    lengths = np.hypot(*sides.T)
    short = int(np.argmin(lengths[:2]))
    a = (corners[short] + corners[short + 1]) / 2
    b = (corners[(short + 2) % 4] + corners[(short + 3) % 4]) / 2
    inset = lengths.min() / np.hypot(*(b - a))
    return LineString([a + (b - a) * inset, b - (b - a) * inset])


def _furnish_sidewalk(
    draft: Draft,
    districts: Sequence[District],
    task: str,
    line: LineString,
    keep_off: BaseGeometry,
    rng: Generator,
) -> None:
    """Places the objects of one task along one sidewalk."""
    s = float(rng.uniform(1.0, 8.0))
    while s < line.length - 1.0:
        at = station_at(line, s)
        here = shapely.Point(at.x, at.y)
        district = min(districts, key=lambda d: d.area.distance(here))
        street = district.plan.street or draft.plan.street
        step, name = _draw_next(street, task, rng)
        if name is not None and not keep_off.intersects(here):
            tags = ("sidewalk", district.plan.name)
            _place_along(draft, name, at, rng, tags, facing_street=True)
        s += step


def _draw_next(
    street: StreetPlan, task: str, rng: Generator
) -> tuple[float, str | None]:
    """Returns the distance to the next place [m], and the object at this place.

    The object is None if the place stays empty.
    """
    if task == "lamp":
        return street.lamp_spacing, street.lamp
    if task == "tree":
        step = float(rng.uniform(*street.tree_spacing))
        if not street.trees:
            return step, None
        name = pick_key(street.trees, rng)
        return step, None if rng.uniform() < street.tree_gaps else name
    step = float(rng.uniform(*street.furniture_spacing))
    if not street.furniture:
        return step, None
    return step, pick_key(street.furniture, rng)


def _place_along(
    draft: Draft,
    name: str,
    at: Station,
    rng: Generator,
    tags: tuple[str, ...],
    *,
    facing_street: bool = False,
) -> None:
    """Places an object on a line, with its heading along the line.

    With `facing_street`, it turns to the street on the right of the line, and
    stands back so that its front (+x) touches the line.
    """
    model = OBJECTS[name].build(rng)
    xy, yaw = (at.x, at.y), at.yaw
    if facing_street:
        front = model.footprint.bounds[2]
        xy = (at.x - front * math.sin(at.yaw), at.y + front * math.cos(at.yaw))
        yaw = at.yaw - math.pi / 2
    draft.place(
        name, model, xy, yaw, tags,
        clearance=_CLEARANCE, crown_part=_CROWN_PART,
    )  # fmt: skip
