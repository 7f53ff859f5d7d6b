"""The shopping hall: blind walls, a glazed vault along its spine, portals."""

from __future__ import annotations

import numpy as np

from cns_drake.city.buildings.house_parts.openings import Openings
from cns_drake.city.buildings.parts import (
    bays,
    details,
    massing,
    pitched_roofs,
    wings,
)
from cns_drake.city.buildings.parts.facades import Band
from cns_drake.city.buildings.parts.materials import Materials
from cns_drake.city.buildings.parts.roof_equipment import equip_roof
from cns_drake.city.buildings.parts.site import Assembly, Dice
from cns_drake.city.buildings.parts.wings import Roof, Wing
from cns_drake.city.geometry.mesh import Mesh

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

    def __init__(self, d: Dice):
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


def build(p: Parameters, assembly: Assembly) -> None:
    """Builds the hall on a rectangle, its main portal in front."""
    materials = Materials(
        walls=p.rgb,
        anchor=p.second_rgb,
        glass=assembly.glass_rgb,
        accent=p.accent_rgb,
        steel=_STEEL,
        roof=p.accent_rgb,
    )
    x0, y0, x1, y1 = assembly.site.bounds
    front, back = y0 + 4.0, y1 - 0.4
    left, right = x0 + 0.4, x1 - 0.4
    flat = Roof("flat", parapet=0.9)
    hall = Wing.at(left, front, right, back, p.hall - 0.2, p.hall, flat)
    boxes = [hall]
    if p.anchor:
        boxes.append(_anchor(p, hall))
    _add_hall(materials, p, hall, boxes)
    if p.anchor:
        _add_anchor(materials, p, boxes[1], boxes)
    _add_spine(materials, p, hall)
    _add_portal(materials, p, hall)
    _add_docks(materials, p, hall)
    z = hall.top - 0.9
    for k, area in enumerate(_free_roofs(p, hall)):
        items = p.roof_items[k::2]
        equip_roof(assembly, area, z, items, clear=1.5, prefix=f"side_{k}_")
    materials.finish(assembly)


def _middle(hall: Wing) -> float:
    return (hall.x0 + hall.x1) / 2


def _anchor(p: Parameters, hall: Wing) -> Wing:
    """Returns the taller store at the back corner."""
    wide = (hall.x1 - hall.x0) / 2 - p.spine / 2 - 1.0
    deep = 0.45 * (hall.y1 - hall.y0)
    x0 = hall.x0 - 0.2 if p.anchor_left else hall.x1 - wide + 0.2
    top = min(p.height - 0.5, p.hall + 3.5)
    return Wing.at(
        x0, hall.y1 - deep, x0 + wide, hall.y1 + 0.2, top - 0.2, top,
        Roof("flat", parapet=0.8),
    )  # fmt: skip


def _free_roofs(p: Parameters, hall: Wing) -> list[np.ndarray]:
    """Returns the parts of the flat roof left and right of the vault."""
    x, half = _middle(hall), p.spine / 2 + 0.4
    deep = hall.y1 - hall.y0
    back = hall.y1 - (0.45 * deep if p.anchor else 0.0)
    backs = (back if p.anchor_left else hall.y1,
             hall.y1 if p.anchor_left else back)  # fmt: skip
    return [
        massing.rectangle(hall.x0, hall.y0, x - half, backs[0]),
        massing.rectangle(x + half, hall.y0, hall.x1, backs[1]),
    ]


def _add_hall(materials, p: Parameters, hall: Wing, boxes) -> None:
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
    openings.add_walls(materials, (_RECESS,), bands)
    wings.add_roof(materials, hall)


def _add_anchor(materials, p: Parameters, anchor: Wing, boxes) -> None:
    openings = Openings(anchor, boxes)
    high = bays.window(3.0, anchor.top - 2.6, anchor.top - 1.2, _RECESS)
    openings.row(range(4), p.hall + 0.2, 5.0, [high], 1.0)
    bands = (Band(0.0, 0.4, -0.06), Band(anchor.top - 0.6, anchor.top - 0.2,
                                         -0.12))  # fmt: skip
    openings.add_walls(materials, (_RECESS,), bands, "anchor")
    wings.add_roof(materials, anchor, material="anchor")
    wall = anchor.wall(3 if p.anchor_left else 1)
    z = anchor.top - 3.4
    sign = massing.box(
        0.35 * wall.length, 0.65 * wall.length, -0.02, 0.25, z, z + 1.6
    )
    materials.add("accent", wall.place(sign))


def _vault_line(p: Parameters, x: float, half: float, z: float, top: float):
    if p.vault == "gable":
        return pitched_roofs.gable_line(x - half, x + half, z, top)
    return pitched_roofs.barrel_line(x - half, x + half, z, top)


def _add_spine(materials, p: Parameters, hall: Wing) -> None:
    """Adds the glazed vault with its ribs along the middle."""
    x, half = _middle(hall), p.spine / 2
    z = p.hall - 0.9
    top = p.height - 0.12
    # A vault is less than half a circle.
    low = max(z + 0.35 * (top - z), top - 0.85 * half - 0.15)
    y0, y1 = hall.y0 + 2.0, hall.y1 - 0.5
    curb = massing.rectangle(x - half, y0, x + half, y1)
    materials.add("steel", massing.skirt(curb, curb, z - 0.05, low + 0.06))
    line = _vault_line(p, x, half, low + 0.15, top)
    glass = pitched_roofs.shell(line, y0, y1, 0.12, along_y=True)
    materials.add("glass", glass)
    for y in (y0, y1):
        # Walls below the ends of the vault.
        under = [(u - x + half, w - 0.12) for u, w in line]
        shield = pitched_roofs.gable_wall(under, 0.0, 2 * half, low)
        edge = 0 if y == y0 else 2
        wall = details.WallFrame(curb, edge)
        materials.add("glass", wall.place(shield))
    rib_line = [(u, w + 0.12) for u, w in line]
    for y, _ in bays.stretches(y1 - y0, 5.0, 0.0):
        rib = pitched_roofs.shell(
            rib_line,
            y0 + y - 0.12 + 0.12 * (y == 0),
            y0 + y + 0.12,
            0.3,
            along_y=True,
        )
        materials.add("steel", rib)


def _add_portal(materials, p: Parameters, hall: Wing) -> None:
    """Adds a tall glazed portal with a roof on columns in front."""
    x, half = _middle(hall), p.portal / 2
    top = min(p.height, p.hall + 0.62 * (p.height - p.hall))
    portal = Wing.at(
        x - half, hall.y0 - 1.2, x + half, hall.y0 + 2.6, top - 0.2, top,
        Roof("flat", parapet=0.6),
    )  # fmt: skip
    openings = Openings(portal, (hall,))
    width = 2 * half - 1.6
    mullions = max(2, round(width / 1.6))
    doors = bays.window(width, 0.05, 2.8, _RECESS, mullions=mullions)
    upper = bays.window(width, 3.1, top - 2.0, _RECESS, mullions=mullions,
                        transom=round((3.1 + top - 2.0) / 2, 2))  # fmt: skip
    openings.put(0, half, width + 0.8, doors)
    openings.add(0, upper(half - width / 2 - 0.4, half + width / 2 + 0.4))
    openings.add_walls(materials, (_RECESS,), material="accent")
    wings.add_roof(materials, portal, material="accent")
    wall = portal.wall(0)
    pieces: list[Mesh] = [
        massing.box(-0.6, 2 * half + 0.6, -0.02, 2.6, 4.2, 4.6)
    ]
    for u in np.linspace(0.4, 2 * half - 0.4, p.columns).tolist():
        shaft = massing.regular_polygon(0.2, 8, (u, 2.2))
        pieces.append(massing.prism(shaft, -massing.FOUNDATION_M, 4.25))
    materials.add("steel", *(wall.place(piece) for piece in pieces))
    sign = massing.box(
        0.6 * half, 1.4 * half, -0.02, 0.25, top - 1.7, top - 0.5
    )
    materials.add("steel", wall.place(sign))


def _add_docks(materials, p: Parameters, hall: Wing) -> None:
    """Adds loading doors behind, flush with the site's edge."""
    wall = hall.wall(2)
    side = 0.72 if p.anchor_left else 0.28
    count = max(1, min(p.docks, int(0.45 * wall.length / 4.4)))
    for k in range(count):
        # The back wall runs from the right to the left.
        u = (1.0 - side) * wall.length + (k - (count - 1) / 2) * 4.4
        gate = massing.box(u - 1.5, u + 1.5, -0.02, 0.08, 1.1, 4.2)
        frame = massing.box(u - 1.8, u + 1.8, -0.02, 0.3, 4.2, 4.5)
        materials.add("steel", wall.place(gate))
        materials.add("accent", wall.place(frame))
