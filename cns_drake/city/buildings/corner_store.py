"""The corner store: a shop at a cut corner, with flats above."""

import numpy as np

from cns_drake.city.facades import (
    Band,
    Building,
    Facade,
    WallFrame,
    around,
    bays,
    canopies,
    equip_roof,
    outlines,
    tiers,
)
from cns_drake.city.facades.site import FRONT_LEFT, FRONT_RIGHT
from cns_drake.city.geometry.mesh import Mesh


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
        self.pitch = max(self.uniform(2.2, 3.0), (site.width + site.depth) / 20)
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
        site = self.site
        if self.corner not in site.free_corners:
            site = site.detached(self.kind.overhang)
        rectangle = site.outline
        plan, front = _cut_rectangle(self, rectangle)
        blind = outlines.edges_on(plan, rectangle, site.blind_edges)
        along = -1 if self.corner == FRONT_LEFT else 1
        side = (front + along) % 5
        top = _add_shop(self, plan, (0, front, side), blind)
        room = self.height - (self.raised + 0.6) - top
        if room > 2.4:
            groups, per_group, storey = tiers.storey_groups(
                room, storey=self.storey, most=4
            )
            head = min(2.3, storey - 0.35)
            window = bays.window(
                width=self.window_width,
                sill=0.85,
                head=head,
                depth=self.recess,
                ledge=self.ledge,
            )
            rows = bays.rhythm(self.pitch, [window], margin=0.5)
            walls = Facade(
                storey, bands=(), layout=rows, glass=(self.recess,), plain=blind
            )
            top = tiers.add_storeys(
                self, plan, walls, z0=top, groups=groups, per_group=per_group
            )
        _add_parapet(self, plan, front, top, blind)
        wall = WallFrame(plan, front)
        self.add("sign", *_corner_sign(self, wall), finish=self.colours["sign"])


def _cut_rectangle(
    store: CornerStore, rectangle: np.ndarray
) -> tuple[np.ndarray, int]:
    """Cuts one front corner off a rectangle.

    Returns:
        The five corners of the outline (5, 2) [m], and the number of the edge
        that replaces the corner.
    """
    (x0, y0), (x1, y1) = rectangle[0], rectangle[2]
    c = store.cut
    if store.corner == FRONT_RIGHT:
        points = [(x0, y0), (x1 - c, y0), (x1, y0 + c), (x1, y1), (x0, y1)]
        return np.array(points), 1
    points = [(x0 + c, y0), (x1, y0), (x1, y1), (x0, y1), (x0, y0 + c)]
    return np.array(points), 4


def _add_shop(
    store: CornerStore,
    plan: np.ndarray,
    streets: tuple[int, int, int],
    blind: frozenset[int],
) -> float:
    h = store.ground
    pitch = 2 * store.pitch
    head = round(h - 1.0, 2)
    front = streets[1]
    shop = bays.shop_front(head=head, depth=0.3, door=False)
    glazed = bays.rhythm(pitch, [shop], margin=0.5)
    entry = bays.alone(
        bays.entrance(width=1.6, height=2.4, depth=0.7, surround=0.1),
        width=store.cut,
    )
    back = [
        bays.window(width=1.2, sill=1.3, head=2.3, depth=0.3),
        bays.gate(width=1.8, height=2.2),
    ]
    layouts = dict.fromkeys(streets, glazed) | {front: entry}
    layout = bays.by_edge(layouts, bays.rhythm(4.0, back, margin=0.7))
    bands = (
        Band(z0=0.0, z1=0.3, depth=-0.05),
        Band(z0=h - 0.25, z1=h, depth=-0.12),
    )
    shades, boards = [], []
    for edge in streets:
        wall = WallFrame(plan, edge)
        if edge == front or edge in blind:
            continue
        cells = bays.stretches(wall.length, pitch=pitch, margin=0.5)
        for a, b in cells:
            boards.append(
                wall.box(
                    x=(a + 0.3, b - 0.3),
                    y=(-0.02, 0.1),
                    z=(head + 0.1, head + 0.7),
                )
            )
        shape = canopies.AwningShape(
            narrower=0.2, reach=0.95, z0=2.4, z1=head + 0.05
        )
        shades += canopies.awnings(
            wall, cells, store.rng, share=store.awnings, shape=shape
        )
    canopies.add_awnings(store, shades)
    store.add("boards", *boards, finish=store.colours["sign"])
    return tiers.add_ground(
        store,
        plan,
        Facade(h, bands=bands, layout=layout, glass=(0.3,), plain=blind),
    )


def _add_parapet(
    store: CornerStore,
    plan: np.ndarray,
    front: int,
    z0: float,
    blind: frozenset[int],
) -> None:
    """Adds the cornice and the roof; the parapet is higher at the corner."""
    rim = round(store.height - store.raised - z0, 3)
    bands = tiers.cornice(
        height=rim - 0.1, reach=store.cornice, thickness=0.45, steps=2
    )
    crown = Facade(rim, bands=bands, plain=blind)
    roof = tiers.add_crown(
        store, plan, crown, z0=z0, parapet=0.5, thickness=0.25
    )
    wall = WallFrame(plan, front)
    store.add(
        "pediment",
        wall.box(
            x=(0.1, wall.length - 0.1),
            y=(-0.25, 0.04),
            z=(z0 + rim - 0.3, store.height),
        ),
    )
    equip_roof(store, plan, roof, store.roof_items)


def _corner_sign(store: CornerStore, wall: WallFrame) -> list[Mesh]:
    """Returns a canopy above the door and an upright sign over it."""
    middle, z = wall.length / 2, store.ground - 0.55
    half = 0.5 * wall.length - 0.25
    top = min(store.height - 0.4, z + 2.6)
    return [
        wall.box(x=around(middle, half), y=(-0.05, 0.9), z=(z - 0.25, z)),
        wall.box(x=around(middle, 0.1), y=(-0.05, 0.75), z=(z - 0.05, top)),
    ]
