"""The parking deck: long open decks, straight ramps along one side."""

from __future__ import annotations

import numpy as np

from cns_drake.city.buildings.parts import bays, details, massing, tiers
from cns_drake.city.buildings.parts.facades import Band, Facade
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

    def __init__(self, d: Dice):
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


def build(p: Parameters, assembly: Assembly) -> None:
    """Builds the decks on a rectangle, their ramps along its long side."""
    x0, y0, x1, y1 = assembly.site.bounds
    a, b, c, d = x0 + 0.3, x1 - 0.3, y0 + 0.3, y1 - 0.3
    low, high = (c, d - p.ramp) if p.ramp_back else (c + p.ramp, d)
    plan = np.round(massing.rectangle(a, low, b, high), 2)
    _add_decks(assembly, p, plan)
    strip = (a, high, b, d) if p.ramp_back else (a, c, b, low)
    _add_ramps(assembly, p, strip)
    _add_screens(assembly, p, plan)
    _add_stairs(assembly, p, plan)
    if p.roofed:
        _add_roof(assembly, p, plan)


def _add_decks(assembly, p: Parameters, plan) -> None:
    """Adds the decks with beams, columns, and walls on the ground."""
    (x0, y0), (x1, y1) = plan[0], plan[2]
    across = bays.stretches(x1 - x0, p.pitch, 0.4)
    xs = [x0 + u for u in (across[0][0], *(v for _, v in across))]
    deep = bays.stretches(y1 - y0, 1.6 * p.pitch, 0.4)
    ys = [y0 + u for u in (deep[0][0], *(v for _, v in deep))]
    low, high = -_SLAB_M - 0.4, -_SLAB_M + 0.02
    beams = [
        massing.box(
            round(x - 0.2, 2), round(x + 0.2, 2), y0 + 0.2, y1 - 0.2, low, high
        )
        for x in xs
    ]
    deck = merge_meshes(
        massing.skirt(plan, plan, -_SLAB_M, p.parapet),
        massing.flat(plan, -_SLAB_M, up=False),
        massing.roof_pan(plan, 0.0, p.parapet, 0.18),
        *beams,
    )
    assembly.stack("deck", deck, p.storey, p.storey, p.storeys)
    top = p.storeys * p.storey - 0.1
    columns = [
        massing.box(
            round(x - 0.22, 2), round(x + 0.22, 2), round(y - 0.3, 2),
            round(y + 0.3, 2), -massing.FOUNDATION_M, top, bottom=False,
        )
        for x in xs
        for y in ys
    ]  # fmt: skip
    spine = (x0 + 0.3 * (x1 - x0), x0 + 0.7 * (x1 - x0))
    middle = (y0 + y1) / 2
    columns.append(
        massing.box(*spine, middle - 0.12, middle + 0.12,
                    -massing.FOUNDATION_M, top, bottom=False)
    )  # fmt: skip
    assembly.add("columns", *columns)


def _add_ramps(assembly, p: Parameters, strip) -> None:
    """Adds a ramp per storey, up to the right and up to the left in turn."""
    x0, y0, x1, y1 = strip
    length = min(x1 - x0 - 2.0, max(0.62 * (x1 - x0), 7.0 * p.storey))
    ramp = _ramp(length, y1 - y0 - 0.1, p.storey, p.parapet)
    shape = MeshShape(assembly.define("ramp", ramp))
    x, y = (x0 + x1) / 2, (y0 + y1) / 2
    for k in range(p.storeys):
        yaw = np.pi * (k % 2)
        at = (x, y, k * p.storey)
        assembly.place(f"ramp_{k:02d}", shape, at, yaw)
    pieces: list[Mesh] = []
    # Landings join the ramps' ends with the decks.
    for k in range(1, p.storeys + 1):
        z = k * p.storey
        for a, b in ((x0, x - length / 2 + 0.05), (x + length / 2 - 0.05, x1)):
            plate = massing.rectangle(a, y0, b, y1)
            pieces.append(massing.prism(plate, z - _SLAB_M, z, bottom=True))
    front = not p.ramp_back
    y_out = y0 + 0.15 if front else y1 - 0.15
    top = p.storeys * p.storey
    for u in np.linspace(x0 + 0.3, x1 - 0.3, max(3, round((x1 - x0) / 9))):
        inside = x - length / 2 < u < x + length / 2
        post = (u - 0.2, u + 0.2, y_out - 0.14, y_out + 0.14)
        high = top - p.storey * 0.9 if inside else top - 0.1
        pieces.append(
            massing.box(*post, -massing.FOUNDATION_M, high, bottom=False)
        )
    for k in range(1, p.storeys + 1):
        z = k * p.storey
        for a, b in ((x0, x - length / 2), (x + length / 2, x1)):
            rail = (a, b, y_out - 0.13, y_out + 0.13)
            pieces.append(massing.box(*rail, z - 0.05, z + p.parapet))
        for u in (x0, x1 - 0.18):
            pieces.append(
                massing.box(u, u + 0.18, y0 + 0.05, y1 - 0.05, z - 0.05,
                            z + p.parapet)
            )  # fmt: skip
    assembly.add("landings", *pieces)


def _ramp(length: float, width: float, rise: float, parapet: float) -> Mesh:
    """A sloped slab between low walls, up along x, centred on z's axis."""
    half, w = length / 2, width / 2

    def prism(y0, y1, low, high) -> Mesh:
        corners = [(-half, low), (half, low + rise), (half, high + rise),
                   (-half, high)]  # fmt: skip
        v = np.array([(x, y, z) for y in (y0, y1) for x, z in corners])
        faces = ((0, 1, 2, 3), (7, 6, 5, 4), (0, 4, 5, 1), (1, 5, 6, 2),
                 (2, 6, 7, 3), (3, 7, 4, 0))  # fmt: skip
        return Mesh(v, faces)

    return merge_meshes(
        prism(-w, w, -_SLAB_M, 0.0),
        prism(-w, -w + 0.2, -_SLAB_M + 0.02, parapet),
        prism(w - 0.2, w, -_SLAB_M + 0.02, parapet),
    )


def _add_screens(assembly, p: Parameters, plan) -> None:
    """Adds fins, panels or cables between the decks on the open sides."""
    if p.screen == "none":
        return
    open_edges = (0, 1, 3) if p.ramp_back else (1, 2, 3)
    top = p.storeys * p.storey + p.parapet - 0.05
    low = p.storey - _SLAB_M - 0.1
    pieces, shafts = [], _shafts(p, plan)
    for edge in open_edges:
        wall = details.WallFrame(plan, edge)
        if p.screen == "panels":
            for a, b in bays.stretches(wall.length, 3 * p.screen_pitch, 0.5):
                for k in range(1, p.storeys + 1):
                    wanted = assembly.rng.random() < 0.55
                    if wanted and not _is_hidden(wall, a, b, shafts):
                        z = k * p.storey - 0.25
                        spot = (round(a + 0.1, 2), round(b - 0.1, 2), 0.0, 0.12)
                        pieces.append(wall.place(
                            massing.box(*spot, z, z + p.storey - 0.3)
                        ))  # fmt: skip
            continue
        step = p.screen_pitch * (1.0 if p.screen == "fins" else 2.0)
        reach = 0.24 if p.screen == "fins" else 0.1
        width = 0.05 if p.screen == "fins" else 0.03
        for u, _ in bays.stretches(wall.length, step, 0.6):
            if _is_hidden(wall, u, u, shafts):
                continue
            spot = (round(u - width, 2), round(u + width, 2), -0.02, reach)
            pieces.append(wall.place(massing.box(*spot, low, top)))
        if p.screen == "cables":
            for k in range(1, p.storeys):
                for share in (0.45, 0.6, 0.75, 0.9):
                    z = round((k + share) * p.storey, 2)
                    bar = (0.6, wall.length - 0.6, 0.02, 0.06)
                    pieces.append(wall.place(massing.box(*bar, z, z + 0.05)))
    if pieces:
        assembly.add("screens", *pieces, rgb=p.screen_rgb)


def _shafts(p: Parameters, plan) -> list[np.ndarray]:
    """Returns the outlines of the stairs, a little in front of the decks."""
    (x0, y0), (x1, y1) = plan[0], plan[2]
    s = min(_STAIR_M, 0.3 * (y1 - y0))
    left, right = x0 + 1.0, x1 - s - 1.0
    front, back = y0 - 0.3, y1 - s + 0.3
    places = ((left, front), (right, front), (right, back), (left, back))
    return [
        massing.rectangle(x, y, x + s, y + s)
        for x, y in (places[corner] for corner in p.stairs)
    ]


def _is_hidden(wall, u0: float, u1: float, shafts) -> bool:
    """Whether a stair stands in front of a part of a wall."""
    ends = np.array([wall.point(u0, 0.0), wall.point(u1, 0.0)])
    low, high = ends.min(axis=0) - 0.05, ends.max(axis=0) + 0.05
    return any(
        (shaft[2] > low).all() and (shaft[0] < high).all() for shaft in shafts
    )


def _add_stairs(assembly, p: Parameters, plan) -> None:
    """Adds glazed stair shafts at two corners of the decks."""
    pieces, panes = [], []
    for shaft in _shafts(p, plan):
        slit = bays.with_middle(
            bays.plain, bays.window(2.2, 2.8, p.height - 0.9, 0.2), 3.0
        )
        entry = bays.with_middle(
            bays.plain, bays.window(2.2, 0.0, p.height - 0.9, 0.2), 3.0
        )
        facade = Facade(
            p.height,
            (Band(p.height - 0.3, p.height, -0.15),),
            bays.by_edge({0: entry, 2: slit}, bays.plain),
            (0.2,),
        )
        pieces += [
            massing.foundation(shaft),
            tiers.facade_mesh(shaft, facade),
            massing.flat(shaft, p.height),
        ]
        panes.append(tiers.glass_mesh(shaft, facade))
    assembly.add("stairs", *pieces, rgb=p.screen_rgb)
    assembly.add("stairs_glass", *panes, rgb=assembly.glass_rgb)


def _add_roof(assembly, p: Parameters, plan) -> None:
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
    assembly.add("roof", *pieces, rgb=(0.24, 0.27, 0.32))
