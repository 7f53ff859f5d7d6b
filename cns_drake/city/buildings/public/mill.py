"""The mill: brick storeys, a hoist house, a tall chimney, a water wheel."""

from __future__ import annotations

import math

import numpy as np

from cns_drake.city.buildings.house_parts.openings import Openings
from cns_drake.city.buildings.parts import bays, details, massing, tiers, wings
from cns_drake.city.buildings.parts.facades import Band, Facade
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

    def __init__(self, d: Dice) -> None:
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


def build(p: Parameters, out: Assembly) -> None:
    """Builds the mill on a rectangle, its dock in front."""
    out.paint(annex=p.rgb, glass=out.glass_rgb, roof=p.roof_rgb, timber=_TIMBER)
    x0, y0, x1, y1 = out.site.bounds
    front, back = y0 + 2.2, y1 - _MARGIN
    wheel_room = 1.7 if p.wheel else 0.0
    left = x0 + _MARGIN + wheel_room * p.mirrored + p.boiler * (not p.mirrored)
    right = x1 - _MARGIN - wheel_room * (not p.mirrored)
    right -= p.boiler * p.mirrored
    back = min(back, front + 17.0)
    plan = massing.rectangle(*(round(v, 2) for v in (left, front, right, back)))
    a, b, c, d = massing.extent(plan)
    along_y = d - b > c - a
    rise = min(wings.ridge_rise(min(c - a, d - b), p.pitch_deg), 0.4 * p.ridge)
    top = _add_storeys(out, p, plan, p.ridge - rise - 0.25)
    roof = Roof("gable", along_y, 0.4, 0.35, 0.25)
    main = Wing(a, b, c, d, top, p.ridge, roof)
    low = top + 0.18 * (p.ridge - top)
    attic = wings.attic_window(1.1, low, low + 1.6, _RECESS, 2)
    wings.add_roof(out, main, attic, material="annex")
    _add_dock(out, p, main)
    if not along_y:
        _add_hoist(out, p, main)
    if p.boiler:
        _add_boiler(out, p, main, (x0, x1))
    if p.chimney:
        _add_chimney(out, p, main, (x0, x1))
    if p.wheel:
        _add_wheel(out, p, main)


def _add_storeys(
    out: Assembly, p: Parameters, plan: np.ndarray, goal: float
) -> float:
    """Adds the walls; returns their top [m]."""
    h = 4.2 if goal > 9.0 else 3.6
    arch = bays.arched(1.8, 0.0, 2.3, _RECESS, rise=0.5)
    window = bays.arched(p.window_width, 1.2, 2.6, _RECESS, rise=0.3)
    gate = bays.gate(2.4, p.dock + 2.4, _RECESS)
    front = bays.rhythm(p.pitch, [window], 0.7)
    layouts = {
        0: bays.with_middle(front, gate, p.hoist + 0.4),
        2: bays.rhythm(2 * p.pitch, [arch, window], 0.7),
    }
    layout = bays.by_edge(layouts, front)
    ground = Facade(h, (Band(h - 0.25, h, -0.08),), layout, (_RECESS,))
    z = tiers.add_ground(out, plan, ground)
    count, per_group, storey = tiers.divided(goal - z, p.storey, 6)
    head = storey - 0.75
    sash = bays.arched(p.window_width, 0.9, head - 0.3, _RECESS, rise=0.3)
    rows = bays.rhythm(p.pitch, [sash], 0.7)
    layout = bays.with_door(rows, bays.gate(1.9, 2.2, _RECESS), p.hoist)
    walls = Facade(storey, (), layout, (_RECESS,))
    top = tiers.add_storeys(out, plan, walls, z, count, per_group)
    if p.piers:
        strips = details.pilasters(
            plan, p.pitch, 0.7, 2, 0.6, 0.18, h, top - 0.3
        )
        out.add("piers", strips)
    return top


def _add_dock(out: Assembly, p: Parameters, main: Wing) -> None:
    """Adds a loading dock with steps under a timber canopy."""
    wall = main.wall(0)
    a, b = 0.15 * wall.length, 0.85 * wall.length
    steps = details.steps(0.0, 2.0, 1.4, p.dock, 4).moved((a - 2.0, 0.0, 0.0))
    dock = wall.standing(a, b, -0.05, 2.0, p.dock, bottom=True)
    out.add_to("annex", dock, wall.place(steps))
    z = p.dock + 2.9
    pieces = [wall.box(a, b, -0.05, 1.9, z, z + 0.15)]
    for x, _ in bays.stretches(b - a, 4.0, 0.2):
        u = a + x
        strut = details.beam((u, 0.0, z - 1.2), (u, 1.6, z + 0.02), 0.16)
        pieces.append(wall.place(strut))
    out.add_to("timber", *pieces)


def _add_hoist(out: Assembly, p: Parameters, main: Wing) -> None:
    """Adds a timber hoist house that stands out above the hatches."""
    wall = main.wall(0)
    x, half = wall.length / 2, p.hoist / 2
    low = main.wall_top - 1.6
    top = min(main.top - 0.3, main.wall_top + 2.4)
    left, right = main.x0 + x - half, main.x0 + x + half
    roof, wall_top = Roof("gable", True, 0.2, 0.25, 0.18), top - 0.4 * p.hoist
    box = Wing.at(
        left, main.y0 - 1.5, right, main.center[1], wall_top - 0.2, top, roof
    )
    hatch = bays.window(1.5, 0.3, box.wall_top - low - 0.4, 0.2, transom=1.2)
    layout = bays.by_edge({0: bays.alone(hatch, 2.2)}, bays.plain)
    facade = Facade(round(box.wall_top - low, 3), (), layout)
    out.add_to(
        "timber",
        tiers.block(box.outline, facade, round(low, 2)),
        massing.flat(box.outline, round(low, 2), up=False),
    )
    wings.add_roof(out, box, material="timber")
    beam = wall.box(x - 0.12, x + 0.12, 1.4, 1.95, top - 1.3, top - 1.05)
    struts = (
        details.beam((u, 0.0, low - 1.2), (u, 1.35, low + 0.05), 0.18)
        for u in (x - half + 0.2, x + half - 0.2)
    )
    out.add_to("timber", beam, *(wall.place(strut) for strut in struts))


def _beside(p: Parameters, main: Wing, xs: bays.Span) -> tuple[float, float]:
    """Returns the x range between the main house and the site's end."""
    if p.mirrored:
        return main.x1 - 0.05, xs[1] - _MARGIN
    return xs[0] + _MARGIN, main.x0 + 0.05


def _add_boiler(
    out: Assembly, p: Parameters, main: Wing, xs: bays.Span
) -> None:
    a, b = _beside(p, main, xs)
    deep = 0.75 * main.depth
    top = min(6.5, 0.6 * main.wall_top)
    roof = Roof("gable", False, 0.3, 0.0, 0.2)
    house = Wing.at(a, main.y1 - deep, b, main.y1 - 0.4, top - 1.4, top, roof)
    openings = Openings(house, (main,))
    window = bays.arched(1.5, 1.0, top - 3.0, _RECESS, rise=0.4)
    openings.row(range(4), 1.0, 2.8, [window], 0.6)
    openings.enclose(out, (_RECESS,), material="annex")


def _add_chimney(
    out: Assembly, p: Parameters, main: Wing, xs: bays.Span
) -> None:
    """Adds a round chimney on a square base through the boiler house."""
    a, b = _beside(p, main, xs)
    r, top = p.chimney, p.height
    x, y = (a + b) / 2, main.y1 - 1.2 - r
    base = 0.24 * top
    profile = [
        (r, base), (0.72 * r, top - 1.6), (0.95 * r, top - 1.2),
        (0.95 * r, top - 0.3), (0.8 * r, top),
    ]  # fmt: skip
    foot = massing.square(x, y, 1.12 * r)
    out.add_to(
        "annex",
        massing.prism(foot, -massing.FOUNDATION_M, base),
        massing.revolved(profile, 10, (x, y)),
    )


def _add_wheel(out: Assembly, p: Parameters, main: Wing) -> None:
    """Adds a water wheel with paddles beside the side wall."""
    wall = main.wall(3 if p.mirrored else 1)
    r, x, z = p.wheel, 0.5 * wall.length, p.wheel - 0.2
    count, inner = 10, 0.78 * r
    angles = np.arange(count) * 2 * math.pi / count
    hub = np.array([x, z])
    pieces: list[Mesh] = []

    def at(radius: float, angle: float) -> np.ndarray:
        return radius * np.array([math.cos(angle), math.sin(angle)])

    for y in (0.3, 1.3):
        for a in angles:
            b = a + 2 * math.pi / count
            ends = ((inner, a), (r, a), (r, b), (inner, b))
            rim = [(x + q * math.cos(t), z + q * math.sin(t)) for q, t in ends]
            pieces.append(massing.bar(rim, y, y + 0.1))
        for t in angles[: count // 2]:
            arm = at(inner, t)
            pieces.append(_strut(hub - arm, hub + arm, y + 0.05, 0.12))
    for t in angles:
        across = 0.04 * np.array([-math.sin(t), math.cos(t)])
        a, b = hub + inner * at(1.0, t), hub + r * at(1.0, t)
        paddle = (a - across, b - across, b + across, a + across)
        pieces.append(massing.bar(paddle, 0.35, 0.35 + 1.0))
    axle = wall.box(x - 0.15, x + 0.15, -0.1, 1.55, z - 0.15, z + 0.15)
    out.add_to("timber", *(wall.place(piece) for piece in pieces), axle)
    pier = (x - 0.5, x + 0.5, 1.45, 1.7, z + 0.3)
    out.add_to("annex", wall.standing(*pier, bottom=True))


def _strut(start: np.ndarray, end: np.ndarray, y: float, width: float) -> Mesh:
    """A square bar between two points (x, z), in a plane of constant y."""
    along = (end - start) / np.linalg.norm(end - start)
    side = np.array([-along[1], along[0]]) * width / 2
    corners = (start - side, end - side, end + side, start + side)
    return massing.bar(corners, y, y + width)
