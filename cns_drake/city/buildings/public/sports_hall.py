"""The sports hall: a wide roof on outer frames, a low front with changing
rooms, bands of high windows."""

from __future__ import annotations

from cns_drake.city.buildings.house_parts.openings import (
    Openings,
    free_stretches,
)
from cns_drake.city.buildings.parts import bays, massing, pitched_roofs, wings
from cns_drake.city.buildings.parts.facades import Band
from cns_drake.city.buildings.parts.materials import Materials
from cns_drake.city.buildings.parts.roof_equipment import equip_roof
from cns_drake.city.buildings.parts.site import Assembly, Dice
from cns_drake.city.buildings.parts.wings import Roof, Wing

_WALLS = ((0.80, 0.78, 0.74), (0.62, 0.44, 0.36), (0.66, 0.70, 0.72))
_ROOFS = ((0.42, 0.46, 0.50), (0.52, 0.30, 0.24), (0.36, 0.44, 0.40))
_FRAMES = ((0.70, 0.24, 0.18), (0.86, 0.85, 0.82), (0.46, 0.36, 0.26),
           (0.22, 0.36, 0.52))  # fmt: skip
_RECESS = 0.2
_MARGIN = 0.6


class Parameters:
    """Parameters of a sports hall; lengths in metres.

    Attributes:
        height: of the ridge, the ribs on it included.
        roof: `barrel`, `gable`, `shed` or `butterfly` (two sheds that
            fall to the middle).
        wall: height of the walls as a part of the ridge's.
        bay: distance between the frames.
        frame_reach: how far the frames stand out of the walls.
        annex: depth of the low front; 0 for none.
        annex_height: [m].
        glazed: whether the gables are glazed.
    """

    def __init__(self, d: Dice):
        depth = d.depth
        self.height = d.height
        self.roof = d.pick(("barrel", "gable", "shed", "butterfly"))
        self.wall = d.uniform(0.58, 0.7)
        self.bay = max(d.uniform(5.0, 7.5), (d.width + depth) / 18)
        self.frame_reach = d.uniform(0.35, 0.6, 2)
        self.annex = (
            round(min(d.uniform(5.0, 8.0), 0.3 * depth), 2)
            if d.chance(0.8)
            else 0.0
        )
        self.annex_height = round(min(d.uniform(3.4, 4.2), 0.5 * d.height), 2)
        self.glazed = d.chance(0.6)
        self.roof_items = d.some_of("air_handler vents ac_unit", 1, 4)
        self.rgb = d.pick(_WALLS)
        self.roof_rgb = d.pick(_ROOFS)
        self.frame_rgb = d.pick(_FRAMES)


def build(p: Parameters, assembly: Assembly) -> None:
    """Builds the hall on a rectangle, its entrance in front."""
    materials = Materials(
        walls=p.rgb,
        glass=assembly.glass_rgb,
        roof=p.roof_rgb,
        frames=p.frame_rgb,
    )
    x0, y0, x1, y1 = assembly.site.bounds
    front = y0 + (p.annex + 1.6 if p.annex else 1.8)
    area = (x0 + _MARGIN, front, x1 - _MARGIN, y1 - _MARGIN)
    along_y = area[3] - area[1] > area[2] - area[0]
    halls = _halls(p, area, along_y)
    for hall in halls:
        _add_hall(materials, p, hall, halls)
    if p.annex:
        _add_annex(assembly, materials, p, halls, y0)
    else:
        _add_porch(materials, p, halls)
    materials.finish(assembly)


def _halls(p: Parameters, area, along_y: bool) -> list[Wing]:
    """Returns one hall, or the two halves of a butterfly."""
    x0, y0, x1, y1 = area
    top = p.height - 0.15
    span = (x1 - x0) if along_y else (y1 - y0)
    rise = {"barrel": 0.22 * span, "gable": 0.2 * span}.get(p.roof, 0.1 * span)
    wall = max(p.wall * top, top - 0.3 - rise)
    thickness = 0.3
    if p.roof != "butterfly":
        eaves = 0.0 if p.roof == "barrel" else 0.4
        roof = Roof(p.roof, along_y, eaves, 0.4, thickness)
        return [Wing.at(x0, y0, x1, y1, wall, top, roof)]
    middle = (x0 + x1) / 2 if along_y else (y0 + y1) / 2
    falling = Roof("shed", along_y, 0.0, 0.4, thickness, falling=True)
    rising = Roof("shed", along_y, 0.0, 0.4, thickness)
    if along_y:
        return [
            Wing.at(x0, y0, middle + 0.02, y1, wall, top, falling),
            Wing.at(middle - 0.02, y0, x1, y1, wall, top, rising),
        ]
    return [
        Wing.at(x0, y0, x1, middle + 0.02, wall, top, falling),
        Wing.at(x0, middle - 0.02, x1, y1, wall, top, rising),
    ]


def _add_hall(materials, p: Parameters, hall: Wing, halls) -> None:
    openings = Openings(hall, halls)
    high = hall.wall_top
    band = bays.window(p.bay - 0.9, high - 2.4, high - 0.6, _RECESS, mullions=1)
    low = 0.5 if p.annex == 0.0 else p.annex_height + 0.4
    tall = bays.window(
        p.bay - 0.9, max(low, 0.3 * high), high - 0.6, _RECESS, mullions=1,
        transom=high - 1.6,
    )  # fmt: skip
    ends = hall.gables
    sides = [k for k in range(4) if k not in ends]
    openings.row(sides, high - 1.0, p.bay, [band], 0.5)
    openings.row(ends, high - 1.0, p.bay, [tall if p.glazed else band], 0.9)
    openings.put(2, 2.6, 2.6, bays.gate(1.9, 2.3, 0.2))
    openings.add_walls(materials, (_RECESS,), (Band(0.0, 0.5, -0.08),))
    wings.add_roof(materials, hall)
    _add_frames(materials, p, hall, halls)


def _add_frames(materials, p: Parameters, hall: Wing, halls) -> None:
    """Adds posts along the walls, and ribs over the roof."""
    reach = p.frame_reach - 0.02
    along_y = hall.roof.along_y
    for edge in (k for k in range(4) if k not in hall.gables):
        wall = hall.wall(edge)
        for a, b in free_stretches(hall, edge, halls, 0.5):
            cells = bays.stretches(b - a, p.bay, 0.5)
            for u, _ in cells[1:]:
                x = a + u
                foot = massing.rectangle(x - 0.2, -0.02, x + 0.2, reach)
                head = massing.rectangle(x - 0.2, -0.02, x + 0.2, 0.3 * reach)
                materials.add(
                    "frames",
                    wall.place(massing.box(
                        x - 0.2, x + 0.2, -0.02, reach,
                        -massing.FOUNDATION_M, 0.0, bottom=False,
                    )),
                    wall.place(
                        massing.frustum(foot, head, 0.0, hall.wall_top)
                    ),
                )  # fmt: skip
    line = [(u, z + 0.15) for u, z in hall.line]
    if along_y:
        start, end = hall.y0, hall.y1
    else:
        start, end = hall.x0, hall.x1
    cells = bays.stretches(end - start, p.bay, 0.5)
    for u, _ in cells[1:]:
        rib = pitched_roofs.shell(
            line, start + u - 0.18, start + u + 0.18, 0.25, along_y=along_y
        )
        materials.add("frames", rib)


def _add_annex(assembly, materials, p: Parameters, halls, y0) -> None:
    """Adds the low front: an entrance between changing rooms."""
    hall = halls[0]
    x0 = min(w.x0 for w in halls)
    x1 = max(w.x1 for w in halls)
    margin = 0.06 * (x1 - x0)
    annex = Wing.at(
        x0 + margin, y0 + 1.6, x1 - margin, hall.y0 + 0.05,
        p.annex_height - 0.1, p.annex_height, Roof("flat", parapet=0.4),
    )  # fmt: skip
    openings = Openings(annex, halls)
    small = bays.window(1.6, 1.5, 2.5, _RECESS)
    openings.row((0, 1, 3), 1.0, 3.6, [small], 0.8)
    wide = annex.x1 - annex.x0
    hall_width = min(7.0, 0.35 * wide)
    glazing = bays.window(
        hall_width - 0.6, 0.05, p.annex_height - 0.8, _RECESS, mullions=3
    )
    openings.put(0, wide / 2, hall_width, glazing)
    openings.add_walls(materials, (_RECESS,), (Band(0.0, 0.3, -0.05),))
    wings.add_roof(materials, annex)
    z = p.annex_height - 0.65
    lid = massing.box(
        wide / 2 - hall_width / 2 - 1.0, wide / 2 + hall_width / 2 + 1.0,
        -0.02, 1.5, z, z + 0.25,
    )  # fmt: skip
    materials.add("frames", annex.wall(0).place(lid))
    top = annex.top - annex.roof.parapet
    equip_roof(assembly, annex.outline, top, p.roof_items, clear=0.5)


def _add_porch(materials, p: Parameters, halls) -> None:
    wall = halls[0].wall(0)
    x = wall.length / 2
    doors = massing.box(x - 2.2, x + 2.2, -0.02, 1.5, 2.7, 3.0)
    materials.add("frames", wall.place(doors))
    for u in (x - 2.1, x + 2.1):
        post = (u - 0.12, u + 0.12, 1.2, 1.44)
        piece = massing.box(*post, -massing.FOUNDATION_M, 2.75, bottom=False)
        materials.add("frames", wall.place(piece))
    leaf = massing.box(x - 1.6, x + 1.6, -0.02, 0.1, 0.0, 2.5)
    materials.add("glass", wall.place(leaf))
