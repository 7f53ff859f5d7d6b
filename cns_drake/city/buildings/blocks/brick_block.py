"""The old brick block: punched windows, cornice, fire stairs, water tower."""

from __future__ import annotations

from cns_drake.city.facades import bays, details, tiers
from cns_drake.city.facades.assembly import Assembly, Dice
from cns_drake.city.facades.roofs import equip_roof
from cns_drake.city.facades.walls import Band, Facade

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

    def __init__(self, d: Dice) -> None:
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


def build(p: Parameters, out: Assembly) -> None:
    """Builds the block on any outline."""
    outline, blind = out.site.outline, out.site.blind_edges
    bottom = _add_shops(out, p)
    room = p.height - p.ground_height - (p.parapet + 1.4)
    groups, per_group, storey = tiers.divided(room, p.storey_height)
    sash = bays.window(
        p.window_width, p.sill, min(p.head, storey - 0.5), p.recess,
        mullions=p.mullions, transom=p.transom, ledge=p.ledge, hood=p.hood,
    )  # fmt: skip
    layout = bays.rhythm(p.pitch, [sash], margin=0.9)
    course = Band(p.sill - 0.2, p.sill, -p.sill_course)
    walls = Facade(storey, (course,), layout, (p.recess,), blind)
    top = tiers.add_storeys(out, outline, walls, bottom, groups, per_group)
    if p.pilasters:
        strips = details.pilasters(
            outline, p.pitch, 0.9, 3, 0.5, 0.2, bottom, top, blind
        )
        out.add("pilasters", strips)
    crown = round(p.height - top, 3)
    corbel = bays.bar(0.35, 0.0, crown - p.parapet - 0.9, -0.3)
    cornice = tiers.cornice(crown - p.parapet, p.cornice_reach)
    layout = bays.rhythm(p.pitch, [corbel if p.corbels else bays.blank], 0.9)
    frieze = Facade(crown, cornice, layout, plain=blind)
    roof = tiers.add_crown(out, outline, frieze, top, p.parapet)
    equip_roof(out, outline, roof, p.roof_items)
    if p.stairs_edge is not None and groups * per_group <= _MOST_FLIGHTS:
        wall = details.WallFrame(outline, p.stairs_edge)
        _add_fire_stairs(out, p, wall, bottom, storey, top)


def _add_shops(out: Assembly, p: Parameters) -> float:
    outline, h = out.site.outline, p.ground_height
    front = details.WallFrame(outline, 0)
    shops = bays.rhythm(2 * p.pitch, [bays.shop_front(h - 1.1)], margin=0.6)
    window = bays.window(p.window_width, 1.4, 2.9, p.recess)
    back = bays.rhythm(p.pitch, [window], margin=0.8)
    entry = bays.with_middle(shops, bays.entrance(1.8, 3.0), 3.4)
    layout = bays.by_edge({0: entry}, shops if len(outline) > 4 else back)
    bands = (Band(0.0, 0.4, -0.08), Band(h - 1.0, h - 0.1, -0.15))
    glass, blind = (0.35, p.recess), out.site.blind_edges
    middle = front.length / 2
    cells = [
        (a, b)
        for a, b in bays.stretches(front.length, 2 * p.pitch, 0.6)
        if b < middle - 1.7 or a > middle + 1.7
    ]
    shape = (0.4, 1.2, 2.6, h - 0.9)
    shades = details.awnings(front, cells, out.rng, 0.6, shape)
    tiers.add_awnings(out, shades)
    roof = details.front_canopy(outline, 1.5, 1.3, 3.1)
    ground = Facade(h, bands, layout, glass, blind)
    return tiers.add_ground(out, outline, ground, [roof])


def _add_fire_stairs(
    out: Assembly,
    p: Parameters,
    wall: details.WallFrame,
    bottom: float,
    storey: float,
    top: float,
) -> None:
    if wall.length < 9.0:
        return
    x, y = wall.point(2.8 + p.stairs_at * (wall.length - 5.6), 0.0)
    scale = (1.0, 1.0, round(storey / details.FIRE_STAIRS_STOREY_M, 3))
    shape = out.shared("fire_stairs_flight", scale)
    for k in range(round((top - bottom) / storey) - 1):
        spot = (x, y, bottom + k * storey)
        part = f"fire_stairs_{k}"
        out.place(part, shape, spot, wall.heading, rgb=(0.2, 0.2, 0.22))
