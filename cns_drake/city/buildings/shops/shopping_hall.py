"""The shopping hall: blind walls, a glazed vault along its spine, portals."""

from __future__ import annotations

import numpy as np

from cns_drake.city.buildings.house_parts.openings import Openings
from cns_drake.city.buildings.parts import (
    bays,
    details,
    massing,
    pitched_roofs,
)
from cns_drake.city.buildings.parts.facades import Band
from cns_drake.city.buildings.parts.roof_equipment import equip_roof
from cns_drake.city.buildings.parts.site import Assembly, Dice
from cns_drake.city.buildings.parts.wings import Wing

_WALLS = (
    (0.80, 0.76, 0.68),
    (0.70, 0.69, 0.67),
    (0.66, 0.54, 0.44),
    (0.84, 0.83, 0.80),
)
_ACCENTS = (
    (0.58, 0.22, 0.20),
    (0.22, 0.36, 0.46),
    (0.40, 0.42, 0.44),
    (0.72, 0.54, 0.24),
)
_STEEL = (0.76, 0.77, 0.78)
_RECESS = 0.3


class Parameters:
    """Parameters of a shopping hall; lengths in metres.

    Attributes:
        height: of the vault, or of the portal where that is higher.
        hall: height of the halls' parapets.
        spine: width of the vault.
        vault: `barrel` or `gable`.
        portal: width of the portals at the ends of the spine.
        columns: in front of each portal.
        pitch: of the panels of the walls.
        shops: part of the front with show windows.
        anchor: whether one corner is a taller store.
        anchor_left: on which side.
        docks: loading doors behind.
    """

    def __init__(self, d: Dice) -> None:
        width, depth = d.width, d.depth
        spine = min(d.uniform(0.16, 0.22) * width, 14.0)
        self.height = d.height
        self.hall = round(d.uniform(0.58, 0.68) * d.height, 2)
        self.spine = round(spine, 2)
        self.vault = d.pick(("barrel", "gable"))
        self.portal = round(spine + d.uniform(2.0, 4.0), 2)
        self.columns = d.whole(2, 5)
        self.pitch = max(d.uniform(5.0, 7.0), (width + depth) / 20)
        self.shops = d.uniform(0.5, 1.0)
        self.anchor = d.chance(0.6)
        self.anchor_left = d.chance(0.5)
        self.docks = d.whole(2, 5)
        self.roof_items = d.some_of(
            "air_handler cooling_tower air_handler skylight skylight "
            "cooling_tower ac_unit vents",
            4,
            9,
        )
        self.rgb = d.pick(_WALLS)
        self.second_rgb = d.pick(_WALLS)
        self.accent_rgb = d.pick(_ACCENTS)


def build(p: Parameters, out: Assembly) -> None:
    """Builds the hall on a rectangle, its main portal in front."""
    out.paint(
        walls=p.rgb,
        anchor=p.second_rgb,
        glass=out.glass_rgb,
        accent=p.accent_rgb,
        steel=_STEEL,
        roof=p.accent_rgb,
    )
    x0, y0, x1, y1 = out.site.bounds
    area = (x0 + 0.4, y0 + 4.0, x1 - 0.4, y1 - 0.4)
    hall = Wing.flat(*area, p.hall, 0.9, rim=0.2)
    boxes = [hall]
    if p.anchor:
        boxes.append(_anchor(p, hall))
    _add_hall(out, p, hall, boxes)
    if p.anchor:
        _add_anchor(out, p, boxes[1], boxes)
    _add_spine(out, p, hall)
    _add_portal(out, p, hall)
    _add_docks(out, p, hall)
    for k, free in enumerate(_free_roofs(p, hall)):
        items, prefix = p.roof_items[k::2], f"side_{k}_"
        equip_roof(out, free, hall.floor, items, clear=1.5, prefix=prefix)


def _anchor(p: Parameters, hall: Wing) -> Wing:
    """Returns the taller store at the back corner."""
    wide = hall.width / 2 - p.spine / 2 - 1.0
    x0 = hall.x0 - 0.2 if p.anchor_left else hall.x1 - wide + 0.2
    top = min(p.height - 0.5, p.hall + 3.5)
    area = (x0, hall.y1 - 0.45 * hall.depth, x0 + wide, hall.y1 + 0.2)
    return Wing.flat(*area, top, 0.8, rim=0.2)


def _free_roofs(p: Parameters, hall: Wing) -> list[np.ndarray]:
    """Returns the parts of the flat roof left and right of the vault."""
    x, half = hall.center[0], p.spine / 2 + 0.4
    back = hall.y1 - (0.45 * hall.depth if p.anchor else 0.0)
    backs = (back, hall.y1) if p.anchor_left else (hall.y1, back)
    return [
        massing.rectangle(hall.x0, hall.y0, x - half, backs[0]),
        massing.rectangle(x + half, hall.y0, hall.x1, backs[1]),
    ]


def _add_hall(
    out: Assembly, p: Parameters, hall: Wing, boxes: list[Wing]
) -> None:
    """Adds walls of panels with show windows and a band of louvres."""
    openings = Openings(hall, boxes)
    show = bays.shop_front(3.6, _RECESS, door=False, riser=0.3)
    niche = bays.window(p.pitch - 1.6, 0.4, p.hall - 2.2, 0.15)
    doors = [show, niche] if p.shops < 0.75 else [show]
    openings.row((0,), 1.0, p.pitch, doors, 0.8)
    openings.row((1, 3), 1.0, p.pitch, [niche, show], 0.9)
    bands = (
        Band(0.0, 0.35, -0.06),
        Band(p.hall - 1.5, p.hall - 1.35, 0.08),
        Band(p.hall - 0.5, p.hall - 0.2, -0.15),
    )
    openings.enclose(out, (_RECESS,), bands)


def _add_anchor(
    out: Assembly, p: Parameters, anchor: Wing, boxes: list[Wing]
) -> None:
    openings, top = Openings(anchor, boxes), anchor.top
    high = bays.window(3.0, top - 2.6, top - 1.2, _RECESS)
    openings.row(range(4), p.hall + 0.2, 5.0, [high], 1.0)
    bands = (Band(0.0, 0.4, -0.06), Band(top - 0.6, top - 0.2, -0.12))
    openings.enclose(out, (_RECESS,), bands, "anchor")
    wall = anchor.wall(3 if p.anchor_left else 1)
    a, b, z = 0.35 * wall.length, 0.65 * wall.length, top - 3.4
    out.add_to("accent", wall.box(a, b, -0.02, 0.25, z, z + 1.6))


def _add_spine(out: Assembly, p: Parameters, hall: Wing) -> None:
    """Adds the glazed vault with its ribs along the middle."""
    x, half = hall.center[0], p.spine / 2
    z = p.hall - 0.9
    top = p.height - 0.12
    # A vault is less than half a circle.
    low = max(z + 0.35 * (top - z), top - 0.85 * half - 0.15)
    y0, y1 = hall.y0 + 2.0, hall.y1 - 0.5
    curb = massing.rectangle(x - half, y0, x + half, y1)
    out.add_to("steel", massing.skirt(curb, curb, z - 0.05, low + 0.06))
    sides = (x - half, x + half, low + 0.15, top)
    line = pitched_roofs.barrel_line(*sides)
    if p.vault == "gable":
        line = pitched_roofs.gable_line(*sides)
    glass = pitched_roofs.shell(line, y0, y1, 0.12, along_y=True)
    out.add_to("glass", glass)
    # Walls below the ends of the vault.
    under = [(u - x + half, w - 0.12) for u, w in line]
    shield = pitched_roofs.gable_wall(under, 0.0, 2 * half, low)
    for edge in (0, 2):
        out.add_to("glass", details.WallFrame(curb, edge).place(shield))
    rib_line = [(u, w + 0.12) for u, w in line]
    for y, _ in bays.stretches(y1 - y0, 5.0, 0.0):
        ends = (y0 + y - 0.12 + 0.12 * (y == 0), y0 + y + 0.12)
        rib = pitched_roofs.shell(rib_line, *ends, 0.3, along_y=True)
        out.add_to("steel", rib)


def _add_portal(out: Assembly, p: Parameters, hall: Wing) -> None:
    """Adds a tall glazed portal with a roof on columns in front."""
    x, half = hall.center[0], p.portal / 2
    top = min(p.height, p.hall + 0.62 * (p.height - p.hall))
    area = (x - half, hall.y0 - 1.2, x + half, hall.y0 + 2.6)
    portal = Wing.flat(*area, top, 0.6, rim=0.2)
    openings = Openings(portal, (hall,))
    width = 2 * half - 1.6
    mullions = max(2, round(width / 1.6))
    doors = bays.window(width, 0.05, 2.8, _RECESS, mullions=mullions)
    upper = bays.window(width, 3.1, top - 2.0, _RECESS, mullions=mullions,
                        transom=round((3.1 + top - 2.0) / 2, 2))  # fmt: skip
    openings.put(0, half, width + 0.8, doors)
    openings.add(0, upper(half - width / 2 - 0.4, half + width / 2 + 0.4))
    openings.enclose(out, (_RECESS,), material="accent")
    wall = portal.wall(0)
    out.add_to("steel", wall.box(-0.6, 2 * half + 0.6, -0.02, 2.6, 4.2, 4.6))
    for u in np.linspace(0.4, 2 * half - 0.4, p.columns).tolist():
        shaft = massing.regular_polygon(0.2, 8, (u, 2.2))
        column = massing.prism(shaft, -massing.FOUNDATION_M, 4.25)
        out.add_to("steel", wall.place(column))
    sign = (0.6 * half, 1.4 * half, -0.02, 0.25, top - 1.7, top - 0.5)
    out.add_to("steel", wall.box(*sign))


def _add_docks(out: Assembly, p: Parameters, hall: Wing) -> None:
    """Adds loading doors behind, flush with the site's edge."""
    wall = hall.wall(2)
    side = 0.72 if p.anchor_left else 0.28
    count = max(1, min(p.docks, int(0.45 * wall.length / 4.4)))
    for k in range(count):
        # The back wall runs from the right to the left.
        u = (1.0 - side) * wall.length + (k - (count - 1) / 2) * 4.4
        out.add_to("steel", wall.box(u - 1.5, u + 1.5, -0.02, 0.08, 1.1, 4.2))
        out.add_to("accent", wall.box(u - 1.8, u + 1.8, -0.02, 0.3, 4.2, 4.5))
