"""Street blocks: shops on the ground floor, flats or offices above."""

from collections.abc import Sequence

import numpy as np

from cns_drake.city.facades import (
    Band,
    Building,
    Facade,
    Relief,
    WallFrame,
    balconies,
    bays,
    canopies,
    equip_roof,
    outlines,
    piers,
    solids,
    tiers,
)
from cns_drake.city.geometry import Finish
from cns_drake.city.geometry.mesh import Mesh

# Taller houses have their fire stairs inside.
_MOST_FLIGHTS = 8
# Numbers of the corners of a rectangle at which a corner building stands.
_FRONT_LEFT = 0
_FRONT_RIGHT = 1
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
        # 0 mullions, 1 transoms, 2 ledges, 3 hoods.
        style = self.whole(0, 4)
        self.ground_height = self.uniform(4.0, 4.8, 2)
        self.pitch = max(self.uniform(2.3, 3.4), site.open_length / 46)
        self.window_width = self.uniform(1.0, 1.6, 2)
        self.sill = self.uniform(0.75, 0.95, 2)
        self.head = self.uniform(2.4, 2.7, 2)
        self.recess = self.uniform(0.18, 0.35, 2)
        self.corbels = self.chance(0.4)
        self.pilasters = self.chance(0.5)
        self.cornice_reach = self.uniform(0.5, 1.0, 2)
        self.parapet = self.uniform(0.7, 1.3, 2)
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
            room, self.storey_height
        )
        sash = bays.window(
            self.window_width, self.sill, min(self.head, storey - 0.5),
            self.recess, mullions=self.mullions, transom=self.transom,
            ledge=self.ledge, hood=self.hood,
        )  # fmt: skip
        layout = bays.rhythm(self.pitch, [sash], margin=0.9)
        course = Band(self.sill - 0.2, self.sill, -self.sill_course)
        walls = Facade(storey, (course,), layout, (self.recess,), blind)
        top = tiers.add_storeys(self, outline, walls, bottom, groups, per_group)
        if self.pilasters:
            strips = piers.pilasters(
                outline, self.pitch, 0.9, 3, 0.5, 0.2, bottom, top, blind
            )
            self.add("pilasters", strips)
        crown = round(self.height - top, 3)
        corbel = bays.bar(0.35, 0.0, crown - self.parapet - 0.9, -0.3)
        cornice = tiers.cornice(crown - self.parapet, self.cornice_reach)
        layout = bays.rhythm(
            self.pitch, [corbel if self.corbels else bays.blank], 0.9
        )
        frieze = Facade(crown, cornice, layout, plain=blind)
        tiers.add_crown(
            self, outline, frieze, top, self.parapet, items=self.roof_items
        )
        if self.stairs_edge is not None and groups * per_group <= _MOST_FLIGHTS:
            wall = WallFrame(outline, self.stairs_edge)
            _add_fire_stairs(self, wall, bottom, storey, top)


def _add_shops(p: BrickBlock) -> float:
    outline, h = p.site.outline, p.ground_height
    front = WallFrame(outline, 0)
    shops = bays.rhythm(2 * p.pitch, [bays.shop_front(h - 1.1)], margin=0.6)
    window = bays.window(p.window_width, 1.4, 2.9, p.recess)
    back = bays.rhythm(p.pitch, [window], margin=0.8)
    entry = bays.with_middle(shops, bays.entrance(1.8, 3.0), 3.4)
    layout = bays.by_edge({0: entry}, shops if len(outline) > 4 else back)
    bands = (Band(0.0, 0.4, -0.08), Band(h - 1.0, h - 0.1, -0.15))
    glass = (0.35, p.recess)
    blind = p.site.blind_edges
    middle = front.length / 2
    cells = [
        (a, b)
        for a, b in bays.stretches(front.length, 2 * p.pitch, 0.6)
        if b < middle - 1.7 or a > middle + 1.7
    ]
    shape = (0.4, 1.2, 2.6, h - 0.9)
    shades = canopies.awnings(front, cells, p.rng, 0.6, shape)
    canopies.add_awnings(p, shades)
    roof = canopies.front_canopy(outline, 1.5, 1.3, 3.1)
    ground = Facade(h, bands, layout, glass, blind)
    return tiers.add_ground(p, outline, ground, [roof])


def _add_fire_stairs(
    p: BrickBlock,
    wall: WallFrame,
    bottom: float,
    storey: float,
    top: float,
) -> None:
    if wall.length < 9.0:
        return
    x, y = wall.point(2.8 + p.stairs_at * (wall.length - 5.6), 0.0)
    scale = (1.0, 1.0, round(storey / _FIRE_STAIRS_STOREY_M, 3))
    shape = p.shared("fire_stairs_flight", scale)
    for k in range(round((top - bottom) / storey) - 1):
        spot = (x, y, bottom + k * storey)
        part = f"fire_stairs_{k}"
        p.place(part, shape, spot, wall.heading, finish=_IRON)


_ROOF_ITEMS = ("stair_house", "skylight", "vents", "ac_unit")


class CornerBuilding(Building):
    """The corner house: a curved front, arched windows, a dome or a lantern.

    `corner` is the rounded corner of the rectangle (`_FRONT_LEFT` or
    `_FRONT_RIGHT`) and `radius` its radius.
    """

    def draw(self) -> None:
        """Samples sizes and style."""
        site = self.site
        side = min(site.width, site.depth, 24.0)
        self.corner = self.pick(
            site.free_corners or [_FRONT_LEFT, _FRONT_RIGHT]
        )
        self.radius = round(self.uniform(0.3, 0.42) * side, 1)
        self.ground_height = self.uniform(4.6, 5.4, 2)
        self.first_height = self.uniform(4.2, 4.8, 2)
        self.storey_height = self.uniform(3.3, 3.8)
        self.pitch = max(self.uniform(2.5, 3.2), site.open_length / 36)
        self.window_width = self.uniform(1.1, 1.5, 2)
        self.recess = self.uniform(0.22, 0.4, 2)
        self.hood = 0.1 if self.chance(0.4) else 0.0
        self.pilasters = self.chance(0.6)
        self.balcony = self.chance(0.7)
        self.dome = self.pick(("dome", "cone", "lantern"))
        self.dome_height = round(self.uniform(0.17, 0.24) * self.height, 1)
        self.cornice_reach = self.uniform(0.5, 0.9, 2)

    def build(self) -> None:
        """Adds all parts of the corner house.

        The building's site must be a rectangle.
        """
        site = self.site
        if self.corner not in site.free_corners:
            site = site.detached(self.kind.overhang)
        rectangle = site.outline
        plan = outlines.rounded(rectangle, {self.corner: self.radius}, 2.8)
        blind = outlines.edges_on(plan, rectangle, site.blind_edges)
        bottom = _add_corner_building_shops(self, plan, blind)
        top = _add_first_floor(self, plan, blind, bottom)
        room = self.height - self.dome_height - 2.2 - top
        groups, per_group, storey = tiers.storey_groups(
            room, self.storey_height
        )
        window = bays.window(
            self.window_width, 0.8, storey - 0.7, self.recess, hood=self.hood
        )
        rows = bays.rhythm(self.pitch, [window], 0.3)
        walls = Facade(
            storey, (Band(0.6, 0.8, -0.1),), rows, (self.recess,), blind
        )
        top = tiers.add_storeys(self, plan, walls, top, groups, per_group)
        if self.pilasters:
            strips = piers.pilasters(
                plan, self.pitch, 0.3, 2, 0.5, 0.16, bottom, top, blind
            )
            self.add("pilasters", strips)
        eaves = Facade(2.2, tiers.cornice(1.4, self.cornice_reach), plain=blind)
        roof = tiers.add_crown(self, plan, eaves, top, 0.8)
        self.add("dome", *_dome(self, plan, roof), finish=self.colours["roof"])
        x0, y0, x1, y1 = site.bounds
        if y1 - y0 - 2 * self.radius > 5.0:
            free = outlines.rectangle(x0, y0 + 2 * self.radius, x1, y1)
            equip_roof(self, free, roof, _ROOF_ITEMS)


def _add_corner_building_shops(
    p: CornerBuilding, plan: np.ndarray, blind: frozenset[int]
) -> float:
    h = p.ground_height
    choices = [
        bays.shop_front(h - 1.2, 0.4, pier=0.25, door=d) for d in (True, False)
    ]
    shops = bays.rhythm(2 * p.pitch, choices, margin=0.35)
    pane = bays.shop_front(h - 1.2, 0.4, door=False, pier=0.15)
    glazed = bays.rhythm(3.0, [pane], 0.1)
    window = bays.window(1.4, 1.5, h - 1.2, 0.4)
    service = bays.rhythm(2.5 * p.pitch, [window], 1.0)
    service = bays.with_middle(service, bays.gate(2.6, 2.9, 0.4), 3.4)

    def layout(edge: int, length: float) -> Sequence[Relief]:
        if length < 3.0:
            return glazed(edge, length)
        along = plan[(edge + 1) % len(plan)] - plan[edge]
        return (service if along[0] < -0.1 else shops)(edge, length)

    bands = (Band(0.0, 0.3, -0.06), Band(h - 1.0, h - 0.2, -0.15))
    front = WallFrame(plan, 0)
    cells = bays.stretches(front.length, 2 * p.pitch, 0.35)
    shape = (0.3, 1.3, 2.7, h - 1.2)
    canopies.add_awnings(p, canopies.awnings(front, cells, p.rng, 0.5, shape))
    return tiers.add_ground(p, plan, Facade(h, bands, layout, (0.4,), blind))


def _add_first_floor(
    p: CornerBuilding, plan: np.ndarray, blind: frozenset[int], z0: float
) -> float:
    """Adds the tall main floor with arched windows; returns its top [m]."""
    h = p.first_height
    arched = bays.arched(p.window_width, 0.5, h - 1.6, p.recess)
    plain = bays.window(p.window_width, 0.5, h - 0.9, p.recess)
    fronts = {
        edge: bays.rhythm(p.pitch, [arched], 0.3)
        for edge in range(len(plan))
        if _is_front(plan, edge)
    }
    layout = bays.by_edge(fronts, bays.rhythm(p.pitch, [plain], 0.3))
    floor = Facade(h, (Band(h - 0.4, h, -0.18),), layout, (p.recess,), blind)
    rails: list[Mesh] = []
    for edge in fronts if p.balcony else ():
        wall = WallFrame(plan, edge)
        cells = bays.stretches(wall.length, p.pitch, 0.3)
        for a, b in cells[len(cells) // 3 :: 3] if edge not in blind else ():
            x = round((a + b) / 2, 2)
            rail = balconies.balcony(x - 0.9, x + 0.9, 0.8, 0.25, 0.9)
            rails.append(wall.place(rail))
    return tiers.add_storeys(p, plan, floor, z0, 1, 1, rails, part="main_floor")


def _corner_centre(p: CornerBuilding, plan: np.ndarray) -> np.ndarray:
    """Returns the middle of the rounded corner's circle."""
    low, high = plan.min(axis=0), plan.max(axis=0)
    x = low[0] + p.radius if p.corner == _FRONT_LEFT else high[0] - p.radius
    return np.array([x, low[1] + p.radius])


def _dome(p: CornerBuilding, plan: np.ndarray, z0: float) -> list[Mesh]:
    """Returns a drum over the corner with a dome, cone or open lantern."""
    center = _corner_centre(p, plan)
    r = 0.62 * p.radius
    top = p.height
    height = p.height - z0
    drum_top = round(z0 + 0.4 * height, 2)

    def ring(radius: float) -> np.ndarray:
        return outlines.regular_polygon(radius, 12, center)

    wall = drum_top - z0
    bands = (Band(0.9, wall - 0.7, 0.25), Band(wall - 0.35, wall, -0.3))
    posts = bays.rhythm(4.0, [bays.bar(0.4, 0.9, wall - 0.7, 0.0)], 0.1)
    pieces = [tiers.lidded_walls(ring(r), Facade(wall, bands, posts), z0)]
    rise = top - drum_top
    if p.dome == "cone":
        return [*pieces, solids.spire(ring(r), center, drum_top, top)]
    share = 0.85 if p.dome == "dome" else 0.6
    angles = np.linspace(0.0, 0.4 * np.pi, 5)
    radii = r * np.cos(angles)
    heights = drum_top + share * rise * np.sin(angles)
    profile = list(zip(radii, heights, strict=True))
    pieces.append(solids.revolved(profile, 12, center))
    lid = heights[-1]
    tip = ring(radii[-1])
    if p.dome == "lantern":
        core = ring(0.6 * radii[-1])
        middle = lid + 0.55 * (top - lid)
        pieces.append(solids.prism(core, lid, middle))
        pieces.append(solids.flat(tip, middle, up=False))
        lid = middle
    return [*pieces, solids.spire(tip, center, lid, top)]


def _is_front(plan: np.ndarray, edge: int) -> bool:
    """Returns whether a wall faces the front or is part of the round corner."""
    along = plan[(edge + 1) % len(plan)] - plan[edge]
    return edge == 0 or (along[0] > 0.1 and abs(along[1]) > 0.1)


class Office(Building):
    """The mid-rise office: a lobby and shops, window bands, a penthouse.

    `style` is `ribbon` (ribbon windows), `frame` (deep square frames) or
    `grooves` (piers from the first floor to the top).
    """

    def draw(self) -> None:
        """Samples sizes and style."""
        site = self.site
        self.ground_height = self.uniform(4.4, 5.4, 2)
        self.storey_height = self.uniform(3.4, 3.9)
        self.style = self.pick(("ribbon", "frame", "grooves"))
        self.pitch = max(self.uniform(3.0, 4.4), site.open_length / 42)
        self.recess = self.uniform(0.25, 0.5, 2)
        self.sill = self.uniform(0.75, 1.05, 2)
        self.pier_reach = self.uniform(0.15, 0.32, 2)
        # Low offices have no penthouse.
        penthouse = self.uniform(3.4, 4.4, 1)
        self.penthouse_height = penthouse if self.height > 18.0 else 0.0
        self.penthouse_inset = self.uniform(2.2, 4.0, 1)
        self.parapet = self.uniform(0.6, 1.2, 2)
        self.awnings = self.uniform(0.0, 0.7)
        self.roof_items = self.draw_roof_items(
            "air_handler lift_house ac_unit ac_unit vents dish", 3, 7
        )

    def build(self) -> None:
        """Adds all parts of the office; its site can have any outline."""
        outline, blind = self.site.outline, self.site.blind_edges
        top = _add_ground(self)
        goal = self.height - self.penthouse_height - self.parapet - 0.5
        if self.style == "grooves":
            grooves = tiers.Grooves(
                storey_height=self.storey_height,
                spandrel=self.sill,
                recess=self.recess,
                pitch=self.pitch,
                pier=0.5,
                pier_reach=self.pier_reach,
                solid_corner=0.8,
            )
            top = tiers.add_grooved(
                self, outline, grooves, top, goal, "storey", 0.2, 8, blind
            )
        else:
            top = _add_windows(self, top, goal)
        rim = round(self.height - self.penthouse_height - top, 3)
        bands = (
            Band(0.1, 0.4, -0.2 if self.style == "ribbon" else 0.0),
            Band(rim - 0.3, rim, -0.35),
        )
        edge = Facade(rim, bands, plain=blind)
        roof = tiers.add_crown(self, outline, edge, top, self.parapet)
        if self.penthouse_height > 0:
            inset = min(self.penthouse_inset, outlines.inset_limit(outline))
            outline = outlines.inset(outline, inset)
            roof = _add_penthouse(self, outline, roof)
        equip_roof(self, outline, roof, self.roof_items)


def _add_ground(p: Office) -> float:
    outline, h = p.site.outline, p.ground_height
    front = WallFrame(outline, 0)
    pitch = 1.6 * p.pitch
    shop = bays.shop_front(h - 1.1, 0.5, door=False)
    shops = bays.rhythm(pitch, [shop], margin=0.7)
    window = bays.window(2.2, 1.2, h - 1.2, 0.5)
    sides = bays.rhythm(1.5 * p.pitch, [window], margin=0.9)
    lobby = bays.with_middle(shops, bays.entrance(3.2, 3.2, 1.8), 5.0)
    layout = bays.by_edge({0: lobby}, shops if len(outline) > 4 else sides)
    bands = (Band(0.0, 0.35, -0.06), Band(h - 0.9, h - 0.1, -0.15))
    ground = Facade(h, bands, layout, (0.5,), p.site.blind_edges)
    cells = bays.stretches(front.length, pitch, 0.7)
    shape = (0.3, 1.3, 2.7, h - 1.1)
    shades = canopies.awnings(front, cells, p.rng, p.awnings, shape, 2.6)
    canopies.add_awnings(p, shades)
    roof = canopies.front_canopy(outline, 2.6, 1.45, 3.4)
    return tiers.add_ground(p, outline, ground, [roof])


def _add_windows(p: Office, z0: float, goal: float) -> float:
    groups, per_group, storey = tiers.storey_groups(goal - z0, p.storey_height)
    head = round(storey - 0.4, 2)
    bands: tuple[Band, ...] = ()
    if p.style == "ribbon":
        pane = bays.ribbon(p.sill, head, p.recess, 0.12)
        cells = bays.rhythm(p.pitch, [pane], margin=0.8)
        bands = (Band(p.sill - 0.15, p.sill, -0.08),)
    else:
        frame = bays.window(
            p.pitch - 0.5, 0.45, head, p.recess, pier=0.22, mullions=1
        )
        cells = bays.rhythm(p.pitch, [frame], margin=0.6)
    site = p.site
    walls = Facade(storey, bands, cells, (p.recess,), site.blind_edges)
    return tiers.add_storeys(p, site.outline, walls, z0, groups, per_group)


def _add_penthouse(p: Office, outline: np.ndarray, roof: float) -> float:
    # The penthouse starts on the roof; its parapet ends at the full height.
    height = round(p.height - roof, 3)
    eaves = height - 0.9
    bands = (Band(0.9, eaves - 0.3, 0.3), Band(eaves, eaves + 0.3, -0.7))
    walls = Facade(height, bands, glass=(0.3,))
    return tiers.add_crown(p, outline, walls, roof, 0.6, part="penthouse")


class CornerStore(Building):
    """The corner store: a door across the corner, flats above the shop."""

    def draw(self) -> None:
        """Samples sizes and style."""
        site = self.site
        # Rise of the parapet above the corner.
        self.raised = self.uniform(0.3, 0.9, 2)
        self.ground = round(
            min(self.uniform(3.5, 4.1), self.height - self.raised - 0.7), 2
        )
        self.corner = self.pick(
            site.free_corners or [_FRONT_LEFT, _FRONT_RIGHT]
        )
        # Length taken off each edge at the corner.
        self.cut = round(min(self.uniform(2.0, 3.0), 0.3 * site.depth), 2)
        self.storey = self.uniform(2.9, 3.3)
        self.pitch = max(self.uniform(2.2, 3.0), (site.width + site.depth) / 20)
        self.window_width = self.uniform(1.0, 1.5, 2)
        self.recess = self.uniform(0.12, 0.25, 2)
        self.ledge = self.pick((0.0, 0.1))
        self.cornice = self.uniform(0.15, 0.4, 2)
        # Part of the shop windows with an awning.
        self.awnings = self.uniform(0.2, 0.9)
        self.roof_items = self.draw_roof_items(
            "stair_house ac_unit vents", 1, 4
        )

    def build(self) -> None:
        """Adds all parts of the corner store.

        The building's site must be a rectangle.
        """
        site = self.site
        if self.corner not in site.free_corners:
            site = site.detached(self.kind.overhang)
        rectangle = site.outline
        plan, front = _cut_rectangle(self, rectangle)
        blind = outlines.edges_on(plan, rectangle, site.blind_edges)
        along = -1 if self.corner == _FRONT_LEFT else 1
        side = (front + along) % 5
        top = _add_shop(self, plan, (0, front, side), blind)
        room = self.height - (self.raised + 0.6) - top
        if room > 2.4:
            groups, per_group, storey = tiers.storey_groups(
                room, self.storey, 4
            )
            head = min(2.3, storey - 0.35)
            window = bays.window(
                self.window_width, 0.85, head, self.recess, ledge=self.ledge
            )
            rows = bays.rhythm(self.pitch, [window], 0.5)
            walls = Facade(storey, (), rows, (self.recess,), blind)
            top = tiers.add_storeys(self, plan, walls, top, groups, per_group)
        _add_parapet(self, plan, front, top, blind)
        wall = WallFrame(plan, front)
        self.add("sign", *_corner_sign(self, wall), finish=self.colours["sign"])


def _cut_rectangle(
    p: CornerStore, rectangle: np.ndarray
) -> tuple[np.ndarray, int]:
    """Cuts one front corner off a rectangle.

    Returns:
        The five corners of the outline (5, 2) [m], and the number of the edge
        that replaces the corner.
    """
    (x0, y0), (x1, y1) = rectangle[0], rectangle[2]
    c = p.cut
    if p.corner == _FRONT_RIGHT:
        points = [(x0, y0), (x1 - c, y0), (x1, y0 + c), (x1, y1), (x0, y1)]
        return np.array(points), 1
    points = [(x0 + c, y0), (x1, y0), (x1, y1), (x0, y1), (x0, y0 + c)]
    return np.array(points), 4


def _add_shop(
    p: CornerStore,
    plan: np.ndarray,
    streets: tuple[int, int, int],
    blind: frozenset[int],
) -> float:
    h = p.ground
    pitch = 2 * p.pitch
    head = round(h - 1.0, 2)
    front = streets[1]
    shop = bays.shop_front(head, 0.3, door=False)
    glazed = bays.rhythm(pitch, [shop], margin=0.5)
    entry = bays.alone(bays.entrance(1.6, 2.4, 0.7, surround=0.1), p.cut)
    back = [bays.window(1.2, 1.3, 2.3, 0.3), bays.gate(1.8, 2.2)]
    layouts = dict.fromkeys(streets, glazed) | {front: entry}
    layout = bays.by_edge(layouts, bays.rhythm(4.0, back, 0.7))
    bands = (Band(0.0, 0.3, -0.05), Band(h - 0.25, h, -0.12))
    shades, boards = [], []
    for edge in streets:
        wall = WallFrame(plan, edge)
        if edge == front or edge in blind:
            continue
        cells = bays.stretches(wall.length, pitch, 0.5)
        for a, b in cells:
            spot = (a + 0.3, b - 0.3, -0.02, 0.1, head + 0.1, head + 0.7)
            boards.append(wall.box(*spot))
        shape = (0.2, 0.95, 2.4, head + 0.05)
        shades += canopies.awnings(wall, cells, p.rng, p.awnings, shape)
    canopies.add_awnings(p, shades)
    p.add("boards", *boards, finish=p.colours["sign"])
    return tiers.add_ground(p, plan, Facade(h, bands, layout, (0.3,), blind))


def _add_parapet(
    p: CornerStore,
    plan: np.ndarray,
    front: int,
    z0: float,
    blind: frozenset[int],
) -> None:
    """Adds the cornice and the roof; the parapet is higher at the corner."""
    rim = round(p.height - p.raised - z0, 3)
    bands = tiers.cornice(rim - 0.1, p.cornice, thickness=0.45, steps=2)
    crown = Facade(rim, bands, plain=blind)
    roof = tiers.add_crown(p, plan, crown, z0, 0.5, thickness=0.25)
    wall = WallFrame(plan, front)
    piece = (0.1, wall.length - 0.1, -0.25, 0.04, z0 + rim - 0.3, p.height)
    p.add("pediment", wall.box(*piece))
    equip_roof(p, plan, roof, p.roof_items)


def _corner_sign(p: CornerStore, wall: WallFrame) -> list[Mesh]:
    """Returns a canopy above the door and an upright sign over it."""
    middle, z = wall.length / 2, p.ground - 0.55
    half = 0.5 * wall.length - 0.25
    lid = (middle - half, middle + half, -0.05, 0.9, z - 0.25, z)
    top = min(p.height - 0.4, z + 2.6)
    blade = (middle - 0.1, middle + 0.1, -0.05, 0.75, z - 0.05, top)
    return [wall.box(*lid), wall.box(*blade)]
