"""Walls with windows, doors and other details, for imported buildings.

The storeys and bays of a wall get the same details as the storeys and bays of
generated buildings.
"""

from collections import Counter
from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
import shapely
from shapely.geometry import box

from worlds.city import (
    AwningShape,
    Relief,
    balcony,
    gate,
    house_door,
    lifted,
    shop_front,
    single_wall,
    window,
)
from worlds.city import awnings as make_awnings
from worlds.city import board as make_board
from worlds.imports.dressing.facade_plan import (
    DOOR_DEEPER,
    DOOR_WIDTH,
    GATE_DEPTH,
    GATE_WIDTH,
    JAMB_WIDTH,
    SHOP_DEPTH,
    FacadePlan,
    Opening,
)
from worlds.imports.dressing.wall_panels import Panel
from worlds.imports.faces import parts_of
from worlds.imports.imported_objects import to_mesh
from worlds.shapes import GRID, Assembly, Mesh, triangulate

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
# Cornices of walls lower than this would collide with doors [m].
_LEAST_WALL = 2.5
# Material of the front of an opening -> its depth if it lies on the wall [m].
_ON_WALL = {"glass": -0.02, "doors": -0.03, "frames": 0.0}
# Distance of openings from the edge of a panel that is not a rectangle [m].
_FROM_EDGE = 0.1
# Smaller remainders of a wall are dropped [m^2].
_LEAST_AREA = 1e-4
# Probability that a wall has balconies, if its style allows them.
_BALCONIES_SHARE = 0.6
# Height of a balcony door's lower edge above the floor of its storey, and above
# the floor of the balcony [m].
_DOOR_ABOVE_FLOOR = 0.1
_DOOR_ABOVE_BALCONY = 0.02
# Distance of balconies from the ends of their wall [m].
_BALCONY_FROM_END = 0.1
# A balcony is this many times as wide as its window.
_BALCONY_RATIO = 1.5
# Windows that begin lower than this have no sills [m].
_LEAST_SILL = 0.2
# Height of a window's horizontal bar, as a share of the window's height.
_BAR_SHARE = 0.7
# Width of the piers beside windows [m].
_PIER_WIDTH = 0.15
# Least height of a plinth [m].
_LEAST_PLINTH = 0.1
# Openings that begin within this distance above a plinth interrupt it [m].
_ABOVE_PLINTH = 0.05
# Shorter pieces of a plinth are left out [m].
_SHORTEST_PLINTH = 0.05
# Distance of a sign from the shop window below it, and from the top of the wall
# [m].
_SIGN_ABOVE_SHOP = 0.06
_SIGN_BELOW_TOP = 0.05
# Least height of a sign [m].
_LEAST_SIGN = 0.15
# Probability that a shop window has an awning.
_AWNINGS_SHARE = 0.4


class _Rectangle(NamedTuple):
    """A rectangle in a wall, in the wall's panel coordinates [m]."""

    x0: float
    z0: float
    x1: float
    z1: float


class _FittedPlan(NamedTuple):
    """The plan of a wall, whose openings are all inside the wall's outline.

    Attributes:
        reliefs: reliefs of the openings, and the materials of their fronts.
        area: area that contains the reliefs.
    """

    plan: FacadePlan
    reliefs: list[tuple[Relief, str]]
    area: _Rectangle


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
    has_balconies = style.balconies and bool(rng.random() < _BALCONIES_SHARE)
    if has_balconies:
        plan = _with_balcony_doors(plan)
    fitted = _within_outline(plan)
    plan, reliefs = fitted.plan, fitted.reliefs
    if not reliefs:
        out.add_to("body", to_mesh(panel.triangles))
    else:
        _add_wall(out, fitted, plan.to_drive < _RECESSES_WITHIN)
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
            _add_in_wall(out, "trim", panel, make_board(*limits))
            counts["gutters" if is_gutter else "cornices"] = 1
    return counts


def _with_balcony_doors(plan: FacadePlan) -> FacadePlan:
    """Returns a plan with windows down to the floor where balconies are."""
    floor = plan.floor + _DOOR_ABOVE_FLOOR
    storey = plan.style.storey
    openings = [
        o._replace(z0=max(min(floor + o.row * storey, o.z0), 0.0))
        if _has_balcony(o)
        else o
        for o in plan.openings
    ]
    return replace(plan, openings=openings)


def _add_in_wall(
    out: Assembly, material: str, panel: Panel, *meshes: Mesh
) -> None:
    """Adds meshes that are given in a wall's coordinates."""
    z = float(panel.origin[2])
    out.add_to(material, *(panel.frame.place(mesh, z) for mesh in meshes))


def _within_outline(plan: FacadePlan) -> _FittedPlan:
    """Returns a plan without rows of openings outside the panel's outline."""
    panel = plan.panel
    whole = _Rectangle(0.0, 0.0, panel.length, panel.height)
    outline = panel.outline
    if outline is not None:
        outline = shapely.buffer(outline, GRID, join_style="mitre")
    while True:
        reliefs = [r for o in plan.openings for r in _reliefs(o, plan)]
        if outline is None or not reliefs:
            return _FittedPlan(plan, reliefs, whole)
        sides = np.array([(r.x0, r.z0, r.x1, r.z1) for r, _ in reliefs])
        low = np.maximum(sides.min(axis=0)[:2] - _FROM_EDGE, whole[:2])
        high = np.minimum(sides.max(axis=0)[2:] + _FROM_EDGE, whole[2:])
        inner = _Rectangle(*np.round([*low, *high], 3).tolist())
        if outline.contains(box(*inner)):
            return _FittedPlan(plan, reliefs, inner)
        last = max(o.row for o in plan.openings)
        kept = [o for o in plan.openings if o.row < last]
        plan = replace(plan, openings=kept)


def _reliefs(opening: Opening, plan: FacadePlan) -> list[tuple[Relief, str]]:
    """Returns the reliefs of an opening, and the materials of their fronts.

    Far from drives, the result is only the front of the opening, which lies on
    the wall.
    """
    style = plan.style
    kind = opening.kind
    x0, x1, z0 = opening.x0, opening.x1, opening.z0
    height = opening.z1 - z0
    if kind == "shop":
        is_even = opening.nth % 2 == 0
        bay = shop_front(height, SHOP_DEPTH, door=is_even)
    elif kind == "gate":
        bay = gate(GATE_WIDTH, height, GATE_DEPTH)
    elif kind == "door":
        depth = style.recess + DOOR_DEEPER
        bay = house_door(DOOR_WIDTH, 0.0, height, depth)
    else:
        has_bars = plan.to_drive < _BARS_WITHIN
        has_sill = plan.to_drive < _SILLS_WITHIN and z0 > _LEAST_SILL
        bay = window(
            style.window_width,
            0.0,
            height,
            style.recess,
            mullions=int(has_bars and style.window_width > _WIDEST_LEAF),
            transom=_BAR_SHARE * height
            if has_bars and height > _HIGHEST_PANE
            else None,
            ledge=_SILL_REACH * has_sill,
            pier=_PIER_WIDTH,
        )
    reliefs = []
    for relief in bay(x0, x1):
        depth = relief.depth
        material = "body"
        if kind == "window" and depth > 0.0:
            material = "glass" if depth == style.recess else "frames"
        elif kind == "shop" and depth >= SHOP_DEPTH:
            material = "glass"
        elif kind in ("door", "gate") and depth > 0.0:
            material = "doors"
        reliefs.append((lifted(relief, z0), material))
    if plan.to_drive < _RECESSES_WITHIN:
        return reliefs
    return [
        (relief._replace(depth=_ON_WALL[material]), material)
        for relief, material in reliefs
        if material in _ON_WALL
    ][:1]


def _add_wall(out: Assembly, fitted: _FittedPlan, has_recesses: bool) -> None:
    """Adds a wall with its openings.

    The area of the openings is cut out of the wall and filled with them.
    Without recesses, panes and doors lie on the wall. This needs far fewer
    triangles than recesses.
    """
    panel = fitted.plan.panel
    x0, z0, x1, z1 = fitted.area
    fronts = [
        {relief.depth for relief, name in fitted.reliefs if name == material}
        for material in _ON_WALL
    ]
    moved = [
        lifted(relief._replace(x0=relief.x0 - x0, x1=relief.x1 - x0), -z0)
        for relief, _ in fitted.reliefs
    ]
    wall, *others = single_wall(x1 - x0, z1 - z0, moved, fronts)
    for material, mesh in zip(_ON_WALL, others, strict=True):
        _add_in_wall(out, material, panel, mesh.moved((x0, 0.0, z0)))
    if not has_recesses:
        out.add_to("body", to_mesh(panel.triangles))
        return
    _add_in_wall(out, "body", panel, wall.moved((x0, 0.0, z0)))
    if panel.outline is not None:
        rest = shapely.difference(
            panel.outline, box(x0, z0, x1, z1), grid_size=GRID
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
    if not is_there or not _LEAST_PLINTH < top < panel.height:
        return 0
    end = panel.length + reach
    gaps = [(r.x0, r.x1) for r, _ in reliefs if r.z0 < top + _ABOVE_PLINTH]
    start = -reach
    for x0, x1 in [*sorted(gaps), (end, end)]:
        if x0 - start > _SHORTEST_PLINTH:
            board = make_board(start, x0, 0.0, top, reach)
            _add_in_wall(out, "trim", panel, board)
        start = max(start, x1)
    return 1


def _has_balcony(opening: Opening) -> bool:
    """Returns whether a window gets a balcony.

    Every other window above the ground floor gets one.
    """
    return opening.row >= 1 and opening.nth % 2 == 1


def _add_balconies(out: Assembly, plan: FacadePlan) -> int:
    """Adds balconies that block no car; returns the number of balconies."""
    count = 0
    for o in filter(_has_balcony, plan.openings):
        middle = (o.x0 + o.x1) / 2
        z = o.z0 - _DOOR_ABOVE_BALCONY
        half = min(_BALCONY_WIDTH, _BALCONY_RATIO * (o.x1 - o.x0)) / 2
        x0 = max(_BALCONY_FROM_END, middle - half)
        x1 = min(plan.panel.length - _BALCONY_FROM_END, middle + half)
        if not plan.is_in_the_way(z, _BALCONY_REACH):
            mesh = balcony(x0, x1, _BALCONY_REACH, z)
            _add_in_wall(out, "trim", plan.panel, mesh)
            count += 1
    return count


def _add_signs(
    out: Assembly, plan: FacadePlan, rng: np.random.Generator
) -> Counter[str]:
    """Adds a sign and awnings above shop windows; returns their counts."""
    shops = [o for o in plan.openings if o.kind == "shop"]
    if not shops:
        return Counter()
    panel = plan.panel
    z = max(o.z1 for o in shops) + _SIGN_ABOVE_SHOP
    height = min(_SIGN_HEIGHT, panel.height - z - _SIGN_BELOW_TOP)
    if height > _LEAST_SIGN:
        start, end = min(o.x0 for o in shops), max(o.x1 for o in shops)
        limits = (start + JAMB_WIDTH, end - JAMB_WIDTH, z, z + height)
        _add_in_wall(out, "sign", panel, make_board(*limits, _SIGN_REACH))
    low, high = z - _AWNING_HEIGHT, z + float(panel.origin[2])
    shape = AwningShape(JAMB_WIDTH, _AWNING_REACH, high - _AWNING_HEIGHT, high)
    cells = [(o.x0, o.x1) for o in shops]
    awnings = make_awnings(panel.frame, cells, rng, _AWNINGS_SHARE, shape)
    if plan.is_in_the_way(low, _AWNING_REACH):
        awnings = []
    out.add_to("sign", *awnings)
    return Counter({"shop windows": len(shops), "awnings": len(awnings)})
