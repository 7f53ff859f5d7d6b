"""The parking deck: long open decks, straight ramps along one side."""

from __future__ import annotations

import numpy as np

from cns_drake.city.buildings.parts import bays, details, massing, tiers
from cns_drake.city.buildings.parts.facades import facade_mesh, glass_mesh
from cns_drake.city.buildings.parts.site import Assembly, Dice
from cns_drake.city.geometry.mesh import Mesh, merge_meshes
from cns_drake.city.geometry.structures import MeshShape

_CONCRETES = ((0.72, 0.71, 0.69), (0.64, 0.63, 0.61), (0.78, 0.76, 0.70))
_SCREENS = (
    (0.60, 0.58, 0.55),
    (0.30, 0.42, 0.34),
    (0.70, 0.36, 0.24),
    (0.28, 0.38, 0.50),
)
_SLAB_M = 0.3
_STAIR_M = 5.0


class Parameters:
    """Parameters of a parking deck; lengths in metres.

    Attributes:
        height: of the stair shafts.
        storeys: decks above the ground.
        storey: height of a storey.
        ramp_back: whether the ramps lie along the back, else in front.
        ramp: width of the ramps.
        pitch: of the columns.
        parapet: height of the upstand around the decks.
        screen: `fins`, `panels`, `cables` or `none`, on the open sides.
        screen_pitch: distance between fins.
        stairs: corners with a stair, of the decks: 0 front left and on
            counter-clockwise.
        roofed: whether a light roof covers part of the top deck.
    """

    def __init__(self, d: Dice) -> None:
        rise = d.height - 3.4
        storeys = max(2, round(rise / d.uniform(2.8, 3.3)))
        self.height = d.height
        self.storeys = storeys
        self.storey = round(rise / storeys, 3)
        self.ramp_back = d.chance(0.5)
        self.ramp = d.uniform(4.2, 5.4, 2)
        self.pitch = d.uniform(7.5, 10.0)
        self.parapet = d.uniform(0.9, 1.15, 2)
        self.screen = d.pick(("fins", "panels", "cables", "none"))
        self.screen_pitch = max(
            d.uniform(1.0, 1.6), (d.width + 2 * d.depth) / 85
        )
        self.stairs = d.pick(((0, 2), (1, 3), (0, 1)))
        self.roofed = d.chance(0.5)
        self.rgb = d.pick(_CONCRETES)
        self.screen_rgb = d.pick(_SCREENS)


def build(p: Parameters, out: Assembly) -> None:
    """Builds the decks on a rectangle, their ramps along its long side."""
    x0, y0, x1, y1 = out.site.bounds
    a, b, c, d = x0 + 0.3, x1 - 0.3, y0 + 0.3, y1 - 0.3
    low, high = (c, d - p.ramp) if p.ramp_back else (c + p.ramp, d)
    plan = np.round(massing.rectangle(a, low, b, high), 2)
    _add_decks(out, p, plan)
    strip = (a, high, b, d) if p.ramp_back else (a, c, b, low)
    _add_ramps(out, p, strip)
    _add_screens(out, p, plan)
    _add_stairs(out, p, plan)
    if p.roofed:
        _add_roof(out, p, plan)


def _add_decks(out: Assembly, p: Parameters, plan: np.ndarray) -> None:
    """Adds the decks with beams, columns, and walls on the ground."""
    x0, y0, x1, y1 = massing.extent(plan)
    across = bays.bounds(bays.stretches(x1 - x0, p.pitch, 0.4))
    deep = bays.bounds(bays.stretches(y1 - y0, 1.6 * p.pitch, 0.4))
    xs, ys = [x0 + u for u in across], [y0 + u for u in deep]
    low, high = -_SLAB_M - 0.4, -_SLAB_M + 0.02
    beams = (
        massing.box(
            round(x - 0.2, 2), round(x + 0.2, 2), y0 + 0.2, y1 - 0.2, low, high
        )
        for x in xs
    )
    deck = merge_meshes(
        massing.skirt(plan, plan, -_SLAB_M, p.parapet),
        massing.flat(plan, -_SLAB_M, up=False),
        massing.roof_pan(plan, 0.0, p.parapet, 0.18),
        *beams,
    )
    out.stack("deck", deck, p.storey, p.storey, p.storeys)
    top = p.storeys * p.storey - 0.1
    spots = [
        (round(x - 0.22, 2), round(x + 0.22, 2), round(y - 0.3, 2),
         round(y + 0.3, 2))
        for x in xs
        for y in ys
    ]  # fmt: skip
    middle, wide = (y0 + y1) / 2, x1 - x0
    spine = (x0 + 0.3 * wide, x0 + 0.7 * wide, middle - 0.12, middle + 0.12)
    columns = (massing.standing(*spot, top) for spot in (*spots, spine))
    out.add("columns", *columns)


def _add_ramps(out: Assembly, p: Parameters, strip: massing.Area) -> None:
    """Adds a ramp per storey, up to the right and up to the left in turn."""
    x0, y0, x1, y1 = strip
    length = min(x1 - x0 - 2.0, max(0.62 * (x1 - x0), 7.0 * p.storey))
    ramp = _ramp(length, y1 - y0 - 0.1, p.storey, p.parapet)
    shape = MeshShape(out.define("ramp", merge_meshes(*ramp)))
    x, y = (x0 + x1) / 2, (y0 + y1) / 2
    for k in range(p.storeys):
        at = (x, y, k * p.storey)
        out.place(f"ramp_{k:02d}", shape, at, np.pi * (k % 2))
    left, right = x - length / 2, x + length / 2
    levels = [k * p.storey for k in range(1, p.storeys + 1)]
    pieces: list[Mesh] = []
    # Landings join the ramps' ends with the decks.
    for z in levels:
        for a, b in ((x0, left + 0.05), (right - 0.05, x1)):
            pieces.append(massing.box(a, b, y0, y1, z - _SLAB_M, z))
    y_out = y1 - 0.15 if p.ramp_back else y0 + 0.15
    top = p.storeys * p.storey
    for u in np.linspace(x0 + 0.3, x1 - 0.3, max(3, round((x1 - x0) / 9))):
        high = top - p.storey * 0.9 if left < u < right else top - 0.1
        post = (u - 0.2, u + 0.2, y_out - 0.14, y_out + 0.14, high)
        pieces.append(massing.standing(*post))
    for z in levels:
        rails = [
            (a, b, y_out - 0.13, y_out + 0.13)
            for a, b in ((x0, left), (right, x1))
        ] + [(u, u + 0.18, y0 + 0.05, y1 - 0.05) for u in (x0, x1 - 0.18)]
        for rail in rails:
            pieces.append(massing.box(*rail, z - 0.05, z + p.parapet))
    out.add("landings", *pieces)


def _ramp(
    length: float, width: float, rise: float, parapet: float
) -> list[Mesh]:
    """A sloped slab between low walls, up along x, centred on z's axis."""
    half, w = length / 2, width / 2

    def slope(y0: float, y1: float, low: float, high: float) -> Mesh:
        section = [(-half, low), (half, low + rise), (half, high + rise),
                   (-half, high)]  # fmt: skip
        return massing.bar(section, y0, y1)

    return [
        slope(-w, w, -_SLAB_M, 0.0),
        slope(-w, -w + 0.2, -_SLAB_M + 0.02, parapet),
        slope(w - 0.2, w, -_SLAB_M + 0.02, parapet),
    ]


def _add_screens(out: Assembly, p: Parameters, plan: np.ndarray) -> None:
    """Adds fins, panels or cables between the decks on the open sides."""
    if p.screen == "none":
        return
    pieces, shafts = [], _shafts(p, plan)
    for edge in (0, 1, 3) if p.ramp_back else (1, 2, 3):
        wall = details.WallFrame(plan, edge)
        if p.screen == "panels":
            pieces += _panels(p, wall, shafts, out.rng)
        else:
            pieces += _bars(p, wall, shafts)
    out.add("screens", *pieces, rgb=p.screen_rgb)


def _panels(
    p: Parameters,
    wall: details.WallFrame,
    shafts: list[np.ndarray],
    rng: np.random.Generator,
) -> list[Mesh]:
    """Panels in front of some storeys."""
    pieces = []
    for a, b in bays.stretches(wall.length, 3 * p.screen_pitch, 0.5):
        for k in range(1, p.storeys + 1):
            wanted = rng.random() < 0.55
            if wanted and not _is_hidden(wall, a, b, shafts):
                z = k * p.storey - 0.25
                spot = (round(a + 0.1, 2), round(b - 0.1, 2), 0.0, 0.12)
                pieces.append(wall.box(*spot, z, z + p.storey - 0.3))
    return pieces


def _bars(
    p: Parameters, wall: details.WallFrame, shafts: list[np.ndarray]
) -> list[Mesh]:
    """Fins from bottom to top, or thin posts with cables between them."""
    top = p.storeys * p.storey + p.parapet - 0.05
    low = p.storey - _SLAB_M - 0.1
    step, reach, width = p.screen_pitch, 0.24, 0.05
    if p.screen == "cables":
        step, reach, width = 2.0 * step, 0.1, 0.03
    pieces = []
    for u, _ in bays.stretches(wall.length, step, 0.6):
        if not _is_hidden(wall, u, u, shafts):
            spot = (round(u - width, 2), round(u + width, 2), -0.02, reach)
            pieces.append(wall.box(*spot, low, top))
    for k in range(1, p.storeys) if p.screen == "cables" else ():
        for share in (0.45, 0.6, 0.75, 0.9):
            z = round((k + share) * p.storey, 2)
            bar = (0.6, wall.length - 0.6, 0.02, 0.06)
            pieces.append(wall.box(*bar, z, z + 0.05))
    return pieces


def _shafts(p: Parameters, plan: np.ndarray) -> list[np.ndarray]:
    """Returns the outlines of the stairs, a little in front of the decks."""
    x0, y0, x1, y1 = massing.extent(plan)
    s = min(_STAIR_M, 0.3 * (y1 - y0))
    left, right = x0 + 1.0, x1 - s - 1.0
    front, back = y0 - 0.3, y1 - s + 0.3
    places = ((left, front), (right, front), (right, back), (left, back))
    return [
        massing.rectangle(x, y, x + s, y + s)
        for x, y in (places[corner] for corner in p.stairs)
    ]


def _is_hidden(
    wall: details.WallFrame, u0: float, u1: float, shafts: list[np.ndarray]
) -> bool:
    """Whether a stair stands in front of a part of a wall."""
    ends = np.array([wall.point(u0, 0.0), wall.point(u1, 0.0)])
    low, high = ends.min(axis=0) - 0.05, ends.max(axis=0) + 0.05
    return any(
        (shaft[2] > low).all() and (shaft[0] < high).all() for shaft in shafts
    )


def _add_stairs(out: Assembly, p: Parameters, plan: np.ndarray) -> None:
    """Adds glazed stair shafts at two corners of the decks."""
    slit = bays.window(2.2, 2.8, p.height - 0.9, 0.2)
    entry = bays.window(2.2, 0.0, p.height - 0.9, 0.2)
    rim = (0.3, 0.15)
    walls = tiers.shaft_walls(p.height, entry, slit, 3.0, rim, (0.2,))
    pieces, panes = [], []
    for shaft in _shafts(p, plan):
        pieces += [
            massing.foundation(shaft),
            facade_mesh(shaft, walls),
            massing.flat(shaft, p.height),
        ]
        panes.append(glass_mesh(shaft, walls))
    out.add("stairs", *pieces, rgb=p.screen_rgb)
    out.add("stairs_glass", *panes, rgb=out.glass_rgb)


def _add_roof(out: Assembly, p: Parameters, plan: np.ndarray) -> None:
    """Adds rows of tilted roofs, with panels, over the top deck."""
    (x0, y0), (x1, y1) = plan[0], plan[2]
    z = p.storeys * p.storey
    s = min(_STAIR_M, 0.3 * (y1 - y0)) + 1.5
    a, b = x0 + s + 0.5, x1 - s - 0.5
    rows = max(1, round((y1 - y0) / 14.0))
    pieces = []
    for k in range(rows):
        y = y0 + (k + 0.5) * (y1 - y0) / rows
        lid = [(y - 2.6, z + 2.5), (y + 2.6, z + 3.1)]
        section = [*lid, (lid[1][0], lid[1][1] - 0.12),
                   (lid[0][0], lid[0][1] - 0.12)]  # fmt: skip
        v = np.array([(x, u, w) for x in (a, b) for u, w in section])
        faces = [(j, (j + 1) % 4, 4 + (j + 1) % 4, 4 + j) for j in range(4)]
        faces += [(3, 2, 1, 0), (4, 5, 6, 7)]
        pieces.append(Mesh(v, tuple(f[::-1] for f in faces)))
        for x in np.linspace(a + 0.6, b - 0.6, max(2, round((b - a) / 9))):
            pieces.append(massing.post(x, y, 0.1, z + 2.75, z - 0.05))
    out.add("roof", *pieces, rgb=(0.24, 0.27, 0.32))
