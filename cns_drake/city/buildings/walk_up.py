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
    around,
    bays,
    equip_roof,
    outlines,
    porches,
    roofs,
    tiers,
    top_band,
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
        self.floor = self.uniform(0.5, 1.1, digits=2)
        self.storey = self.uniform(2.8, 3.1)
        # Wanted length of front for each stair.
        self.section = self.uniform(11.0, 15.0)
        # How far the bays of the front stand out; 0 for none.
        self.bay_reach = self.pick((0.0, 0.4, 0.6))
        self.pitch = max(self.uniform(2.1, 2.8), (site.width + depth) / 17)
        self.window_width = self.uniform(1.0, 1.5, digits=2)
        self.recess = self.uniform(0.14, 0.26, digits=2)
        # Whether the windows of the ground floor are arched.
        self.arched = self.chance(0.3)
        self.ledge = self.pick((0.0, 0.08))
        self.hood = self.pick((0.0, 0.08))
        self.cornice = self.uniform(0.15, 0.45, digits=2)
        self.roof_items = self.draw_roof_items(
            "stair_house vents tank skylight", low=1, high=5
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
            goal - top, storey=self.storey, most=6
        )
        window = bays.window(
            width=self.window_width,
            sill=0.8,
            head=min(2.3, storey - 0.4),
            depth=self.recess,
            ledge=self.ledge,
            hood=self.hood,
        )
        rows = bays.rhythm(self.pitch, [window], margin=0.45)
        landing = bays.window(
            width=1.1, sill=storey - 1.0, head=storey - 0.05, depth=self.recess
        )
        layouts = dict.fromkeys(
            stairs, bays.with_middle(rows, landing, width=2.2)
        )
        layout = bays.by_edge(layouts, rows)
        walls = Facade(
            storey, bands=(), layout=layout, glass=(self.recess,), plain=blind
        )
        top = tiers.add_storeys(
            self, plan, walls, z0=top, groups=groups, per_group=per_group
        )
        _add_roof(self, body, plan, top, blind)


def _outline_and_stairs(
    flats: WalkUp, body: np.ndarray
) -> tuple[np.ndarray, list[int]]:
    """Returns the outline with bays in front, and the edges with stairs."""
    (x0, y0), (x1, y1) = body[0], body[2]
    count = max(1, round((x1 - x0) / flats.section))
    bounds = np.linspace(x0, x1, count + 1)
    if flats.bay_reach == 0.0 or (x1 - x0) / count < 9.0:
        return body, [0] if count == 1 else []
    points: list[tuple[float, float]] = []
    stairs = []
    for a, b in itertools.pairwise(bounds):
        # Bays left and right of the stair, clear of the party walls.
        third = 0.3 * (b - a)
        for start, end in ((a + 0.9, a + third), (b - third, b - 0.9)):
            start, end = round(start, 2), round(end, 2)
            points += [
                (start, y0),
                (start, y0 - flats.bay_reach),
                (end, y0 - flats.bay_reach),
                (end, y0),
            ]
        stairs.append(len(points) - 5 + 1)
    plan = [(x0, y0), *points, (x1, y0), (x1, y1), (x0, y1)]
    return np.array(plan), stairs


def _add_ground(
    flats: WalkUp, plan: np.ndarray, stairs: list[int], blind: frozenset[int]
) -> float:
    """Adds the raised ground floor with its entrances and steps."""
    h = round(flats.floor + flats.storey, 2)
    sill, head = round(flats.floor + 0.8, 2), round(flats.floor + 2.25, 2)
    if flats.arched:
        width = min(flats.window_width, 1.2)
        window = bays.arched(
            width=width,
            bottom=sill,
            spring=head - width / 2,
            depth=flats.recess,
        )
    else:
        window = bays.window(
            width=flats.window_width, sill=sill, head=head, depth=flats.recess
        )
    rows = bays.rhythm(flats.pitch, [window], margin=0.45)
    door = bays.house_door(
        width=1.4, z0=flats.floor, z1=round(flats.floor + 2.35, 2), depth=0.4
    )
    vent = bays.window(width=0.9, sill=0.1, head=flats.floor - 0.15, depth=0.15)
    cellar = bays.rhythm(2 * flats.pitch, [vent], margin=0.5)
    doors = stairs or [0]
    entries = dict.fromkeys(doors, bays.with_middle(rows, door, width=2.4))
    others = _combined_layout(rows, cellar) if flats.floor > 0.7 else rows
    layout = bays.by_edge({0: rows} | entries, others)
    bands = (
        Band(z0=flats.floor, z1=flats.floor + 0.12, depth=-0.08),
        top_band(h, height=0.2, reach=0.08),
    )
    pieces: list[Mesh] = []
    room = _FRONT_M - flats.bay_reach * (not stairs) - 0.05
    for edge in doors:
        pieces += _entrance_steps(flats, WallFrame(plan, edge), room)
    flats.add("steps", *pieces, finish=flats.colours["base"])
    return tiers.add_ground(
        flats,
        plan,
        Facade(
            h, bands=bands, layout=layout, glass=(flats.recess,), plain=blind
        ),
    )


def _entrance_steps(flats: WalkUp, wall: WallFrame, room: float) -> list[Mesh]:
    """Returns the steps up to a door, between cheeks and under a hood."""
    x = wall.length / 2
    count = max(2, round(flats.floor / 0.17))
    run = min(0.28 * count, room - 0.3)
    flight = porches.steps(
        x0=x - 0.8, x1=x + 0.8, reach=run, rise=flats.floor, count=count
    )
    cheeks = (
        wall.standing(
            x=around(u, 0.12),
            y=(-0.05, room),
            z1=flats.floor + 0.35,
            bottom=True,
        )
        for u in (x - 0.98, x + 0.98)
    )
    return [
        wall.standing(
            x=around(x, 1.1),
            y=(-0.05, room - run),
            z1=flats.floor,
            bottom=True,
        ),
        wall.place(flight.moved((0.0, room - run, 0.0))),
        wall.box(
            x=around(x, 1.2),
            y=(-0.05, 0.9),
            z=(flats.floor + 2.5, flats.floor + 2.7),
        ),
        *cheeks,
    ]


def _add_roof(
    flats: WalkUp,
    body: np.ndarray,
    plan: np.ndarray,
    z0: float,
    blind: frozenset[int],
) -> None:
    if flats.roof == "flat":
        rim = round(flats.height - z0, 3)
        top = max(rim - 0.15, 0.5)
        bands = tiers.cornice(
            height=top, reach=flats.cornice, thickness=0.4, steps=2
        )
        crown = Facade(rim, bands=bands, plain=blind)
        parapet = min(0.6, rim - 0.1)
        z = tiers.add_crown(
            flats, plan, crown, z0=z0, parapet=parapet, thickness=0.25
        )
        equip_roof(flats, body, z, flats.roof_items)
        return
    eaves = (max(flats.bay_reach + 0.15, 0.45), 0.45, 0.45, 0.45)
    solid = roofs.hip(
        body, z=z0 - 0.02, top=flats.height, eaves=eaves, fascia=0.3
    )
    flats.add("roof", solid, finish=flats.colours["roof"])
    (ax, ay), (bx, by) = body[0], body[2]
    for k, share in enumerate((0.35, 0.65)):
        x, y = ax + share * (bx - ax), ay + 0.5 * (by - ay)
        if by - ay > bx - ax:
            x, y = ax + 0.5 * (bx - ax), ay + share * (by - ay)
        spot = (x, y, flats.height - 1.4)
        brick = flats.kind.choices["bricks"][k]
        add_chimney(flats, f"chimney_{k}", spot, brick, item="chimney_row")


def _combined_layout(first: Layout, second: Layout) -> Layout:
    """Returns a layout with the reliefs of two layouts.

    No relief of one layout may overlap a relief of the other.
    """

    def layout(edge: int, length: float) -> list[Relief]:
        return [*first(edge, length), *second(edge, length)]

    return layout
