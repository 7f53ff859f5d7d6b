"""The old brick block: punched windows, cornice, fire stairs, water tower."""

from __future__ import annotations

from cns_drake.city.buildings.parts import bays, details, tiers
from cns_drake.city.buildings.parts.facades import Band, Facade
from cns_drake.city.buildings.parts.roof_equipment import equip_roof
from cns_drake.city.buildings.parts.site import Assembly, Dice
from cns_drake.city.geometry.structures import MeshShape

_BRICKS = (
    (0.56, 0.33, 0.27),
    (0.62, 0.42, 0.33),
    (0.48, 0.31, 0.27),
    (0.69, 0.55, 0.43),
)

# Higher houses have their fire stairs inside.
_MOST_FLIGHTS = 8


class Parameters:
    """Parameters of a brick block; lengths in metres."""

    def __init__(self, d: Dice):
        storey = d.uniform(3.1, 3.7)
        free = [
            k
            for k in range(1, len(d.site.outline))
            if k not in d.site.blind_edges
        ]
        items = ["stair_house", "vents", "ac_unit", "skylight"]
        if d.chance(0.6):
            items.insert(0, "water_tower")
        style = d.whole(0, 4)
        self.height = d.height
        self.ground_height = d.uniform(4.0, 4.8, 2)
        self.storey_height = storey
        self.pitch = max(d.uniform(2.3, 3.4), d.site.open_length / 46)
        self.window_width = d.uniform(1.0, 1.6, 2)
        self.sill = d.uniform(0.75, 0.95, 2)
        self.head = d.uniform(2.4, 2.7, 2)
        self.recess = d.uniform(0.18, 0.35, 2)
        self.mullions = 1 if style == 0 else 0
        self.transom = 1.65 if style == 1 else None
        self.ledge = 0.12 if style == 2 else 0.0
        self.hood = 0.12 if style == 3 else 0.0
        self.sill_course = 0.1 if style < 2 else 0.0
        self.corbels = d.chance(0.4)
        self.pilasters = d.chance(0.5)
        self.cornice_reach = d.uniform(0.5, 1.0, 2)
        self.parapet = d.uniform(0.7, 1.3, 2)
        self.stairs_edge = d.pick(free) if free else None
        self.stairs_at = d.uniform(0.3, 0.7)
        self.roof_items = tuple(items)
        self.rgb = d.pick(_BRICKS)


def build(p: Parameters, assembly: Assembly) -> None:
    """Builds the block on any outline."""
    site = assembly.site
    outline = site.outline
    crown_height = p.parapet + 1.4
    groups, per_group, storey = tiers.divided(
        p.height - p.ground_height - crown_height, p.storey_height
    )
    front = details.WallFrame(outline, 0)
    shops = bays.rhythm(
        2 * p.pitch, [bays.shop_front(p.ground_height - 1.1)], margin=0.6
    )
    door = bays.entrance(1.8, 3.0)
    back = bays.rhythm(
        p.pitch, [bays.window(p.window_width, 1.4, 2.9, p.recess)], margin=0.8
    )
    belt = Band(p.ground_height - 1.0, p.ground_height - 0.1, -0.15)
    ground = Facade(
        p.ground_height,
        (Band(0.0, 0.4, -0.08), belt),
        bays.by_edge(
            {0: bays.with_middle(shops, door, 3.4)},
            shops if len(outline) > 4 else back,
        ),
        glass=(0.35, p.recess),
        plain=site.blind_edges,
    )
    middle = front.length / 2
    roof = details.canopy(middle - 1.5, middle + 1.5, 1.3, 3.1)
    shades = []
    for x0, x1 in bays.stretches(front.length, 2 * p.pitch, 0.6):
        clear = x1 < middle - 1.7 or x0 > middle + 1.7
        if clear and assembly.rng.random() < 0.6:
            shade = details.awning(
                x0 + 0.4, x1 - 0.4, 1.2, 2.6, p.ground_height - 0.9
            )
            shades.append(front.place(shade))
    tiers.add_awnings(assembly, shades)
    top = tiers.add_ground(assembly, outline, ground, [front.place(roof)])

    sash = bays.window(
        p.window_width,
        p.sill,
        min(p.head, storey - 0.5),
        p.recess,
        mullions=p.mullions,
        transom=p.transom,
        ledge=p.ledge,
        hood=p.hood,
    )
    layout = bays.rhythm(p.pitch, [sash], margin=0.9)
    course = Band(p.sill - 0.2, p.sill, -p.sill_course)
    walls = Facade(
        storey, (course,), layout, (p.recess,), plain=site.blind_edges
    )
    bottom = top
    top = tiers.add_storeys(assembly, outline, walls, top, groups, per_group)

    if p.pilasters:
        strips = details.pilasters(
            outline, p.pitch, 0.9, 3, 0.5, 0.2, bottom, top, site.blind_edges
        )
        assembly.add("pilasters", strips)
    crown_height = round(p.height - top, 3)
    corbel = bays.bar(0.35, 0.0, crown_height - p.parapet - 0.9, -0.3)
    frieze = Facade(
        crown_height,
        tiers.cornice(crown_height - p.parapet, p.cornice_reach),
        bays.rhythm(p.pitch, [corbel if p.corbels else bays.blank], 0.9),
        plain=site.blind_edges,
    )
    roof = tiers.add_crown(assembly, outline, frieze, top, p.parapet)
    equip_roof(assembly, outline, roof, p.roof_items)
    if p.stairs_edge is not None and groups * per_group <= _MOST_FLIGHTS:
        _add_fire_stairs(assembly, p, site, bottom, storey, top)


def _add_fire_stairs(assembly, p, site, bottom, storey, top) -> None:
    wall = details.WallFrame(site.outline, p.stairs_edge)
    if wall.length < 9.0:
        return
    x, y = wall.point(2.8 + p.stairs_at * (wall.length - 5.6), 0.0)
    assembly.share("fire_stairs_flight", details.fire_stairs_flight())
    scale = (1.0, 1.0, round(storey / details.FIRE_STAIRS_STOREY_M, 3))
    for k in range(round((top - bottom) / storey) - 1):
        assembly.place(
            f"fire_stairs_{k}",
            MeshShape("fire_stairs_flight", scale),
            (x, y, bottom + k * storey),
            wall.heading,
            rgb=(0.2, 0.2, 0.22),
        )
