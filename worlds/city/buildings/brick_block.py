"""The brick block: an old street block with shops and flats."""

from worlds.city.facades import (
    Band,
    Building,
    Facade,
    WallFrame,
    bays,
    canopies,
    foot_band,
    piers,
    tiers,
)
from worlds.shapes import Finish

# Greatest number of windows beside one another around the whole block.
_MOST_BAYS = 46
# Part of the crown below the parapet: the frieze and its cornice [m].
_FRIEZE_M = 1.4
# Distance of the outermost windows and pilasters from a corner [m].
_END_M = 0.9
# How far the details of windows (ledges and hoods) protrude [m].
_DETAIL_REACH_M = 0.12
# Distance of the outermost shops, and so of their awnings, from a corner [m].
_SHOP_END_M = 0.6
# Depth of the shop windows [m].
_SHOP_RECESS_M = 0.35
# Width of the stretch of the front for the door [m].
_DOOR_BAY_M = 3.4
# Taller houses have their fire stairs inside.
_MOST_FLIGHTS = 8
# Shorter walls have no fire stairs [m].
_LEAST_STAIRS_WALL_M = 9.0
# Distance of the middle of the fire stairs from the corners [m].
_STAIRS_END_M = 2.8
# Height of the shared mesh of fire stairs, which is scaled to the storey [m].
_FIRE_STAIRS_STOREY_M = 3.4
# Finish of fire stairs.
_IRON = Finish((0.2, 0.2, 0.22))


class BrickBlock(Building):
    """The old brick block: punched windows, fire stairs, a water tower."""

    def draw(self) -> None:
        site = self.site
        self.storey_height = self.uniform(3.1, 3.7)
        free = [
            k for k in range(1, len(site.outline)) if k not in site.blind_edges
        ]
        on_top = ["water_tower"] if self.chance(0.6) else []
        detail = self.pick(("mullion", "transom", "ledge", "hood"))
        self.ground_height = self.uniform(4.0, 4.8, digits=2)
        self.pitch = max(self.uniform(2.3, 3.4), site.open_length / _MOST_BAYS)
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
        self.mullions = 1 if detail == "mullion" else 0
        self.transom = 1.65 if detail == "transom" else None
        self.ledge = _DETAIL_REACH_M if detail == "ledge" else 0.0
        self.hood = _DETAIL_REACH_M if detail == "hood" else 0.0
        # How far a band below the windows protrudes.
        self.sill_course = 0.1 if detail in ("mullion", "transom") else 0.0
        self.roof_items = [
            *on_top,
            "stair_house",
            "vents",
            "ac_unit",
            "skylight",
        ]

    def build(self) -> None:
        """Adds all parts of the brick block on a site of any outline."""
        outline = self.site.outline
        bottom = _add_shops(self)
        frieze = self.parapet + _FRIEZE_M
        storeys = tiers.storey_groups(
            self.height - self.ground_height - frieze,
            storey=self.storey_height,
        )
        top = tiers.add_storeys(
            self,
            outline,
            _storey_walls(self, storeys.storey),
            z0=bottom,
            groups=storeys.groups,
            per_group=storeys.per_group,
        )
        if self.pilasters:
            _add_pilasters(self, bottom, top)
        _add_crown(self, top)
        if (
            self.stairs_edge is not None
            and storeys.num_storeys <= _MOST_FLIGHTS
        ):
            wall = WallFrame(outline, self.stairs_edge)
            _add_fire_stairs(self, wall, bottom, storeys.storey, top)


def _storey_walls(block: BrickBlock, storey: float) -> Facade:
    """Returns the walls of a storey of the height `storey` [m]."""
    window = bays.window(
        width=block.window_width,
        sill=block.sill,
        head=min(block.head, storey - 0.5),
        depth=block.recess,
        mullions=block.mullions,
        transom=block.transom,
        ledge=block.ledge,
        hood=block.hood,
    )
    course = Band(z0=block.sill - 0.2, z1=block.sill, depth=-block.sill_course)
    return Facade(
        storey,
        bands=(course,),
        layout=bays.rhythm(block.pitch, [window], margin=_END_M),
        glass=(block.recess,),
        plain=block.site.blind_edges,
    )


def _add_pilasters(block: BrickBlock, z0: float, z1: float) -> None:
    """Adds pilasters between every third pair of windows, from z0 to z1 [m]."""
    strips = piers.pilasters(
        block.site.outline,
        pitch=block.pitch,
        margin=_END_M,
        every=3,
        reach=0.2,
        z0=z0,
        z1=z1,
        skip=block.site.blind_edges,
    )
    block.add("pilasters", strips)


def _add_crown(block: BrickBlock, z0: float) -> None:
    """Adds the frieze with its cornice, and the roof behind the parapet."""
    height = round(block.height - z0, 3)
    eaves = height - block.parapet
    corbel = bays.bar(width=0.35, z0=0.0, z1=eaves - 0.9, depth=-0.3)
    bay = corbel if block.corbels else bays.blank
    walls = Facade(
        height,
        bands=tiers.cornice(height=eaves, reach=block.cornice_reach),
        layout=bays.rhythm(block.pitch, [bay], margin=_END_M),
        plain=block.site.blind_edges,
    )
    tiers.add_crown(
        block,
        block.site.outline,
        walls,
        z0=z0,
        parapet=block.parapet,
        items=block.roof_items,
    )


def _add_shops(block: BrickBlock) -> float:
    """Adds the ground floor with shops and awnings; returns its top [m].

    Shops are in front; on a site that is not a rectangle, they are on all
    sides.
    """
    outline, height = block.site.outline, block.ground_height
    shop_pitch = 2 * block.pitch
    shops = bays.rhythm(
        shop_pitch,
        [bays.shop_front(head=height - 1.1, depth=_SHOP_RECESS_M)],
        margin=_SHOP_END_M,
    )
    entrance = bays.entrance(width=1.8, height=3.0)
    front = bays.with_middle(shops, entrance, width=_DOOR_BAY_M)
    window = bays.window(
        width=block.window_width, sill=1.4, head=2.9, depth=block.recess
    )
    flats = bays.rhythm(block.pitch, [window], margin=0.8)
    walls = Facade(
        height,
        bands=(
            foot_band(height=0.4, reach=0.08),
            Band(z0=height - 1.0, z1=height - 0.1, depth=-0.15),
        ),
        layout=bays.by_edge({0: front}, shops if len(outline) > 4 else flats),
        glass=(_SHOP_RECESS_M, block.recess),
        plain=block.site.blind_edges,
    )
    _add_awnings(block, shop_pitch)
    canopy = canopies.front_canopy(outline, half=1.5, reach=1.3, z=3.1)
    return tiers.add_ground(block, outline, walls, extras=[canopy])


def _add_awnings(block: BrickBlock, pitch: float) -> None:
    """Adds awnings to some of the shops beside the door.

    `pitch` is the approximate width of a shop [m].
    """
    front = WallFrame(block.site.outline, 0)
    middle, half = front.length / 2, _DOOR_BAY_M / 2
    shops = [
        (start, end)
        for start, end in bays.stretches(
            front.length, pitch=pitch, margin=_SHOP_END_M
        )
        if end < middle - half or start > middle + half
    ]
    shape = canopies.AwningShape(
        narrower=0.4, reach=1.2, z0=2.6, z1=block.ground_height - 0.9
    )
    awnings = canopies.awnings(front, shops, block.rng, share=0.6, shape=shape)
    canopies.add_awnings(block, awnings)


def _add_fire_stairs(
    block: BrickBlock,
    wall: WallFrame,
    bottom: float,
    storey: float,
    top: float,
) -> None:
    """Adds one flight of fire stairs to each storey except the lowest.

    Args:
        wall: the wall with the stairs.
        bottom: height of the lowest flight [m].
        storey: height of a storey [m].
        top: height of the topmost storey's top [m].
    """
    if wall.length < _LEAST_STAIRS_WALL_M:
        return
    room = wall.length - 2 * _STAIRS_END_M
    x, y = wall.point(_STAIRS_END_M + block.stairs_at * room, 0.0)
    scale = (1.0, 1.0, round(storey / _FIRE_STAIRS_STOREY_M, 3))
    shape = block.shared("fire_stairs_flight", scale)
    for k in range(round((top - bottom) / storey) - 1):
        spot = (x, y, bottom + k * storey)
        part = f"fire_stairs_{k}"
        block.place(part, shape, spot, yaw=wall.heading, finish=_IRON)
