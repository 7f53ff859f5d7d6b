"""The walk-up: brick flats around a stair, bay fronts, a raised entrance."""

from __future__ import annotations

import itertools

import numpy as np

from cns_drake.city.buildings.house_parts import family_house
from cns_drake.city.facades import bays, details, massing, roofs, tiers
from cns_drake.city.facades.assembly import Assembly, Dice
from cns_drake.city.facades.roofs import add_chimney, equip_roof
from cns_drake.city.facades.walls import Band, Facade, Layout, Relief
from cns_drake.city.geometry.mesh import Mesh

_WALLS = (*family_house.BRICKS, (0.66, 0.50, 0.38), (0.72, 0.62, 0.50))

# Room in front of the walls for steps, and behind for eaves [m].
_FRONT_M, _BACK_M = 1.5, 0.5


class Parameters:
    """Parameters of a walk-up; lengths in metres.

    Attributes:
        height: of the parapet or the ridge.
        roof: `flat` or `hip`.
        floor: height of the ground floor above the street.
        storey: wanted height of a storey.
        section: wanted length of front for each stair.
        bay_reach: how far the bays of the front stand out; 0 for none.
        pitch, window_width, recess: of the windows.
        arched: whether the windows of the ground floor are arched.
        ledge, hood: of the windows' sills and lintels.
        cornice: how far it sticks out.
    """

    def __init__(self, d: Dice) -> None:
        depth = d.depth - _FRONT_M - _BACK_M
        blind = bool({1, 3} & d.site.blind_edges)
        hipped = not blind and depth < 16.0 and d.chance(0.4)
        rise = 0.3 * min(depth, d.width) if hipped else 0.0
        if d.height - rise < 7.0:
            rise = 0.0
        self.height = d.height
        self.roof = "hip" if rise > 0 else "flat"
        self.rise = round(rise, 2)
        self.floor = d.uniform(0.5, 1.1, 2)
        self.storey = d.uniform(2.8, 3.1)
        self.section = d.uniform(11.0, 15.0)
        self.bay_reach = d.pick((0.0, 0.4, 0.6))
        self.pitch = max(d.uniform(2.1, 2.8), (d.width + depth) / 17)
        self.window_width = d.uniform(1.0, 1.5, 2)
        self.recess = d.uniform(0.14, 0.26, 2)
        self.arched = d.chance(0.3)
        self.ledge = d.pick((0.0, 0.08))
        self.hood = d.pick((0.0, 0.08))
        self.cornice = d.uniform(0.15, 0.45, 2)
        self.roof_items = d.some_of("stair_house vents tank skylight", 1, 5)
        self.rgb = d.pick(_WALLS)
        self.roof_rgb = d.pick(family_house.ROOFS)


def build(p: Parameters, out: Assembly) -> None:
    """Builds the flats on a rectangle."""
    site = out.site
    x0, y0, x1, y1 = site.bounds
    left = x0 + 0.5 * (3 not in site.blind_edges)
    right = x1 - 0.5 * (1 not in site.blind_edges)
    body = massing.rectangle(left, y0 + _FRONT_M, right, y1 - _BACK_M)
    plan, stairs = _bay_front(p, body)
    site_outline = massing.rectangle(x0, y0, x1, y1)
    blind = massing.edges_on(plan, site_outline, site.blind_edges)
    top = _add_ground(out, p, plan, stairs, blind)
    goal = p.height - p.rise - (0.9 if p.roof == "flat" else 0.15)
    groups, per_group, storey = tiers.divided(goal - top, p.storey, 6)
    window = bays.window(
        p.window_width, 0.8, min(2.3, storey - 0.4), p.recess,
        ledge=p.ledge, hood=p.hood,
    )  # fmt: skip
    rows = bays.rhythm(p.pitch, [window], 0.45)
    landing = bays.window(1.1, storey - 1.0, storey - 0.05, p.recess)
    layouts = dict.fromkeys(stairs, bays.with_middle(rows, landing, 2.2))
    layout = bays.by_edge(layouts, rows)
    walls = Facade(storey, (), layout, (p.recess,), blind)
    top = tiers.add_storeys(out, plan, walls, top, groups, per_group)
    _add_top(out, p, body, plan, top, blind)


def _bay_front(p: Parameters, body: np.ndarray) -> tuple[np.ndarray, list[int]]:
    """Returns the plan, its front with bays, and the walls with stairs."""
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
    out: Assembly,
    p: Parameters,
    plan: np.ndarray,
    stairs: list[int],
    blind: frozenset[int],
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
    others = _both(rows, cellar) if p.floor > 0.7 else rows
    layout = bays.by_edge({0: rows} | entries, others)
    bands = (Band(p.floor, p.floor + 0.12, -0.08), Band(h - 0.2, h, -0.08))
    pieces: list[Mesh] = []
    room = _FRONT_M - p.bay_reach * (not stairs) - 0.05
    for edge in doors:
        pieces += _steps(p, details.WallFrame(plan, edge), room)
    out.add("steps", *pieces, rgb=family_house.BASE)
    return tiers.add_ground(
        out, plan, Facade(h, bands, layout, (p.recess,), blind)
    )


def _steps(p: Parameters, wall: details.WallFrame, room: float) -> list[Mesh]:
    """Returns the steps up to a door, between cheeks and under a hood."""
    x = wall.length / 2
    count = max(2, round(p.floor / 0.17))
    run = min(0.28 * count, room - 0.3)
    flight = details.steps(x - 0.8, x + 0.8, run, p.floor, count)
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


def _both(first: Layout, second: Layout) -> Layout:
    """Returns the layout of two layouts that do not meet."""

    def layout(edge: int, length: float) -> list[Relief]:
        return [*first(edge, length), *second(edge, length)]

    return layout


def _add_top(
    out: Assembly,
    p: Parameters,
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
        z = tiers.add_crown(out, plan, crown, z0, parapet, thickness=0.25)
        equip_roof(out, body, z, p.roof_items)
        return
    eaves = (max(p.bay_reach + 0.15, 0.45), 0.45, 0.45, 0.45)
    solid = roofs.hip(body, z0 - 0.02, p.height, eaves, 0.3)
    out.add("roof", solid, rgb=p.roof_rgb)
    (ax, ay), (bx, by) = body[0], body[2]
    for k, share in enumerate((0.35, 0.65)):
        x, y = ax + share * (bx - ax), ay + 0.5 * (by - ay)
        if by - ay > bx - ax:
            x, y = ax + 0.5 * (bx - ax), ay + share * (by - ay)
        spot, brick = (x, y, p.height - 1.4), family_house.BRICKS[k]
        add_chimney(out, f"chimney_{k}", spot, brick, item="chimney_row")
