"""The corner store: a shop at a cut corner, with flats above."""

import numpy as np

from cns_drake.city.facades import (
    Band,
    Building,
    Facade,
    WallFrame,
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
        self.raised = self.uniform(0.3, 0.9, 2)
        self.ground = round(
            min(self.uniform(3.5, 4.1), self.height - self.raised - 0.7), 2
        )
        self.corner = self.pick(site.free_corners or [FRONT_LEFT, FRONT_RIGHT])
        # Length taken off each edge at the corner.
        self.cut = round(min(self.uniform(2.0, 3.0), 0.3 * site.depth), 2)
        self.storey = self.uniform(2.9, 3.3)
        self.pitch = max(self.uniform(2.2, 3.0), (site.width + site.depth) / 20)
        self.window_width = self.uniform(1.0, 1.5, 2)
        self.recess = self.uniform(0.12, 0.25, 2)
        self.ledge = self.pick((0.0, 0.1))
        self.cornice = self.uniform(0.15, 0.4, 2)
        # Share of the shop windows with an awning.
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
        along = -1 if self.corner == FRONT_LEFT else 1
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
    if p.corner == FRONT_RIGHT:
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
        shape = canopies.AwningShape(0.2, 0.95, 2.4, head + 0.05)
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
