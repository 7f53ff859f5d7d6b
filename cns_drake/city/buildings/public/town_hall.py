"""The town hall: a columned porch, hipped pavilions, a clock tower."""

from __future__ import annotations

import math

import numpy as np

from cns_drake.city.buildings.parts import (
    bays,
    details,
    massing,
    pitched_roofs,
    tiers,
)
from cns_drake.city.buildings.parts.facades import Band, Facade
from cns_drake.city.buildings.parts.site import Assembly, Dice
from cns_drake.city.geometry.mesh import Mesh

_WALLS = ((0.82, 0.77, 0.66), (0.60, 0.40, 0.32), (0.76, 0.72, 0.66))
_STONE = (0.84, 0.81, 0.74)
_ROOFS = ((0.34, 0.36, 0.38), (0.34, 0.46, 0.42), (0.45, 0.29, 0.24))
_MARGIN = 0.6


class Parameters:
    """Parameters of a town hall; lengths in metres.

    Attributes:
        height: of the tower's tip.
        storeys: of the main house.
        storey: height of a storey.
        floor: height of the main floor above the ground.
        porch_columns: along the front of the porch.
        pavilion: width of the pavilions at both ends; 0 for none.
        mansard: whether their roofs are steep, with a knee.
        tower: side of the tower.
        crown: `dome`, `spire` or `cupola` (a lantern on a dome).
        rise: of the roofs.
        pitch, window_width: of the windows.
    """

    def __init__(self, d: Dice) -> None:
        width, depth = d.width, d.depth
        body = d.uniform(0.36, 0.42) * d.height
        storeys = int(np.clip(round(body / 4.6), 1, 3))
        columns = 6 if width > 34.0 else 4
        self.height = d.height
        self.storeys = storeys
        self.storey = round(body / storeys, 2)
        self.floor = d.uniform(0.7, 1.1, 2)
        self.porch_columns = columns
        self.pavilion = (
            round(d.uniform(0.18, 0.22) * width, 2)
            if width > 26.0 and d.chance(0.75)
            else 0.0
        )
        self.mansard = d.chance(0.5)
        self.tower = round(min(0.14 * width + 2.4, 0.35 * depth, 8.0), 2)
        self.crown = d.pick(("dome", "spire", "cupola"))
        self.rise = round(d.uniform(0.28, 0.4) * min(depth, 16.0), 2)
        self.pitch = max(d.uniform(2.8, 3.4), (width + depth) / 16)
        self.window_width = d.uniform(1.2, 1.6, 2)
        self.rgb = d.pick(_WALLS)
        self.roof_rgb = d.pick(_ROOFS)


def build(p: Parameters, out: Assembly) -> None:
    """Builds the town hall on a rectangle."""
    x0, y0, x1, y1 = out.site.bounds
    depth = y1 - y0
    ahead = min(4.6, 0.28 * depth)
    front = y0 + ahead
    back = min(y1 - _MARGIN, front + 18.0)
    body = massing.rectangle(x0 + _MARGIN, front, x1 - _MARGIN, back)
    body = np.round(body, 2)
    plan = _with_pavilions(p, body)
    top = _add_walls(out, p, plan)
    ridge = min(top + 0.15 + p.rise, 0.62 * p.height)
    roofs = [pitched_roofs.hip(body, top - 0.02, ridge, 0.5, 0.35)]
    for end in _pavilions(p, body):
        roofs.append(_pavilion_roof(p, end, top - 0.02, ridge))
    out.add("roof", *roofs, rgb=p.roof_rgb)
    _add_porch(out, p, body, ahead, top)
    _add_tower(out, p, body, top)


def _pavilions(p: Parameters, body: np.ndarray) -> list[np.ndarray]:
    """Returns the rectangles of the pavilions, half a metre in front."""
    if p.pavilion == 0.0:
        return []
    x0, y0, x1, y1 = massing.extent(body)
    a, b = round(x0 + p.pavilion, 2), round(x1 - p.pavilion, 2)
    return [
        massing.rectangle(x0, y0 - 0.6, a, y1),
        massing.rectangle(b, y0 - 0.6, x1, y1),
    ]


def _pavilion_roof(
    p: Parameters, plan: np.ndarray, z: float, ridge: float
) -> Mesh:
    """Returns a hip, or a mansard that is as high as the main ridge."""
    if p.mansard:
        knee = z + 0.75 * (ridge - z)
        lean = 0.3 * (knee - z)
        return pitched_roofs.mansard(plan, z, knee, ridge + 0.4, lean, 0.5)
    return pitched_roofs.hip(plan, z, ridge + 0.3, 0.5, 0.35)


def _with_pavilions(p: Parameters, body: np.ndarray) -> np.ndarray:
    """Returns the outline of the walls."""
    ends = _pavilions(p, body)
    if not ends:
        return body
    x0, y0, x1, y1 = massing.extent(body)
    a, b, y = ends[0][1, 0], ends[1][0, 0], ends[0][0, 1]
    return np.array(
        [(a, y0), (b, y0), (b, y), (x1, y), (x1, y1), (x0, y1), (x0, y), (a, y)]
    )


def _add_walls(out: Assembly, p: Parameters, plan: np.ndarray) -> float:
    """Adds plinth, storeys and cornice; returns their top [m]."""
    recess = 0.25
    h = round(p.floor + p.storey, 2)
    arch = bays.arched(
        p.window_width, p.floor + 0.7, h - 1.5, recess,
        rise=round(p.window_width / 2, 2),
    )  # fmt: skip
    door = bays.entrance(2.0, min(p.floor + 3.0, h - 0.6), 0.7)
    layout = bays.with_door(bays.rhythm(p.pitch, [arch], 0.6), door, 4.2)
    bands = (Band(0.0, p.floor, -0.12), Band(h - 0.3, h, -0.12))
    z = tiers.add_ground(out, plan, Facade(h, bands, layout, (recess,)))
    if p.storeys > 1:
        size = (p.window_width, 0.8, p.storey - 1.2, recess)
        plain = bays.rhythm(p.pitch, [bays.window(*size)], 0.6)
        hooded = bays.rhythm(p.pitch, [bays.window(*size, hood=0.12)], 0.6)
        along = np.roll(plan, -1, axis=0) - plan
        fronts = {k: hooded for k in range(len(plan)) if along[k, 0] > 0.1}
        upper = Facade(p.storey, (), bays.by_edge(fronts, plain), (recess,))
        z = tiers.add_storeys(out, plan, upper, z, p.storeys - 1, 1)
    rim = 0.9
    cornice = Facade(rim, tiers.cornice(rim, 0.35, thickness=0.6))
    out.add("cornice", tiers.block(plan, cornice, z), rgb=_STONE)
    return round(z + rim, 3)


def _add_porch(
    out: Assembly, p: Parameters, body: np.ndarray, ahead: float, top: float
) -> None:
    """Adds steps, columns and a pediment in front of the door."""
    wall = details.WallFrame(body, 0)
    x = wall.length / 2
    half = min(0.22 * wall.length, 1.5 * p.porch_columns)
    reach = ahead - 1.9
    count = max(3, round(p.floor / 0.17))
    lintel = min(p.floor + p.storey * min(p.storeys, 2) - 0.8, top - 1.0)
    steps = details.steps(x - half, x + half, 1.7, p.floor, count)
    floor = (x - half - 0.5, x + half + 0.5, -0.2, reach, p.floor)
    beam = (x - half - 0.4, x + half + 0.4, -0.4, reach - 0.1)
    pieces = [
        wall.standing(*floor, bottom=True),
        wall.place(steps.moved((0.0, reach, 0.0))),
        wall.box(*beam, lintel, lintel + 0.8),
    ]
    radius = min(0.38, 0.05 * (lintel - p.floor) + 0.12)
    for u in np.linspace(x - half + 0.2, x + half - 0.2, p.porch_columns):
        a, b = wall.point(u, reach - 0.65)
        pieces.append(details.column(a, b, p.floor, lintel + 0.02, radius))
    gable = massing.gable_roof(
        -0.4, x - half - 0.5, reach + 0.05, x + half + 0.5, lintel + 0.8,
        0.36 * half,
    )  # fmt: skip
    # The ridge runs away from the wall: wall x and y change places.
    pieces.append(wall.place(massing.swapped(gable)))
    out.add("porch", *pieces, rgb=_STONE)


def _add_tower(
    out: Assembly, p: Parameters, body: np.ndarray, z0: float
) -> None:
    """Adds the tower above the door: clock, open belfry, crown."""
    (x0, y0), (x1, _) = body[0], body[2]
    x, s = (x0 + x1) / 2, p.tower / 2
    y = y0 + s + 0.4
    shaft = massing.square(x, y, s)
    low, room = z0 - 1.0, p.height - z0
    clock = z0 + 0.42 * room
    bell = z0 + 0.62 * room
    height = round(clock - low, 3)
    slit = bays.window(0.8, 0.4 * height, 0.4 * height + 1.6, 0.2)
    bands = (Band(height - 0.4, height, -0.3),)
    walls = Facade(height, bands, bays.alone(slit, 1.6))
    out.add("tower", tiers.block(shaft, walls, low))
    r = min(0.3 * p.tower, 0.3 * (clock - z0))
    dial = massing.prism(massing.regular_polygon(r, 14), 0.0, 0.15)
    # Upright: the disc's axis turns to the wall's outward direction.
    u, v, w = dial.vertices.T
    upright = np.column_stack([v + s, w - 0.02, u + clock - 0.6 - r])
    disc = Mesh(upright, dial.faces)
    frames = (details.WallFrame(shaft, edge) for edge in range(4))
    dials = (frame.place(disc) for frame in frames)
    out.add("dials", *dials, rgb=(0.92, 0.91, 0.87))
    out.add("belfry", *_belfry((x, y), s, clock, bell), rgb=_STONE)
    out.add("crown", *_crown(p, (x, y), s, bell), rgb=p.roof_rgb)


def _belfry(
    center: massing.Point, s: float, z0: float, z1: float
) -> list[Mesh]:
    """Eight posts around a core that carries the crown."""
    x, y = center
    core = massing.regular_polygon(0.45 * s, 8, center)
    pieces = [massing.skirt(core, core, z0, z1)]
    inner = 0.82 * s
    for k in range(8):
        angle = k * math.pi / 4
        u = x + inner * np.clip(1.42 * math.cos(angle), -1, 1)
        v = y + inner * np.clip(1.42 * math.sin(angle), -1, 1)
        pieces.append(massing.post(u, v, 0.16, z1, z0))
    rail = massing.rectangle(x - s + 0.05, y - s + 0.05, x + s - 0.05,
                             y + s - 0.05)  # fmt: skip
    pieces.append(massing.roof_pan(rail, z0, z0 + 0.8, 0.2))
    return [*pieces, massing.skirt(rail, rail, z0, z0 + 0.8)]


def _crown(
    p: Parameters, center: massing.Point, s: float, z0: float
) -> list[Mesh]:
    top, eaves = p.height, massing.square(*center, 1.02 * s)
    z, rise = z0 + 0.3, top - z0 - 0.3
    plate = massing.prism(eaves, z0, z, bottom=True)
    if p.crown == "spire":
        base = massing.inset(eaves, 0.1)
        return [plate, massing.spire(base, center, z, top)]
    share = 0.75 if p.crown == "dome" else 0.45
    profile = [
        (0.92 * s * math.cos(t), z + share * rise * math.sin(t))
        for t in np.linspace(0.0, 0.42 * math.pi, 5).tolist()
    ]
    if p.crown == "cupola":
        neck, lid = profile[-1]
        profile += [(0.8 * neck, lid), (0.8 * neck, lid + 0.25 * rise),
                    (1.2 * neck, lid + 0.26 * rise)]  # fmt: skip
    profile.append((0.0, top))
    return [plate, massing.revolved(profile, 10, center)]
