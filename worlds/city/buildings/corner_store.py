"""The corner store: a shop at a cut corner, with flats above."""

from typing import NamedTuple

import numpy as np

from worlds.city.facades import (
    Building,
    Facade,
    WallFrame,
    around,
    bays,
    canopies,
    foot_band,
    tiers,
    top_band,
)
from worlds.shapes import FRONT_LEFT, FRONT_RIGHT, Mesh, equip_roof, outlines

# Greatest number of windows along the front and one side together.
_MOST_BAYS = 20
# Least height above the shop for a storey of flats [m].
_LEAST_STOREY_M = 2.4
# Height of the walls above the topmost storey, except at the corner [m].
_RIM_M = 0.6
# Depth of the shop windows [m].
_SHOP_RECESS_M = 0.3
# Distance of the bays from the ends of a wall [m].
_END_M = 0.5
# Number of walls: the four sides, and the cut corner.
_WALLS = 5


class _Walls(NamedTuple):
    """The outline of the store, and the numbers of its walls.

    Attributes:
        plan: corners (5, 2) of the outline [m].
        corner: number of the wall across the corner, which has the door.
        shops: numbers of the two walls with shop windows beside the corner.
        blind: numbers of the walls against a neighbour.
    """

    plan: np.ndarray
    corner: int
    shops: tuple[int, int]
    blind: frozenset[int]


class CornerStore(Building):
    """The corner store: a door across the corner, flats above the shop."""

    def draw(self) -> None:
        """Samples sizes and style."""
        site = self.site
        # Rise of the parapet above the corner.
        self.raised = self.uniform(0.3, 0.9, digits=2)
        self.ground = round(
            min(self.uniform(3.5, 4.1), self.height - self.raised - 0.7), 2
        )
        self.corner = self.pick(site.free_corners or [FRONT_LEFT, FRONT_RIGHT])
        # Length taken off each edge at the corner.
        self.cut = round(min(self.uniform(2.0, 3.0), 0.3 * site.depth), 2)
        self.storey = self.uniform(2.9, 3.3)
        least_pitch = (site.width + site.depth) / _MOST_BAYS
        self.pitch = max(self.uniform(2.2, 3.0), least_pitch)
        self.window_width = self.uniform(1.0, 1.5, digits=2)
        self.recess = self.uniform(0.12, 0.25, digits=2)
        self.ledge = self.pick((0.0, 0.1))
        self.cornice = self.uniform(0.15, 0.4, digits=2)
        # Share of the shop windows with an awning.
        self.awnings = self.uniform(0.2, 0.9)
        self.roof_items = self.draw_roof_items(
            "stair_house ac_unit vents", low=1, high=4
        )

    def build(self) -> None:
        """Adds all parts of the corner store.

        The building's site must be a rectangle.
        """
        walls = _walls(self)
        top = _add_shop(self, walls)
        room = self.height - (self.raised + _RIM_M) - top
        if room > _LEAST_STOREY_M:
            top = _add_flats(self, walls, top, room)
        _add_parapet(self, walls, top)
        corner = WallFrame(walls.plan, walls.corner)
        sign = _corner_sign(self, corner)
        self.add("sign", *sign, finish=self.colours["sign"])


def _walls(store: CornerStore) -> _Walls:
    """Returns the outline of the store, and the numbers of its walls.

    If the corner touches a neighbour, all walls stand back from neighbours.
    """
    site = store.site
    if store.corner not in site.free_corners:
        site = site.detached(store.kind.overhang)
    rectangle = site.outline
    plan, corner = _cut_rectangle(store, rectangle)
    blind = outlines.edges_on(plan, rectangle, site.blind_edges)
    along = -1 if store.corner == FRONT_LEFT else 1
    side = (corner + along) % _WALLS
    return _Walls(plan, corner, (0, side), blind)


def _cut_rectangle(
    store: CornerStore, rectangle: np.ndarray
) -> tuple[np.ndarray, int]:
    """Cuts one front corner off a rectangle.

    Returns:
        The five corners of the outline (5, 2) [m], and the number of the edge
        that replaces the corner.
    """
    (x0, y0), (x1, y1) = rectangle[0], rectangle[2]
    cut = store.cut
    if store.corner == FRONT_RIGHT:
        points = [(x0, y0), (x1 - cut, y0), (x1, y0 + cut), (x1, y1), (x0, y1)]
        return np.array(points), 1
    points = [(x0 + cut, y0), (x1, y0), (x1, y1), (x0, y1), (x0, y0 + cut)]
    return np.array(points), 4


def _add_shop(store: CornerStore, walls: _Walls) -> float:
    """Adds the ground floor with its shop; returns the height of its top [m].

    The door is in the wall across the corner. The two walls beside it have shop
    windows, and the others have windows and gates.
    """
    height = store.ground
    head = round(height - 1.0, 2)
    shop_window = bays.shop_front(head=head, depth=_SHOP_RECESS_M, door=False)
    shop = bays.rhythm(2 * store.pitch, [shop_window], margin=_END_M)
    entrance = bays.alone(
        bays.entrance(width=1.6, height=2.4, depth=0.7, surround=0.1),
        width=store.cut,
    )
    service = [
        bays.window(width=1.2, sill=1.3, head=2.3, depth=_SHOP_RECESS_M),
        bays.gate(width=1.8, height=2.2),
    ]
    layouts = dict.fromkeys(walls.shops, shop) | {walls.corner: entrance}
    facade = Facade(
        height,
        bands=(
            foot_band(height=0.3, reach=0.05),
            top_band(height, height=0.25, reach=0.12),
        ),
        layout=bays.by_edge(layouts, bays.rhythm(4.0, service, margin=0.7)),
        glass=(_SHOP_RECESS_M,),
        plain=walls.blind,
    )
    _add_awnings_and_boards(store, walls, head)
    return tiers.add_ground(store, walls.plan, facade)


def _add_awnings_and_boards(
    store: CornerStore, walls: _Walls, head: float
) -> None:
    """Adds a board above each shop window, and awnings to some of them.

    `head` is the height of the tops of the shop windows [m].
    """
    shape = canopies.AwningShape(
        narrower=0.2, reach=0.95, z0=2.4, z1=head + 0.05
    )
    awnings, boards = [], []
    for edge in walls.shops:
        if edge in walls.blind:
            continue
        wall = WallFrame(walls.plan, edge)
        windows = bays.stretches(
            wall.length, pitch=2 * store.pitch, margin=_END_M
        )
        for start, end in windows:
            board = wall.box(
                x=(start + 0.3, end - 0.3),
                y=(-0.02, 0.1),
                z=(head + 0.1, head + 0.7),
            )
            boards.append(board)
        awnings += canopies.awnings(
            wall, windows, store.rng, share=store.awnings, shape=shape
        )
    canopies.add_awnings(store, awnings)
    store.add("boards", *boards, finish=store.colours["sign"])


def _add_flats(
    store: CornerStore, walls: _Walls, z0: float, room: float
) -> float:
    """Adds the storeys above the shop; returns the height of their top [m].

    `z0` is the height of their floor, and `room` the height of all storeys
    together [m].
    """
    groups, per_group, storey = tiers.storey_groups(
        room, storey=store.storey, most=4
    )
    window = bays.window(
        width=store.window_width,
        sill=0.85,
        head=min(2.3, storey - 0.35),
        depth=store.recess,
        ledge=store.ledge,
    )
    facade = Facade(
        storey,
        layout=bays.rhythm(store.pitch, [window], margin=_END_M),
        glass=(store.recess,),
        plain=walls.blind,
    )
    return tiers.add_storeys(
        store, walls.plan, facade, z0=z0, groups=groups, per_group=per_group
    )


def _add_parapet(store: CornerStore, walls: _Walls, z0: float) -> None:
    """Adds the cornice and the roof; the parapet is higher at the corner.

    `z0` is the height of the foot of the topmost walls [m].
    """
    rim = round(store.height - store.raised - z0, 3)
    cornice = tiers.cornice(
        height=rim - 0.1, reach=store.cornice, thickness=0.45, steps=2
    )
    crown = Facade(rim, bands=cornice, plain=walls.blind)
    roof = tiers.add_crown(
        store, walls.plan, crown, z0=z0, parapet=0.5, thickness=0.25
    )
    corner = WallFrame(walls.plan, walls.corner)
    pediment = corner.box(
        x=(0.1, corner.length - 0.1),
        y=(-0.25, 0.04),
        z=(z0 + rim - 0.3, store.height),
    )
    store.add("pediment", pediment)
    equip_roof(store, walls.plan, roof, store.roof_items)


def _corner_sign(store: CornerStore, wall: WallFrame) -> list[Mesh]:
    """Returns a canopy above the door and an upright sign over it."""
    middle, z = wall.length / 2, store.ground - 0.55
    half = 0.5 * wall.length - 0.25
    top = min(store.height - 0.4, z + 2.6)
    return [
        wall.box(x=around(middle, half), y=(-0.05, 0.9), z=(z - 0.25, z)),
        wall.box(x=around(middle, 0.1), y=(-0.05, 0.75), z=(z - 0.05, top)),
    ]
