"""Walls and roofs with details for imported buildings.

A wall is divided into storeys and bays, which get the same details as the
storeys and bays of generated buildings. A roof gets equipment or chimneys.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace
import math
from typing import NamedTuple

import numpy as np
import shapely
from shapely.geometry import box

from cns_drake.city.facades import (
    Assembly,
    Relief,
    balconies,
    bays,
    boards,
    canopies,
    lifted,
    single_wall,
)
from cns_drake.city.geometry import Mesh, triangulate, upper_sides
from cns_drake.imports.dressing.styles import Style
from cns_drake.imports.dressing.wall_panels import Panel
from cns_drake.imports.faces import parts_of
from cns_drake.imports.foreign_city import to_mesh

# Distance from the end of a wall to its first bay [m].
_MARGIN = 0.5
# Windows keep this distance from the foot of their wall, and the probe of the
# wall's top keeps it from the top [m].
_FROM_FOOT = 0.3
# Windows keep this distance from the top of their wall [m].
_FROM_TOP = 0.12
# Windows keep this distance from the ground [m].
_FROM_GROUND = 0.4
# Below a roof, a window may shrink to this share of its height.
_LEAST_PART = 0.7
# Probes are this far in front of a wall [m].
_BEFORE = 0.4
# The height of the paving is taken this far in front of a door's wall [m].
_PAVING_BEFORE = 0.15
# Width of the walls beside a door [m].
_JAMB = 0.3
# A front has one door for every such length [m].
_DOOR_EVERY = 16.0
_DOOR_HEIGHT = 2.2
# Least height of a door or a shop window [m].
_LEAST_DOOR = 1.8
_DOOR_WIDTH = 1.15
_GATE_WIDTH = 2.5
# Height of a threshold above the paving [m].
_THRESHOLD = 0.04
# Greatest height of the top of a shop window above the ground [m].
_SHOP_TOP = 2.9
# Least width of a shop window [m].
_LEAST_SHOP = 2.2
# Doors are this much deeper than windows [m].
_DOOR_DEEPER = 0.1
_SHOP_DEPTH = 0.35
_GATE_DEPTH = 0.3
# A wall stands on the ground if it begins at most this high above the ground
# [m].
_ON_GROUND = 0.6


class Opening(NamedTuple):
    """A window or a door in a wall, in the wall's panel coordinates [m].

    Attributes:
        row: number of the storey, from 0.
        nth: number of bays between the opening and the nearer end of the wall.
        x0: left end, seen from outside.
        x1: right end.
        z0: height of the lower edge.
        z1: height of the upper edge.
        kind: `window`, `shop`, `door` or `gate`.
    """

    row: int
    nth: int
    x0: float
    x1: float
    z0: float
    z1: float
    kind: str = "window"


@dataclass(frozen=True)
class FacadePlan:
    """The plan of a wall: its panel, style and openings.

    Attributes:
        panel: the wall.
        style: the style of the building.
        openings: the wall's windows and doors.
        floor: height of the lowest floor above the panel's origin [m].
        ground: height of the ground in front, above the panel's origin [m].
        to_drive: distance from the wall to the nearest drive [m].
        top_is_free: whether no building touches the wall's upper edge.
    """

    panel: Panel
    style: Style
    openings: Sequence[Opening]
    floor: float
    ground: float
    to_drive: float
    top_is_free: bool = True

    @property
    def stands_on_ground(self) -> bool:
        return self.ground > -_ON_GROUND

    @property
    def on_street(self) -> list[Opening]:
        """Openings at ground level; none if the wall starts above ground."""
        on_ground = self.stands_on_ground
        return [o for o in self.openings if o.row == 0 and on_ground]

    def is_in_the_way(self, z: float, reach: float) -> bool:
        """Returns whether a part on the wall would block a car on a drive.

        `z` is the height of the part above the panel's origin, and `reach` is
        how far the part protrudes from the wall [m].
        """
        is_low = z - self.ground < _TALLEST_CAR
        return is_low and self.to_drive < reach + _HALF_PATH

    def probes(self) -> np.ndarray:
        """Returns a point in front of each opening and of the wall's top.

        The result contains (N + 1, 3) points in W, for N openings [m]; the last
        point belongs to the top. An opening, or the top, is occluded if the
        corresponding point cannot be seen.
        """
        panel = self.panel
        at = [((o.x0 + o.x1) / 2, (o.z0 + o.z1) / 2) for o in self.openings]
        at.append((panel.length / 2, panel.height - _FROM_FOOT))
        x, z = np.transpose(at)
        return panel.place(x, z, _BEFORE)

    def threshold(self, door: Opening, paving: upper_sides.UpperSides) -> float:
        """Returns the height of a door's threshold in panel coordinates [m].

        The threshold is one step above the highest paving in front of the door
        and in its recess. Paving far above or below the ground is ignored.
        """
        depths = {"shop": _SHOP_DEPTH, "gate": _GATE_DEPTH}
        deep = depths.get(door.kind, self.style.recess + _DOOR_DEEPER)
        middle = (door.x0 + door.x1) / 2
        x, out = np.meshgrid(
            [door.x0 + _JAMB, middle, door.x1 - _JAMB],
            [_PAVING_BEFORE, -deep / 2, -deep],
        )
        places = self.panel.place(x, np.zeros(x.shape), out).reshape(-1, 3)
        low = float(paving.heights(places[:, :2]).max()) - self.panel.origin[2]
        is_near = abs(low - self.ground) < _ON_GROUND
        return max((low if is_near else self.ground) + _THRESHOLD, 0.0)

    def without(self, is_hidden: np.ndarray) -> FacadePlan:
        """Returns the plan without its occluded openings.

        The field `top_is_free` of the result is false if the top is occluded.

        Args:
            is_hidden: (N + 1,) bool, which of the points that `probes` returns
                are occluded: N points of openings, and last the point of the
                top.
        """
        pairs = zip(self.openings, is_hidden[:-1], strict=True)
        return replace(
            self,
            openings=[o for o, is_gone in pairs if not is_gone],
            top_is_free=not is_hidden[-1],
        )


def plan_facade(
    panel: Panel, style: Style, base: float, ground: float, to_drive: float
) -> FacadePlan:
    """Returns a plan with a window in each bay and storey of a wall.

    Args:
        panel: the wall.
        style: the style of the building.
        base: height of the building's lowest floor in W [m].
        ground: height of the ground in front of the wall in W [m].
        to_drive: distance from the wall to the nearest drive [m].
    """
    floor, ground = base - panel.origin[2], ground - panel.origin[2]
    cells = bays.stretches(panel.length, style.window_pitch, _MARGIN)
    first = max(0, math.floor(-floor / style.storey))
    last = math.ceil((panel.height - floor) / style.storey)
    if style.use == "church":
        last = min(last, 1)
    top = panel.height - _FROM_TOP - style.cornice
    openings = []
    for row in range(first, last):
        low = floor + row * style.storey + style.window_sill
        if (
            low >= max(_FROM_FOOT, ground + _FROM_GROUND)
            and low + _LEAST_PART * style.window_height <= top
        ):
            high = min(low + style.window_height, top)
            openings += [
                Opening(row, min(k, len(cells) - 1 - k), x0, x1, low, high)
                for k, (x0, x1) in enumerate(cells)
            ]
    return FacadePlan(panel, style, openings, floor, ground, to_drive)


def with_shops(plan: FacadePlan, paving: upper_sides.UpperSides) -> FacadePlan:
    """Returns the plan with shop windows on the ground floor, where possible.

    Only wide openings towards the street become shop windows.

    Args:
        plan: plan of the wall.
        paving: upper sides of the paving in front of the wall.
    """
    top = plan.floor + plan.style.storey - 0.75
    top = min(top, plan.ground + _SHOP_TOP)
    street = set(plan.on_street)
    openings = []
    for o in plan.openings:
        if o in street and o.x1 - o.x0 >= _LEAST_SHOP:
            shop = o._replace(kind="shop", z1=top)
            low = plan.threshold(shop, paving)
            if top >= low + _LEAST_DOOR:
                o = shop._replace(z0=low)
        openings.append(o)
    return replace(plan, openings=openings)


def with_doors(plan: FacadePlan, paving: upper_sides.UpperSides) -> FacadePlan:
    """Returns a wall's plan with doors in place of some ground-floor windows.

    `paving` is the paving in front of the wall.
    """
    street = plan.on_street
    if not street or any(o.kind == "shop" for o in street):
        return plan
    is_gate = plan.style.use in ("shed", "industrial")
    kind, width = ("gate", _GATE_WIDTH) if is_gate else ("door", _DOOR_WIDTH)
    # A door must not extend into the windows above.
    above = min((o.z0 for o in plan.openings if o.row > 0), default=np.inf)
    most = min(plan.panel.height - _JAMB, above - 0.2)
    number = max(1, round(plan.panel.length / _DOOR_EVERY))
    wanted = (np.arange(number) + 0.5) * plan.panel.length / number
    middles = np.array([(o.x0 + o.x1) / 2 for o in street])
    nearest = np.abs(middles - wanted[:, None]).argmin(axis=1)
    doors = {street[k] for k in nearest.tolist()}
    openings = []
    for o in plan.openings:
        middle = (o.x0 + o.x1) / 2
        has_room = middle - o.x0 >= width + 2 * _JAMB
        # Otherwise a house would have a door but no window to the street.
        is_alone = len(doors) == len(street) and has_room
        door = o._replace(kind=kind, x1=middle if is_alone else o.x1)
        low = plan.threshold(door, paving) if o in doors else np.inf
        high = min(low + _DOOR_HEIGHT, most)
        if high < low + _LEAST_DOOR:
            openings.append(o)
            continue
        openings.append(door._replace(z0=low, z1=high))
        if is_alone:
            openings.append(o._replace(x0=middle))
    return replace(plan, openings=openings)


# How far parts protrude from their wall [m].
_PLINTH_REACH = 0.06
_CORNICE_REACH = 0.28
_GUTTER_REACH = 0.14
_SIGN_REACH = 0.15
_BALCONY_REACH = 1.15
_AWNING_REACH = 1.1
_SILL_REACH = 0.07
# Cornices lower than this are gutters [m].
_HIGHEST_GUTTER = 0.15
# Greatest height of a sign [m].
_SIGN_HEIGHT = 0.5
# Greatest width of a balcony [m].
_BALCONY_WIDTH = 3.0
_AWNING_HEIGHT = 0.55
# Windows farther from drives than this have no sills [m].
_SILLS_WITHIN = 12.0
# Windows farther from drives than this have no bars [m].
_BARS_WITHIN = 20.0
# Openings farther from drives than this have no recesses, but lie on their
# wall; such a wall has no plinth [m].
_RECESSES_WITHIN = 25.0
# Windows at most this wide have no vertical bar [m].
_WIDEST_LEAF = 1.0
# Windows at most this high have no horizontal bar [m].
_HIGHEST_PANE = 1.5
# Nothing below this height may extend over a car's path [m].
_TALLEST_CAR = 4.0
# A car's path extends this far to each side of its middle [m].
_HALF_PATH = 2.5
# Cornices of walls lower than this would collide with doors [m].
_LEAST_WALL = 2.5
# Material of the front of an opening -> its depth if it lies on the wall [m].
_ON_WALL = {"glass": -0.02, "doors": -0.03, "frames": 0.0}
# Distance of openings from the edge of a panel that is not a rectangle [m].
_FROM_EDGE = 0.1
# Grid on which areas of walls are computed [m].
_GRID = 1e-3
# Smaller remainders of a wall are dropped [m^2].
_LEAST_AREA = 1e-4


def add_facade(
    out: Assembly, plan: FacadePlan, rng: np.random.Generator
) -> Counter[str]:
    """Adds a wall and all its details to a building under assembly.

    Args:
        out: the building, which gets the parts.
        plan: the plan of the wall.
        rng: random generator for balconies and signs.

    Returns:
        Kind of detail, such as `windows` -> number of details.
    """
    counts: Counter[str] = Counter()
    panel, style = plan.panel, plan.style
    has_balconies = style.balconies and bool(rng.random() < 0.6)
    if has_balconies:
        floor = plan.floor + 0.1
        openings = [
            o._replace(z0=max(min(floor + o.row * style.storey, o.z0), 0.0))
            if _has_balcony(o)
            else o
            for o in plan.openings
        ]
        plan = replace(plan, openings=openings)
    plan, reliefs, area = _in_outline(plan)
    if not reliefs:
        out.add_to("body", to_mesh(panel.triangles))
    else:
        _add_wall(out, panel, reliefs, area, plan.to_drive < _RECESSES_WITHIN)
        counts["windows"] = sum(o.kind == "window" for o in plan.openings)
        counts["doors"] = sum(o.kind in ("door", "gate") for o in plan.openings)
        if has_balconies:
            counts["balconies"] = _add_balconies(out, plan)
        counts += _add_signs(out, plan, rng)
    if panel.outline is None and plan.top_is_free:
        if plan.to_drive < _RECESSES_WITHIN:
            counts["plinths"] = _add_plinth(out, plan, reliefs)
        if style.cornice and panel.height > _LEAST_WALL:
            is_gutter = style.cornice < _HIGHEST_GUTTER
            reach = _GUTTER_REACH if is_gutter else _CORNICE_REACH
            low = panel.height - style.cornice
            limits = (-reach, panel.length + reach, low, panel.height, reach)
            _put(out, "trim", panel, boards.board(*limits))
            counts["gutters" if is_gutter else "cornices"] = 1
    return counts


def _put(out: Assembly, material: str, panel: Panel, *meshes: Mesh) -> None:
    """Adds meshes that are given in a wall's coordinates."""
    z = float(panel.origin[2])
    out.add_to(material, *(panel.frame.place(mesh, z) for mesh in meshes))


def _in_outline(
    plan: FacadePlan,
) -> tuple[FacadePlan, list[tuple[Relief, str]], tuple[float, ...]]:
    """Returns a plan without the rows that leave the panel's outline.

    Returns:
        The plan, its reliefs with their materials, and the rectangle x0, z0,
        x1, z1 that contains them [m].
    """
    panel = plan.panel
    area = (0.0, 0.0, panel.length, panel.height)
    outline = panel.outline
    if outline is not None:
        outline = shapely.buffer(outline, _GRID, join_style="mitre")
    while True:
        reliefs = [r for o in plan.openings for r in _reliefs(o, plan)]
        if outline is None or not reliefs:
            return plan, reliefs, area
        sides = np.array([(r.x0, r.z0, r.x1, r.z1) for r, _ in reliefs])
        low = np.maximum(sides.min(axis=0)[:2] - _FROM_EDGE, area[:2])
        high = np.minimum(sides.max(axis=0)[2:] + _FROM_EDGE, area[2:])
        inner = tuple(np.round([*low, *high], 3).tolist())
        if outline.contains(box(*inner)):
            return plan, reliefs, inner
        last = max(o.row for o in plan.openings)
        kept = [o for o in plan.openings if o.row < last]
        plan = replace(plan, openings=kept)


def _reliefs(opening: Opening, plan: FacadePlan) -> list[tuple[Relief, str]]:
    """Returns the reliefs of an opening, and the materials of their fronts."""
    style = plan.style
    kind = opening.kind
    x0, x1, z0 = opening.x0, opening.x1, opening.z0
    height = opening.z1 - z0
    if kind == "shop":
        is_even = opening.nth % 2 == 0
        bay = bays.shop_front(height, _SHOP_DEPTH, door=is_even)
    elif kind == "gate":
        bay = bays.gate(_GATE_WIDTH, height, _GATE_DEPTH)
    elif kind == "door":
        depth = style.recess + _DOOR_DEEPER
        bay = bays.house_door(_DOOR_WIDTH, 0.0, height, depth)
    else:
        has_bars = plan.to_drive < _BARS_WITHIN
        has_sill = plan.to_drive < _SILLS_WITHIN and z0 > 0.2
        bay = bays.window(
            style.window_width,
            0.0,
            height,
            style.recess,
            mullions=int(has_bars and style.window_width > _WIDEST_LEAF),
            transom=0.7 * height
            if has_bars and height > _HIGHEST_PANE
            else None,
            ledge=_SILL_REACH * has_sill,
            pier=0.15,
        )
    found = []
    for relief in bay(x0, x1):
        depth = relief.depth
        material = "body"
        if kind == "window" and depth > 0.0:
            material = "glass" if depth == style.recess else "frames"
        elif kind == "shop" and depth >= _SHOP_DEPTH:
            material = "glass"
        elif kind in ("door", "gate") and depth > 0.0:
            material = "doors"
        found.append((lifted(relief, z0), material))
    if plan.to_drive < _RECESSES_WITHIN:
        return found
    first = next((pair for pair in found if pair[1] in _ON_WALL), None)
    if first is None:
        return []
    return [(first[0]._replace(depth=_ON_WALL[first[1]]), first[1])]


def _add_wall(
    out: Assembly,
    panel: Panel,
    reliefs: Sequence[tuple[Relief, str]],
    area: tuple[float, ...],
    has_recesses: bool,
) -> None:
    """Adds a wall with its openings.

    The `area` (see `_in_outline`) is cut out and filled with the openings.
    Without recesses, panes and doors lie on the wall, which needs far fewer
    triangles.
    """
    x0, z0, x1, z1 = area
    fronts = [
        {relief.depth for relief, name in reliefs if name == material}
        for material in _ON_WALL
    ]
    moved = [
        lifted(relief._replace(x0=relief.x0 - x0, x1=relief.x1 - x0), -z0)
        for relief, _ in reliefs
    ]
    wall, *others = single_wall(x1 - x0, z1 - z0, moved, fronts)
    for material, mesh in zip(_ON_WALL, others, strict=True):
        _put(out, material, panel, mesh.moved((x0, 0.0, z0)))
    if not has_recesses:
        out.add_to("body", to_mesh(panel.triangles))
        return
    _put(out, "body", panel, wall.moved((x0, 0.0, z0)))
    if panel.outline is not None:
        rest = shapely.difference(
            panel.outline, box(x0, z0, x1, z1), grid_size=_GRID
        )
        for part in parts_of(rest):
            if part.area > _LEAST_AREA:
                x, z = np.moveaxis(triangulate(part), 2, 0)
                out.add_to("body", to_mesh(panel.place(x, z)))


def _add_plinth(
    out: Assembly, plan: FacadePlan, reliefs: Sequence[tuple[Relief, str]]
) -> int:
    """Adds the plinth of a wall, if any; returns the number of plinths."""
    panel = plan.panel
    reach = _PLINTH_REACH
    top = plan.ground + plan.style.plinth
    is_there = plan.style.plinth and plan.stands_on_ground
    if not is_there or not 0.1 < top < panel.height:
        return 0
    end = panel.length + reach
    low = [(r.x0, r.x1) for r, _ in reliefs if r.z0 < top + 0.05]
    start = -reach
    for x0, x1 in [*sorted(low), (end, end)]:
        if x0 - start > 0.05:
            board = boards.board(start, x0, 0.0, top, reach)
            _put(out, "trim", panel, board)
        start = max(start, x1)
    return 1


def _has_balcony(opening: Opening) -> bool:
    """Returns whether a window has a balcony, as every other upper one has."""
    return opening.row >= 1 and opening.nth % 2 == 1


def _add_balconies(out: Assembly, plan: FacadePlan) -> int:
    count = 0
    for o in filter(_has_balcony, plan.openings):
        middle = (o.x0 + o.x1) / 2
        z = o.z0 - 0.02
        half = min(_BALCONY_WIDTH, 1.5 * (o.x1 - o.x0)) / 2
        x0 = max(0.1, middle - half)
        x1 = min(plan.panel.length - 0.1, middle + half)
        if not plan.is_in_the_way(z, _BALCONY_REACH):
            mesh = balconies.balcony(x0, x1, _BALCONY_REACH, z)
            _put(out, "trim", plan.panel, mesh)
            count += 1
    return count


def _add_signs(
    out: Assembly, plan: FacadePlan, rng: np.random.Generator
) -> Counter[str]:
    """Adds the signs and awnings above shop windows."""
    shops = [o for o in plan.openings if o.kind == "shop"]
    if not shops:
        return Counter()
    panel = plan.panel
    z = max(o.z1 for o in shops) + 0.06
    height = min(_SIGN_HEIGHT, panel.height - z - 0.05)
    if height > 0.15:
        start, end = min(o.x0 for o in shops), max(o.x1 for o in shops)
        limits = (start + _JAMB, end - _JAMB, z, z + height)
        _put(out, "sign", panel, boards.board(*limits, _SIGN_REACH))
    low, high = z - _AWNING_HEIGHT, z + float(panel.origin[2])
    shape = (_JAMB, _AWNING_REACH, high - _AWNING_HEIGHT, high)
    cells = [(o.x0, o.x1) for o in shops]
    awnings = canopies.awnings(panel.frame, cells, rng, 0.4, shape)
    if plan.is_in_the_way(low, _AWNING_REACH):
        awnings = []
    out.add_to("sign", *awnings)
    return Counter({"shop windows": len(shops), "awnings": len(awnings)})
