"""Towers with setbacks or podiums, and a hotel behind its forecourt."""

import math

import numpy as np

from cns_drake.city.facades import (
    Band,
    Building,
    Facade,
    WallFrame,
    balconies,
    bays,
    canopies,
    outlines,
    piers,
    solids,
    tiers,
)
from cns_drake.city.geometry import Finish
from cns_drake.city.geometry.mesh import Mesh, merge_meshes


class ArtDecoTower(Building):
    """The art-deco tower: symmetric setbacks, tall piers, a stepped crown."""

    def draw(self) -> None:
        """Samples sizes and style."""
        site = self.site
        # Where each tier above the base starts, as a part of the height.
        starts = self.pick(((0.5,), (0.3, 0.62)))
        share = 0.24 if len(starts) == 2 else 0.4
        # For each of these tiers, where it starts, how far it steps back across
        # the front and along the sides, and by how much it starts higher.
        self.steps = [
            (
                start,
                share * self.uniform(0.3, 0.9) * site.depth / 2,
                share * self.uniform(0.6, 1.2) * site.width / 2,
                self.uniform(-0.04, 0.04),
            )
            for start in starts
        ]
        self.ground_height = self.uniform(6.5, 8.5, 2)
        self.grooves = tiers.Grooves(
            storey_height=self.uniform(3.4, 3.8),
            spandrel=self.uniform(1.1, 1.6, 2),
            recess=self.uniform(0.2, 0.4, 2),
            pitch=max(self.uniform(2.6, 3.6), site.open_length / 34),
            pier=self.uniform(0.8, 1.4, 2),
            pier_reach=self.uniform(0.2, 0.34, 2),
            solid_corner=self.uniform(1.4, 2.4, 2),
        )
        self.portal_width = self.uniform(4.0, 5.5, 1)
        self.crown_steps = self.whole(2, 5)
        # Height of the spire, as a part of the crown's.
        self.spire = self.uniform(0.35, 0.6)
        self.notch = self.pick((0.0, 1.2, 2.0))

    def build(self) -> None:
        """Adds all parts of the art-deco tower.

        The building's site must be a rectangle.
        """
        base = self.site.outline
        plan = outlines.notched(base, self.notch) if self.notch else base
        top = _add_ground(self, plan)
        crown_height = round(min(0.16 * self.height, 16.0), 1)
        across = along = 0.0
        for k, (start, a, b, jitter) in enumerate(self.steps):
            goal = round(self.height * (start + jitter), 1)
            part = f"tier_{k}"
            top = tiers.add_grooved(
                self, plan, self.grooves, top, goal, part, 1.7
            )
            edges = (Band(0.0, 0.3, -0.12), Band(1.0, 1.3, -0.1))
            parapet = Facade(1.3, edges)
            part = f"terrace_{k}"
            tiers.add_crown(self, plan, parapet, top, 1.1, part=part)
            across, along = across + a, along + b
            step = (round(across, 1), round(along, 1)) * 2
            plan = outlines.inset(base, step)
            plan = outlines.notched(plan, self.notch) if self.notch else plan
        goal = round(self.height - crown_height, 1)
        part = f"tier_{k + 1}"
        top = tiers.add_grooved(self, plan, self.grooves, top, goal, part, 1.7)
        _add_crown(self, plan, top)


def _add_ground(p: ArtDecoTower, plan: np.ndarray) -> float:
    h = p.ground_height
    portal = bays.entrance(p.portal_width, h - 1.6, 1.4, surround=0.3)
    arch = bays.arched(3.4, 0.5, 3.2, 0.5)
    arches = bays.rhythm(1.7 * p.grooves.pitch, [arch], margin=1.4)
    bands = (Band(h - 0.7, h - 0.4, -0.15), Band(h - 0.4, h, -0.3))
    layout = bays.with_door(arches, portal, p.portal_width + 2.0)
    roof = canopies.front_canopy(plan, 2.4, 1.4, 3.6)
    return tiers.add_ground(p, plan, Facade(h, bands, layout, (0.5,)), [roof])


def _add_crown(p: ArtDecoTower, plan: np.ndarray, z0: float) -> None:
    pieces = []
    height = p.height - z0
    step = round((1.0 - p.spire) * height / p.crown_steps, 2)
    side = outlines.shortest_side(plan)
    bands = (Band(0.6, 0.5 * step, 0.25), Band(step - 0.4, step, -0.25))
    for k in range(p.crown_steps):
        pieces.append(
            tiers.lidded_walls(plan, Facade(step, bands), z0 + k * step)
        )
        plan = outlines.inset(plan, 0.28 * side / p.crown_steps)
    z = z0 + p.crown_steps * step
    pieces.append(solids.spire(plan, np.mean(plan, axis=0), z, z0 + height))
    p.add("crown", *pieces)


_ROOF_ITEMS = ("lift_house", "mast", *2 * ("cooling_tower",), "air_handler")


class GlassSkyscraper(Building):
    """The glass skyscraper: curtain walls with fins, setbacks, a crown."""

    def draw(self) -> None:
        """Samples sizes and style."""
        site = self.site
        edges = len(site.outline)
        starts = self.pick(((0.62,), (0.45, 0.78)))
        # 0 ribbons, 1 a grid, above that fins.
        style = self.whole(0, 4)
        # For each tier above the first, where it starts, as a part of the
        # height, how far edges step back, as a part of the most, and by how
        # much it starts higher.
        self.setbacks = [
            (start, self._setback_share(edges), self.uniform(-0.06, 0.06))
            for start in starts
        ]
        walls, glass = (self.kind.choices[part] for part in ("walls", "glass"))
        tint = self.whole(0, len(walls))
        self.walls = walls[tint]
        self.glass = glass[tint]
        wanted = self.pick(("plain", "chamfered", "notched", "rounded"))
        self.corners = wanted if edges == 4 else "plain"
        self.lobby_height = self.uniform(6.0, 9.0, 2)
        self.grooves = tiers.Grooves(
            storey_height=self.uniform(3.7, 4.2),
            spandrel=self.uniform(0.6, 1.2, 2),
            ledge=self.uniform(0.3, 0.6, 2) * (style < 2),
            recess=self.uniform(0.2, 0.4, 2),
            pitch=max(self.uniform(2.2, 3.6), site.open_length / 38),
            pier=self.uniform(0.12, 0.3, 2) * (style > 0),
            pier_reach=self.uniform(0.2, 0.55, 2),
        )
        # Size of cut corners, as a part of the shorter side.
        self.corner_size = self.uniform(0.08, 0.16)
        self.crown = self.pick(("screen", "wedge", "stepped"))
        self.crown_height = self.uniform(5.0, 9.0, 1)

    def _setback_share(self, edges: int) -> float | np.ndarray:
        """Returns how far a tier steps back: its edges, or all alike."""
        if edges == 4:
            return self.rng.uniform(0.06, 0.13, 4) * (self.rng.random(4) < 0.6)
        return self.uniform(0.5, 1.0)

    def build(self) -> None:
        """Adds all parts of the skyscraper; its site can have any outline."""
        base = self.site.outline
        plan = _shaped(self, base)
        top = _add_lobby(self, plan)
        reach = outlines.shortest_side(base)
        total = np.zeros(len(base))
        if len(base) != 4:
            reach = min(0.08 * reach, 0.5 * outlines.inset_limit(base))
        for k, (start, share, jitter) in enumerate(self.setbacks):
            goal = round((start + jitter) * self.height, 1)
            part = f"tier_{k}"
            top = tiers.add_grooved(
                self, plan, self.grooves, top, goal, part, 1.1
            )
            terrace = Facade(1.1, (Band(0.8, 1.1, -0.1),))
            tiers.add_crown(self, plan, terrace, top, 1.0, part=f"terrace_{k}")
            total = total + np.round(share * reach, 1)
            plan = _shaped(self, outlines.inset(base, total))
        rise = self.crown_height if self.crown == "screen" else 0.0
        goal = self.height - self.crown_height
        part = "tier_top"
        top = tiers.add_grooved(self, plan, self.grooves, top, goal, part, rise)
        _add_glass_skyscraper_crown(self, plan, top)


def _shaped(p: GlassSkyscraper, outline: np.ndarray) -> np.ndarray:
    side = outlines.shortest_side(p.site.outline)
    size = round(p.corner_size * side, 1)
    if p.corners == "chamfered":
        return outlines.chamfered(outline, size)
    if p.corners == "notched":
        return outlines.notched(outline, 0.6 * size)
    if p.corners == "rounded":
        corners = dict.fromkeys(range(len(outline)), size)
        return outlines.rounded(outline, corners, 3.5)
    return outline


def _add_lobby(p: GlassSkyscraper, plan: np.ndarray) -> float:
    height, length = p.lobby_height, WallFrame(plan, 0).length
    door = bays.entrance(min(5.0, length / 3), 3.6, 1.6)
    bar = bays.bar(0.12, 0.0, height - 0.8, 0.4)
    mullions = bays.rhythm(2 * p.grooves.pitch, [bar], margin=1.0)
    bands = (
        Band(0.0, height - 0.8, 0.7),
        Band(0.0, 0.3, 0.45),
        Band(height - 0.8, height - 0.5, -0.25),
    )
    layout = bays.with_door(mullions, door, 7.0)
    columns = piers.wall_piers(
        plan, 7.0, 0.9, 0.25, 0.0, height - 0.8, depth=0.75, margin=0.55,
        entrance=min(5.8, length / 2),
    )  # fmt: skip
    roof = canopies.front_canopy(plan, 4.0, 1.5, 4.2)
    lobby = Facade(height, bands, layout, (0.7,))
    return tiers.add_ground(p, plan, lobby, [columns, roof])


def _add_glass_skyscraper_crown(
    p: GlassSkyscraper, plan: np.ndarray, z0: float
) -> None:
    height = round(p.height - z0, 3)
    if p.crown == "wedge":
        p.add("crown", solids.sloped_prism(plan, z0, height, 0.35))
        return
    if p.crown == "stepped":
        low = round(0.45 * height, 2)
        ledge = Facade(low, (Band(low - 0.5, low, -0.3),))
        tiers.add_crown(p, plan, ledge, z0, 1.0, part="crown_low")
        reach = 0.12 * outlines.shortest_side(plan)
        plan = outlines.inset(plan, min(reach, outlines.inset_limit(plan)))
        z0, height = round(z0 + low - 1.0, 3), round(height - low + 1.0, 3)
    louvres = tuple(
        Band(z, z + 0.5, 0.2)
        for z in np.arange(0.8, height - 1.5, 1.0).tolist()
    )
    parapet = 0.7 * height if p.crown == "screen" else 1.0
    walls = Facade(height, louvres)
    tiers.add_crown(p, plan, walls, z0, parapet, items=_ROOF_ITEMS)


_FORECOURT_M = 7.0
_HOTEL_ROOF_ITEMS = ("cooling_tower", "air_handler", "mast", "vents", "ac_unit")


class Hotel(Building):
    """The hotel: balconies along rounded walls, a forecourt, a roof-top bar."""

    def draw(self) -> None:
        """Samples sizes and style."""
        site = self.site
        depth = site.depth - _FORECOURT_M
        self.pitch = max(self.uniform(3.6, 4.6), site.width / 11)
        self.ground_height = self.uniform(5.0, 6.2, 2)
        self.storey_height = self.uniform(3.1, 3.4)
        self.round_ends = self.chance(0.5) and site.width > 1.5 * depth
        self.corner = round(self.uniform(0.2, 0.35) * min(depth, site.width), 1)
        self.side_pitch = max(2.7, (site.width + 2 * depth) / 34)
        self.recess = self.uniform(0.2, 0.35, 2)
        self.balcony_reach = self.uniform(1.1, 1.45, 2)
        self.balcony_width = round(self.uniform(0.6, 0.95) * self.pitch, 2)
        self.rail = self.uniform(0.95, 1.1, 2)
        self.bar_height = self.uniform(4.0, 5.0, 1)
        self.bar_inset = self.uniform(1.8, 3.0, 1)
        self.sign_left = self.chance(0.5)

    def build(self) -> None:
        """Adds all parts of the hotel, which stands behind a forecourt.

        The building's site must be a rectangle.
        """
        x0, y0, x1, y1 = self.site.bounds
        front = y0 + _FORECOURT_M
        if self.round_ends:
            plan = outlines.stadium(x0, front, x1, y1, 3.2)
        else:
            block = outlines.rectangle(x0, front, x1, y1)
            plan = outlines.rounded(
                block, {0: self.corner, 1: self.corner}, 2.8
            )
        top = _add_hotel_lobby(self, plan, y0)
        goal = self.height - self.bar_height - 1.2
        top = _add_rooms(self, plan, top, goal)
        edge = Facade(1.2, (Band(0.0, 0.3, -0.15), Band(0.9, 1.2, -0.2)))
        roof = tiers.add_crown(self, plan, edge, top, 1.1)
        bar = outlines.inset(plan, self.bar_inset)
        h = round(self.height - roof, 3)
        bands = (Band(0.4, h - 1.2, 0.3), Band(h - 0.9, h - 0.5, -1.3))
        walls = Facade(h, bands, glass=(0.3,))
        items = _HOTEL_ROOF_ITEMS
        tiers.add_crown(self, bar, walls, roof, 0.4, part="bar", items=items)
        _add_sign(self, plan)


def _add_hotel_lobby(p: Hotel, plan: np.ndarray, y0: float) -> float:
    h = p.ground_height
    pane = bays.ribbon(0.4, h - 1.2, 0.4, 0.5)
    glazing = bays.rhythm(p.pitch, [pane], margin=0.5)
    layout = bays.with_door(glazing, bays.entrance(4.4, 3.4, 1.5), 6.4)
    bands = (Band(0.0, 0.4, -0.1), Band(h - 0.8, h - 0.3, -0.4))
    # The canopy of the drive stands on four pillars in the forecourt.
    middle = float(np.mean(plan[:2, 0]))
    front = float(plan[0, 1])
    left = middle - 6.0
    right = middle + 6.0
    z = 4.2
    roof = solids.box(left, right, y0 + 0.3, front + 0.2, z, z + 0.7)
    pillars = [
        solids.standing(x, x + 0.7, y, y + 0.7, z)
        for x in (left + 0.6, right - 1.3)
        for y in (y0 + 0.8, front - 2.0)
    ]
    drive = solids.standing(
        middle - 2.8, middle + 2.8, front - 2.2, front, 0.14
    )
    lobby = Facade(h, bands, layout, (0.4,))
    return tiers.add_ground(p, plan, lobby, [roof, *pillars, drive])


def _add_rooms(p: Hotel, plan: np.ndarray, z0: float, goal: float) -> float:
    groups, per_group, storey = tiers.storey_groups(
        goal - z0, p.storey_height, 15
    )
    head = round(storey - 0.45, 2)
    french = bays.window(p.pitch - 1.2, 0.0, head, p.recess, mullions=1)
    plain = bays.window(1.5, 0.8, head, p.recess)
    front_rooms = {0: bays.rhythm(p.pitch, [french], margin=0.4)}
    others = bays.rhythm(p.side_pitch, [plain], margin=0.35)
    layout = bays.by_edge(front_rooms, others)
    band = Band(storey - 0.12, storey, -0.08)
    walls = Facade(storey, (band,), layout, (p.recess,))
    front = WallFrame(plan, 0)
    rails = []
    for a, b in bays.stretches(front.length, p.pitch, 0.4):
        half = p.balcony_width / 2
        x = (a + b) / 2
        ends = round(x - half, 2), round(x + half, 2)
        rail = balconies.balcony(*ends, p.balcony_reach, 0.0, p.rail)
        rails.append(front.place(rail))
    return tiers.add_storeys(p, plan, walls, z0, groups, per_group, rails)


def _add_sign(p: Hotel, plan: np.ndarray) -> None:
    """Adds an upright sign to the front, at one end of the balconies."""
    front = WallFrame(plan, 0)
    x = 0.4 if p.sign_left else front.length - 0.4
    low, high = p.ground_height + 3.0, 0.7 * p.height
    blade = front.box(x - 0.15, x + 0.15, 0.25, 1.3, low, high)
    arms = (
        front.box(x - 0.08, x + 0.08, 0.0, 0.4, z, z + 0.15)
        for z in (low + 0.5, high - 0.7)
    )
    p.add("sign", blade, *arms, finish=Finish((0.55, 0.16, 0.14)))


_PODIUM_TOWER_ROOF_ITEMS = (
    "lift_house",
    "cooling_tower",
    "air_handler",
    "mast",
)


class PodiumTower(Building):
    """The podium tower: a block of shops with a tower set back on its roof."""

    def draw(self) -> None:
        """Samples sizes and style."""
        site = self.site
        podium, tower = (
            self.kind.choices[part] for part in ("podium", "tower")
        )
        cladding = self.whole(0, len(podium))
        self.walls = podium[cladding]
        self.tower_walls = tower[cladding]
        # Share of the podium that the tower covers along x and y.
        self.tower = self.rng.uniform(0.5, 0.68, 2).tolist()
        run = 2 * (self.tower[0] * site.width + self.tower[1] * site.depth)
        self.podium_storeys = self.whole(2, 4)
        self.ground_height = self.uniform(4.8, 5.6, 2)
        self.storey_height = self.uniform(3.2, 3.7)
        self.shop_pitch = self.uniform(5.5, 7.5) * min(
            1.3, max(1.0, (site.width + site.depth) / 70)
        )
        # Where the tower stands, as a part of the room that is left.
        self.at = self.rng.choice([0.15, 0.5, 0.85], 2).tolist()
        self.chamfer = self.pick((0.0, 2.0, 3.5))
        self.pitch = max(self.uniform(3.0, 4.2), run / 19)
        self.recess = self.uniform(0.35, 0.5, 2)
        self.frame = self.uniform(0.5, 0.9, 2)
        self.mullions = int(run < 70.0)
        self.balconies = self.chance(0.5)
        self.awnings = self.uniform(0.3, 0.9)

    def build(self) -> None:
        """Adds all parts of the podium and of the tower on it.

        The building's site must be a rectangle.
        """
        (x0, y0, x1, y1), base = self.site.bounds, self.site.outline
        top, walls = _add_shops(self), _podium_storey(self)
        top = tiers.add_storeys(
            self, base, walls, top, self.podium_storeys, 1, part="podium"
        )
        edge = Facade(1.6, (Band(0.2, 0.7, -0.3), Band(1.4, 1.6, -0.1)))
        roof = tiers.add_crown(self, base, edge, top, 1.2, part="terrace")
        width, depth = self.tower[0] * (x1 - x0), self.tower[1] * (y1 - y0)
        left = round(x0 + self.at[0] * (x1 - x0 - width), 2)
        near = round(y0 + self.at[1] * (y1 - y0 - depth), 2)
        right, far = round(left + width, 2), round(near + depth, 2)
        plan = outlines.rectangle(left, near, right, far)
        _add_garden(self, plan, roof)
        if self.chamfer:
            plan = outlines.chamfered(plan, self.chamfer)
        self.walls = self.tower_walls
        _add_tower(self, plan, roof)


def _add_shops(p: PodiumTower) -> float:
    outline, h = p.site.outline, p.ground_height
    front = WallFrame(outline, 0)
    pitch = p.shop_pitch
    choices = [bays.shop_front(h - 0.6, 0.45, door=d) for d in (True, False)]
    shops = bays.rhythm(pitch, choices, margin=0.8)
    gates = [bays.gate(4.0, 3.4), bays.blank]
    main = bays.with_middle(shops, bays.entrance(4.0, 3.8, 1.6), 6.0)
    service = bays.rhythm(pitch, gates, margin=1.0)
    layout = bays.by_edge({0: main, 2: service}, shops)
    bands = (Band(0.0, 0.3, -0.06), Band(h - 1.1, h - 0.2, -0.2))
    cells = bays.stretches(front.length, pitch, 0.8)
    shape = (0.4, 1.35, 2.7, h - 1.3)
    shades = canopies.awnings(front, cells, p.rng, p.awnings, shape, 3.2)
    canopies.add_awnings(p, shades)
    roof = canopies.front_canopy(outline, 3.2, 1.45, 4.0)
    facade = Facade(h, bands, layout, (0.45,))
    return tiers.add_ground(p, outline, facade, [roof])


def _podium_storey(p: PodiumTower) -> Facade:
    storey = 4.2
    window = bays.window(p.shop_pitch - 1.4, 0.7, storey - 0.7, 0.3, mullions=2)
    layout = bays.rhythm(p.shop_pitch, [window], margin=0.8)
    return Facade(storey, (Band(0.0, 0.25, -0.12),), layout, glass=(0.3,))


def _add_tower(p: PodiumTower, plan: np.ndarray, z0: float) -> None:
    room = p.height - 3.0 - z0
    groups, per_group, storey = tiers.storey_groups(room, p.storey_height)
    # Deep frames, one bay wide, with the glass at their backs.
    frame = bays.window(
        1e3, round(p.frame / 2, 2), round(storey - p.frame / 2, 2), p.recess,
        pier=round(p.frame / 2, 2), mullions=p.mullions,
    )  # fmt: skip
    layout = bays.rhythm(p.pitch, [frame], margin=0.5)
    walls = Facade(storey, (), layout, (p.recess,))
    extras = []
    for edge in range(len(plan)) if p.balconies else ():
        wall = WallFrame(plan, edge)
        if wall.length > 3 * p.pitch:
            x = 0.5 + p.pitch
            extras.append(wall.place(balconies.balcony(x - 2.6, x, 1.4, 0.0)))
    top = tiers.add_storeys(p, plan, walls, z0, groups, per_group, extras)
    crown = round(p.height - top, 3)
    louvres = tuple(Band(z, z + 0.35, 0.15) for z in (0.5, 1.2, 1.9))
    screen = Facade(crown, (*louvres, Band(2.6, crown, -0.15)))
    items = _PODIUM_TOWER_ROOF_ITEMS
    tiers.add_crown(p, plan, screen, top, 2.2, items=items)


def _add_garden(p: PodiumTower, tower: np.ndarray, z: float) -> None:
    """Adds planters and a pergola to the podium roof's widest free strip."""
    x0, y0, x1, y1 = p.site.bounds
    (tx0, ty0), (tx1, ty1) = tower[0], tower[2]
    strips = (
        (x0, tx0, y0, y1),
        (tx1, x1, y0, y1),
        (x0, x1, y0, ty0),
        (x0, x1, ty1, y1),
    )
    a, b, c, d = max(strips, key=lambda s: min(s[1] - s[0], s[3] - s[2]))
    a, b, c, d = a + 1.4, b - 1.4, c + 1.4, d - 1.4
    if min(b - a, d - c) < 2.0:
        return
    if b - a > d - c:
        garden = _garden(b - a, d - c).moved((a, c, z))
    else:
        garden = _garden(d - c, b - a).moved((b, c, z), math.pi / 2)
    p.add("garden", garden, finish=Finish((0.45, 0.40, 0.33)))


def _garden(length: float, width: float) -> Mesh:
    """Returns planters along x, with a pergola behind them."""
    planters = (
        (u * length, (u + 0.12) * length, 0.0, 1.2, -0.1, 0.8)
        for u in (0.1, 0.32, 0.54, 0.76)
    )
    places = [round(u * length, 2) for u in np.linspace(0.25, 0.75, 7)]
    beams = (solids.box(x, x + 0.15, 1.5, width, 2.6, 2.85) for x in places)
    posts = (
        (x, x + 0.15, y, y + 0.15, -0.1, 2.7)
        for x in (places[0], places[-1])
        for y in (1.6, width - 0.2)
    )
    return merge_meshes(
        *(solids.box(*spot, bottom=False) for spot in planters),
        *beams,
        *(solids.box(*spot, bottom=False) for spot in posts),
    )
