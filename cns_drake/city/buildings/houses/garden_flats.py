"""Flats in a garden: staggered houses under gables, stacks of verandas."""

from __future__ import annotations

import numpy as np

from cns_drake.city.buildings.house_parts import family_house
from cns_drake.city.buildings.house_parts.family_house import ROOF_M
from cns_drake.city.facades import bays, details, house_walls, wings
from cns_drake.city.facades.assembly import Assembly, Dice
from cns_drake.city.facades.house_walls import Openings
from cns_drake.city.facades.roofs import add_chimney
from cns_drake.city.facades.walls import Band
from cns_drake.city.facades.wings import Roof, Wing
from cns_drake.city.geometry.mesh import merge_meshes
from cns_drake.city.geometry.structures import MeshShape

_MARGIN = 0.5
_FLOOR = 0.3


class Parameters(family_house.Colours):
    """Parameters of a group of flats; lengths in metres.

    Attributes:
        height: of the highest ridge.
        roof: `gable` or `hip`.
        pitch_deg: wanted, of the roofs.
        section: wanted length of front for each house of the group.
        stagger: by which every other house stands back.
        crossed: whether every other house turns its gable to the front.
        veranda_width, veranda_reach: of the stacks of verandas.
    """

    def __init__(self, d: Dice) -> None:
        self.height = d.height
        self.roof = d.pick(("gable", "gable", "hip"))
        self.pitch_deg = d.uniform(22.0, 34.0)
        self.section = d.uniform(11.0, 15.0)
        self.stagger = round(d.uniform(0.0, 0.16) * d.depth, 2)
        self.crossed = d.chance(0.5)
        self.window_pitch = max(d.uniform(2.6, 3.4), d.width / 12)
        self.window_width = d.uniform(1.1, 1.6, 2)
        self.veranda_width = d.uniform(2.8, 4.0, 2)
        self.veranda_reach = d.uniform(1.4, 1.9, 2)
        self.casing = d.pick(("frame", "sill")) if d.width < 20.0 else "sill"
        self.draw_colours(d)


def build(p: Parameters, out: Assembly) -> None:
    """Builds the group along the front of a rectangle."""
    p.paint(out)
    x0, y0, x1, y1 = out.site.bounds
    left, right = x0 + _MARGIN, x1 - _MARGIN
    count = max(1, round((right - left) / p.section))
    bounds = np.linspace(left, right, count + 1)
    front = y0 + p.veranda_reach + 0.4
    deep = min(y1 - _MARGIN - front - p.stagger, 13.0)
    storeys = family_house.storeys_for(p.height, _FLOOR, deep, p.pitch_deg)
    storeys = max(2, storeys)
    wall_top = family_house.wall_top_for(p.height, _FLOOR, deep, storeys)
    boxes = []
    for k in range(count):
        y = front + p.stagger * (k % 2)
        top, cross = p.height, False
        if k % 2 and p.crossed:
            cross = True
            run = (bounds[1] - bounds[0]) / 2
            slope = 2 * (p.height - wall_top - ROOF_M) / deep
            top = min(wall_top + ROOF_M + slope * run, p.height - 0.1)
        shape = Roof(p.roof, cross, 0.4, 0.35, ROOF_M)
        area = (bounds[k] - 0.05 * (k > 0), y, bounds[k + 1], y + deep)
        boxes.append(Wing.at(*area, wall_top, top, shape))
    for k, wing in enumerate(boxes):
        _add_house(out, p, wing, boxes, storeys, k)


def _add_house(
    out: Assembly,
    p: Parameters,
    wing: Wing,
    boxes: list[Wing],
    storeys: int,
    number: int,
) -> None:
    openings = Openings(wing, boxes)
    storey = (wing.wall_top - 0.15 - _FLOOR) / storeys
    head = min(2.2, storey - 0.4)
    for edges, pitch in (((0, 2), p.window_pitch), ((1, 3), 4.5)):
        house_walls.add_rows(
            openings, edges, _FLOOR, storey, storeys, pitch, p.window_width,
            head=head,
        )  # fmt: skip
    wall = wing.wall(0)
    middle = wall.length / 2
    glass = house_walls.GLASS_M
    openings.clear(0, middle - 1.1, middle + 1.1, 0.0, wing.wall_top)
    if wing.wall_top > 6.0:
        stair = bays.window(1.8, _FLOOR + 2.6, wing.wall_top - 0.7, glass)
        openings.put(0, middle, 2.6, stair)
    house_walls.add_door(
        out, wing, openings, 0, middle, _FLOOR, width=1.2, lights=0.4
    )
    area = (middle - 1.4, middle + 1.4, -0.05, 1.3)
    out.add_to("trim", wall.box(*area, _FLOOR + 2.3, _FLOOR + 2.5))
    out.add_to("base", wall.standing(*area, _FLOOR, bottom=True))
    _add_verandas(out, p, wing, storeys, storey, number)
    house_walls.add_casings(out, wing, openings, (0,), p.casing)
    z = round(_FLOOR + storey, 2)
    bands = (Band(0.0, _FLOOR, -0.05), Band(z - 0.2, z, -0.05))
    low = wing.wall_top + 0.4
    attic = wings.attic_window(0.9, low, low + 1.0, glass, 2)
    openings.enclose(out, (glass,), bands, attic=attic)
    if not wing.roof.along_y:
        x, y = wing.x0 + 0.3 * wall.length, wing.center[1]
        spot, brick = (x, y, wing.top - 1.3), family_house.BRICKS[0]
        add_chimney(out, f"chimney_{number}", spot, brick)


def _add_verandas(
    out: Assembly,
    p: Parameters,
    wing: Wing,
    storeys: int,
    storey: float,
    number: int,
) -> None:
    """Adds verandas left and right of the entrance, one on another."""
    wall = wing.wall(0)
    width = min(p.veranda_width, wall.length / 2 - 2.2)
    if width < 2.0:
        return
    reach, top = p.veranda_reach, wing.wall_top - 0.1
    pieces, frame = [], []
    for x in (0.9 + width / 2, wall.length - 0.9 - width / 2):
        a, b = round(x - width / 2, 2), round(x + width / 2, 2)
        pieces.append(wall.place(details.balcony(a, b, reach, 0.0, 1.0)))
        for u in (a + 0.1, b - 0.1):
            spot = (u - 0.09, u + 0.09, reach - 0.2, reach - 0.02)
            frame.append(wall.standing(*spot, top - 0.1))
        lid = (a - 0.1, b + 0.1, -0.05, reach + 0.1, top - 0.25, top)
        frame.append(wall.box(*lid))
    part, rgb = f"house_{number}", family_house.TRIM
    mesh = merge_meshes(*pieces)
    shape = MeshShape(out.define(f"{part}_verandas", mesh))
    for k in range(1, storeys):
        at = (0.0, 0.0, _FLOOR + k * storey)
        out.place(f"{part}_verandas_{k}", shape, at, rgb=rgb)
    out.add(f"{part}_posts", *frame, rgb=rgb)
