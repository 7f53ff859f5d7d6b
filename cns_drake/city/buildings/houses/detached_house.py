"""The detached house: wings under gables or hips, a porch, a garage."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from cns_drake.city.buildings.house_parts import family_house
from cns_drake.city.buildings.house_parts.family_house import ROOF_M, STOREY_M
from cns_drake.city.facades import bays, details, house_walls, wings
from cns_drake.city.facades.assembly import Assembly, Dice, Site
from cns_drake.city.facades.roofs import add_chimney
from cns_drake.city.facades.wings import Roof, Wing

# Kept free around the walls, for eaves and chimneys [m].
_MARGIN = 0.5


class Parameters(family_house.Colours):
    """Parameters of a detached house; lengths in metres.

    `plan` is `box`, `ell` (a wing to the front), `tee` (a wing to the
    back) or `cross` (both). The garage stands on the right, the front wing
    on the left, unless `mirrored`.
    """

    def __init__(self, d: Dice) -> None:
        self.height = d.height
        self.plan = d.pick(("box", "ell", "tee", "cross", "ell"))
        self.mirrored = d.chance(0.5)
        self.roof = d.pick(("gable", "gable", "hip", "gambrel"))
        self.pitch_deg = d.uniform(28.0, 45.0)
        self.wing_width = d.uniform(0.36, 0.46)
        self.low_wing = d.chance(0.35)
        self.deck = d.uniform(0.2, 0.6, 2)
        self.window_pitch = d.uniform(2.6, 3.4)
        self.window_width = d.uniform(0.95, 1.3, 2)
        self.casing = d.pick(("frame", "sill", "sill", "shutters"))
        self.porch = d.pick(("shed", "gable", "full", "flat"))
        self.porch_reach = d.uniform(1.5, 2.2, 2)
        self.garage = d.pick(("flat", "gable", "shed", "none"))
        self.garage_width = d.uniform(3.2, 5.8, 1)
        self.chimney = d.pick(("ridge", "breast", "ridge", "none"))
        self.chimney_at = d.uniform(0.2, 0.8)
        self.dormers = d.whole(0, 3)
        self.dormer = d.pick(("gable", "shed"))
        self.bay_window = d.chance(0.4)
        self.draw_colours(d)


_WING_ENDS = {
    "box": (),
    "ell": ("front",),
    "tee": ("back",),
    "cross": ("front", "back"),
}


@dataclass(frozen=True)
class _Plan:
    """The places of the parts of a house.

    Attributes:
        main, wings, garage: its boxes.
        storeys: of the main box.
        free: part of the main front that no wing hides, in x [m].
        ahead: room in front of the main front [m].
    """

    main: Wing
    wings: tuple[Wing, ...]
    garage: Wing | None
    storeys: int
    free: tuple[float, float]
    ahead: float

    @property
    def boxes(self) -> tuple[Wing, ...]:
        garage = () if self.garage is None else (self.garage,)
        return (self.main, *self.wings, *garage)

    def mirrored(self, width: float) -> _Plan:
        """Returns the plan with x replaced by `width` - x."""
        parts = tuple(wing.mirrored(width) for wing in self.wings)
        garage = self.garage and self.garage.mirrored(width)
        a, b = self.free
        return replace(
            self,
            main=self.main.mirrored(width),
            wings=parts,
            garage=garage,
            free=(width - b, width - a),
        )


def _planned(p: Parameters, site: Site) -> _Plan:
    """Lays the house out."""
    x0, y0, x1, y1 = site.bounds
    left, right, back = x0 + _MARGIN, x1 - _MARGIN, y1 - _MARGIN
    ahead = min(p.porch_reach + 0.3 + 1.8 * p.deck, 0.3 * (back - y0))
    front = y0 + ahead
    main_back = front + min(back - front, 10.0)
    deep = main_back - front
    garage_width = min(p.garage_width, 0.36 * (right - left))
    has_garage = p.garage != "none" and garage_width > 2.9
    split = right - garage_width * has_garage
    pitch_deg = 48.0 if p.roof == "gambrel" else p.pitch_deg
    n = family_house.storeys_for(p.height, p.deck, deep, pitch_deg)
    wall_top = family_house.wall_top_for(p.height, p.deck, deep, n)
    slope = 2 * (p.height - wall_top - ROOF_M) / deep
    roof = Roof(p.roof, eaves=0.4, verge=0.3, thickness=ROOF_M)
    main = Wing.at(left, front, split, main_back, wall_top, p.height, roof)
    wide = max(3.2, p.wing_width * (split - left))
    drop = STOREY_M * (n > 1 and p.low_wing)
    top = min(wall_top + ROOF_M + slope * wide / 2, p.height - 0.25) - drop
    kind = "hip" if p.roof == "hip" else "gable"
    shape = Roof(kind, True, 0.35, 0.3, ROOF_M)
    middle = (front + main_back) / 2
    parts = []
    for end in _WING_ENDS[p.plan]:
        if end == "front":
            span = (left - 0.02, front - max(0.6, ahead - 0.6))
            area = (*span, left + wide, middle)
        else:
            a = left + 0.4 * (split - left - wide)
            area = (a, middle, a + wide, min(back, main_back + 3.0))
        if end == "front" or back - main_back > 1.0:
            parts.append(Wing.at(*area, wall_top - drop, top, shape))
    garage = None
    if has_garage:
        garage = family_house.garage_wing(
            p.garage, split - 0.06, right, front + 0.6, main_back - 0.4,
            p.height,
        )  # fmt: skip
    taken = left + wide if "front" in _WING_ENDS[p.plan] else left
    plan = _Plan(main, tuple(parts), garage, n, (taken, split), ahead)
    return plan.mirrored(x0 + x1) if p.mirrored else plan


def build(p: Parameters, out: Assembly) -> None:
    """Builds the house on a rectangle, its porch in front."""
    p.paint(out)
    plan = _planned(p, out.site)
    _add_main(out, p, plan)
    for wing in plan.wings:
        _add_wing(out, p, plan, wing)
    if plan.garage is not None:
        family_house.add_garage(out, plan.garage, plan.boxes)
    _add_chimney(out, p, plan)


def _add_main(out: Assembly, p: Parameters, plan: _Plan) -> None:
    main = plan.main
    openings = family_house.window_rows(
        main, plan.boxes, p.deck, plan.storeys, p.window_pitch, p.window_width
    )
    a, b = (x - main.x0 for x in plan.free)
    door = a + 0.5 * (b - a)
    house_walls.add_door(out, main, openings, 0, door, p.deck, lights=0.3)
    _add_porch(out, p, plan, (a, b))
    family_house.close_box(out, main, openings, p.deck, p.casing)
    if p.roof in ("gable", "gambrel"):
        wings.add_dormers(out, main, a, b, p.dormers, p.dormer, 3.0)


def _add_porch(
    out: Assembly, p: Parameters, plan: _Plan, free: bays.Span
) -> None:
    """Roofs the door; a `full` porch runs along the free front."""
    wall = plan.main.wall(0)
    a, b = free
    door = (a + b) / 2
    reach = min(p.porch_reach, plan.ahead - 0.3)
    eaves = p.deck + 2.3
    top = eaves + (0.9 if p.porch == "gable" else 0.45)
    if plan.storeys == 1:
        top = min(top, plan.main.wall_top + 0.1)
    full = p.porch == "full" and b - a > 3.5
    x0, x1 = (a + 0.3, b - 0.3) if full else (door - 1.2, door + 1.2)
    details.add_porch(
        out, wall, x0, x1, reach, p.deck, eaves, top,
        roof="shed" if p.porch == "full" else p.porch,
        posts=max(3, round((x1 - x0) / 2.2)) if full else 2,
    )  # fmt: skip
    room = plan.ahead - reach - 0.02
    details.add_steps(out, wall, door - 0.7, door + 0.7, reach, p.deck, room)
    if full and p.deck > 0.3:
        y = reach - 0.15
        runs = ((x0 + 0.15, door - 0.8), (door + 0.8, x1 - 0.15))
        for k, (start, end) in enumerate(runs):
            details.add_railing(
                out, f"railing_{k}", wall, (start, y), (end, y), p.deck,
                family_house.TRIM,
            )  # fmt: skip


def _add_wing(out: Assembly, p: Parameters, plan: _Plan, wing: Wing) -> None:
    count = max(1, round((wing.wall_top - p.deck) / STOREY_M))
    openings = family_house.window_rows(
        wing, plan.boxes, p.deck, count, p.window_pitch, p.window_width
    )
    family_house.close_box(out, wing, openings, p.deck, p.casing)
    is_front = wing.y0 < plan.main.y0
    if p.bay_window and is_front and wing.width > 3.0:
        size = (wing.width / 2, 2.2, 0.4, 0.0, p.deck + 2.3)
        details.add_bay_window(out, wing.wall(0), *size)


def _add_chimney(out: Assembly, p: Parameters, plan: _Plan) -> None:
    main = plan.main
    if p.chimney == "breast":
        wall = main.wall(1 if p.mirrored else 3)
        x = wall.length / 2
        breast = details.chimney_breast(wall, x, 1.6, 0.42, main.top - 0.1)
        out.add_to("base", breast)
        spot = (*wall.point(x, 0.18), main.top - 0.9)
        add_chimney(out, "chimney", spot, family_house.BASE, yaw=np.pi / 2)
    elif p.chimney == "ridge":
        x = main.x0 + p.chimney_at * main.width
        spot = (x, main.center[1], main.top - 1.2)
        add_chimney(out, "chimney", spot, family_house.BRICKS[0])
