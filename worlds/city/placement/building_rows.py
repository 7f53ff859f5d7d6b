"""Places single buildings, and rows of buildings along streets."""

from dataclasses import dataclass, field
import math

import numpy as np
from numpy.random import Generator
from shapely.geometry import LineString, Polygon
from shapely.geometry.base import BaseGeometry

from evaluation.base import InputError, value_errors
from worlds.city.buildings import ARCHETYPES, sample
from worlds.city.city_plan import BuildingPlan, RowPlan
from worlds.city.ground.districts import District
from worlds.city.placement.draft import Draft
from worlds.city.placement.frontage import Lot, lines_along, lot_at
from worlds.shapes import Site, Structure, placed

# Neighbours closer than this get blank walls on the sides that face each other.
# It leaves room for the eaves and balconies of both [m].
_PARTY_WALL = 3.1
# Buildings that are not neighbours in one row keep this distance [m].
_YARD = 3.1
# A house stands at the height of the ground this far in front of it [m].
_DOORSTEP = 1.0
# If a lot does not fit, the next one tried starts this much further on [m].
_STEP = 1.0
# Factors of the sampled width and depth, which are tried one after the other.
# The result is never below the row's least width or depth.
_SIZES = ((1.0, 1.0), (1.0, 0.7), (0.75, 1.0), (0.5, 1.0), (0.5, 0.5))
# Rounding may make walls of adjoining houses overlap by this much [m].
_TOUCH = 0.005
# Numbers of a rectangle's edges, counter-clockwise from the front.
_RIGHT_EDGE = 1
_LEFT_EDGE = 3


@dataclass
class _House:
    """A building to be built.

    Attributes:
        footprint: ground of the building, in its frame S [m].
        xy: position of S in W [m].
        yaw: heading of S in W [rad].
        height: height of the parapet, ridge or spire [m].
        taken: ground in W that was taken for the building.
        blind_edges: numbers of the edges towards a neighbour.
    """

    archetype: str
    footprint: Polygon
    xy: tuple[float, float]
    yaw: float
    height: float
    taken: BaseGeometry
    blind_edges: set[int] = field(default_factory=set)


def place_buildings(draft: Draft, district: District) -> None:
    """Adds a district's single buildings, then its rows, to a draft.

    Raises:
        InputError: if there is no space for a single building, or an archetype
            cannot be built in the planned size.
    """
    name = district.plan.name
    draft.names.open_range()
    for index, plan in enumerate(district.plan.buildings):
        rng = draft.rng(name, "building", index)
        fault_at = f"{draft.source}: districts.{name}.buildings.{index}"
        house = _single_house(draft, district, plan, fault_at)
        _add_house(draft, name, plan.kind, house, rng, fault_at)
    for index, row in enumerate(district.plan.rows):
        fault_at = f"{draft.source}: districts.{name}.rows.{index}"
        rng = draft.task(name, "row", index)
        for k, house in enumerate(_row_houses(draft, district, row, rng)):
            rng = draft.rng(name, "row", index, k)
            _add_house(draft, name, row.kind, house, rng, fault_at)


def _add_house(
    draft: Draft,
    district: str,
    stem: str | None,
    house: _House,
    rng: Generator,
    fault_at: str,
) -> None:
    """Builds a house, and adds it to a draft.

    Args:
        draft: the city so far.
        stem: first part of the house's name; None for the archetype.
        fault_at: entry of the plan, named in error messages.
    """
    name = draft.names.next_name(stem or house.archetype)
    with value_errors(fault_at):
        model = sample(
            house.archetype,
            house.footprint,
            house.height,
            rng,
            name,
            house.blind_edges,
        )
    x, y = (round(float(value), 3) for value in house.xy)
    xyz = (x, y, _ground_height_before(draft, house))
    tags = (district, house.archetype)
    yaw = round(house.yaw, 5)
    draft.add_building(Structure(name, "building", model, xyz, yaw, tags))


def _ground_height_before(draft: Draft, house: _House) -> float:
    """Returns the height of the ground in front of a house [m]."""
    start, end = Site(house.footprint, house.archetype).outline[:2]
    along = (end - start) / np.hypot(*(end - start))
    step = (start + end) / 2 + _DOORSTEP * np.array([along[1], -along[0]])
    c, s = math.cos(house.yaw), math.sin(house.yaw)
    x = house.xy[0] + c * step[0] - s * step[1]
    y = house.xy[1] + s * step[0] + c * step[1]
    return round(float(draft.base(np.array([x]), np.array([y]))[0]), 3)


def _single_house(
    draft: Draft, district: District, plan: BuildingPlan, fault_at: str
) -> _House:
    if plan.archetype not in ARCHETYPES:
        raise InputError(
            f"{fault_at}.archetype: unknown archetype {plan.archetype}"
        )
    footprint = (
        Lot(0.0, 0.0, 0.0, *plan.size).footprint
        if plan.size is not None
        else Polygon(plan.outline)
    )
    yaw = math.radians(plan.yaw_deg)
    area = placed(footprint, plan.at, yaw)
    if not district.area.contains(area):
        raise InputError(
            f"{fault_at}.at: the building reaches out of the district"
        )
    if not draft.is_free(area, _YARD):
        raise InputError(
            f"{fault_at}.at: the building is closer than {_YARD} m to another "
            "one"
        )
    draft.take(area)
    return _House(plan.archetype, footprint, plan.at, yaw, plan.height, area)


def _row_houses(
    draft: Draft, district: District, row: RowPlan, rng: Generator
) -> list[_House]:
    """Returns the houses of a row: one on each lot that fits along the streets.

    Rows stay on the district's own ground, since patches are meant to stay
    open.
    """
    area: BaseGeometry = district.grounds[district.plan.ground]
    if row.within is not None:
        area = area.intersection(Polygon(row.within))
    # Rounding must not reject lots that touch the edge of the area.
    limit = area.buffer(0.05)
    houses: list[_House] = []
    for line in lines_along(draft.frontage, area, row.setback):
        start = 0.0
        previous = None
        while start < line.length - row.width[0]:
            house = _fitting_house(
                draft, limit, row, line, start, previous, rng
            )
            if house is None:
                start += _STEP
                previous = None
                continue
            x0, _, x1, _ = house.footprint.bounds
            if rng.uniform() > row.fill:
                start += x1 - x0
                previous = None
                continue
            draft.take(house.taken)
            houses.append(house)
            gap = float(rng.uniform(*row.gap))
            if gap < _PARTY_WALL:
                house.blind_edges.add(_RIGHT_EDGE)
            start = start + (x1 - x0) + gap
            previous = house
    return houses


def _fitting_house(
    draft: Draft,
    limit: BaseGeometry,
    row: RowPlan,
    line: LineString,
    start: float,
    previous: _House | None,
    rng: Generator,
) -> _House | None:
    """Returns a random house for the lot at `start`; None if none fits."""
    names = list(row.archetypes)
    if previous is not None and len(names) > 1:
        # Neighbours are never of the same archetype.
        names = [name for name in names if name != previous.archetype]
    weights = np.array([row.archetypes[name] for name in names])
    archetype = names[rng.choice(len(names), p=weights / weights.sum())]
    kind = ARCHETYPES[archetype]
    height = np.clip(rng.uniform(*row.height), *kind.heights)
    width = rng.uniform(*row.width)
    depth = rng.uniform(*row.depth)
    low, high = kind.widths
    for width_part, depth_part in _SIZES:
        wanted = width * width_part, depth * depth_part
        size = np.maximum(wanted, (row.width[0], row.depth[0]))
        lot = lot_at(line, start, *np.clip(size, low, high).round(1).tolist())
        # On a curve, the front of a lot is a chord, slightly shorter than asked
        # for.
        if lot is None or lot.width < low:
            continue
        area = lot.footprint_W
        ignore = previous.taken if previous else None
        inner = area.buffer(-_TOUCH, join_style="mitre")
        if limit.contains(area) and draft.is_free(inner, _YARD, ignore):
            house = _House(
                archetype,
                lot.footprint,
                (lot.x, lot.y),
                lot.yaw,
                round(float(height), 1),
                area,
            )
            if previous and _RIGHT_EDGE in previous.blind_edges:
                house.blind_edges.add(_LEFT_EDGE)
            return house
    return None
