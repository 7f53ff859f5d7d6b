"""The church: nave, aisles and buttresses, an apse, a tower with a spire."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
import itertools

import numpy as np

from cns_drake.city.buildings.parts import bays, details, massing, tiers
from cns_drake.city.buildings.parts.facades import (
    Arch,
    Band,
    Facade,
    Layout,
    Relief,
)
from cns_drake.city.buildings.parts.site import Assembly, Dice
from cns_drake.city.geometry.mesh import Mesh
from cns_drake.city.geometry.structures import Part

_STONES = ((0.66, 0.61, 0.53), (0.56, 0.36, 0.30), (0.62, 0.62, 0.60))


class Parameters:
    """Parameters of a church; lengths in metres. The spire is `height`."""

    def __init__(self, d: Dice) -> None:
        width = min(d.width, d.depth)
        nave = round(d.uniform(0.48, 0.56) * min(width, 26.0), 1)
        wall = round(min(d.uniform(0.3, 0.36) * d.height, 0.9 * nave + 3.0), 1)
        self.height = d.height
        self.tower_at = d.pick(("middle", "left", "right"))
        self.tower_width = round(d.uniform(0.5, 0.62) * nave, 1)
        self.tower_wall = d.uniform(0.56, 0.64)
        self.spire = d.pick(("needle", "broach", "bulb"))
        self.nave_width = nave
        self.nave_height = wall
        self.roof_rise = round(d.uniform(0.5, 0.7) * nave, 1)
        self.aisle_width = round(min((width - nave) / 2 - 1.3, 0.45 * nave), 1)
        self.aisle_height = round(0.5 * wall, 1)
        self.bay = d.uniform(4.2, 5.4)
        self.window_depth = d.uniform(0.35, 0.5, 2)
        self.apse_sides = d.whole(3, 6)
        self.rgb = d.pick(_STONES)
        self.roof_rgb = d.pick(((0.3, 0.31, 0.34), (0.45, 0.27, 0.22)))


def build(p: Parameters, out: Assembly) -> None:
    """Builds the church along the longer side of a rectangle.

    Its portal is at the front, or on the left where it lies along x.
    """
    x0, y0, x1, y1 = out.site.bounds
    if x1 - x0 <= y1 - y0:
        _add_all(p, out, x0, y0, x1, y1)
        return
    # Built a quarter turn to the right of where it will stand.
    _add_all(p, out, -y1, x0, -y0, x1)
    out.parts = [_turned(part) for part in out.parts]


def _turned(part: Part) -> Part:
    """Returns the part turned by a quarter to the right (x, y -> y, -x)."""
    (x, y, z), yaw = part.xyz, round(part.rpy[2] - np.pi / 2, 5)
    return replace(part, xyz=(y, -x, z), rpy=(0.0, 0.0, yaw))


def _add_all(
    p: Parameters, out: Assembly, x0: float, y0: float, x1: float, y1: float
) -> None:
    middle, half = (x0 + x1) / 2, p.nave_width / 2
    apse = half
    front = y0 + 1.6 + (0.6 * p.tower_width if p.tower_at == "middle" else 0.0)
    back = y1 - apse - 1.0
    nave = massing.rectangle(middle - half, front, middle + half, back)
    wide = half + p.aisle_width
    outer = massing.rectangle(
        middle - wide, front + 2.5, middle + wide, back - 1.5
    )
    _add_nave(out, p, nave)
    _add_aisles(out, p, outer)
    _add_apse(out, p, (middle, back), apse)
    _add_roofs(out, p, nave, outer)
    side = p.tower_width / 2
    if p.tower_at == "middle":
        tower = (middle, front + 0.4 * p.tower_width)
    else:
        sign = -1.0 if p.tower_at == "left" else 1.0
        tower = (middle + sign * (half + 0.35 * side), front + side + 0.5)
    _add_tower(out, p, tower, side)


def _lancet(width: float, low: float, spring: float, depth: float) -> bays.Bay:
    return bays.arched(width, low, spring, depth, rise=0.9 * width, pier=0.4)


def _add_nave(out: Assembly, p: Parameters, nave: np.ndarray) -> None:
    """The tall middle: a portal and a rose in front, clerestory above."""
    h, d = p.nave_height, p.window_depth

    def front(edge: int, length: float) -> Sequence[Relief]:
        x, w = round(length / 2, 2), round(min(0.13 * length, 0.12 * h), 2)
        rise = min(0.3 * h, 4.0)
        rose, z = min(0.16 * length, 0.18 * h), 0.72 * h
        return [
            Arch(x - w, x + w, 0.0, rise, rise + w, 1.1),
            Arch(x - rose, x + rose, z - rose, z, z + rose, d),
            *(
                Arch(u - 0.5, u + 0.5, 1.5, 0.45 * h, 0.45 * h + 0.9, d)
                for u in (x - 0.32 * length, x + 0.32 * length)
            ),
        ]

    low = p.aisle_height + 2.6
    layouts: dict[int, Layout] = {0: front}
    if h - low > 3.4:
        window = _lancet(1.3, low, max(low + 0.6, h - 2.4), d)
        layouts[1] = layouts[3] = bays.rhythm(p.bay, [window], margin=1.6)
    layout = bays.by_edge(layouts, bays.plain)
    # A stone gable in front of the roof's, with its coping.
    (x0, y0), (x1, _) = nave[0], nave[1]
    shield = massing.gable_roof(
        y0 - 0.35, -x1 - 0.6, y0 + 0.3, -x0 + 0.6, h, p.roof_rise + 0.4
    )
    walls = Facade(h, (Band(h - 0.5, h, -0.25),), layout, (d,))
    gable = shield.moved(yaw=np.pi / 2)
    tiers.add_ground(out, nave, walls, [gable], part="nave")


def _add_aisles(out: Assembly, p: Parameters, outer: np.ndarray) -> None:
    h, d = p.aisle_height, p.window_depth
    window = _lancet(1.5, 1.6, max(2.2, h - 2.4), d)
    windows = bays.rhythm(p.bay, [window], margin=1.6)
    layout = bays.by_edge({1: windows, 3: windows}, bays.plain)
    bands = (Band(0.0, 0.8, -0.12), Band(h - 0.3, h, -0.2))
    buttresses = []
    for edge in (1, 3):
        wall = details.WallFrame(outer, edge)
        cells = bays.stretches(wall.length, p.bay, 1.6)
        for x in [wall.length - 1.6, *(a for a, _ in cells)]:
            for reach, top in ((1.1, 0.55 * h), (0.6, 0.9 * h)):
                plan = massing.rectangle(x - 0.4, -0.02, x + 0.4, reach)
                slope = massing.rectangle(x - 0.4, -0.02, x + 0.4, 0.1)
                body = massing.skirt(plan, plan, -massing.FOUNDATION_M, top)
                cap = massing.frustum(plan, slope, top, top + reach)
                buttresses += [wall.place(body), wall.place(cap)]
    walls = Facade(h, bands, layout, (d,))
    tiers.add_ground(out, outer, walls, buttresses, part="aisles")


def _add_apse(
    out: Assembly, p: Parameters, center: massing.Point, radius: float
) -> None:
    """A many-sided choir under half a cone."""
    n = p.apse_sides
    angles = np.linspace(0.0, np.pi, n + 1)
    arc = np.array(center) + 0.96 * radius * np.column_stack(
        [np.cos(angles), np.sin(angles)]
    )
    # Its straight side is buried in the nave.
    plan = np.vstack([arc, arc[-1] - (0.0, 1.0), arc[0] - (0.0, 1.0)])
    h = round(0.8 * p.nave_height, 2)
    window = _lancet(1.3, 2.4, h - 2.8, p.window_depth)

    def layout(edge: int, length: float) -> Sequence[Relief]:
        return window(0.3, length - 0.3) if edge < n else ()

    bands = (Band(0.0, 0.8, -0.12), Band(h - 0.4, h, -0.2))
    walls = Facade(h, bands, layout, (p.window_depth,))
    tiers.add_ground(out, plan, walls, part="apse")
    eaves = massing.inset(plan, -0.3)
    cone = massing.spire(eaves, center, h, h + 0.75 * p.roof_rise)
    soffit = massing.flat(eaves, h, up=False)
    out.add("apse_roof", cone, soffit, rgb=p.roof_rgb)


def _add_roofs(
    out: Assembly, p: Parameters, nave: np.ndarray, outer: np.ndarray
) -> None:
    (x0, y0), (x1, y1) = nave[0], nave[2]
    x, h = (x0 + x1) / 2, p.nave_height
    # The gable roof lies along y: the shed along x, turned.
    main = massing.gable_roof(y0, -x1 - 0.4, y1, -x0 + 0.4, h, p.roof_rise)
    pieces = [main.moved(yaw=np.pi / 2)]
    (ox0, oy0), (ox1, oy1) = outer[0], outer[2]
    low, high = p.aisle_height, p.aisle_height + 2.2
    for a, b in ((ox0 - 0.3, x0), (x1, ox1 + 0.3)):
        za, zb = (low, high) if a < x else (high, low)
        section = [(a, low), (b, low), (b, zb), (a, za)]
        corners = [c for k, c in enumerate(section) if c != section[k - 1]]
        pieces.append(massing.bar(corners, oy0, oy1))
    out.add("roofs", *pieces, rgb=p.roof_rgb)


def _add_tower(
    out: Assembly, p: Parameters, center: massing.Point, half: float
) -> None:
    """The tower in three stages, belfry openings in the last."""
    plan = massing.regular_polygon(half * np.sqrt(2), 4, center, -0.75 * np.pi)
    wall = round(p.tower_wall * p.height, 1)
    belfry = round(0.3 * wall, 1)
    shaft = wall - belfry

    def lower(edge: int, length: float) -> Sequence[Relief]:
        x, w = length / 2, 0.17 * length
        relief = [
            Arch(x - 0.5, x + 0.5, z, z + 1.6, z + 2.3, p.window_depth)
            for z in np.arange(6.5, shaft - 4.0, 6.0).tolist()
        ]
        if edge == 0 and p.tower_at == "middle":
            relief.append(Arch(x - w, x + w, 0.0, 2.8, 2.8 + w, 0.9))
        return relief

    courses = tuple(
        Band(z, z + 0.3, -0.15)
        for z in np.arange(4.8, shaft - 1.0, 6.0).tolist()
    )
    stage = Facade(shaft, courses, lower, glass=(p.window_depth,))
    corner = details.corner_piers(
        plan, 0.17 * 2 * half, 0.3, 0.02, -massing.FOUNDATION_M, 0.7 * shaft
    )
    tiers.add_ground(out, plan, stage, [corner], part="tower")

    def openings(edge: int, length: float) -> Sequence[Relief]:
        w = 0.16 * length
        return [
            Arch(x - w, x + w, 1.2, belfry - 2.2 - w, belfry - 2.2, 0.8)
            for x in (0.3 * length, 0.7 * length)
        ]

    bands = (Band(0.0, 0.4, -0.2), Band(belfry - 0.9, belfry, -0.35))
    pieces = [tiers.block(plan, Facade(belfry, bands, openings), shaft)]
    if p.spire != "bulb":
        pieces += _pinnacles(center, half, wall)
    out.add("belfry", *pieces)
    out.add("spire", *_spire(p, center, half, wall), rgb=p.roof_rgb)


def _pinnacles(center: massing.Point, half: float, z: float) -> list[Mesh]:
    pieces = []
    for sx, sy in itertools.product((-1, 1), repeat=2):
        x, y = center[0] + sx * (half - 0.4), center[1] + sy * (half - 0.4)
        plan = massing.square(x, y, 0.4)
        pieces.append(massing.skirt(plan, plan, z, z + 1.4))
        pieces.append(massing.spire(plan, (x, y), z + 1.4, z + 3.4))
    return pieces


def _spire(
    p: Parameters, center: massing.Point, half: float, z: float
) -> list[Mesh]:
    tip = p.height
    if p.spire == "bulb":
        r = half * 0.95
        shares = (
            (0.85, 0.0), (1.0, 0.12), (0.95, 0.25), (0.6, 0.4), (0.3, 0.5),
            (0.3, 0.62), (0.42, 0.66), (0.1, 0.82), (0.0, 1.0),
        )  # fmt: skip
        profile = [(r * a, z + b * (tip - z)) for a, b in shares]
        return [massing.revolved(profile, 12, center)]
    ring = massing.regular_polygon(0.92 * half, 8, center, np.pi / 8)
    needle = massing.spire(ring, center, z, tip)
    if p.spire == "needle":
        return [needle]
    width = half * np.sqrt(2) * 0.98
    square = massing.regular_polygon(width, 4, center, -0.75 * np.pi)
    return [needle, massing.spire(square, center, z, z + 0.45 * (tip - z))]
