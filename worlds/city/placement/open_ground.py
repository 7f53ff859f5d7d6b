"""Places objects on a district's own ground: trees, hedges, cars, benches."""

from collections import defaultdict
import itertools
import math

import numpy as np
from numpy.random import Generator
import shapely
from shapely.geometry import LineString, Polygon
from shapely.ops import unary_union

from evaluation.base import InputError
from worlds.city.city_plan import LinePlan, ObjectPlan, ScatterPlan
from worlds.city.ground.districts import District
from worlds.city.placement.draft import Draft
from worlds.city.placement.frontage import station_at
from worlds.city.placement.parking import park_in_bays
from worlds.shapes import OBJECTS, pick_key

# Least distance between two objects [m].
_CLEARANCE = 0.15
# A trunk's least distance from any building, as a share of the crown's reach:
# it keeps crowns away from walls.
_CROWN_PART = 0.8
# Greatest length of a fence or hedge [m]. A longer line is divided, so that a
# stage can lack one piece without lacking all of them.
_LONGEST_RUN = 24.0
# Gap between two pieces, which prevents overlaps [m].
_RUN_GAP = 0.06
# On slopes, the height from one piece to the next is at most this [m].
_HIGHEST_STEP = 0.3


def furnish_district(draft: Draft, district: District) -> None:
    """Places the objects, fences, parked cars and plants of a district.

    The plan describes them in the entries `objects`, `lines`, `parking` and
    `scatter` of the district. Objects for which there is no room are left out.
    Lack of room is an error only for an entry of `objects`.

    Raises:
        InputError: if there is no room for an entry of `objects`, or its
            parameters are wrong.
    """
    plan = district.plan
    draft.names.open_range()
    for index, one in enumerate(plan.objects):
        rng = draft.rng(plan.name, "object", index)
        _place_object(draft, plan.name, index, one, rng)
    for index, line in enumerate(plan.lines):
        rng = draft.task(plan.name, "line", index)
        _place_line(draft, district, line, rng)
    for index, parking in enumerate(plan.parking):
        rng = draft.task(plan.name, "parking", index)
        park_in_bays(draft, plan.name, parking, rng)
    for index, scatter in enumerate(plan.scatter):
        rng = draft.task(plan.name, "scatter", index)
        _scatter(draft, district, scatter, rng)


def _place_object(
    draft: Draft, district: str, index: int, plan: ObjectPlan, rng: Generator
) -> None:
    field = f"{draft.source}: districts.{district}.objects.{index}"
    try:
        model = OBJECTS[plan.object].build(rng, **plan.parameters)
    except (TypeError, ValueError) as error:
        raise InputError(f"{field}.parameters: {error}") from error
    yaw = math.radians(plan.yaw_deg)
    if not draft.place(
        plan.object, model, plan.at, yaw, (district,), stem=plan.kind
    ):
        raise InputError(f"{field}.at: the place is taken by another structure")


def _place_line(
    draft: Draft, district: District, plan: LinePlan, rng: Generator
) -> None:
    points = np.array(plan.points)
    if plan.spacing is None:
        for start, end in itertools.pairwise(points):
            _place_run(draft, district.plan.name, plan, start, end, rng)
        return
    line = LineString(points)
    s = 0.0
    while s <= line.length:
        at = station_at(line, s)
        object_kind = pick_key(plan.objects, rng)
        yaw = at.yaw + math.radians(plan.yaw_deg)
        _place_if_free(
            draft, district, object_kind, plan.kind, at[:2], yaw, rng
        )
        s += float(rng.uniform(*plan.spacing))


def _place_run(
    draft: Draft,
    district: str,
    plan: LinePlan,
    start: np.ndarray,
    end: np.ndarray,
    rng: Generator,
) -> None:
    """Places fences or hedges end to end between two points, in W [m]."""
    length = float(np.hypot(*(end - start)))
    count = max(1, math.ceil(length / _LONGEST_RUN))
    # On a slope, the pieces go down in steps.
    line = np.linspace(start, end, math.ceil(length) + 1)
    fall = float(np.abs(np.diff(draft.base(*line.T))).sum())
    count = max(count, math.ceil(round(fall, 3) / _HIGHEST_STEP))
    yaw = math.atan2(*(end - start)[::-1]) + math.radians(plan.yaw_deg)
    object_kind = pick_key(plan.objects, rng)
    for k in range(count):
        middle = start + (end - start) * (k + 0.5) / count
        model = OBJECTS[object_kind].build(
            rng, length=length / count - _RUN_GAP, **plan.parameters
        )
        draft.place(
            object_kind,
            model,
            tuple(middle),
            yaw,
            (district,),
            stem=plan.kind,
        )


def _scatter(
    draft: Draft, district: District, plan: ScatterPlan, rng: Generator
) -> None:
    """Places objects at random, at least `spacing` apart (dart throwing)."""
    grounds = district.grounds.items()
    area = unary_union([area for kind, area in grounds if kind in plan.ground])
    if plan.within is not None:
        area = area.intersection(Polygon(plan.within))
    area = area.buffer(-plan.clearance)
    if area.is_empty:
        return
    shapely.prepare(area)
    x0, y0, x1, y1 = area.bounds
    # Cell of a grid, as wide as the spacing -> the chosen places in it.
    chosen: defaultdict[tuple[int, int], list[np.ndarray]] = defaultdict(list)
    darts = int(4 * (x1 - x0) * (y1 - y0) / plan.spacing**2) + 1
    for dart in rng.uniform((x0, y0), (x1, y1), (darts, 2)):
        if not shapely.contains_xy(area, *dart):
            continue
        x, y = (dart // plan.spacing).astype(int).tolist()
        cells = itertools.product((x - 1, x, x + 1), (y - 1, y, y + 1))
        near = [place for cell in cells for place in chosen.get(cell, ())]
        if near and np.hypot(*(np.array(near) - dart).T).min() < plan.spacing:
            continue
        chosen[x, y].append(dart)
        # Two numbers are sampled for every place, kept or not, so that another
        # fill does not move the objects.
        keep = rng.uniform() < plan.fill
        yaw = rng.uniform(-math.pi, math.pi)
        object_kind = pick_key(plan.objects, rng)
        if keep:
            xy = float(dart[0]), float(dart[1])
            _place_if_free(
                draft, district, object_kind, plan.kind, xy, yaw, rng
            )


def _place_if_free(
    draft: Draft,
    district: District,
    object_kind: str,
    stem: str | None,
    xy: tuple[float, float],
    yaw: float,
    rng: Generator,
) -> None:
    """Places an object within the district, if there is room.

    Args:
        draft: the city so far.
        object_kind: kind of object, a key of `OBJECTS`.
        stem: first part of the structure's name; None for the usual one.
        xy: position of the object in W [m].
        yaw: heading of the object in W [rad].
    """
    draft.place(
        object_kind,
        OBJECTS[object_kind].build(rng),
        xy,
        yaw,
        (district.plan.name,),
        stem=stem,
        clearance=_CLEARANCE,
        crown_part=_CROWN_PART,
        within=district.area,
    )
