"""The podium tower."""

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
    foot_band,
    outlines,
    solids,
    tiers,
)
from cns_drake.city.geometry import Finish
from cns_drake.city.geometry.mesh import Mesh, merge_meshes

_ROOF_ITEMS = (
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
        self.ground_height = self.uniform(4.8, 5.6, digits=2)
        self.storey_height = self.uniform(3.2, 3.7)
        self.shop_pitch = self.uniform(5.5, 7.5) * min(
            1.3, max(1.0, (site.width + site.depth) / 70)
        )
        # Place of the tower along x and y, as a share of the free length there.
        self.at = self.rng.choice([0.15, 0.5, 0.85], 2).tolist()
        self.chamfer = self.pick((0.0, 2.0, 3.5))
        self.pitch = max(self.uniform(3.0, 4.2), run / 19)
        self.recess = self.uniform(0.35, 0.5, digits=2)
        self.frame = self.uniform(0.5, 0.9, digits=2)
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
            self,
            base,
            walls,
            z0=top,
            groups=self.podium_storeys,
            per_group=1,
            part="podium",
        )
        edge = Facade(
            1.6,
            bands=(
                Band(z0=0.2, z1=0.7, depth=-0.3),
                Band(z0=1.4, z1=1.6, depth=-0.1),
            ),
        )
        roof = tiers.add_crown(
            self, base, edge, z0=top, parapet=1.2, part="terrace"
        )
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


def _add_shops(building: PodiumTower) -> float:
    outline, h = building.site.outline, building.ground_height
    front = WallFrame(outline, 0)
    pitch = building.shop_pitch
    choices = [
        bays.shop_front(head=h - 0.6, depth=0.45, door=d) for d in (True, False)
    ]
    shops = bays.rhythm(pitch, choices, margin=0.8)
    gates = [bays.gate(width=4.0, height=3.4), bays.blank]
    main = bays.with_middle(
        shops, bays.entrance(width=4.0, height=3.8, depth=1.6), width=6.0
    )
    service = bays.rhythm(pitch, gates, margin=1.0)
    layout = bays.by_edge({0: main, 2: service}, shops)
    bands = (
        foot_band(height=0.3, reach=0.06),
        Band(z0=h - 1.1, z1=h - 0.2, depth=-0.2),
    )
    cells = bays.stretches(front.length, pitch=pitch, margin=0.8)
    shape = canopies.AwningShape(narrower=0.4, reach=1.35, z0=2.7, z1=h - 1.3)
    shades = canopies.awnings(
        front,
        cells,
        building.rng,
        share=building.awnings,
        shape=shape,
        door=3.2,
    )
    canopies.add_awnings(building, shades)
    roof = canopies.front_canopy(outline, half=3.2, reach=1.45, z=4.0)
    facade = Facade(h, bands=bands, layout=layout, glass=(0.45,))
    return tiers.add_ground(building, outline, facade, extras=[roof])


def _podium_storey(building: PodiumTower) -> Facade:
    storey = 4.2
    window = bays.window(
        width=building.shop_pitch - 1.4,
        sill=0.7,
        head=storey - 0.7,
        depth=0.3,
        mullions=2,
    )
    layout = bays.rhythm(building.shop_pitch, [window], margin=0.8)
    return Facade(
        storey,
        bands=(foot_band(height=0.25, reach=0.12),),
        layout=layout,
        glass=(0.3,),
    )


def _add_tower(building: PodiumTower, plan: np.ndarray, z0: float) -> None:
    room = building.height - 3.0 - z0
    groups, per_group, storey = tiers.storey_groups(
        room, storey=building.storey_height
    )
    # Deep frames, one bay wide, with the glass at their backs.
    frame = bays.window(
        width=1e3,
        sill=round(building.frame / 2, 2),
        head=round(storey - building.frame / 2, 2),
        depth=building.recess,
        pier=round(building.frame / 2, 2),
        mullions=building.mullions,
    )
    layout = bays.rhythm(building.pitch, [frame], margin=0.5)
    walls = Facade(storey, bands=(), layout=layout, glass=(building.recess,))
    extras = []
    for edge in range(len(plan)) if building.balconies else ():
        wall = WallFrame(plan, edge)
        if wall.length > 3 * building.pitch:
            x = 0.5 + building.pitch
            extras.append(
                wall.place(
                    balconies.balcony(x0=x - 2.6, x1=x, reach=1.4, z=0.0)
                )
            )
    top = tiers.add_storeys(
        building,
        plan,
        walls,
        z0=z0,
        groups=groups,
        per_group=per_group,
        extras=extras,
    )
    crown = round(building.height - top, 3)
    louvres = tuple(
        Band(z0=z, z1=z + 0.35, depth=0.15) for z in (0.5, 1.2, 1.9)
    )
    screen = Facade(
        crown, bands=(*louvres, Band(z0=2.6, z1=crown, depth=-0.15))
    )
    items = _ROOF_ITEMS
    tiers.add_crown(building, plan, screen, z0=top, parapet=2.2, items=items)


def _add_garden(building: PodiumTower, tower: np.ndarray, z: float) -> None:
    """Adds planters and a pergola to the podium roof's widest free strip."""
    x0, y0, x1, y1 = building.site.bounds
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
    building.add("garden", garden, finish=Finish((0.45, 0.40, 0.33)))


def _garden(length: float, width: float) -> Mesh:
    """Returns planters along x, with a pergola behind them."""
    planters = (
        ((u * length, (u + 0.12) * length), (0.0, 1.2), (-0.1, 0.8))
        for u in (0.1, 0.32, 0.54, 0.76)
    )
    places = [round(u * length, 2) for u in np.linspace(0.25, 0.75, 7)]
    beams = (
        solids.box(x=(x, x + 0.15), y=(1.5, width), z=(2.6, 2.85))
        for x in places
    )
    posts = (
        ((x, x + 0.15), (y, y + 0.15), (-0.1, 2.7))
        for x in (places[0], places[-1])
        for y in (1.6, width - 0.2)
    )
    return merge_meshes(
        *(solids.box(x, y, z, bottom=False) for x, y, z in planters),
        *beams,
        *(solids.box(x, y, z, bottom=False) for x, y, z in posts),
    )
