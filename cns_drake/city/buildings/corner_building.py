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
        self.ground_height = self.uniform(4.6, 5.4, digits=2)
        self.first_height = self.uniform(4.2, 4.8, digits=2)
        self.storey_height = self.uniform(3.3, 3.8)
        self.pitch = max(self.uniform(2.5, 3.2), site.open_length / 36)
        self.window_width = self.uniform(1.1, 1.5, digits=2)
        self.recess = self.uniform(0.22, 0.4, digits=2)
        self.hood = 0.1 if self.chance(0.4) else 0.0
        self.pilasters = self.chance(0.6)
        self.balcony = self.chance(0.7)
        self.dome = self.pick(("dome", "cone", "lantern"))
        self.dome_height = round(self.uniform(0.17, 0.24) * self.height, 1)
        self.cornice_reach = self.uniform(0.5, 0.9, digits=2)

    def build(self) -> None:
        """Adds all parts of the corner house.

        The building's site must be a rectangle.
        """
        site = self.site
        if self.corner not in site.free_corners:
            site = site.detached(self.kind.overhang)
        rectangle = site.outline
        plan = outlines.rounded(rectangle, {self.corner: self.radius}, step=2.8)
        blind = outlines.edges_on(plan, rectangle, site.blind_edges)
        bottom = _add_shops(self, plan, blind)
        top = _add_first_floor(self, plan, blind, bottom)
        room = self.height - self.dome_height - 2.2 - top
        groups, per_group, storey = tiers.storey_groups(
            room, storey=self.storey_height
        )
        window = bays.window(
            width=self.window_width,
            sill=0.8,
            head=storey - 0.7,
            depth=self.recess,
            hood=self.hood,
        )
        rows = bays.rhythm(self.pitch, [window], margin=0.3)
        walls = Facade(
            storey,
            bands=(Band(z0=0.6, z1=0.8, depth=-0.1),),
            layout=rows,
            glass=(self.recess,),
            plain=blind,
        )
        top = tiers.add_storeys(
            self, plan, walls, z0=top, groups=groups, per_group=per_group
        )
        if self.pilasters:
            strips = piers.pilasters(
                plan,
                pitch=self.pitch,
                margin=0.3,
                every=2,
                width=0.5,
                reach=0.16,
                z0=bottom,
                z1=top,
                skip=blind,
            )
            self.add("pilasters", strips)
        eaves = Facade(
            2.2,
            bands=tiers.cornice(height=1.4, reach=self.cornice_reach),
            plain=blind,
        )
        roof = tiers.add_crown(self, plan, eaves, z0=top, parapet=0.8)
        self.add("dome", *_dome(self, plan, roof), finish=self.colours["roof"])
        x0, y0, x1, y1 = site.bounds
        if y1 - y0 - 2 * self.radius > 5.0:
            free = outlines.rectangle(x0, y0 + 2 * self.radius, x1, y1)
            equip_roof(self, free, roof, _ROOF_ITEMS)


def _add_shops(
    building: CornerBuilding, plan: np.ndarray, blind: frozenset[int]
) -> float:
    h = building.ground_height
    choices = [
        bays.shop_front(head=h - 1.2, depth=0.4, pier=0.25, door=d)
        for d in (True, False)
    ]
    shops = bays.rhythm(2 * building.pitch, choices, margin=0.35)
    pane = bays.shop_front(head=h - 1.2, depth=0.4, door=False, pier=0.15)
    glazed = bays.rhythm(3.0, [pane], margin=0.1)
    window = bays.window(width=1.4, sill=1.5, head=h - 1.2, depth=0.4)
    service = bays.rhythm(2.5 * building.pitch, [window], margin=1.0)
    service = bays.with_middle(
        service, bays.gate(width=2.6, height=2.9, depth=0.4), width=3.4
    )

    def layout(edge: int, length: float) -> Sequence[Relief]:
        if length < 3.0:
            return glazed(edge, length)
        along = plan[(edge + 1) % len(plan)] - plan[edge]
        return (service if along[0] < -0.1 else shops)(edge, length)

    bands = (
        Band(z0=0.0, z1=0.3, depth=-0.06),
        Band(z0=h - 1.0, z1=h - 0.2, depth=-0.15),
    )
    front = WallFrame(plan, 0)
    cells = bays.stretches(front.length, pitch=2 * building.pitch, margin=0.35)
    shape = canopies.AwningShape(narrower=0.3, reach=1.3, z0=2.7, z1=h - 1.2)
    canopies.add_awnings(
        building,
        canopies.awnings(front, cells, building.rng, share=0.5, shape=shape),
    )
    return tiers.add_ground(
        building,
        plan,
        Facade(h, bands=bands, layout=layout, glass=(0.4,), plain=blind),
    )


def _add_first_floor(
    building: CornerBuilding, plan: np.ndarray, blind: frozenset[int], z0: float
) -> float:
    """Adds the tall main floor with arched windows; returns its top [m]."""
    h = building.first_height
    arched = bays.arched(
        width=building.window_width,
        bottom=0.5,
        spring=h - 1.6,
        depth=building.recess,
    )
    plain = bays.window(
        width=building.window_width,
        sill=0.5,
        head=h - 0.9,
        depth=building.recess,
    )
    fronts = {
        edge: bays.rhythm(building.pitch, [arched], margin=0.3)
        for edge in range(len(plan))
        if _is_front(plan, edge)
    }
    layout = bays.by_edge(
        fronts, bays.rhythm(building.pitch, [plain], margin=0.3)
    )
    floor = Facade(
        h,
        bands=(Band(z0=h - 0.4, z1=h, depth=-0.18),),
        layout=layout,
        glass=(building.recess,),
        plain=blind,
    )
    rails: list[Mesh] = []
    for edge in fronts if building.balcony else ():
        wall = WallFrame(plan, edge)
        cells = bays.stretches(wall.length, pitch=building.pitch, margin=0.3)
        for a, b in cells[len(cells) // 3 :: 3] if edge not in blind else ():
            x = round((a + b) / 2, 2)
            rail = balconies.balcony(
                x0=x - 0.9, x1=x + 0.9, reach=0.8, z=0.25, rail=0.9
            )
            rails.append(wall.place(rail))
    return tiers.add_storeys(
        building,
        plan,
        floor,
        z0=z0,
        groups=1,
        per_group=1,
        extras=rails,
        part="main_floor",
    )


def _corner_centre(building: CornerBuilding, plan: np.ndarray) -> np.ndarray:
    """Returns the middle of the rounded corner's circle."""
    low, high = plan.min(axis=0), plan.max(axis=0)
    x = (
        low[0] + building.radius
        if building.corner == FRONT_LEFT
        else high[0] - building.radius
    )
    return np.array([x, low[1] + building.radius])


def _dome(building: CornerBuilding, plan: np.ndarray, z0: float) -> list[Mesh]:
    """Returns a drum over the corner with a dome, cone or open lantern."""
    center = _corner_centre(building, plan)
    r = 0.62 * building.radius
    top = building.height
    height = building.height - z0
    drum_top = round(z0 + 0.4 * height, 2)

    def ring(radius: float) -> np.ndarray:
        return outlines.regular_polygon(radius=radius, count=12, center=center)

    wall = drum_top - z0
    bands = (
        Band(z0=0.9, z1=wall - 0.7, depth=0.25),
        Band(z0=wall - 0.35, z1=wall, depth=-0.3),
    )
    posts = bays.rhythm(
        4.0, [bays.bar(width=0.4, z0=0.9, z1=wall - 0.7, depth=0.0)], margin=0.1
    )
    pieces = [
        tiers.lidded_walls(ring(r), Facade(wall, bands=bands, layout=posts), z0)
    ]
    rise = top - drum_top
    if building.dome == "cone":
        return [*pieces, solids.spire(ring(r), center, z0=drum_top, z1=top)]
    share = 0.85 if building.dome == "dome" else 0.6
    angles = np.linspace(0.0, 0.4 * np.pi, 5)
    radii = r * np.cos(angles)
    heights = drum_top + share * rise * np.sin(angles)
    profile = list(zip(radii, heights, strict=True))
    pieces.append(solids.revolved(profile, 12, center=center))
    lid = heights[-1]
    tip = ring(radii[-1])
    if building.dome == "lantern":
        core = ring(0.6 * radii[-1])
        middle = lid + 0.55 * (top - lid)
        pieces.append(solids.prism(core, z0=lid, z1=middle))
        pieces.append(solids.flat(tip, middle, up=False))
        lid = middle
    return [*pieces, solids.spire(tip, center, z0=lid, z1=top)]


def _is_front(plan: np.ndarray, edge: int) -> bool:
    """Returns whether a wall faces the front or is part of the round corner."""
    along = plan[(edge + 1) % len(plan)] - plan[edge]
    return edge == 0 or (along[0] > 0.1 and abs(along[1]) > 0.1)
