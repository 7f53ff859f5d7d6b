"""The brick block: an old street block with shops and flats."""

from cns_drake.city.facades import (
    Band,
    Building,
    Facade,
    WallFrame,
    bays,
    canopies,
    piers,
    tiers,
)
from cns_drake.city.geometry import Finish

# Taller houses have their fire stairs inside.
_MOST_FLIGHTS = 8
# Height of the shared mesh of fire stairs, which is scaled to the storey [m].
_FIRE_STAIRS_STOREY_M = 3.4
# Finish of fire stairs.
_IRON = Finish((0.2, 0.2, 0.22))


class BrickBlock(Building):
    """The old brick block: punched windows, fire stairs, a water tower."""

    def draw(self) -> None:
        """Samples sizes and style."""
        site = self.site
        self.storey_height = self.uniform(3.1, 3.7)
        free = [
            k for k in range(1, len(site.outline)) if k not in site.blind_edges
        ]
        on_top = ["water_tower"] if self.chance(0.6) else []
        # Details of the windows: 0 mullions, 1 transoms, 2 ledges, 3 hoods.
        style = self.whole(0, 4)
        self.ground_height = self.uniform(4.0, 4.8, digits=2)
        self.pitch = max(self.uniform(2.3, 3.4), site.open_length / 46)
        self.window_width = self.uniform(1.0, 1.6, digits=2)
        self.sill = self.uniform(0.75, 0.95, digits=2)
        self.head = self.uniform(2.4, 2.7, digits=2)
        self.recess = self.uniform(0.18, 0.35, digits=2)
        self.corbels = self.chance(0.4)
        self.pilasters = self.chance(0.5)
        self.cornice_reach = self.uniform(0.5, 1.0, digits=2)
        self.parapet = self.uniform(0.7, 1.3, digits=2)
        self.stairs_edge = self.pick(free) if free else None
        self.stairs_at = self.uniform(0.3, 0.7)
        self.mullions = 1 if style == 0 else 0
        self.transom = 1.65 if style == 1 else None
        self.ledge = 0.12 if style == 2 else 0.0
        self.hood = 0.12 if style == 3 else 0.0
        self.sill_course = 0.1 if style < 2 else 0.0
        self.roof_items = [
            *on_top,
            "stair_house",
            "vents",
            "ac_unit",
            "skylight",
        ]

    def build(self) -> None:
        """Adds all parts of the brick block on a site of any outline."""
        outline, blind = self.site.outline, self.site.blind_edges
        bottom = _add_shops(self)
        room = self.height - self.ground_height - (self.parapet + 1.4)
        groups, per_group, storey = tiers.storey_groups(
            room, storey=self.storey_height
        )
        sash = bays.window(
            width=self.window_width,
            sill=self.sill,
            head=min(self.head, storey - 0.5),
            depth=self.recess,
            mullions=self.mullions,
            transom=self.transom,
            ledge=self.ledge,
            hood=self.hood,
        )
        layout = bays.rhythm(self.pitch, [sash], margin=0.9)
        course = Band(z0=self.sill - 0.2, z1=self.sill, depth=-self.sill_course)
        walls = Facade(
            storey,
            bands=(course,),
            layout=layout,
            glass=(self.recess,),
            plain=blind,
        )
        top = tiers.add_storeys(
            self, outline, walls, z0=bottom, groups=groups, per_group=per_group
        )
        if self.pilasters:
            strips = piers.pilasters(
                outline,
                pitch=self.pitch,
                margin=0.9,
                every=3,
                width=0.5,
                reach=0.2,
                z0=bottom,
                z1=top,
                skip=blind,
            )
            self.add("pilasters", strips)
        crown = round(self.height - top, 3)
        corbel = bays.bar(
            width=0.35, z0=0.0, z1=crown - self.parapet - 0.9, depth=-0.3
        )
        cornice = tiers.cornice(
            height=crown - self.parapet, reach=self.cornice_reach
        )
        layout = bays.rhythm(
            self.pitch, [corbel if self.corbels else bays.blank], margin=0.9
        )
        frieze = Facade(crown, bands=cornice, layout=layout, plain=blind)
        tiers.add_crown(
            self,
            outline,
            frieze,
            z0=top,
            parapet=self.parapet,
            items=self.roof_items,
        )
        if self.stairs_edge is not None and groups * per_group <= _MOST_FLIGHTS:
            wall = WallFrame(outline, self.stairs_edge)
            _add_fire_stairs(self, wall, bottom, storey, top)


def _add_shops(block: BrickBlock) -> float:
    outline, h = block.site.outline, block.ground_height
    front = WallFrame(outline, 0)
    shops = bays.rhythm(
        2 * block.pitch, [bays.shop_front(head=h - 1.1)], margin=0.6
    )
    window = bays.window(
        width=block.window_width, sill=1.4, head=2.9, depth=block.recess
    )
    back = bays.rhythm(block.pitch, [window], margin=0.8)
    entry = bays.with_middle(
        shops, bays.entrance(width=1.8, height=3.0), width=3.4
    )
    layout = bays.by_edge({0: entry}, shops if len(outline) > 4 else back)
    bands = (
        Band(z0=0.0, z1=0.4, depth=-0.08),
        Band(z0=h - 1.0, z1=h - 0.1, depth=-0.15),
    )
    glass = (0.35, block.recess)
    blind = block.site.blind_edges
    middle = front.length / 2
    cells = [
        (a, b)
        for a, b in bays.stretches(
            front.length, pitch=2 * block.pitch, margin=0.6
        )
        if b < middle - 1.7 or a > middle + 1.7
    ]
    shape = canopies.AwningShape(narrower=0.4, reach=1.2, z0=2.6, z1=h - 0.9)
    shades = canopies.awnings(front, cells, block.rng, share=0.6, shape=shape)
    canopies.add_awnings(block, shades)
    roof = canopies.front_canopy(outline, half=1.5, reach=1.3, z=3.1)
    ground = Facade(h, bands=bands, layout=layout, glass=glass, plain=blind)
    return tiers.add_ground(block, outline, ground, extras=[roof])


def _add_fire_stairs(
    block: BrickBlock,
    wall: WallFrame,
    bottom: float,
    storey: float,
    top: float,
) -> None:
    if wall.length < 9.0:
        return
    x, y = wall.point(2.8 + block.stairs_at * (wall.length - 5.6), 0.0)
    scale = (1.0, 1.0, round(storey / _FIRE_STAIRS_STOREY_M, 3))
    shape = block.shared("fire_stairs_flight", scale)
    for k in range(round((top - bottom) / storey) - 1):
        spot = (x, y, bottom + k * storey)
        part = f"fire_stairs_{k}"
        block.place(part, shape, spot, yaw=wall.heading, finish=_IRON)
