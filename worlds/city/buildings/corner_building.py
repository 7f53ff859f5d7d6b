"""The corner building: a street block with a round corner under a dome."""

from collections.abc import Sequence

import numpy as np

from evaluation.base import cos, sin
from worlds.city.facades import (
    Band,
    Building,
    Facade,
    Relief,
    WallFrame,
    around,
    balconies,
    bays,
    canopies,
    foot_band,
    piers,
    solids,
    tiers,
    top_band,
)
from worlds.shapes import FRONT_LEFT, FRONT_RIGHT, Mesh, equip_roof, outlines

_ROOF_ITEMS = ("stair_house", "skylight", "vents", "ac_unit")
# The radius of the corner depends on the site up to this side [m].
_MOST_SIDE_M = 24.0
# Greatest number of windows around the whole building.
_MOST_BAYS = 36
# Greatest length of the chords of the round corner [m].
_CHORD_M = 2.8
# Shorter walls are chords of the round corner [m].
_CHORD_WALL_M = 3.0
# Distance of the bays of a storey from the ends of a wall [m].
_END_M = 0.3
# Distance of the shops from the ends of a wall [m].
_SHOP_END_M = 0.35
# Depth of the windows of the ground floor [m].
_SHOP_RECESS_M = 0.4
# Height of the walls above the topmost storey: cornice and parapet [m].
_CROWN_M = 2.2
# Height of the parapet above the roof [m].
_PARAPET_M = 0.8
# Radius of the drum below the dome, as a share of the radius of the corner.
_DRUM_SHARE = 0.62
# Number of sides of drum and dome.
_DOME_SIDES = 12
# Least depth of the roof behind the dome for equipment [m].
_LEAST_ROOF_M = 5.0


class CornerBuilding(Building):
    """The corner house: a curved front, arched windows, a dome or a lantern.

    `corner` is the rounded corner of the rectangle (`FRONT_LEFT` or
    `FRONT_RIGHT`) and `radius` its radius.
    """

    def draw(self) -> None:
        """Samples sizes and style."""
        site = self.site
        side = min(site.width, site.depth, _MOST_SIDE_M)
        self.corner = self.pick(site.free_corners or [FRONT_LEFT, FRONT_RIGHT])
        self.radius = round(self.uniform(0.3, 0.42) * side, 1)
        self.ground_height = self.uniform(4.6, 5.4, digits=2)
        self.first_height = self.uniform(4.2, 4.8, digits=2)
        self.storey_height = self.uniform(3.3, 3.8)
        self.pitch = max(self.uniform(2.5, 3.2), site.open_length / _MOST_BAYS)
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
        plan = outlines.rounded(
            rectangle, {self.corner: self.radius}, step=_CHORD_M
        )
        blind = outlines.edges_on(plan, rectangle, site.blind_edges)
        bottom = _add_shops(self, plan, blind)
        top = _add_first_floor(self, plan, blind, bottom)
        top = _add_upper_floors(self, plan, blind, top)
        if self.pilasters:
            strips = piers.pilasters(
                plan,
                pitch=self.pitch,
                margin=_END_M,
                every=2,
                reach=0.16,
                z0=bottom,
                z1=top,
                skip=blind,
            )
            self.add("pilasters", strips)
        cornice = tiers.cornice(
            height=_CROWN_M - _PARAPET_M, reach=self.cornice_reach
        )
        crown = Facade(_CROWN_M, bands=cornice, plain=blind)
        roof = tiers.add_crown(self, plan, crown, z0=top, parapet=_PARAPET_M)
        self.add("dome", *_dome(self, plan, roof), finish=self.colours["roof"])
        x0, y0, x1, y1 = site.bounds
        behind_dome = y0 + 2 * self.radius
        if y1 - y0 - 2 * self.radius > _LEAST_ROOF_M:
            free = outlines.rectangle(x0, behind_dome, x1, y1)
            equip_roof(self, free, roof, _ROOF_ITEMS)


def _add_shops(
    building: CornerBuilding, plan: np.ndarray, blind: frozenset[int]
) -> float:
    """Adds the ground floor; returns the height of its top [m].

    The round corner is glazed, and walls that face the back have a gate. All
    other walls have shops, with awnings in front.

    Args:
        building: the building.
        plan: (N, 2) corners of the walls [m].
        blind: numbers of the walls against a neighbour.
    """
    height = building.ground_height
    head, depth = height - 1.2, _SHOP_RECESS_M
    pitch = 2 * building.pitch
    choices = [
        bays.shop_front(head=head, depth=depth, pier=0.25, door=has_door)
        for has_door in (True, False)
    ]
    shops = bays.rhythm(pitch, choices, margin=_SHOP_END_M)
    pane = bays.shop_front(head=head, depth=depth, door=False, pier=0.15)
    glazed = bays.rhythm(3.0, [pane], margin=0.1)
    window = bays.window(width=1.4, sill=1.5, head=head, depth=depth)
    service = bays.with_middle(
        bays.rhythm(2.5 * building.pitch, [window], margin=1.0),
        bays.gate(width=2.6, height=2.9, depth=depth),
        width=3.4,
    )

    def layout(edge: int, length: float) -> Sequence[Relief]:
        if length < _CHORD_WALL_M:
            return glazed(edge, length)
        along = plan[(edge + 1) % len(plan)] - plan[edge]
        return (service if along[0] < -0.1 else shops)(edge, length)

    front = WallFrame(plan, 0)
    cells = bays.stretches(front.length, pitch=pitch, margin=_SHOP_END_M)
    shape = canopies.AwningShape(narrower=0.3, reach=1.3, z0=2.7, z1=head)
    awnings = canopies.awnings(
        front, cells, building.rng, share=0.5, shape=shape
    )
    canopies.add_awnings(building, awnings)
    walls = Facade(
        height,
        bands=(
            foot_band(height=0.3, reach=0.06),
            Band(z0=height - 1.0, z1=height - 0.2, depth=-0.15),
        ),
        layout=layout,
        glass=(depth,),
        plain=blind,
    )
    return tiers.add_ground(building, plan, walls)


def _add_first_floor(
    building: CornerBuilding, plan: np.ndarray, blind: frozenset[int], z0: float
) -> float:
    """Adds the tall main floor with arched windows; returns its top [m]."""
    height = building.first_height
    arched = bays.arched(
        width=building.window_width,
        bottom=0.5,
        spring=height - 1.6,
        depth=building.recess,
    )
    plain = bays.window(
        width=building.window_width,
        sill=0.5,
        head=height - 0.9,
        depth=building.recess,
    )
    fronts = {
        edge: bays.rhythm(building.pitch, [arched], margin=_END_M)
        for edge in range(len(plan))
        if _is_front(plan, edge)
    }
    others = bays.rhythm(building.pitch, [plain], margin=_END_M)
    floor = Facade(
        height,
        bands=(top_band(height, height=0.4, reach=0.18),),
        layout=bays.by_edge(fronts, others),
        glass=(building.recess,),
        plain=blind,
    )
    rails: list[Mesh] = []
    if building.balcony:
        for edge in fronts:
            if edge not in blind:
                rails += _first_floor_balconies(building, plan, edge)
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


def _first_floor_balconies(
    building: CornerBuilding, plan: np.ndarray, edge: int
) -> list[Mesh]:
    """Returns a balcony in front of every third window of a wall."""
    wall = WallFrame(plan, edge)
    cells = bays.stretches(wall.length, pitch=building.pitch, margin=_END_M)
    rails = []
    for start, end in cells[len(cells) // 3 :: 3]:
        x0, x1 = around(round((start + end) / 2, 2), 0.9)
        rail = balconies.balcony(x0=x0, x1=x1, reach=0.8, z=0.25, rail=0.9)
        rails.append(wall.place(rail))
    return rails


def _add_upper_floors(
    building: CornerBuilding, plan: np.ndarray, blind: frozenset[int], z0: float
) -> float:
    """Adds the storeys above the main floor; returns their top [m]."""
    room = building.height - building.dome_height - _CROWN_M - z0
    groups, per_group, storey = tiers.storey_groups(
        room, storey=building.storey_height
    )
    window = bays.window(
        width=building.window_width,
        sill=0.8,
        head=storey - 0.7,
        depth=building.recess,
        hood=building.hood,
    )
    walls = Facade(
        storey,
        bands=(Band(z0=0.6, z1=0.8, depth=-0.1),),
        layout=bays.rhythm(building.pitch, [window], margin=_END_M),
        glass=(building.recess,),
        plain=blind,
    )
    return tiers.add_storeys(
        building, plan, walls, z0=z0, groups=groups, per_group=per_group
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
    radius = _DRUM_SHARE * building.radius
    top = building.height
    drum_top = round(z0 + 0.4 * (top - z0), 2)

    def ring(radius: float) -> np.ndarray:
        return outlines.regular_polygon(
            radius=radius, count=_DOME_SIDES, center=center
        )

    drum = _drum(ring(radius), z0, drum_top)
    if building.dome == "cone":
        cone = solids.spire(ring(radius), center, z0=drum_top, z1=top)
        return [drum, cone]
    # The dome ends below the tip, where the lantern or the spire begins.
    share = 0.85 if building.dome == "dome" else 0.6
    angles = np.linspace(0.0, 0.4 * np.pi, 5)
    radii = radius * cos(angles)
    heights = drum_top + share * (top - drum_top) * sin(angles)
    profile = list(zip(radii, heights, strict=True))
    pieces = [drum, solids.revolved(profile, _DOME_SIDES, center=center)]
    spire_foot = heights[-1]
    lid = ring(radii[-1])
    if building.dome == "lantern":
        core = ring(0.6 * radii[-1])
        lantern_top = spire_foot + 0.55 * (top - spire_foot)
        pieces.append(solids.prism(core, z0=spire_foot, z1=lantern_top))
        pieces.append(solids.flat(lid, lantern_top, up=False))
        spire_foot = lantern_top
    return [*pieces, solids.spire(lid, center, z0=spire_foot, z1=top)]


def _drum(outline: np.ndarray, z0: float, z1: float) -> Mesh:
    """Returns the drum below the dome, with recesses between posts.

    `outline` contains its corners (N, 2), `z0` is the height of its foot, and
    `z1` the height of its top [m].
    """
    height = z1 - z0
    recess = Band(z0=0.9, z1=height - 0.7, depth=0.25)
    post = bays.bar(width=0.4, z0=recess.z0, z1=recess.z1, depth=0.0)
    walls = Facade(
        height,
        bands=(recess, top_band(height, height=0.35, reach=0.3)),
        layout=bays.rhythm(4.0, [post], margin=0.1),
    )
    return tiers.lidded_walls(outline, walls, z0)


def _is_front(plan: np.ndarray, edge: int) -> bool:
    """Returns whether a wall faces the front or is part of the round corner."""
    along = plan[(edge + 1) % len(plan)] - plan[edge]
    return edge == 0 or (along[0] > 0.1 and abs(along[1]) > 0.1)
