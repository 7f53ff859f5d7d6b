"""The walk-up: flats around a stair, without a lift."""

import itertools

import numpy as np

from cns_drake.city.facades import (
    Band,
    Building,
    Facade,
    Layout,
    Relief,
    WallFrame,
    add_chimney,
    bays,
    equip_roof,
    outlines,
    porches,
    roofs,
    tiers,
)
from cns_drake.city.geometry import Mesh

# Room in front of the walls for steps [m].
_FRONT_M = 1.5
# Room behind the walls for eaves [m].
_BACK_M = 0.5


class WalkUp(Building):
    """The walk-up: brick flats around a stair, behind a raised entrance."""

    def draw(self) -> None:
        """Samples sizes and style."""
        site = self.site
        depth = site.depth - _FRONT_M - _BACK_M
        is_free = not {1, 3} & site.blind_edges
        # Rise of a hipped roof; 0 for a flat one.
        self.rise = 0.0
        if is_free and depth < 16.0 and self.chance(0.4):
            rise = 0.3 * min(depth, site.width)
            self.rise = round(rise, 2) if self.height - rise >= 7.0 else 0.0
        self.roof = "hip" if self.rise > 0 else "flat"
        self.floor = self.uniform(0.5, 1.1, 2)
        self.storey = self.uniform(2.8, 3.1)
        # Wanted length of front for each stair.
        self.section = self.uniform(11.0, 15.0)
        # How far the bays of the front stand out; 0 for none.
        self.bay_reach = self.pick((0.0, 0.4, 0.6))
        self.pitch = max(self.uniform(2.1, 2.8), (site.width + depth) / 17)
        self.window_width = self.uniform(1.0, 1.5, 2)
        self.recess = self.uniform(0.14, 0.26, 2)
        # Whether the windows of the ground floor are arched.
        self.arched = self.chance(0.3)
        self.ledge = self.pick((0.0, 0.08))
        self.hood = self.pick((0.0, 0.08))
        self.cornice = self.uniform(0.15, 0.45, 2)
        self.roof_items = self.draw_roof_items(
            "stair_house vents tank skylight", 1, 5
        )

    def build(self) -> None:
        """Adds all parts of the walk-up flats.

        The building's site must be a rectangle.
        """
        site = self.site
        x0, y0, x1, y1 = site.bounds
        left = x0 + 0.5 * (3 not in site.blind_edges)
        right = x1 - 0.5 * (1 not in site.blind_edges)
        body = outlines.rectangle(left, y0 + _FRONT_M, right, y1 - _BACK_M)
        plan, stairs = _outline_and_stairs(self, body)
        site_outline = outlines.rectangle(x0, y0, x1, y1)
        blind = outlines.edges_on(plan, site_outline, site.blind_edges)
        top = _add_ground(self, plan, stairs, blind)
        goal = self.height - self.rise - (0.9 if self.roof == "flat" else 0.15)
        groups, per_group, storey = tiers.storey_groups(
            goal - top, self.storey, 6
        )
        window = bays.window(
            self.window_width, 0.8, min(2.3, storey - 0.4), self.recess,
            ledge=self.ledge, hood=self.hood,
        )  # fmt: skip
        rows = bays.rhythm(self.pitch, [window], 0.45)
        landing = bays.window(1.1, storey - 1.0, storey - 0.05, self.recess)
        layouts = dict.fromkeys(stairs, bays.with_middle(rows, landing, 2.2))
        layout = bays.by_edge(layouts, rows)
        walls = Facade(storey, (), layout, (self.recess,), blind)
        top = tiers.add_storeys(self, plan, walls, top, groups, per_group)
        _add_roof(self, body, plan, top, blind)


def _outline_and_stairs(
    p: WalkUp, body: np.ndarray
) -> tuple[np.ndarray, list[int]]:
    """Returns the outline with bays in front, and the edges with stairs."""
    (x0, y0), (x1, y1) = body[0], body[2]
    count = max(1, round((x1 - x0) / p.section))
    bounds = np.linspace(x0, x1, count + 1)
    if p.bay_reach == 0.0 or (x1 - x0) / count < 9.0:
        return body, [0] if count == 1 else []
    points: list[tuple[float, float]] = []
    stairs = []
    for a, b in itertools.pairwise(bounds):
        # Bays left and right of the stair, clear of the party walls.
        third = 0.3 * (b - a)
        for start, end in ((a + 0.9, a + third), (b - third, b - 0.9)):
            start, end = round(start, 2), round(end, 2)
            points += [(start, y0), (start, y0 - p.bay_reach),
                       (end, y0 - p.bay_reach), (end, y0)]  # fmt: skip
        stairs.append(len(points) - 5 + 1)
    plan = [(x0, y0), *points, (x1, y0), (x1, y1), (x0, y1)]
    return np.array(plan), stairs


def _add_ground(
    p: WalkUp, plan: np.ndarray, stairs: list[int], blind: frozenset[int]
) -> float:
    """Adds the raised ground floor with its entrances and steps."""
    h = round(p.floor + p.storey, 2)
    sill, head = round(p.floor + 0.8, 2), round(p.floor + 2.25, 2)
    if p.arched:
        width = min(p.window_width, 1.2)
        window = bays.arched(width, sill, head - width / 2, p.recess)
    else:
        window = bays.window(p.window_width, sill, head, p.recess)
    rows = bays.rhythm(p.pitch, [window], 0.45)
    door = bays.house_door(1.4, p.floor, round(p.floor + 2.35, 2), 0.4)
    vent = bays.window(0.9, 0.1, p.floor - 0.15, 0.15)
    cellar = bays.rhythm(2 * p.pitch, [vent], 0.5)
    doors = stairs or [0]
    entries = dict.fromkeys(doors, bays.with_middle(rows, door, 2.4))
    others = _combined_layout(rows, cellar) if p.floor > 0.7 else rows
    layout = bays.by_edge({0: rows} | entries, others)
    bands = (Band(p.floor, p.floor + 0.12, -0.08), Band(h - 0.2, h, -0.08))
    pieces: list[Mesh] = []
    room = _FRONT_M - p.bay_reach * (not stairs) - 0.05
    for edge in doors:
        pieces += _entrance_steps(p, WallFrame(plan, edge), room)
    p.add("steps", *pieces, finish=p.colours["base"])
    return tiers.add_ground(
        p, plan, Facade(h, bands, layout, (p.recess,), blind)
    )


def _entrance_steps(p: WalkUp, wall: WallFrame, room: float) -> list[Mesh]:
    """Returns the steps up to a door, between cheeks and under a hood."""
    x = wall.length / 2
    count = max(2, round(p.floor / 0.17))
    run = min(0.28 * count, room - 0.3)
    flight = porches.steps(x - 0.8, x + 0.8, run, p.floor, count)
    slab = (x - 1.1, x + 1.1, -0.05, room - run, p.floor)
    hood = (x - 1.2, x + 1.2, -0.05, 0.9, p.floor + 2.5, p.floor + 2.7)
    cheeks = (
        wall.standing(
            u - 0.12, u + 0.12, -0.05, room, p.floor + 0.35, bottom=True
        )
        for u in (x - 0.98, x + 0.98)
    )
    return [
        wall.standing(*slab, bottom=True),
        wall.place(flight.moved((0.0, room - run, 0.0))),
        wall.box(*hood),
        *cheeks,
    ]


def _add_roof(
    p: WalkUp,
    body: np.ndarray,
    plan: np.ndarray,
    z0: float,
    blind: frozenset[int],
) -> None:
    if p.roof == "flat":
        rim = round(p.height - z0, 3)
        top = max(rim - 0.15, 0.5)
        bands = tiers.cornice(top, p.cornice, thickness=0.4, steps=2)
        crown = Facade(rim, bands, plain=blind)
        parapet = min(0.6, rim - 0.1)
        z = tiers.add_crown(p, plan, crown, z0, parapet, thickness=0.25)
        equip_roof(p, body, z, p.roof_items)
        return
    eaves = (max(p.bay_reach + 0.15, 0.45), 0.45, 0.45, 0.45)
    solid = roofs.hip(body, z0 - 0.02, p.height, eaves, 0.3)
    p.add("roof", solid, finish=p.colours["roof"])
    (ax, ay), (bx, by) = body[0], body[2]
    for k, share in enumerate((0.35, 0.65)):
        x, y = ax + share * (bx - ax), ay + 0.5 * (by - ay)
        if by - ay > bx - ax:
            x, y = ax + 0.5 * (bx - ax), ay + share * (by - ay)
        spot = (x, y, p.height - 1.4)
        brick = p.kind.choices["bricks"][k]
        add_chimney(p, f"chimney_{k}", spot, brick, item="chimney_row")


def _combined_layout(first: Layout, second: Layout) -> Layout:
    """Returns a layout with the reliefs of two layouts.

    No relief of one layout may overlap a relief of the other.
    """

    def layout(edge: int, length: float) -> list[Relief]:
        return [*first(edge, length), *second(edge, length)]

    return layout
