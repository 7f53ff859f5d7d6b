"""The waterfront hall: a long shed with a loading dock and big doors."""

from __future__ import annotations

import itertools

import numpy as np

from cns_drake.city.facades import bays, details, massing
from cns_drake.city.facades.assembly import Assembly, Dice
from cns_drake.city.facades.walls import Band, Facade, facade_mesh, glass_mesh
from cns_drake.city.geometry.mesh import Mesh, merge_meshes

_WALLS = ((0.60, 0.36, 0.29), (0.62, 0.62, 0.60), (0.70, 0.64, 0.52))
_ROOFS = ((0.42, 0.44, 0.46), (0.50, 0.33, 0.27), (0.36, 0.42, 0.40))


class Parameters:
    """Parameters of a hall; lengths in metres.

    `roof` is `gable`, `barrel` or `sawtooth`; the ridge is at `height`.
    """

    def __init__(self, d: Dice) -> None:
        roof = d.pick(("gable", "barrel", "sawtooth"))
        dock = d.uniform(2.5, 4.0, 1)
        depth = d.depth - dock
        self.height = d.height
        self.roof = roof
        self.eaves = round(d.height * d.uniform(0.6, 0.7), 1)
        self.spans = max(1, round(depth / d.uniform(16.0, 22.0)))
        self.pitch = max(d.uniform(4.5, 6.0), (d.width + depth) / 15)
        self.pier_width = d.uniform(0.6, 0.9, 2)
        self.pier_reach = d.uniform(0.2, 0.34, 2)
        self.window_depth = d.uniform(0.2, 0.35, 2)
        self.door_every = d.whole(2, 4)
        self.dock_depth = dock
        self.dock_height = d.uniform(0.9, 1.2, 2)
        self.ventilators = d.whole(3, 7)
        self.rgb = d.pick(_WALLS)
        self.roof_rgb = d.pick(_ROOFS)


def build(p: Parameters, out: Assembly) -> None:
    """Builds the hall on a rectangle, its dock at the front."""
    x0, y0, x1, y1 = out.site.bounds
    front = y0 + p.dock_depth
    plan = massing.rectangle(x0, front, x1, y1)
    walls = _walls(p)
    pieces = [
        massing.foundation(plan),
        facade_mesh(plan, walls),
        details.piers(
            plan, p.pitch, p.pier_width, p.pier_reach, 0.0, p.eaves - 0.5,
            margin=0.5 + p.pier_width / 2,
        ),
        *_dock(p, x0, x1, y0, front),
    ]  # fmt: skip
    out.add("walls", *pieces)
    out.add("glass", glass_mesh(plan, walls), rgb=out.glass_rgb)
    out.add("roof", _roof(p, plan), rgb=p.roof_rgb)


def _walls(p: Parameters) -> Facade:
    """Tall windows between the piers, doors under every few of them."""
    head = p.eaves - 1.0
    window = bays.window(
        p.pitch - 1.6, 2.2, head, p.window_depth, mullions=1,
        transom=round((2.2 + head) / 2, 2),
    )  # fmt: skip
    door = bays.gate(p.pitch - 1.4, min(4.6, head - 0.3))
    front = bays.gate(p.pitch - 1.4, min(4.2 + p.dock_height, head - 0.3))
    choices = [front] + [window] * (p.door_every - 1)
    rows = bays.rhythm(p.pitch, [window], margin=0.5)
    layouts = {0: bays.rhythm(p.pitch, choices, margin=0.5), 2: rows}
    layout = bays.by_edge(layouts, bays.with_middle(rows, door, p.pitch))
    bands = (Band(0.0, 0.6, -0.1), Band(p.eaves - 0.5, p.eaves, -0.3))
    return Facade(p.eaves, bands, layout, (p.window_depth,))


def _dock(
    p: Parameters, x0: float, x1: float, y0: float, front: float
) -> list[Mesh]:
    """A loading platform under a canopy on posts, steps at both ends."""
    high = p.dock_height
    a, b = x0 + 2.0, x1 - 2.0
    platform = massing.standing(a, b, y0 + 0.4, front, high, bottom=True)
    steps = details.steps(0.0, p.dock_depth - 0.6, 1.6, high, 5)
    ends = massing.rectangle(a, y0 + 0.4, b, front)
    pieces = [platform]
    pieces += [details.WallFrame(ends, k).place(steps) for k in (1, 3)]
    eaves = min(p.eaves - 0.8, high + 5.2)
    (ya, za), (yb, zb) = (
        (front - p.dock_depth + 0.1, eaves - 0.5),
        (front, eaves),
    )
    section = [(ya, za), (yb, zb), (yb, zb + 0.2), (ya, za + 0.25)]
    vertices = np.array([(x, y, z) for x in (a, b) for y, z in section])
    faces = [(k, 4 + k, 4 + (k + 1) % 4, (k + 1) % 4) for k in range(4)]
    faces += [(0, 1, 2, 3), (7, 6, 5, 4)]
    pieces.append(Mesh(vertices, tuple(f[::-1] for f in faces)))
    for x, _ in bays.stretches(b - a, 1.5 * p.pitch, 0.3)[1:]:
        post = (a + x - 0.12, a + x + 0.12, y0 + 0.6, y0 + 0.84)
        pieces.append(massing.box(*post, high - 0.1, eaves - 0.2))
    return pieces


def _roof(p: Parameters, plan: np.ndarray) -> Mesh:
    (x0, y0), (x1, y1) = plan[0], plan[2]
    rise = p.height - p.eaves
    if p.roof == "sawtooth":
        teeth = massing.extruded(_sawtooth(x0, x1, rise), y0, y1)
        teeth = massing.swapped(teeth)
        return teeth.moved((0.0, 0.0, p.eaves))
    pieces = []
    edges = np.linspace(y0, y1, p.spans + 1)
    for a, b in itertools.pairwise(edges):
        shed = massing.extruded(_profile(p.roof, a, b, rise), x0, x1)
        pieces.append(shed.moved((0.0, 0.0, p.eaves)))
        pieces += _ridge(p, x0, x1, (a + b) / 2)
    return merge_meshes(*pieces)


def _sawtooth(x0: float, x1: float, rise: float) -> list:
    """Upright glazing and the slopes that fall away from it."""
    teeth = max(2, round((x1 - x0) / 7.0))
    step = (x1 - x0) / teeth
    line = [(x0, 0.0)]
    for k in range(teeth):
        line += [(x0 + k * step, rise), (x0 + (k + 1) * step, 0.0)]
    return line


def _profile(roof: str, a: float, b: float, rise: float) -> list:
    # The monitor on the ridge stands above the roof by what is kept here.
    rise -= 0.6
    half, middle = (b - a) / 2, (a + b) / 2
    if roof == "gable":
        return [(a, 0.0), (middle, rise), (b, 0.0)]
    angles = np.linspace(np.pi, 0.0, 9)[1:-1]
    arc = [(middle + half * np.cos(t), rise * np.sin(t)) for t in angles]
    return [(a, 0.0), *arc, (b, 0.0)]


def _ridge(p: Parameters, x0: float, x1: float, y: float) -> list[Mesh]:
    """A monitor along the ridge with ventilators at equal distances."""
    top, low = p.height - 0.25, p.height - 1.1
    length = x1 - x0
    a, b = x0 + 0.15 * length, x1 - 0.15 * length
    pieces = [massing.box(a, b, y - 0.7, y + 0.7, low, top, bottom=False)]
    for k in range(p.ventilators):
        x = a + (k + 0.5) * (b - a) / p.ventilators
        hood = (x - 0.5, x + 0.5, y - 0.9, y + 0.9)
        pieces.append(massing.box(*hood, low, p.height, bottom=False))
    return pieces
