"""Divides the ground outside the streets into the districts of a plan."""

from typing import NamedTuple

import shapely
from shapely.geometry import MultiPolygon, Point, Polygon, box
from shapely.geometry.base import BaseGeometry
from shapely.ops import unary_union

from evaluation.base import InputError
from worlds.city.city_plan import CityPlan, DistrictPlan, PatchPlan
from worlds.city.ground.elevation import Pad
from worlds.shapes import polygons_of, snap


class District(NamedTuple):
    """A district of a city, and the areas of its ground in W [m].

    Attributes:
        plan: the entry of the district in the plan.
        area: ground of the district.
        grounds: kind of ground, such as `lawn` -> area of this kind. Together,
            these areas make up `area`.
        terraces: patches that are level.
    """

    plan: DistrictPlan
    area: MultiPolygon
    grounds: dict[str, MultiPolygon]
    terraces: tuple[Pad, ...] = ()


def share_out(
    plan: CityPlan, streets: BaseGeometry, source: str
) -> list[District]:
    """Divides the ground of a city among its districts.

    `streets` is the area of carriageways, sidewalks and medians in W [m].
    `source` is the plan's file, named in error messages.

    Returns:
        The districts, in the order of the plan.

    Raises:
        InputError: if a district has no ground, because its ground is outside
            the city, below streets or part of an earlier district; or if some
            ground belongs to no district.
    """
    free = snap(box(*plan.bounds)).difference(streets)
    districts = []
    for district in plan.districts:
        field = f"{source}: districts.{district.name}"
        if district.block is not None:
            block = Point(district.block)
            hit = (one for one in polygons_of(free) if one.contains(block))
            area: BaseGeometry = next(hit, Polygon())
            fault = f"block: no free ground at {district.block}"
        elif district.area is not None:
            area = _polygon(district.area, f"{field}.area").intersection(free)
            fault = "area: on ground that another district has taken"
        else:
            area = free
            fault = "no ground is left for it"
        pieces = MultiPolygon(polygons_of(snap(area)))
        if pieces.is_empty:
            raise InputError(f"{field}.{fault}")
        terraces = tuple(
            Pad(snap(_patch_shape(patch).intersection(pieces)), patch.level)
            for patch in district.patches
            if patch.level is not None
        )
        grounds = _grounds(district, pieces)
        districts.append(District(district, pieces, grounds, terraces))
        free = snap(free.difference(pieces))
    left = sum(piece.area for piece in polygons_of(free))
    if left > 1.0:
        raise InputError(
            f"{source}: districts: {left:.0f} m^2 belong to no district"
        )
    return districts


def _polygon(corners: list[tuple[float, float]], field: str) -> Polygon:
    polygon = Polygon(corners) if len(corners) >= 3 else Polygon()
    if polygon.is_empty or not polygon.is_valid:
        raise InputError(f"{field}: the corners make no simple polygon")
    return polygon


def _grounds(plan: DistrictPlan, area: MultiPolygon) -> dict[str, MultiPolygon]:
    """Returns the area of each kind of ground; the first patch has priority."""
    pieces: dict[str, list[BaseGeometry]] = {}
    rest: BaseGeometry = area
    for patch in plan.patches:
        shape = snap(_patch_shape(patch))
        pieces.setdefault(patch.ground, []).append(shape.intersection(rest))
        rest = rest.difference(shape)
    pieces.setdefault(plan.ground, []).append(rest)
    return {
        ground: MultiPolygon(polygons_of(snap(unary_union(shapes))))
        for ground, shapes in pieces.items()
    }


def _patch_shape(patch: PatchPlan) -> BaseGeometry:
    if patch.area is not None:
        return Polygon(patch.area)
    return shapely.LineString(patch.line).buffer(
        patch.width / 2, cap_style="flat", join_style="mitre"
    )
