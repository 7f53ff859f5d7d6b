"""The walk-up: flats around a stair, without a lift."""

import itertools

import numpy as np

from worlds.city.facades import (
    Band,
    Building,
    Facade,
    Layout,
    Relief,
    WallFrame,
    around,
    bays,
    porches,
    roofs,
    tiers,
    top_band,
)
from worlds.shapes import Mesh, add_chimney, equip_roof, outlines

# Room in front of the walls for steps [m].
_FRONT_M = 1.5
# Room behind the walls for eaves [m].
_BACK_M = 0.5
# Strip beside a free side wall, for eaves [m].
_SIDE_M = 0.5
# Greatest depth of flats with a hipped roof [m].
_HIP_DEPTH_M = 16.0
# Least height of the walls below a hipped roof [m].
_HIP_WALL_M = 7.0
# Rise of a hipped roof, as a share of its span.
_HIP_RISE = 0.3
# Greatest number of windows of the front and one side together.
_MOST_BAYS = 17
# Height of a flat roof's parapet and cornice above the topmost storey [m].
_CROWN_M = 0.9
# Greatest number of parts of which the storeys consist.
_MOST_GROUPS = 6
# Distance of the windows from the ends of a wall [m].
_END_M = 0.45
# Least length of front for each stair if there are bays in front [m].
_BAYS_SECTION_M = 9.0
# Distance of the bays in front from the ends of a section [m].
_BAY_END_M = 0.9
# Depth of a step [m].
_TREAD_M = 0.28
# Least height of the ground floor for windows of the cellar [m].
_CELLAR_FLOOR_M = 0.7
# Overhang of a hipped roof [m].
_EAVES_M = 0.45


class WalkUp(Building):
    """The walk-up: brick flats around a stair, behind a raised entrance."""

    def draw(self) -> None:
        site = self.site
        depth = site.depth - _FRONT_M - _BACK_M
        is_free = not {1, 3} & site.blind_edges
        # Rise of a hipped roof; 0 for a flat one.
        self.rise = 0.0
        if is_free and depth < _HIP_DEPTH_M and self.chance(0.4):
            rise = _HIP_RISE * min(depth, site.width)
            if self.height - rise >= _HIP_WALL_M:
                self.rise = round(rise, 2)
        self.roof = "hip" if self.rise > 0 else "flat"
        self.floor = self.uniform(0.5, 1.1, digits=2)
        self.storey = self.uniform(2.8, 3.1)
        # Wanted length of front for each stair.
        self.section = self.uniform(11.0, 15.0)
        # How far the bays of the front stand out; 0 for none.
        self.bay_reach = self.pick((0.0, 0.4, 0.6))
        self.pitch = max(
            self.uniform(2.1, 2.8), (site.width + depth) / _MOST_BAYS
        )
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
        site = self.site
        x0, y0, x1, y1 = site.bounds
        left = x0 if 3 in site.blind_edges else x0 + _SIDE_M
        right = x1 if 1 in site.blind_edges else x1 - _SIDE_M
        body = outlines.rectangle(left, y0 + _FRONT_M, right, y1 - _BACK_M)
        plan, stairs = _outline_and_stairs(self, body)
        site_outline = outlines.rectangle(x0, y0, x1, y1)
        blind = outlines.edges_on(plan, site_outline, site.blind_edges)
        top = _add_ground(self, plan, stairs, blind)
        above = _CROWN_M if self.roof == "flat" else 0.15
        goal = self.height - self.rise - above
        groups, per_group, storey = tiers.storey_groups(
            goal - top, storey=self.storey, most=_MOST_GROUPS
        )
        walls = _storey_walls(self, storey, stairs, blind)
        top = tiers.add_storeys(
            self, plan, walls, z0=top, groups=groups, per_group=per_group
        )
        if self.roof == "flat":
            _add_flat_roof(self, body, plan, top, blind)
        else:
            _add_hipped_roof(self, body, top)


def _storey_walls(
    flats: WalkUp, storey: float, stairs: list[int], blind: frozenset[int]
) -> Facade:
    """Returns the walls of a storey; walls of a stair have a landing's window.

    Args:
        storey: height of the storey [m].
        stairs: numbers of the walls with a stair behind them.
        blind: numbers of the walls against a neighbour.
    """
    window = bays.window(
        width=flats.window_width,
        sill=0.8,
        head=min(2.3, storey - 0.4),
        depth=flats.recess,
        ledge=flats.ledge,
        hood=flats.hood,
    )
    rows = bays.rhythm(flats.pitch, [window], margin=_END_M)
    landing = bays.window(
        width=1.1, sill=storey - 1.0, head=storey - 0.05, depth=flats.recess
    )
    with_stair = bays.with_middle(rows, landing, width=2.2)
    return Facade(
        storey,
        layout=bays.by_edge(dict.fromkeys(stairs, with_stair), rows),
        glass=(flats.recess,),
        plain=blind,
    )


def _outline_and_stairs(
    flats: WalkUp, body: np.ndarray
) -> tuple[np.ndarray, list[int]]:
    """Returns the outline with bays in front, and the edges with stairs."""
    (x0, y0), (x1, y1) = body[0], body[2]
    count = max(1, round((x1 - x0) / flats.section))
    bounds = np.linspace(x0, x1, count + 1)
    if flats.bay_reach == 0.0 or (x1 - x0) / count < _BAYS_SECTION_M:
        return body, [0] if count == 1 else []
    points: list[outlines.Point] = []
    stairs = []
    for left, right in itertools.pairwise(bounds):
        # Bays left and right of the stair, clear of the party walls.
        third = 0.3 * (right - left)
        first = (left + _BAY_END_M, left + third)
        second = (right - third, right - _BAY_END_M)
        for bay_start, bay_end in (first, second):
            start, end = round(bay_start, 2), round(bay_end, 2)
            points += [
                (start, y0),
                (start, y0 - flats.bay_reach),
                (end, y0 - flats.bay_reach),
                (end, y0),
            ]
        # The wall between the two bays: it starts at the fourth last point but
        # one, and the outline's first corner comes before all points.
        stairs.append(len(points) - 5 + 1)
    plan = [(x0, y0), *points, (x1, y0), (x1, y1), (x0, y1)]
    return np.array(plan), stairs


def _add_ground(
    flats: WalkUp, plan: np.ndarray, stairs: list[int], blind: frozenset[int]
) -> float:
    """Adds the raised ground floor; returns the height of its top [m].

    It has entrances with steps in front, and windows of the cellar at its foot.

    Args:
        plan: (N, 2) corners of the walls [m].
        stairs: numbers of the walls with a stair behind them.
        blind: numbers of the walls against a neighbour.
    """
    floor = flats.floor
    height = round(floor + flats.storey, 2)
    rows = bays.rhythm(flats.pitch, [_ground_window(flats)], margin=_END_M)
    door = bays.house_door(
        width=1.4, z0=floor, z1=round(floor + 2.35, 2), depth=0.4
    )
    doors = stairs or [0]
    with_door = bays.with_middle(rows, door, width=2.4)
    others = rows
    if floor > _CELLAR_FLOOR_M:
        vent = bays.window(width=0.9, sill=0.1, head=floor - 0.15, depth=0.15)
        cellar = bays.rhythm(2 * flats.pitch, [vent], margin=0.5)
        others = _combined_layout(rows, cellar)
    walls = Facade(
        height,
        bands=(
            Band(z0=floor, z1=floor + 0.12, depth=-0.08),
            top_band(height, height=0.2, reach=0.08),
        ),
        layout=bays.by_edge(
            {0: rows} | dict.fromkeys(doors, with_door), others
        ),
        glass=(flats.recess,),
        plain=blind,
    )
    # Without a wall of its own, a door is behind the fronts of the bays.
    behind = 0.0 if stairs else flats.bay_reach
    room = _FRONT_M - behind - 0.05
    steps: list[Mesh] = []
    for edge in doors:
        steps += _entrance_steps(flats, WallFrame(plan, edge), room)
    flats.add("steps", *steps, finish=flats.colours["base"])
    return tiers.add_ground(flats, plan, walls)


def _ground_window(flats: WalkUp) -> bays.Bay:
    """Returns a bay with a window of the ground floor, which may be arched."""
    sill, head = round(flats.floor + 0.8, 2), round(flats.floor + 2.25, 2)
    if flats.arched:
        width = min(flats.window_width, 1.2)
        spring = head - width / 2
        return bays.arched(
            width=width, bottom=sill, spring=spring, depth=flats.recess
        )
    return bays.window(
        width=flats.window_width, sill=sill, head=head, depth=flats.recess
    )


def _entrance_steps(flats: WalkUp, wall: WallFrame, room: float) -> list[Mesh]:
    """Returns the steps up to a door, between cheeks and under a hood.

    `room` is the depth of the free ground in front of the wall [m].
    """
    middle, floor = wall.length / 2, flats.floor
    count = max(2, round(floor / porches.RISER_M))
    run = min(_TREAD_M * count, room - 0.3)
    x0, x1 = around(middle, 0.8)
    flight = porches.steps(x0=x0, x1=x1, reach=run, rise=floor, count=count)
    landing = wall.standing(
        x=around(middle, 1.1), y=(-0.05, room - run), z1=floor, bottom=True
    )
    hood = wall.box(
        x=around(middle, 1.2), y=(-0.05, 0.9), z=(floor + 2.5, floor + 2.7)
    )
    cheeks = (
        wall.standing(
            x=around(x, 0.12), y=(-0.05, room), z1=floor + 0.35, bottom=True
        )
        for x in around(middle, 0.98)
    )
    stair = wall.place(flight.moved((0.0, room - run, 0.0)))
    return [landing, stair, hood, *cheeks]


def _add_flat_roof(
    flats: WalkUp,
    body: np.ndarray,
    plan: np.ndarray,
    z0: float,
    blind: frozenset[int],
) -> None:
    """Adds a flat roof behind a parapet with a cornice.

    Args:
        body: (4, 2) corners of the walls without the bays in front [m].
        plan: (N, 2) corners of the walls [m].
        z0: height of the parapet's foot [m].
        blind: numbers of the walls against a neighbour.
    """
    rim = round(flats.height - z0, 3)
    cornice = tiers.cornice(
        height=max(rim - 0.15, 0.5),
        reach=flats.cornice,
        thickness=0.4,
        steps=2,
    )
    crown = Facade(rim, bands=cornice, plain=blind)
    parapet = min(0.6, rim - 0.1)
    z = tiers.add_crown(
        flats, plan, crown, z0=z0, parapet=parapet, thickness=0.25
    )
    equip_roof(flats, body, z, flats.roof_items)


def _add_hipped_roof(flats: WalkUp, body: np.ndarray, z0: float) -> None:
    """Adds a hipped roof, with two chimneys on its ridge.

    `body` contains the corners (4, 2) of the walls without the bays in front,
    and `z0` is the height of the walls [m].
    """
    front_eaves = max(flats.bay_reach + 0.15, _EAVES_M)
    eaves = (front_eaves, _EAVES_M, _EAVES_M, _EAVES_M)
    roof = roofs.hip(
        body, z=z0 - 0.02, top=flats.height, eaves=eaves, fascia=0.3
    )
    flats.add("roof", roof, finish=flats.colours["roof"])
    (x0, y0), (x1, y1) = body[0], body[2]
    for k, share in enumerate((0.35, 0.65)):
        x, y = x0 + share * (x1 - x0), y0 + 0.5 * (y1 - y0)
        if y1 - y0 > x1 - x0:
            x, y = x0 + 0.5 * (x1 - x0), y0 + share * (y1 - y0)
        foot = (x, y, flats.height - 1.4)
        brick = flats.kind.choices["bricks"][k]
        add_chimney(flats, f"chimney_{k}", foot, brick, item="chimney_row")


def _combined_layout(first: Layout, second: Layout) -> Layout:
    """Returns a layout with the reliefs of two layouts.

    No relief of one layout may overlap a relief of the other.
    """

    def layout(edge: int, length: float) -> list[Relief]:
        return [*first(edge, length), *second(edge, length)]

    return layout
