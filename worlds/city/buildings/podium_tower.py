"""The podium tower."""

import math

import numpy as np

from worlds.city.facades import (
    Band,
    Building,
    Facade,
    WallFrame,
    balconies,
    bays,
    canopies,
    foot_band,
    solids,
    tiers,
)
from worlds.shapes import Finish, Mesh, merge_meshes, outlines

_ROOF_ITEMS = (
    "lift_house",
    "cooling_tower",
    "air_handler",
    "mast",
)

# Greatest number of windows around the tower.
_MOST_BAYS = 19
# Height of a storey of the podium [m].
_PODIUM_STOREY_M = 4.2
# Height of the walls around the terrace on the podium [m].
_TERRACE_WALL_M = 1.6
# Height of everything above the topmost storey [m].
_TOP_M = 3.0
# Depth of the shop windows [m].
_SHOP_RECESS_M = 0.45
# Depth of the windows of the podium [m].
_PODIUM_RECESS_M = 0.3
# Distance of the shops from the ends of a wall [m].
_SHOP_END_M = 0.8
# Half the width of the stretch of the front for the door and its canopy [m].
_DOOR_HALF_M = 3.2
# Width of a balcony [m].
_BALCONY_M = 2.6
# Distance of the tower's bays from its corners [m].
_END_M = 0.5
# Distance of the garden from the edges of the terrace [m].
_GARDEN_EDGE_M = 1.4
# Least width of a garden [m].
_LEAST_GARDEN_M = 2.0
# Side of the posts, and width of the beams, of a pergola [m].
_PERGOLA_M = 0.15
# Finish of planters and pergola.
_GARDEN = Finish((0.45, 0.40, 0.33))


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
        self.pitch = max(self.uniform(3.0, 4.2), run / _MOST_BAYS)
        self.recess = self.uniform(0.35, 0.5, digits=2)
        self.frame = self.uniform(0.5, 0.9, digits=2)
        self.mullions = int(run < 70.0)
        self.balconies = self.chance(0.5)
        self.awnings = self.uniform(0.3, 0.9)

    def build(self) -> None:
        """Adds all parts of the podium and of the tower on it.

        The building's site must be a rectangle.
        """
        base = self.site.outline
        top = _add_shops(self)
        top = tiers.add_storeys(
            self,
            base,
            _podium_storey(self),
            z0=top,
            groups=self.podium_storeys,
            per_group=1,
            part="podium",
        )
        height = _TERRACE_WALL_M
        bands = (
            Band(z0=0.2, z1=0.7, depth=-0.3),
            Band(z0=1.4, z1=height, depth=-0.1),
        )
        walls = Facade(height, bands=bands)
        roof = tiers.add_crown(
            self, base, walls, z0=top, parapet=1.2, part="terrace"
        )
        plan = _tower_outline(self)
        _add_garden(self, plan, roof)
        if self.chamfer:
            plan = outlines.chamfered(plan, self.chamfer)
        self.walls = self.tower_walls
        _add_tower(self, plan, roof)


def _tower_outline(building: PodiumTower) -> np.ndarray:
    """Returns the outline (4, 2) of the tower on the podium [m]."""
    x0, y0, x1, y1 = building.site.bounds
    x_share, y_share = building.tower
    x_at, y_at = building.at
    width, depth = x_share * (x1 - x0), y_share * (y1 - y0)
    left = round(x0 + x_at * (x1 - x0 - width), 2)
    near = round(y0 + y_at * (y1 - y0 - depth), 2)
    right, far = round(left + width, 2), round(near + depth, 2)
    return outlines.rectangle(left, near, right, far)


def _add_shops(building: PodiumTower) -> float:
    """Adds the ground floor of the podium; returns the height of its top [m].

    Shops are on three sides, and gates for deliveries at the back.
    """
    outline, height = building.site.outline, building.ground_height
    pitch = building.shop_pitch
    choices = [
        bays.shop_front(head=height - 0.6, depth=_SHOP_RECESS_M, door=has_door)
        for has_door in (True, False)
    ]
    shops = bays.rhythm(pitch, choices, margin=_SHOP_END_M)
    entrance = bays.entrance(width=4.0, height=3.8, depth=1.6)
    front = bays.with_middle(shops, entrance, width=6.0)
    gates = [bays.gate(width=4.0, height=3.4), bays.blank]
    service = bays.rhythm(pitch, gates, margin=1.0)
    walls = Facade(
        height,
        bands=(
            foot_band(height=0.3, reach=0.06),
            Band(z0=height - 1.1, z1=height - 0.2, depth=-0.2),
        ),
        layout=bays.by_edge({0: front, 2: service}, shops),
        glass=(_SHOP_RECESS_M,),
    )
    _add_awnings(building)
    canopy = canopies.front_canopy(
        outline, half=_DOOR_HALF_M, reach=1.45, z=4.0
    )
    return tiers.add_ground(building, outline, walls, extras=[canopy])


def _add_awnings(building: PodiumTower) -> None:
    """Adds awnings to some of the shops in front."""
    front = WallFrame(building.site.outline, 0)
    shops = bays.stretches(
        front.length, pitch=building.shop_pitch, margin=_SHOP_END_M
    )
    shape = canopies.AwningShape(
        narrower=0.4, reach=1.35, z0=2.7, z1=building.ground_height - 1.3
    )
    awnings = canopies.awnings(
        front,
        shops,
        building.rng,
        share=building.awnings,
        shape=shape,
        door=_DOOR_HALF_M,
    )
    canopies.add_awnings(building, awnings)


def _podium_storey(building: PodiumTower) -> Facade:
    """Returns the walls of a storey of the podium above the shops."""
    window = bays.window(
        width=building.shop_pitch - 1.4,
        sill=0.7,
        head=_PODIUM_STOREY_M - 0.7,
        depth=_PODIUM_RECESS_M,
        mullions=2,
    )
    return Facade(
        _PODIUM_STOREY_M,
        bands=(foot_band(height=0.25, reach=0.12),),
        layout=bays.rhythm(building.shop_pitch, [window], margin=_SHOP_END_M),
        glass=(_PODIUM_RECESS_M,),
    )


def _add_tower(building: PodiumTower, plan: np.ndarray, z0: float) -> None:
    """Adds the storeys of the tower, and a screen around its roof.

    `plan` contains the corners (N, 2) of the tower, and `z0` is the height of
    its foot [m].
    """
    room = building.height - _TOP_M - z0
    groups, per_group, storey = tiers.storey_groups(
        room, storey=building.storey_height
    )
    # Deep frames, one bay wide, with the glass at their backs.
    frame_half = building.frame / 2
    frame = bays.window(
        width=1e3,
        sill=round(frame_half, 2),
        head=round(storey - frame_half, 2),
        depth=building.recess,
        pier=round(frame_half, 2),
        mullions=building.mullions,
    )
    layout = bays.rhythm(building.pitch, [frame], margin=_END_M)
    walls = Facade(storey, layout=layout, glass=(building.recess,))
    rails = _tower_balconies(building, plan) if building.balconies else []
    top = tiers.add_storeys(
        building,
        plan,
        walls,
        z0=z0,
        groups=groups,
        per_group=per_group,
        extras=rails,
    )
    crown = round(building.height - top, 3)
    louvres = tuple(
        Band(z0=z, z1=z + 0.35, depth=0.15) for z in (0.5, 1.2, 1.9)
    )
    rim = Band(z0=2.6, z1=crown, depth=-0.15)
    screen = Facade(crown, bands=(*louvres, rim))
    tiers.add_crown(
        building, plan, screen, z0=top, parapet=2.2, items=_ROOF_ITEMS
    )


def _tower_balconies(building: PodiumTower, plan: np.ndarray) -> list[Mesh]:
    """Returns a balcony for each wall of a storey that is long enough."""
    rails = []
    for edge in range(len(plan)):
        wall = WallFrame(plan, edge)
        if wall.length > 3 * building.pitch:
            # The balcony ends where the second bay begins.
            end = _END_M + building.pitch
            rail = balconies.balcony(
                x0=end - _BALCONY_M, x1=end, reach=1.4, z=0.0
            )
            rails.append(wall.place(rail))
    return rails


def _add_garden(building: PodiumTower, tower: np.ndarray, z: float) -> None:
    """Adds planters and a pergola to the podium roof's widest free strip.

    `tower` is the outline (4, 2) of the tower, and `z` the height of the roof
    [m].
    """
    x0, y0, x1, y1 = building.site.bounds
    (left, near), (right, far) = tower[0], tower[2]
    strips = (
        (x0, y0, left, y1),
        (right, y0, x1, y1),
        (x0, y0, x1, near),
        (x0, far, x1, y1),
    )
    x0, y0, x1, y1 = max(
        strips, key=lambda s: round(min(s[2] - s[0], s[3] - s[1]), 6)
    )
    x0, x1 = x0 + _GARDEN_EDGE_M, x1 - _GARDEN_EDGE_M
    y0, y1 = y0 + _GARDEN_EDGE_M, y1 - _GARDEN_EDGE_M
    if min(x1 - x0, y1 - y0) < _LEAST_GARDEN_M:
        return
    if x1 - x0 > y1 - y0:
        garden = _garden(x1 - x0, y1 - y0).moved((x0, y0, z))
    else:
        garden = _garden(y1 - y0, x1 - x0).moved((x1, y0, z), math.pi / 2)
    building.add("garden", garden, finish=_GARDEN)


def _garden(length: float, width: float) -> Mesh:
    """Returns planters along x, with a pergola behind them."""
    planters = (
        solids.box(
            x=(start * length, (start + 0.12) * length),
            y=(0.0, 1.2),
            z=(-0.1, 0.8),
            bottom=False,
        )
        for start in (0.1, 0.32, 0.54, 0.76)
    )
    spots = [round(share * length, 2) for share in np.linspace(0.25, 0.75, 7)]
    beams = (
        solids.box(x=(x, x + _PERGOLA_M), y=(1.5, width), z=(2.6, 2.85))
        for x in spots
    )
    posts = (
        solids.box(
            x=(x, x + _PERGOLA_M),
            y=(y, y + _PERGOLA_M),
            z=(-0.1, 2.7),
            bottom=False,
        )
        for x in (spots[0], spots[-1])
        for y in (1.6, width - 0.2)
    )
    return merge_meshes(*planters, *beams, *posts)
