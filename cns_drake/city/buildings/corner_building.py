"""The corner building: a street block with a round corner under a dome."""

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
from cns_drake.city.facades.site import FRONT_LEFT, FRONT_RIGHT
from cns_drake.city.geometry.mesh import Mesh

_ROOF_ITEMS = ("stair_house", "skylight", "vents", "ac_unit")


class CornerBuilding(Building):
    """The corner house: a curved front, arched windows, a dome or a lantern.

    `corner` is the rounded corner of the rectangle (`FRONT_LEFT` or
    `FRONT_RIGHT`) and `radius` its radius.
    """

    def draw(self) -> None:
        """Samples sizes and style."""
        site = self.site
        side = min(site.width, site.depth, 24.0)
        self.corner = self.pick(site.free_corners or [FRONT_LEFT, FRONT_RIGHT])
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
        bottom = _add_shops(self, plan, blind)
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


def _add_shops(
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
    shape = canopies.AwningShape(0.3, 1.3, 2.7, h - 1.2)
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
    x = low[0] + p.radius if p.corner == FRONT_LEFT else high[0] - p.radius
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
