"""The tower under construction: core, concrete frame, scaffolds, cladding."""

from __future__ import annotations

import itertools

import numpy as np

from cns_drake.city.facades import bays, details, massing
from cns_drake.city.facades.assembly import Assembly, Dice
from cns_drake.city.facades.walls import Band, Facade, facade_mesh, glass_mesh
from cns_drake.city.geometry.mesh import Mesh, merge_meshes

_CONCRETE = (0.66, 0.65, 0.63)
_STEEL = (0.52, 0.53, 0.55)
_TIMBER = (0.72, 0.58, 0.38)
_NETS = ((0.26, 0.42, 0.34), (0.24, 0.36, 0.54), (0.62, 0.60, 0.56))
_CLADDINGS = ((0.78, 0.76, 0.72), (0.46, 0.50, 0.54), (0.66, 0.52, 0.42))
_SLAB_M = 0.28
# Room for scaffolds around the frame [m].
_SCAFFOLD_M = 1.7
# Cladding stands this far in front of the slabs [m].
_CLADDING_M = 0.35
_LIFT_M = 2.0


class Parameters:
    """Parameters of a building site's tower; lengths in metres.

    Attributes:
        height: of the core.
        storeys: slabs above the ground.
        storey: height of a storey.
        group: storeys that are placed as one.
        pitch: of the columns.
        core: extent of the core, as parts of the plan.
        clad: storeys whose walls are finished.
        scaffolds: edges with a scaffold.
        scaffold_top: storeys it covers.
        nets: part of the scaffold's bays behind a net.
        props: whether the top slab is still propped.
        hoist: whether a hoist climbs the right side.
    """

    def __init__(self, d: Dice) -> None:
        rise = d.height - d.uniform(3.5, 5.5)
        storeys = max(3, round(rise / d.uniform(3.4, 4.0)))
        group = -(-storeys // 8)
        storeys = group * max(2, round(storeys / group))
        self.height = d.height
        self.storeys = storeys
        self.storey = round(rise / storeys, 3)
        self.pitch = d.uniform(6.0, 8.0)
        self.core = (d.uniform(0.28, 0.4), d.uniform(0.28, 0.4))
        self.group = group
        self.clad = group * d.whole(0, max(1, storeys // group // 2))
        self.scaffolds = d.pick(((0,), (0, 1), (0, 3), (1, 3)))
        self.scaffold_top = min(d.whole(storeys // 2, storeys), 8)
        self.nets = d.uniform(0.2, 0.7)
        self.props = d.chance(0.7)
        self.hoist = d.chance(0.6)
        self.rgb = _CONCRETE
        self.clad_rgb = d.pick(_CLADDINGS)
        self.net_rgb = d.pick(_NETS)


def build(p: Parameters, out: Assembly) -> None:
    """Builds the tower on a rectangle."""
    site = massing.rectangle(*out.site.bounds)
    plan = np.round(massing.inset(site, _SCAFFOLD_M + 0.2), 2)
    _add_frame(out, p, plan)
    _add_core(out, p, plan)
    if p.clad:
        _add_cladding(out, p, plan)
    if p.props:
        _add_props(out, p, plan)
    _add_scaffolds(out, p, plan)
    if p.hoist:
        _add_hoist(out, p, plan)


def _repeated(pieces: list[Mesh], count: int, step: float) -> Mesh:
    """Returns `count` copies of some meshes above one another."""
    storey = merge_meshes(*pieces)
    copies = (storey.moved((0.0, 0.0, k * step)) for k in range(count))
    return merge_meshes(*copies)


def _columns(p: Parameters, plan: np.ndarray) -> list[massing.Point]:
    """Returns where the columns stand."""
    x0, y0, x1, y1 = massing.extent(plan)
    places = []
    for a, b in ((x0, x1), (y0, y1)):
        count = min(6, max(2, round((b - a) / p.pitch) + 1))
        places.append(np.round(np.linspace(a + 0.5, b - 0.5, count), 2))
    xs, ys = (place.tolist() for place in places)
    return [(x, y) for x in xs for y in ys]


def _add_frame(out: Assembly, p: Parameters, plan: np.ndarray) -> None:
    """Adds a storey's columns and the slab on them, over and over."""
    columns, low = _columns(p, plan), p.storey - _SLAB_M
    top = p.storeys * p.storey
    pieces = [massing.post(x, y, 0.25, low + 0.02, 0.0) for x, y in columns]
    pieces.append(massing.prism(plan, low, p.storey, bottom=True))
    # Columns of the storey to come, and their bars.
    stubs = [massing.prism(plan, -massing.FOUNDATION_M, 0.05)]
    for x, y in columns:
        foot = (x - 0.25, x + 0.25, y - 0.25, y + 0.25)
        bar = massing.regular_polygon(0.05, 3, (x + 0.12, y))
        stubs.append(massing.box(*foot, top - 0.05, top + 0.5))
        stubs.append(massing.prism(bar, top + 0.45, top + 1.5))
    for edge in range(4):
        wall = details.WallFrame(plan, edge)
        for z in (p.storey + 0.5, p.storey + 1.0):
            rail = (0.05, wall.length - 0.05, -0.08, -0.03)
            pieces.append(wall.box(*rail, z, z + 0.06))
        for u in np.linspace(0.1, wall.length - 0.1, 6).tolist():
            post = (u - 0.03, u + 0.03, -0.09, -0.03)
            stubs.append(wall.box(*post, top, top + 1.1))
    group, step = _repeated(pieces, p.group, p.storey), p.group * p.storey
    out.stack("frame", group, 0.0, step, p.storeys // p.group)
    out.add("stubs", *stubs)


def _add_core(out: Assembly, p: Parameters, plan: np.ndarray) -> None:
    """Adds the core with its doorways and the form that climbs on it."""
    x0, y0, x1, y1 = massing.extent(plan)
    x, y = (x0 + x1) / 2, (y0 + y1) / 2
    a, b = p.core[0] * (x1 - x0) / 2, p.core[1] * (y1 - y0) / 2
    core = np.round(massing.rectangle(x - a, y - b, x + a, y + b), 2)
    door = bays.alone(bays.window(1.2, 0.05, 2.2, 0.35), 2.0)
    layout = bays.by_edge({0: door, 2: door}, bays.plain)
    facade = Facade(p.storey, (), layout).stacked(p.storeys)
    top, high = round(p.storeys * p.storey, 3), p.height
    out.add(
        "core",
        facade_mesh(core, facade),
        massing.skirt(core, core, top, high - 0.4),
        massing.roof_pan(core, high - 2.0, high - 0.4, 0.3),
    )
    form = massing.inset(core, -0.3)
    out.add(
        "form",
        massing.skirt(form, form, high - 2.6, high),
        massing.flat(form, high - 2.6, up=False),
        massing.roof_pan(form, high - 0.6, high, 0.3),
        rgb=_TIMBER,
    )


def _add_cladding(out: Assembly, p: Parameters, plan: np.ndarray) -> None:
    """Adds the finished walls of the lower storeys."""
    outer = massing.inset(plan, -_CLADDING_M)
    head = round(p.storey - 0.5, 2)
    pitch = max(p.pitch / 2, max(np.ptp(plan, axis=0)) / 8)
    rows = bays.rhythm(pitch, [bays.window(pitch - 0.5, 0.7, head, 0.2)], 0.5)
    facade = Facade(p.storey, (Band(0.0, 0.2, -0.08),), rows, (0.2,))
    # The panels' backs, seen from within, and their top edge.
    backs = massing.skirt(plan[::-1], plan[::-1], 0.0, p.storey)
    rim = massing.skirt(outer, plan, p.storey, p.storey)
    walls = [facade_mesh(outer, facade), backs, rim]
    panes = [glass_mesh(outer, facade)]
    groups, step = p.clad // p.group, p.group * p.storey
    for part, pieces, rgb in (
        ("cladding", walls, p.clad_rgb),
        ("cladding_glass", panes, out.glass_rgb),
    ):
        mesh = _repeated(pieces, p.group, p.storey)
        out.stack(part, mesh, 0.0, step, groups, rgb=rgb)
    out.add("foot", massing.foundation(outer), rgb=p.clad_rgb)


def _add_props(out: Assembly, p: Parameters, plan: np.ndarray) -> None:
    """Adds props below the top slab, along the front and the back."""
    x0, y0, x1, y1 = massing.extent(plan)
    low = (p.storeys - 1) * p.storey
    high = p.storeys * p.storey - _SLAB_M + 0.02
    props = []
    for x in np.linspace(x0 + 1.5, x1 - 1.5, max(3, round((x1 - x0) / 3.0))):
        for y in (y0 + 1.2, y1 - 1.2):
            shaft = massing.regular_polygon(0.06, 4, (x, y))
            props.append(massing.skirt(shaft, shaft, low - 0.02, high))
    out.add("props", *props, rgb=_STEEL)


def _add_scaffolds(out: Assembly, p: Parameters, plan: np.ndarray) -> None:
    """Adds scaffolds: standards of full height, and lifts between them."""
    lifts = max(2, int(p.scaffold_top * p.storey / _LIFT_M))
    per_group = -(-lifts // 6)
    groups = -(-lifts // per_group)
    lifts, rng = per_group * groups, out.rng
    levels, standards, nets = [], [], []
    for edge in p.scaffolds:
        wall = details.WallFrame(plan, edge)
        count = max(2, round((wall.length - 0.4) / max(2.8, wall.length / 11)))
        xs = np.round(
            np.linspace(0.2, wall.length - 0.2, count + 1), 2
        ).tolist()
        levels.append(wall.place(_scaffold_level(xs)))
        for x in xs:
            for y in (0.6, 1.45):
                pole = massing.square(x, y, 0.04)
                mesh = massing.prism(
                    pole, -massing.FOUNDATION_M, lifts * _LIFT_M + 0.9
                )
                standards.append(wall.place(mesh))
        for a, b in itertools.pairwise(xs):
            if rng.random() < p.nets:
                first = int(rng.integers(0, lifts - 1))
                last = int(rng.integers(first + 1, lifts + 1))
                low, high = first * _LIFT_M + 0.2, last * _LIFT_M - 0.2
                spot = (round(a + 0.05, 2), round(b - 0.05, 2), 1.56, 1.6)
                nets.append(wall.box(*spot, low, high))
    stack = _repeated(levels, per_group, _LIFT_M)
    out.stack("scaffold", stack, 0.0, per_group * _LIFT_M, groups, rgb=_STEEL)
    out.add("standards", *standards, rgb=_STEEL)
    out.add("nets", *nets, rgb=p.net_rgb)


def _scaffold_level(xs: list[float]) -> Mesh:
    """One lift of a scaffold: boards, a guard rail, braces."""
    a, b, top = xs[0], xs[-1], _LIFT_M
    pieces = [massing.box(a, b, 0.55, 1.5, top - 0.12, top - 0.05)]
    for z in (0.5, 1.0):
        pieces.append(massing.box(a, b, 1.5, 1.54, z, z + 0.06))
    for x0, x1 in itertools.pairwise(xs[::3]):
        start, stop = (x0, 1.54, 0.05), (x1, 1.54, top - 0.15)
        pieces.append(details.beam(start, stop, 0.07))
    return merge_meshes(*pieces)


def _add_hoist(out: Assembly, p: Parameters, plan: np.ndarray) -> None:
    """Adds a hoist's mast and cage at the back."""
    wall = details.WallFrame(plan, 2)
    x, top = 0.5 * wall.length, p.storeys * p.storey - 1.0
    pieces = [
        wall.standing(u - 0.05, u + 0.05, v - 0.05, v + 0.05, top)
        for u in (x - 0.3, x + 0.3)
        for v in (0.3, 0.9)
    ]
    for z in np.arange(1.0, top, 4.5).tolist():
        pieces.append(wall.box(x - 0.3, x + 0.3, -0.05, 0.92, z, z + 0.08))
    z = round(0.55 * top, 1)
    cage = wall.box(x + 0.4, x + 1.9, 0.15, 1.35, z, z + 2.4)
    out.add("hoist", *pieces, cage, rgb=(0.80, 0.62, 0.16))
