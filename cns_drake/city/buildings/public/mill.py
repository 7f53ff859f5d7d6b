"""The mill: brick storeys, a hoist house, a tall chimney, a water wheel."""

from __future__ import annotations

import math

import numpy as np

from cns_drake.city.buildings.house_parts.openings import Openings
from cns_drake.city.buildings.parts import bays, details, massing, tiers, wings
from cns_drake.city.buildings.parts.facades import Band, Facade
from cns_drake.city.buildings.parts.materials import Materials
from cns_drake.city.buildings.parts.site import Assembly, Dice
from cns_drake.city.buildings.parts.wings import Roof, Wing
from cns_drake.city.geometry.mesh import Mesh

_BRICKS = ((0.54, 0.33, 0.27), (0.48, 0.30, 0.25), (0.62, 0.45, 0.35))
_ROOFS = ((0.36, 0.36, 0.38), (0.44, 0.30, 0.25), (0.42, 0.44, 0.44))
_TIMBER = (0.40, 0.33, 0.27)
_MARGIN = 0.5
_RECESS = 0.25


class Parameters:
    """Parameters of a mill; lengths in metres.

    Attributes:
        height: of the chimney, else of the ridge.
        ridge: of the main house.
        chimney: radius at its foot; 0 for none.
        wheel: radius of the water wheel; 0 for none.
        mirrored: whether the wheel turns on the left.
        storey: wanted height of a storey.
        pitch, window_width: of the windows.
        hoist: width of the hoist house in front.
        dock: height of the loading dock.
        boiler: width of the boiler house beside the main house.
    """

    def __init__(self, d: Dice):
        width, depth = d.width, d.depth
        chimney = width > 24.0 and d.height > 16.0 and d.chance(0.7)
        ridge = round(d.height * d.uniform(0.64, 0.74), 2)
        boiler = round(d.uniform(0.22, 0.3) * width, 2)
        self.height = d.height
        self.ridge = ridge if chimney else d.height
        self.pitch_deg = d.uniform(28.0, 40.0)
        self.chimney = d.uniform(1.0, 1.4, 2) if chimney else 0.0
        self.wheel = (
            round(min(d.uniform(2.4, 3.4), 0.2 * depth), 2)
            if d.chance(0.45)
            else 0.0
        )
        self.mirrored = d.chance(0.5)
        self.storey = d.uniform(3.1, 3.7)
        self.pitch = max(d.uniform(2.8, 3.6), (width + depth) / 20)
        self.window_width = d.uniform(1.1, 1.7, 2)
        self.piers = d.chance(0.6)
        self.hoist = d.uniform(3.0, 3.8, 2)
        self.dock = d.uniform(0.7, 1.1, 2)
        self.boiler = (
            boiler if chimney or (width > 22 and d.chance(0.5)) else 0.0
        )
        self.rgb = d.pick(_BRICKS)
        self.roof_rgb = d.pick(_ROOFS)


def build(p: Parameters, assembly: Assembly) -> None:
    """Builds the mill on a rectangle, its dock in front."""
    materials = Materials(
        annex=p.rgb, glass=assembly.glass_rgb, roof=p.roof_rgb, timber=_TIMBER
    )
    x0, y0, x1, y1 = assembly.site.bounds
    front, back = y0 + 2.2, y1 - _MARGIN
    wheel_room = 1.7 if p.wheel else 0.0
    left = x0 + _MARGIN + wheel_room * p.mirrored + p.boiler * (not p.mirrored)
    right = x1 - _MARGIN - wheel_room * (not p.mirrored)
    right -= p.boiler * p.mirrored
    back = min(back, front + 17.0)
    plan = massing.rectangle(*(round(v, 2) for v in (left, front, right, back)))
    along_y = plan[2, 1] - plan[0, 1] > plan[2, 0] - plan[0, 0]
    span = min(plan[2] - plan[0])
    rise = min(wings.ridge_rise(span, p.pitch_deg), 0.4 * p.ridge)
    top = _add_storeys(assembly, p, plan, p.ridge - rise - 0.25)
    roof = Roof("gable", along_y, 0.4, 0.35, 0.25)
    (a, b), (c, d) = plan[0], plan[2]
    main = Wing(a, b, c, d, top, p.ridge, roof)
    low = top + 0.18 * (p.ridge - top)
    attic = wings.attic_window(1.1, low, low + 1.6, _RECESS, 2)
    wings.add_roof(materials, main, attic, material="annex")
    _add_dock(materials, p, main)
    if not along_y:
        _add_hoist(materials, p, main)
    if p.boiler:
        _add_boiler(materials, p, main, (x0, x1))
    if p.chimney:
        _add_chimney(materials, p, main, (x0, x1))
    if p.wheel:
        _add_wheel(materials, p, main)
    materials.finish(assembly)


def _add_storeys(assembly, p: Parameters, plan, goal: float) -> float:
    """Adds the walls; returns their top [m]."""
    ground_height = 4.2 if goal > 9.0 else 3.6
    arch = bays.arched(1.8, 0.0, 2.3, _RECESS, rise=0.5)
    window = bays.arched(p.window_width, 1.2, 2.6, _RECESS, rise=0.3)
    gate = bays.gate(2.4, p.dock + 2.4, _RECESS)
    front = bays.rhythm(p.pitch, [window], 0.7)
    layouts = {
        0: bays.with_middle(front, gate, p.hoist + 0.4),
        2: bays.rhythm(2 * p.pitch, [arch, window], 0.7),
    }
    ground = Facade(
        ground_height,
        (Band(ground_height - 0.25, ground_height, -0.08),),
        bays.by_edge(layouts, front),
        (_RECESS,),
    )
    z = tiers.add_ground(assembly, plan, ground)
    count, per_group, storey = tiers.divided(goal - z, p.storey, 6)
    head = storey - 0.75
    sash = bays.arched(p.window_width, 0.9, head - 0.3, _RECESS, rise=0.3)
    rows = bays.rhythm(p.pitch, [sash], 0.7)
    hatch = bays.gate(1.9, 2.2, _RECESS)
    walls = Facade(
        storey,
        (),
        bays.by_edge({0: bays.with_middle(rows, hatch, p.hoist)}, rows),
        (_RECESS,),
    )
    top = tiers.add_storeys(assembly, plan, walls, z, count, per_group)
    if p.piers:
        strips = details.pilasters(
            plan, p.pitch, 0.7, 2, 0.6, 0.18, ground_height, top - 0.3
        )
        if strips.faces:
            assembly.add("piers", strips)
    return top


def _add_dock(materials, p: Parameters, main: Wing) -> None:
    """Adds a loading dock with steps under a timber canopy."""
    wall = main.wall(0)
    a, b = 0.15 * wall.length, 0.85 * wall.length
    materials.add(
        "annex",
        wall.place(
            massing.box(a, b, -0.05, 2.0, -massing.FOUNDATION_M, p.dock)
        ),
        main.wall(0).place(
            details.steps(0.0, 2.0, 1.4, p.dock, 4).moved((a - 2.0, 0.0, 0.0))
        ),
    )
    z = p.dock + 2.9
    lid = massing.box(a, b, -0.05, 1.9, z, z + 0.15)
    pieces = [lid]
    for x, _ in bays.stretches(b - a, 4.0, 0.2):
        u = a + x
        pieces.append(details.beam((u, 0.0, z - 1.2), (u, 1.6, z + 0.02), 0.16))
    materials.add("timber", *(wall.place(piece) for piece in pieces))


def _add_hoist(materials, p: Parameters, main: Wing) -> None:
    """Adds a timber hoist house that stands out above the hatches."""
    wall = main.wall(0)
    x, half = wall.length / 2, p.hoist / 2
    low = main.wall_top - 1.6
    top = min(main.top - 0.3, main.wall_top + 2.4)
    box = Wing.at(
        main.x0 + x - half, main.y0 - 1.5, main.x0 + x + half,
        (main.y0 + main.y1) / 2, top - 0.4 * p.hoist - 0.2, top,
        Roof("gable", True, 0.2, 0.25, 0.18),
    )  # fmt: skip
    hatch = bays.window(1.5, 0.3, box.wall_top - low - 0.4, 0.2, transom=1.2)
    facade = Facade(
        round(box.wall_top - low, 3),
        (),
        bays.by_edge({0: bays.with_middle(bays.plain, hatch, 2.2)}, bays.plain),
    )
    materials.add(
        "timber",
        tiers.block(box.outline, facade, round(low, 2)),
        massing.flat(box.outline, round(low, 2), up=False),
    )
    wings.add_roof(materials, box, material="timber")
    beam = massing.box(x - 0.12, x + 0.12, 1.4, 1.95, top - 1.3, top - 1.05)
    struts = [
        details.beam((u, 0.0, low - 1.2), (u, 1.35, low + 0.05), 0.18)
        for u in (x - half + 0.2, x + half - 0.2)
    ]
    materials.add("timber", *(wall.place(m) for m in (beam, *struts)))


def _beside(p: Parameters, main: Wing, xs) -> tuple[float, float]:
    """Returns the x range between the main house and the site's end."""
    if p.mirrored:
        return main.x1 - 0.05, xs[1] - _MARGIN
    return xs[0] + _MARGIN, main.x0 + 0.05


def _add_boiler(materials, p: Parameters, main: Wing, xs) -> None:
    a, b = _beside(p, main, xs)
    deep = 0.75 * (main.y1 - main.y0)
    top = min(6.5, 0.6 * main.wall_top)
    roof = Roof("gable", False, 0.3, 0.0, 0.2)
    house = Wing.at(a, main.y1 - deep, b, main.y1 - 0.4, top - 1.4, top, roof)
    openings = Openings(house, (main,))
    window = bays.arched(1.5, 1.0, top - 3.0, _RECESS, rise=0.4)
    openings.row(range(4), 1.0, 2.8, [window], 0.6)
    openings.add_walls(materials, (_RECESS,), material="annex")
    wings.add_roof(materials, house, material="annex")


def _add_chimney(materials, p: Parameters, main: Wing, xs) -> None:
    """Adds a round chimney on a square base through the boiler house."""
    a, b = _beside(p, main, xs)
    r, top = p.chimney, p.height
    x, y = (a + b) / 2, main.y1 - 1.2 - r
    base = 0.24 * top
    profile = [
        (r, base), (0.72 * r, top - 1.6), (0.95 * r, top - 1.2),
        (0.95 * r, top - 0.3), (0.8 * r, top),
    ]  # fmt: skip
    side = 1.12 * r
    foot = massing.rectangle(x - side, y - side, x + side, y + side)
    materials.add(
        "annex",
        massing.prism(foot, -massing.FOUNDATION_M, base),
        massing.revolved(profile, 10, (x, y)),
    )


def _add_wheel(materials, p: Parameters, main: Wing) -> None:
    """Adds a water wheel with paddles beside the side wall."""
    edge = 3 if p.mirrored else 1
    wall = main.wall(edge)
    r, x = p.wheel, 0.5 * wall.length
    z = r - 0.2
    count, inner = 10, 0.78 * r
    angles = np.arange(count) * 2 * math.pi / count
    pieces: list[Mesh] = []
    for y in (0.3, 1.3):
        for k in range(count):
            a, b = angles[k], angles[k] + 2 * math.pi / count
            rim = [
                (x + q * math.cos(t), y, z + q * math.sin(t))
                for q, t in ((inner, a), (r, a), (r, b), (inner, b))
            ]
            pieces.append(_plate(rim, 0.1))
        for t in angles[: count // 2]:
            arm = inner * np.array([math.cos(t), 0.0, math.sin(t)])
            middle = np.array([x, y + 0.05, z])
            pieces.append(_strut(middle - arm, middle + arm, 0.12))
    for t in angles:
        out = np.array([math.cos(t), 0.0, math.sin(t)])
        across = 0.04 * np.array([-math.sin(t), 0.0, math.cos(t)])
        hub = np.array([x, 0.35, z])
        ends = hub + inner * out, hub + r * out
        corners = [ends[0] - across, ends[1] - across,
                   ends[1] + across, ends[0] + across]  # fmt: skip
        pieces.append(_plate(corners, 1.0))
    axle = massing.box(x - 0.15, x + 0.15, -0.1, 1.55, z - 0.15, z + 0.15)
    pier = massing.box(
        x - 0.5, x + 0.5, 1.45, 1.7, -massing.FOUNDATION_M, z + 0.3
    )
    materials.add("timber", *(wall.place(m) for m in (*pieces, axle)))
    materials.add("annex", wall.place(pier))


def _plate(corners, thickness: float) -> Mesh:
    """A plate of even thickness along y over four corners in x and z."""
    near = np.array(corners, dtype=float)
    far = near + np.array([0.0, thickness, 0.0])
    faces = [(0, 1, 2, 3), (7, 6, 5, 4)]
    faces += [(k, k + 4, (k + 1) % 4 + 4, (k + 1) % 4) for k in range(4)]
    return Mesh(np.vstack([near, far]), tuple(faces))


def _strut(start, end, width: float) -> Mesh:
    """A square bar in a plane of constant y."""
    along = (end - start) / np.linalg.norm(end - start)
    side = np.array([-along[2], 0.0, along[0]]) * width / 2
    corners = [start - side, end - side, end + side, start + side]
    return _plate(corners, width)
