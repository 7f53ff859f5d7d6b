"""Places lamps, trees and furniture on sidewalks, and trees on medians."""

from collections.abc import Sequence
import math

import numpy as np
from numpy.random import Generator
import shapely
from shapely.geometry import LineString, Polygon
from shapely.geometry.base import BaseGeometry

from worlds.city.city_plan import StreetPlan
from worlds.city.ground.districts import District
from worlds.city.placement.draft import Draft
from worlds.city.placement.frontage import Station, lines_along, station_at
from worlds.shapes import OBJECTS, pick_key

# Distance from the kerb to an object's nearest point [m].
_FROM_KERB_OF = {"lamp": 0.45, "tree": 0.9, "furniture": 0.6}
# Within this distance of a junction, only the junction's own objects may stand
# [m].
_JUNCTION_CLEARANCE = {"lamp": 1.0, "tree": 5.0, "furniture": 3.0}
# Least distance between two objects, and from objects to lanes [m].
_CLEARANCE = 0.4
# Distance of the first object from the start of a sidewalk, least and greatest
# [m].
_FIRST_OBJECT = (1.0, 8.0)
# Distance of the first tree from the start of a median, least and greatest [m].
_FIRST_TREE = (1.0, 3.0)
# Least distance of objects from the end of a sidewalk or median [m].
_END = 1.0
# A trunk's least distance from any building, as a share of the crown's reach.
_CROWN_PART = 0.85


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
        s = float(rng.uniform(*_FIRST_TREE))
        while s < line.length - _END:
            at = station_at(line, s)
            species = pick_key(plan.trees, rng)
            _place_along(draft, species, at, rng, ("median",))
            s += float(rng.uniform(*plan.tree_spacing))


def _middle_line(median: Polygon) -> LineString:
    """Returns the long axis of a strip, without its round ends."""
    corners = shapely.get_coordinates(median.minimum_rotated_rectangle)[:4]
    sides = np.roll(corners, -1, axis=0) - corners
    lengths = np.hypot(*sides.T)
    short = int(np.argmin(np.round(lengths[:2], 6)))
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
    s = float(rng.uniform(*_FIRST_OBJECT))
    while s < line.length - _END:
        at = station_at(line, s)
        here = shapely.Point(at.x, at.y)
        district = min(districts, key=lambda d: round(d.area.distance(here), 6))
        street = district.plan.street or draft.plan.street
        step, object_kind = _draw_next(street, task, rng)
        if object_kind is not None and not keep_off.intersects(here):
            tags = ("sidewalk", district.plan.name)
            _place_along(draft, object_kind, at, rng, tags, facing_street=True)
        s += step


def _draw_next(
    street: StreetPlan, task: str, rng: Generator
) -> tuple[float, str | None]:
    """Returns the distance to the next place [m], and the kind of object here.

    The kind is None if the place stays empty.
    """
    if task == "lamp":
        return street.lamp_spacing, street.lamp
    if task == "tree":
        step = float(rng.uniform(*street.tree_spacing))
        if not street.trees:
            return step, None
        species = pick_key(street.trees, rng)
        is_gap = rng.uniform() < street.tree_gaps
        return step, None if is_gap else species
    step = float(rng.uniform(*street.furniture_spacing))
    if not street.furniture:
        return step, None
    return step, pick_key(street.furniture, rng)


def _place_along(
    draft: Draft,
    object_kind: str,
    at: Station,
    rng: Generator,
    tags: tuple[str, ...],
    *,
    facing_street: bool = False,
) -> None:
    """Places an object on a line; its heading is the line's direction.

    With `facing_street`, the object faces the street on the right of the line,
    and stands back so that the object's front (+x) touches the line.
    """
    model = OBJECTS[object_kind].build(rng)
    xy, yaw = (at.x, at.y), at.yaw
    if facing_street:
        front = model.footprint.bounds[2]
        xy = (at.x - front * math.sin(at.yaw), at.y + front * math.cos(at.yaw))
        yaw = at.yaw - math.pi / 2
    draft.place(
        object_kind,
        model,
        xy,
        yaw,
        tags,
        clearance=_CLEARANCE,
        crown_part=_CROWN_PART,
    )
