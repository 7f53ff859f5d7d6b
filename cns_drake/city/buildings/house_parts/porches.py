"""Parts in front of houses: porches, stoops, bay windows, chimneys.

Wall coordinates are those of `details.WallFrame`: x along the wall, y
outwards, z up.
"""

from __future__ import annotations

from collections.abc import Sequence
import math

import numpy as np

from cns_drake.city.buildings.parts import bays, details, massing, pitched_roofs
from cns_drake.city.buildings.parts.facades import (
    Band,
    Facade,
    Relief,
    facade_mesh,
    glass_mesh,
)
from cns_drake.city.buildings.parts.site import Assembly, Rgb
from cns_drake.city.geometry.mesh import Mesh, merge_meshes

_POST_M = 0.16
# Depth of the windows of bays [m].
_RECESS = 0.1
# Length of the shared panel of railing [m].
RAILING_M = 2.0


def add_porch(
    out: Assembly,
    wall: details.WallFrame,
    x0: float,
    x1: float,
    reach: float,
    deck: float,
    eaves: float,
    top: float,
    *,
    roof: str = "shed",
    posts: int = 2,
) -> None:
    """Adds a roofed porch in front of a wall.

    Args:
        out: gets `trim` and `roof`.
        wall: the wall behind it.
        x0, x1: its extent along the wall [m].
        reach: of its posts out of the wall; the roof ends 0.25 m further.
        deck: height of its floor [m].
        eaves: underside of the beam on the posts [m].
        top: of the roof [m].
        roof: `shed`, `gable` (a pediment over all of it) or `flat`.
        posts: how many along the front, at least 2.
    """
    pieces = [massing.box(x0, x1, -0.05, reach, -massing.FOUNDATION_M, deck)]
    y, half = reach - 0.15, _POST_M / 2
    for x in np.linspace(x0 + 0.15, x1 - 0.15, posts).tolist():
        spot = (x - half, x + half, y - half, y + half)
        pieces.append(massing.box(*spot, deck, eaves + 0.02, bottom=False))
    pieces.append(massing.box(x0, x1, y - 0.1, y + 0.1, eaves, eaves + 0.22))
    for x in (x0 + 0.1, x1 - 0.1):
        pieces.append(
            massing.box(x - 0.1, x + 0.1, -0.05, y, eaves, eaves + 0.22)
        )
    lid = _porch_roof(x0, x1, reach, eaves + 0.2, top, roof)
    out.add_to("roof", wall.place(lid))
    if roof == "gable":
        z = eaves + 0.2
        line = pitched_roofs.gable_line(0.0, x1 - x0, z, top - 0.12)
        shield = pitched_roofs.gable_wall(line, 0.0, x1 - x0, z)
        pieces.append(shield.moved((x0, y + 0.08, 0.0)))
    out.add_to("trim", *(wall.place(piece) for piece in pieces))


def add_steps(
    out: Assembly,
    wall: details.WallFrame,
    x0: float,
    x1: float,
    start: float,
    rise: float,
    room: float = 9.0,
) -> None:
    """Adds steps, as `base`, down from y = start within `room` metres."""
    count = max(1, round(rise / 0.17))
    run = min(0.29 * count, room)
    if run > 0.05 and rise > 0.05:
        flight = details.steps(x0, x1, run, rise, count)
        out.add_to("base", wall.place(flight.moved((0.0, start, 0.0))))


def _porch_roof(
    x0: float, x1: float, reach: float, z: float, top: float, roof: str
) -> Mesh:
    a, b, out = x0 - 0.15, x1 + 0.15, reach + 0.25
    if roof == "gable":
        line = pitched_roofs.gable_line(x0, x1, z + 0.1, top)
        line = pitched_roofs.with_eaves(line, 0.2, 0.2)
        return pitched_roofs.shell(line, -0.1, out, 0.12, along_y=True)
    if roof == "flat":
        return massing.box(a, b, -0.05, out, z, top)
    line = [(-0.05, top), (out, z + 0.1)]
    return pitched_roofs.shell(line, a, b, 0.12)


def add_railing(
    out: Assembly,
    part: str,
    wall: details.WallFrame,
    start: tuple[float, float],
    end: tuple[float, float],
    z: float,
    rgb: Rgb,
) -> None:
    """Places the shared panel of railing between two points of a wall.

    Args:
        out: the building.
        part: name of the visual.
        wall: in whose coordinates the points are (x along, y outwards).
        start, end: ends of the railing [m].
        z: height of the floor [m].
        rgb: its colour.
    """
    p, q = wall.point(*start), wall.point(*end)
    length = float(np.hypot(*(q - p)))
    out.place(
        part,
        out.shared("railing_panel", (round(length / RAILING_M, 3), 1.0, 1.0)),
        (*((p + q) / 2), z),
        math.atan2(*(q - p)[::-1]),
        rgb=rgb,
    )


def add_bay_window(
    out: Assembly,
    wall: details.WallFrame,
    x: float,
    width: float,
    reach: float,
    z0: float,
    z1: float,
    *,
    storeys: int = 1,
    canted: bool = True,
) -> None:
    """Adds a bay window, on the ground (z0 = 0) or hung on the wall.

    Args:
        out: gets `glass`, `roof` and `walls`.
        wall: the wall behind it.
        x, width: its middle and extent along the wall [m].
        reach: out of the wall [m].
        z0, z1: bottom and top of its walls [m].
        storeys: rows of windows.
        canted: with slanted sides; else a box.
    """
    a, b = x - width / 2, x + width / 2
    if canted:
        slant = min(reach, 0.28 * width)
        plan = [(a, -0.1), (a, 0.0), (a + slant, reach), (b - slant, reach),
                (b, 0.0), (b, -0.1)]  # fmt: skip
        flush = frozenset({0, 4, 5})
    else:
        plan = [(a, -0.1), (a, reach), (b, reach), (b, -0.1)]
        flush = frozenset({3})
    points = np.array([wall.point(*p) for p in plan])
    height = round(z1 - z0, 3)
    step = height / storeys

    def layout(edge: int, length: float) -> list[Relief]:
        relief: list[Relief] = []
        for k in range(storeys if edge not in flush and length >= 0.7 else 0):
            z = k * step
            pane = bays.window(
                length - 0.3, round(z + 0.75, 2), round(z + step - 0.45, 2),
                _RECESS, mullions=1 if length > 1.5 else 0, pier=0.15,
            )  # fmt: skip
            relief += pane(0.0, length)
        return relief

    bands = (Band(height - 0.2, height, -0.08),)
    facade = Facade(height, bands, layout, (_RECESS,), flush)
    if z0 == 0.0:
        under = massing.foundation(points)
    else:
        under = massing.flat(points, z0, up=False)
    out.add_to("walls", facade_mesh(points, facade, z0), under)
    out.add_to("glass", glass_mesh(points, facade, z0))
    reaches = [-0.12 * (k not in flush) for k in range(len(points))]
    outer = massing.inset(points, reaches)
    tip = (outer[0] + outer[-1]) / 2
    out.add_to(
        "roof",
        massing.flat(outer, z1, up=False),
        massing.skirt(outer, outer, z1, z1 + 0.15),
        massing.spire(outer, tip, z1 + 0.15, z1 + 0.15 + 0.7 * reach),
    )


def chimney_breast(
    wall: details.WallFrame, x: float, width: float, reach: float, top: float
) -> Mesh:
    """A chimney up a wall, slimmer above its shoulders."""
    a, b = x - width / 2, x + width / 2
    neck = 0.62 * width / 2
    shoulder = 0.5 * top
    low = massing.rectangle(a, -0.05, b, reach)
    high = massing.rectangle(x - neck, -0.05, x + neck, reach)
    head = (x - neck - 0.08, x + neck + 0.08, -0.05, reach + 0.06)
    breast = merge_meshes(
        massing.skirt(low, low, -massing.FOUNDATION_M, shoulder),
        massing.skirt(low, high, shoulder, shoulder + 0.6),
        massing.prism(high, shoulder + 0.6, top),
        massing.box(*head, top - 0.35, top - 0.15),
    )
    return wall.place(breast)


def casings(
    reliefs: Sequence[Relief],
    glass: Sequence[float],
    style: str,
    reach: float = 0.05,
) -> list[Mesh]:
    """Returns the frames of a wall's windows, in wall coordinates.

    Args:
        reliefs: the openings of the wall.
        glass: depths of the windows among them [m].
        style: `frame` (a ring of boards), `sill` or `shutters`.
        reach: of the boards out of the wall [m].
    """
    pieces = []
    for r in reliefs:
        if r.depth not in glass or r.z1 - r.z0 < 0.5:
            continue
        if style == "frame":
            pieces.append(_ring(r, 0.12, reach))
        elif style == "sill":
            low = r.z0 - 0.1
            pieces.append(board(r.x0 - 0.1, r.x1 + 0.1, low, r.z0, 2 * reach))
        else:
            side = min((r.x1 - r.x0) / 2, 0.45)
            for a, b in ((r.x0 - side, r.x0), (r.x1, r.x1 + side)):
                pieces.append(board(a, b, r.z0, r.z1, reach))
    return pieces


def _ring(r: Relief, width: float, reach: float) -> Mesh:
    """Boards around an opening, mitred at its corners."""
    w = width
    outer = [(r.x0 - w, r.z0 - w), (r.x0 - w, r.z1 + w),
             (r.x1 + w, r.z1 + w), (r.x1 + w, r.z0 - w)]  # fmt: skip
    inner = [(r.x0, r.z0), (r.x0, r.z1), (r.x1, r.z1), (r.x1, r.z0)]
    rings = ((outer, 0.0), (outer, reach), (inner, reach), (inner, 0.0))
    vertices = np.array([(x, y, z) for ring, y in rings for x, z in ring])
    faces = [
        (4 * n + k, 4 * n + (k + 1) % 4, 4 * n + 4 + (k + 1) % 4, 4 * n + 4 + k)
        for n in range(3)
        for k in range(4)
    ]
    return Mesh(vertices, tuple(faces))


def board(x0: float, x1: float, z0: float, z1: float, reach: float) -> Mesh:
    """A board on a wall, without its back, in wall coordinates."""
    v = [(x, y, z) for y in (0.0, reach) for z in (z0, z1) for x in (x0, x1)]
    faces = (
        (4, 6, 7, 5),
        (0, 4, 5, 1),
        (2, 3, 7, 6),
        (0, 2, 6, 4),
        (1, 5, 7, 3),
    )
    return Mesh(np.array(v), faces)
