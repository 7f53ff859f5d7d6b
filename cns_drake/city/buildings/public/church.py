"""The church: nave, aisles and buttresses, an apse, a tower with a spire."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from cns_drake.city.buildings.parts import bays, details, massing, tiers
from cns_drake.city.buildings.parts.facades import (
    Arch,
    Band,
    Facade,
    facade_mesh,
    glass_mesh,
)
from cns_drake.city.buildings.parts.site import Assembly, Dice
from cns_drake.city.geometry.mesh import Mesh, merge_meshes
from cns_drake.city.geometry.structures import Part

_STONES = ((0.66, 0.61, 0.53), (0.56, 0.36, 0.30), (0.62, 0.62, 0.60))


class Parameters:
    """Parameters of a church; lengths in metres. The spire is `height`."""

    def __init__(self, d: Dice):
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


def build(p: Parameters, assembly: Assembly) -> None:
    """Builds the church along the longer side of a rectangle.

    Its portal is at the front, or on the left where it lies along x.
    """
    x0, y0, x1, y1 = assembly.site.bounds
    if x1 - x0 <= y1 - y0:
        _add_all(p, assembly, x0, y0, x1, y1)
        return
    # Built a quarter turn to the right of where it will stand.
    _add_all(p, assembly, -y1, x0, -y0, x1)
    assembly.parts = [_turned(part) for part in assembly.parts]


def _turned(part: Part) -> Part:
    """Returns the part turned by a quarter to the right (x, y -> y, -x)."""
    (x, y, z), yaw = part.xyz, round(part.rpy[2] - np.pi / 2, 5)
    return replace(part, xyz=(y, -x, z), rpy=(0.0, 0.0, yaw))


def _add_all(
    p: Parameters,
    assembly: Assembly,
    x0: float,
    y0: float,
    x1: float,
    y1: float,
) -> None:
    middle, half = (x0 + x1) / 2, p.nave_width / 2
    apse = half
    front = y0 + 1.6 + (0.6 * p.tower_width if p.tower_at == "middle" else 0.0)
    back = y1 - apse - 1.0
    nave = massing.rectangle(middle - half, front, middle + half, back)
    outer = massing.rectangle(
        middle - half - p.aisle_width,
        front + 2.5,
        middle + half + p.aisle_width,
        back - 1.5,
    )
    _add_nave(assembly, p, nave)
    _add_aisles(assembly, p, outer)
    _add_apse(assembly, p, (middle, back), apse)
    _add_roofs(assembly, p, nave, outer)
    side = p.tower_width / 2
    if p.tower_at == "middle":
        tower = (middle, front + 0.4 * p.tower_width)
    else:
        sign = -1.0 if p.tower_at == "left" else 1.0
        tower = (middle + sign * (half + 0.35 * side), front + side + 0.5)
    _add_tower(assembly, p, tower, side)


def _lancet(width: float, low: float, spring: float, depth: float):
    return bays.arched(width, low, spring, depth, rise=0.9 * width, pier=0.4)


def _add_nave(assembly, p: Parameters, nave) -> None:
    """The tall middle: a portal and a rose in front, clerestory above."""
    h, d = p.nave_height, p.window_depth

    def front(edge: int, length: float):
        x, w = round(length / 2, 2), round(min(0.13 * length, 0.12 * h), 2)
        rise = min(0.3 * h, 4.0)
        relief = [Arch(x - w, x + w, 0.0, rise, rise + w, 1.1)]
        rose = min(0.16 * length, 0.18 * h)
        z = 0.72 * h
        relief.append(Arch(x - rose, x + rose, z - rose, z, z + rose, d))
        for k in (-1, 1):
            u = x + k * 0.32 * length
            relief.append(
                Arch(u - 0.5, u + 0.5, 1.5, 0.45 * h, 0.45 * h + 0.9, d)
            )
        return relief

    low = p.aisle_height + 2.6
    clerestory = bays.rhythm(
        p.bay, [_lancet(1.3, low, max(low + 0.6, h - 2.4), d)], margin=1.6
    )
    plain = h - low > 3.4
    # A stone gable in front of the roof's, with its coping.
    (x0, y0), (x1, _) = nave[0], nave[1]
    shield = massing.gable_roof(
        y0 - 0.35, -x1 - 0.6, y0 + 0.3, -x0 + 0.6, h, p.roof_rise + 0.4
    )
    walls = Facade(
        h,
        (Band(h - 0.5, h, -0.25),),
        bays.by_edge(
            {0: front, 1: clerestory, 3: clerestory} if plain else {0: front},
            bays.plain,
        ),
        glass=(d,),
    )
    gable = shield.moved(yaw=np.pi / 2)
    tiers.add_ground(assembly, nave, walls, [gable], part="nave")


def _add_aisles(assembly, p: Parameters, outer) -> None:
    h, d = p.aisle_height, p.window_depth
    windows = bays.rhythm(
        p.bay, [_lancet(1.5, 1.6, max(2.2, h - 2.4), d)], margin=1.6
    )
    walls = Facade(
        h,
        (Band(0.0, 0.8, -0.12), Band(h - 0.3, h, -0.2)),
        bays.by_edge({1: windows, 3: windows}, bays.plain),
        glass=(d,),
    )
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
    tiers.add_ground(assembly, outer, walls, buttresses, part="aisles")


def _add_apse(assembly, p: Parameters, center, radius: float) -> None:
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

    def layout(edge: int, length: float):
        return window(0.3, length - 0.3) if edge < n else ()

    walls = Facade(
        h,
        (Band(0.0, 0.8, -0.12), Band(h - 0.4, h, -0.2)),
        layout,
        glass=(p.window_depth,),
    )
    cone = massing.spire(
        massing.inset(plan, -0.3), center, h, h + 0.75 * p.roof_rise
    )
    base = massing.foundation(plan)
    pieces = [base, facade_mesh(plan, walls)]
    assembly.add("apse", *pieces)
    assembly.add("apse_glass", glass_mesh(plan, walls), rgb=assembly.glass_rgb)
    eaves = massing.flat(massing.inset(plan, -0.3), h, up=False)
    assembly.add("apse_roof", cone, eaves, rgb=p.roof_rgb)


def _add_roofs(assembly, p: Parameters, nave, outer) -> None:
    (x0, y0), (x1, y1) = nave[0], nave[2]
    x, h = (x0 + x1) / 2, p.nave_height
    # The gable roof lies along y: the shed along x, turned.
    main = massing.gable_roof(y0, -x1 - 0.4, y1, -x0 + 0.4, h, p.roof_rise)
    pieces = [main.moved(yaw=np.pi / 2)]
    (ox0, oy0), (ox1, oy1) = outer[0], outer[2]
    low, high = p.aisle_height, p.aisle_height + 2.2
    for a, b in ((ox0 - 0.3, x0), (x1, ox1 + 0.3)):
        left = a < x
        za, zb = (low, high) if left else (high, low)
        section = [(a, low), (b, low), (b, zb), (a, za)]
        corners = [c for k, c in enumerate(section) if c != section[k - 1]]
        n = len(corners)
        vertices = [(u, v, w) for v in (oy0, oy1) for u, w in corners]
        faces = [tuple(range(n)), tuple(range(2 * n - 1, n - 1, -1))]
        faces += [(k, n + k, n + (k + 1) % n, (k + 1) % n) for k in range(n)]
        pieces.append(Mesh(np.array(vertices), tuple(faces)))
    assembly.add("roofs", *pieces, rgb=p.roof_rgb)


def _add_tower(assembly, p: Parameters, center, half: float) -> None:
    """The tower in three stages, belfry openings in the last."""
    plan = massing.regular_polygon(half * np.sqrt(2), 4, center, -0.75 * np.pi)
    wall = round(p.tower_wall * p.height, 1)
    belfry = round(0.3 * wall, 1)
    shaft = wall - belfry

    def lower(edge: int, length: float):
        x, w = length / 2, 0.17 * length
        relief = [
            Arch(x - 0.5, x + 0.5, z, z + 1.6, z + 2.3, p.window_depth)
            for z in np.arange(6.5, shaft - 4.0, 6.0)
        ]
        if edge == 0 and p.tower_at == "middle":
            relief.append(Arch(x - w, x + w, 0.0, 2.8, 2.8 + w, 0.9))
        return relief

    courses = tuple(
        Band(z, z + 0.3, -0.15) for z in np.arange(4.8, shaft - 1.0, 6.0)
    )
    stage = Facade(shaft, courses, lower, glass=(p.window_depth,))
    corner = details.corner_piers(
        plan, 0.17 * 2 * half, 0.3, 0.02, -massing.FOUNDATION_M, 0.7 * shaft
    )
    tiers.add_ground(assembly, plan, stage, [corner], part="tower")

    def openings(edge: int, length: float):
        w = 0.16 * length
        return [
            Arch(x - w, x + w, 1.2, belfry - 2.2 - w, belfry - 2.2, 0.8)
            for x in (0.3 * length, 0.7 * length)
        ]

    top = Facade(
        belfry,
        (Band(0.0, 0.4, -0.2), Band(belfry - 0.9, belfry, -0.35)),
        openings,
    )
    pieces = [tiers.block(plan, top, shaft)]
    if p.spire != "bulb":
        pieces += _pinnacles(center, half, wall)
    assembly.add("belfry", *pieces)
    assembly.add("spire", _spire(p, center, half, wall), rgb=p.roof_rgb)


def _pinnacles(center, half: float, z: float) -> list[Mesh]:
    pieces = []
    for sx in (-1, 1):
        for sy in (-1, 1):
            x, y = center[0] + sx * (half - 0.4), center[1] + sy * (half - 0.4)
            plan = massing.rectangle(x - 0.4, y - 0.4, x + 0.4, y + 0.4)
            pieces.append(massing.skirt(plan, plan, z, z + 1.4))
            pieces.append(massing.spire(plan, (x, y), z + 1.4, z + 3.4))
    return pieces


def _spire(p: Parameters, center, half: float, z: float) -> Mesh:
    tip = p.height
    if p.spire == "bulb":
        r = half * 0.95
        shares = (
            (0.85, 0.0), (1.0, 0.12), (0.95, 0.25), (0.6, 0.4), (0.3, 0.5),
            (0.3, 0.62), (0.42, 0.66), (0.1, 0.82), (0.0, 1.0),
        )  # fmt: skip
        profile = [(r * a, z + b * (tip - z)) for a, b in shares]
        return massing.revolved(profile, 12, center)
    ring = massing.regular_polygon(0.92 * half, 8, center, np.pi / 8)
    needle = massing.spire(ring, center, z, tip)
    if p.spire == "needle":
        return needle
    square = massing.regular_polygon(
        half * np.sqrt(2) * 0.98, 4, center, -0.75 * np.pi
    )
    broach = massing.spire(square, center, z, z + 0.45 * (tip - z))
    return merge_meshes(needle, broach)
