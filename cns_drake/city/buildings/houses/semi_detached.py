"""The pair of semi-detached houses: mirrored halves under one roof."""

from __future__ import annotations

import numpy as np

from cns_drake.city.buildings.house_parts import family_house
from cns_drake.city.buildings.house_parts.family_house import ROOF_M, STOREY_M
from cns_drake.city.facades import details, house_walls
from cns_drake.city.facades.assembly import Assembly, Dice
from cns_drake.city.facades.house_walls import Openings
from cns_drake.city.facades.roofs import add_chimney
from cns_drake.city.facades.wings import Roof, Wing

# Kept free around the walls, for eaves [m].
_MARGIN = 0.5


class Parameters(family_house.Colours):
    """Parameters of a pair of houses; lengths in metres.

    Attributes:
        height: of the ridge.
        roof: `gable` or `hip`.
        pitch_deg: wanted, of the roof.
        floor: height of the ground floor.
        bay: `gabled` (through all storeys, under a gable of its own),
            `canted` or `none`.
        bay_width, bay_reach: of the bays.
        doors_inside: whether the doors lie side by side in the middle.
        porch_reach: of the roofs above the doors.
        garages: `none`, `flat`, `shed` or `hip`, one on either side.
        chimneys: `middle` or `ends`.
    """

    def __init__(self, d: Dice) -> None:
        self.height = d.height
        self.roof = d.pick(("gable", "hip"))
        self.pitch_deg = d.uniform(30.0, 45.0)
        self.floor = d.uniform(0.15, 0.45, 2)
        self.window_pitch = d.uniform(2.4, 3.2)
        self.window_width = d.uniform(1.0, 1.4, 2)
        self.casing = d.pick(("frame", "sill", "sill", "shutters"))
        self.bay = d.pick(("gabled", "canted", "gabled", "none"))
        self.bay_width = d.uniform(2.6, 3.2, 2)
        self.bay_reach = d.uniform(0.6, 1.0, 2)
        self.doors_inside = d.chance(0.5)
        self.porch_reach = d.uniform(1.1, 1.5, 2)
        self.garages = d.pick(("none", "flat", "shed", "hip"))
        self.garage_width = d.uniform(2.9, 3.4, 2)
        self.chimneys = d.pick(("middle", "ends"))
        self.draw_colours(d)


def build(p: Parameters, out: Assembly) -> None:
    """Builds the pair on a rectangle."""
    p.paint(out)
    x0, y0, x1, y1 = out.site.bounds
    left, right, back = x0 + _MARGIN, x1 - _MARGIN, y1 - _MARGIN
    front = y0 + min(2.4, 0.25 * (y1 - y0))
    deep = min(back - front, 10.0)
    has_garages = p.garages != "none" and right - left > 17.0
    side = p.garage_width * has_garages
    n = family_house.storeys_for(p.height, p.floor, deep, p.pitch_deg)
    wall_top = family_house.wall_top_for(p.height, p.floor, deep, n)
    shape = Roof(p.roof, eaves=0.4, verge=0.3, thickness=ROOF_M)
    main = Wing.at(
        left + side, front, right - side, front + deep, wall_top, p.height,
        shape,
    )  # fmt: skip
    bays = _gabled_bays(p, main) if p.bay == "gabled" else ()
    garages = []
    if has_garages:
        for a, b in ((left, main.x0 + 0.06), (main.x1 - 0.06, right)):
            area = (a, b, front + 1.5, main.y1 - 0.3)
            garages.append(family_house.garage_wing(p.garages, *area, p.height))
    boxes = (main, *bays, *garages)
    openings = family_house.window_rows(
        main, boxes, p.floor, n, p.window_pitch, p.window_width
    )
    _add_entrances(out, p, main, openings, y0)
    family_house.close_box(out, main, openings, p.floor, p.casing)
    for wing in bays:
        rows = Openings(wing, boxes)
        house_walls.add_rows(
            rows, (0,), p.floor, STOREY_M, n, 2.4, 1.5, margin=0.2
        )
        family_house.close_box(out, wing, rows, p.floor, p.casing)
    for garage in garages:
        family_house.add_garage(out, garage, boxes)
    _add_chimneys(out, p, main)


def _middles(p: Parameters, main: Wing) -> tuple[float, float]:
    """Returns the x of the bays in the main wall's coordinates [m]."""
    half = (main.x1 - main.x0) / 2
    # Doors take the middle or the ends; bays take the rest of each half.
    u = 0.6 * half if p.doors_inside else 0.36 * half
    offset = half - u if not p.doors_inside else u
    return half - offset, half + offset


def _gabled_bays(p: Parameters, main: Wing) -> tuple[Wing, ...]:
    width = min(p.bay_width, 0.45 * (main.x1 - main.x0) / 2)
    if width < 1.8:
        return ()
    rise = min(0.5 * width, main.top - main.wall_top - ROOF_M - 0.2)
    top = main.wall_top + ROOF_M + rise
    shape = Roof("gable", True, 0.2, 0.25, ROOF_M)
    middle = (main.y0 + main.y1) / 2
    fronts = (
        (main.x0 + x - width / 2, main.x0 + x + width / 2)
        for x in _middles(p, main)
    )
    y0 = main.y0 - p.bay_reach
    return tuple(
        Wing.at(a, y0, b, middle, main.wall_top, top, shape) for a, b in fronts
    )


def _add_entrances(
    out: Assembly, p: Parameters, main: Wing, openings: Openings, y0: float
) -> None:
    """Adds the doors under one roof or two, and bays on the ground."""
    wall = main.wall(0)
    half = wall.length / 2
    room = main.y0 - y0 - 0.1
    reach = min(p.porch_reach, room - 0.3)
    offset = 0.75 if p.doors_inside else half - 0.95
    eaves = p.floor + 2.35
    size = (reach, p.floor, eaves, eaves + 0.4)
    for x in (half - offset, half + offset):
        house_walls.add_door(out, main, openings, 0, x, p.floor)
        if not p.doors_inside:
            details.add_porch(out, wall, x - 0.85, x + 0.85, *size)
    if p.doors_inside:
        details.add_porch(
            out, wall, half - 1.6, half + 1.6, *size, roof="flat", posts=3
        )
    for x in _middles(p, main) if p.bay == "canted" else ():
        width = min(2.4, 0.5 * half)
        ends = (x - width / 2 - 0.1, x + width / 2 + 0.1)
        openings.clear(0, *ends, 0.0, p.floor + STOREY_M - 0.2)
        details.add_bay_window(
            out, wall, x, width, min(0.7, room - 0.1), 0.0,
            round(p.floor + 2.3, 2),
        )  # fmt: skip
    if p.doors_inside:
        step = (half - 1.4, half + 1.4, reach, reach + 0.28, 0.12)
        out.add_to("base", wall.standing(*step, bottom=True))


def _add_chimneys(out: Assembly, p: Parameters, main: Wing) -> None:
    x, y = main.center
    spots = [x]
    if p.chimneys != "middle":
        side = 0.7 if p.roof == "gable" else 0.35 * main.width
        spots = [main.x0 + side, main.x1 - side]
    for k, x in enumerate(spots):
        add_chimney(
            out, f"chimney_{k}", (x, y, main.top - 1.1),
            family_house.BRICKS[0], item="chimney_row",
            yaw=np.pi / 2, scale=(0.8, 1.0, 1.0),
        )  # fmt: skip
