"""The bungalow: one long low storey, a carport or a garage under its roof."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cns_drake.city.buildings.house_parts import family_house
from cns_drake.city.buildings.house_parts.family_house import ROOF_M
from cns_drake.city.facades import details, house_walls, massing
from cns_drake.city.facades.assembly import Assembly, Dice, Site
from cns_drake.city.facades.house_walls import Openings
from cns_drake.city.facades.roofs import add_chimney
from cns_drake.city.facades.wings import Roof, Wing

# Kept free around the walls, for wide eaves [m].
_MARGIN = 0.75


class Parameters(family_house.Colours):
    """Parameters of a bungalow; lengths in metres.

    Attributes:
        height: of the ridge.
        plan: `long`, `ell` (a wing to the front) or `court` (two of them).
        parking: `garage` in the front wing, `carport` beside the house or
            `none`.
        mirrored: whether the front wing stands on the right.
        roof: `gable` or `hip`.
        wing_width: of a front wing, as a part of the house.
        reach: of the front wings.
        floor: height of the floor.
        picture: width of the large window beside the door.
        veranda: whether a porch runs along the front.
    """

    def __init__(self, d: Dice) -> None:
        self.height = d.height
        self.plan = d.pick(("long", "ell", "ell", "court"))
        self.parking = d.pick(("garage", "carport", "none"))
        self.mirrored = d.chance(0.5)
        self.roof = d.pick(("gable", "hip", "hip"))
        self.wing_width = d.uniform(0.3, 0.4)
        self.reach = d.uniform(2.0, 4.0, 2)
        self.floor = d.uniform(0.1, 0.35, 2)
        self.window_pitch = d.uniform(2.6, 3.6)
        self.window_width = d.uniform(1.2, 1.7, 2)
        self.picture = d.uniform(2.2, 3.4, 2)
        self.casing = d.pick(("frame", "sill", "shutters"))
        self.veranda = d.chance(0.5)
        self.chimney_at = d.uniform(0.25, 0.75)
        self.draw_colours(d)


@dataclass(frozen=True)
class _Plan:
    """The places of the parts; `carport` is x0, y0, x1, y1 or None."""

    main: Wing
    fronts: tuple[Wing, ...]
    carport: tuple[float, float, float, float] | None
    free: tuple[float, float]

    def mirrored(self, width: float) -> _Plan:
        a, b = self.free
        carport = self.carport
        if carport is not None:
            x0, y0, x1, y1 = carport
            carport = (width - x1, y0, width - x0, y1)
        return _Plan(
            self.main.mirrored(width),
            tuple(wing.mirrored(width) for wing in self.fronts),
            carport,
            (width - b, width - a),
        )


def _planned(p: Parameters, site: Site) -> _Plan:
    x0, y0, x1, y1 = site.bounds
    left, right, back = x0 + _MARGIN, x1 - _MARGIN, y1 - _MARGIN
    width = right - left
    fronts_wanted = {"long": 0, "ell": 1, "court": 2}[p.plan]
    fronts_wanted = min(fronts_wanted, int(width / 6.5))
    depth = back - y0
    ahead = min(1.9, 0.2 * depth)
    reach = min(p.reach, 0.3 * depth) if fronts_wanted else 0.0
    front = y0 + max(ahead, _MARGIN + reach)
    deep = min(back - front, 8.5)
    carport = None
    if p.parking == "carport" and width > 13.0:
        carport = (right - 3.4, front + 0.4, right, front + min(6.0, deep))
        right -= 3.6
    top = p.height
    wall_top = min(
        p.floor + 2.75, top - ROOF_M - 0.1 * deep, 0.8 * (top - ROOF_M)
    )
    shape = Roof(p.roof, eaves=0.6, verge=0.4, thickness=ROOF_M)
    main = Wing.at(left, front, right, front + deep, wall_top, top, shape)
    slope = 2 * (top - main.wall_top - ROOF_M) / deep
    wide = max(3.4, p.wing_width * (right - left))
    fronts = []
    taken = [left, right]
    for k in range(fronts_wanted):
        a = left - 0.02 if k == 0 else right - wide
        end = min(top - 0.2, main.wall_top + ROOF_M + slope * wide / 2)
        cross = Roof(p.roof, True, 0.5, 0.4, ROOF_M)
        fronts.append(
            Wing.at(
                a, front - reach, a + wide + 0.02, front + deep / 2,
                main.wall_top, end, cross,
            )
        )  # fmt: skip
        taken[k] = a + wide if k == 0 else a
    plan = _Plan(main, tuple(fronts), carport, (taken[0], taken[1]))
    return plan.mirrored(x0 + x1) if p.mirrored else plan


def build(p: Parameters, out: Assembly) -> None:
    """Builds the bungalow along the front of a rectangle."""
    p.paint(out)
    plan = _planned(p, out.site)
    boxes = (plan.main, *plan.fronts)
    size = (p.floor, 1, p.window_pitch, p.window_width)
    openings = family_house.window_rows(plan.main, boxes, *size)
    _add_main(out, p, plan, openings, out.site.bounds[1])
    for k, wing in enumerate(plan.fronts):
        openings = family_house.window_rows(wing, boxes, *size)
        if p.parking == "garage" and k == 0:
            width = min(wing.width - 0.8, 4.8)
            house_walls.add_garage_door(
                out, wing, openings, 0, wing.width / 2, width
            )
        family_house.close_box(out, wing, openings, p.floor, p.casing)
    if plan.carport is not None:
        _add_carport(out, plan.carport)
    main = plan.main
    x = main.x0 + p.chimney_at * main.width
    spot, scale = (x, main.center[1], main.top - 1.3), (1.5, 1.2, 0.95)
    add_chimney(out, "chimney", spot, family_house.BASE, scale=scale)


def _add_main(
    out: Assembly, p: Parameters, plan: _Plan, openings: Openings, y0: float
) -> None:
    main = plan.main
    wall = main.wall(0)
    a, b = (x - main.x0 for x in plan.free)
    door = a + 0.3 * (b - a)
    if b - door > p.picture + 1.6:
        x = (door + 0.6 + b) / 2
        pane = house_walls.sash(p.picture, p.floor, 0.45, 2.15, bars=2)
        openings.put(0, x, p.picture + 0.7, pane)
    house_walls.add_door(out, main, openings, 0, door, p.floor, lights=0.3)
    family_house.close_box(out, main, openings, p.floor, p.casing)
    reach = min(1.6, main.y0 - y0 - 0.4)
    if p.veranda and b - a > 4.0 and reach > 0.9:
        eaves = min(p.floor + 2.25, main.wall_top - 0.35)
        details.add_porch(
            out, wall, a + 0.25, b - 0.25, reach, p.floor, eaves,
            eaves + 0.4, posts=max(3, round((b - a) / 2.4)),
        )  # fmt: skip
    else:
        slab = (door - 1.0, door + 1.0, -0.05, min(1.2, reach), p.floor)
        out.add_to("base", wall.standing(*slab, bottom=True))


def _add_carport(out: Assembly, area: massing.Area) -> None:
    """Adds a flat roof on six posts, with a shed at its end."""
    x0, y0, x1, y1 = area
    top = 2.65
    out.add_to("roof", massing.box(x0, x1, y0, y1, top - 0.25, top))
    for x in (x0 + 0.15, x1 - 0.15):
        for y in np.linspace(y0 + 0.3, y1 - 2.0, 3).tolist():
            out.add_to("trim", massing.post(x, y, 0.08, top - 0.2))
    shed = (x0 + 0.1, x1 - 0.1, y1 - 1.6, y1 - 0.1, top - 0.2)
    out.add_to("walls", massing.standing(*shed, bottom=True))
