"""Dormers: windows with walls and roofs of their own on a pitched roof."""

from __future__ import annotations

import numpy as np

from cns_drake.city.buildings.parts import bays, details, pitched_roofs
from cns_drake.city.buildings.parts.pitched_roofs import Hole
from cns_drake.city.buildings.parts.site import Assembly
from cns_drake.city.buildings.parts.wings import Wing
from cns_drake.city.geometry.mesh import Mesh

_THICKNESS = 0.14
_RECESS = 0.1
_QUAD = ((0, 1, 2, 3),)
# How far a dormer's walls and roof reach into the slope behind them [m].
_SUNK = 0.25


def add_dormer(
    out: Assembly,
    wall: details.WallFrame,
    x: float,
    width: float,
    *,
    base: float,
    slope: float,
    ridge: float,
    setback: float,
    height: float,
    roof: str = "gable",
) -> None:
    """Adds a dormer on the slope that rises behind a wall, if it fits.

    Args:
        out: gets `glass`, `roof` and `walls`.
        wall: the wall below the slope.
        x, width: middle and width of the dormer along the wall [m].
        base: height of the slope's upper surface above the wall [m].
        slope: its rise per run.
        ridge: its upper end, above the dormer [m].
        setback: of the dormer's front from the wall [m].
        height: of its front above the slope [m].
        roof: `gable`, `shed` or `flat`.
    """
    a, b = x - width / 2, x + width / 2
    foot = base + slope * setback
    rise = {"gable": 0.42 * width, "shed": 0.35, "flat": 0.0}[roof]
    eaves = min(foot + height, ridge - rise - _THICKNESS - 0.1)
    if eaves < foot + 0.8:
        return
    edge = eaves + _THICKNESS
    back = (edge + rise - base) / slope + _SUNK
    if roof == "gable":
        line = pitched_roofs.gable_line(a, b, edge, edge + rise)
        wide = pitched_roofs.with_eaves(line, 0.15, 0.15)
        lid = pitched_roofs.shell(
            wide, -back, 0.2 - setback, _THICKNESS, along_y=True
        )
    else:
        line = [(a, edge), (b, edge)]
        fall = [(-back, edge + rise), (-setback, edge)]
        fall = pitched_roofs.with_eaves(fall, 0.0, 0.25)
        lid = pitched_roofs.shell(fall, a - 0.15, b + 0.15, _THICKNESS)
    under = [(u, z - _THICKNESS) for u, z in line]
    low = foot - _SUNK
    hole = Hole(
        round(a + 0.15, 2), round(b - 0.15, 2),
        round(foot + 0.25, 2), round(eaves - 0.15, 2), _RECESS,
    )  # fmt: skip
    front = pitched_roofs.gable_wall(under, a, b, low, [hole])
    pane = pitched_roofs.gable_glass([hole])
    top = eaves + (rise if roof == "shed" else 0.0)
    side = [(-back, low), (-back, top), (-setback, eaves), (-setback, low)]
    cheeks = (
        wall.place(Mesh(np.array([(u, y, z) for y, z in ring]), _QUAD))
        for u, ring in ((a, side), (b, side[::-1]))
    )
    shift = (0.0, -setback, 0.0)
    out.add_to("walls", wall.place(front.moved(shift)), *cheeks)
    out.add_to("glass", wall.place(pane.moved(shift)))
    out.add_to("roof", wall.place(lid))


def add_dormers(
    out: Assembly,
    wing: Wing,
    start: float,
    end: float,
    count: int,
    roof: str,
    pitch: float = 9.0,
) -> None:
    """Adds dormers side by side on the front slope of a wing.

    On a gambrel roof they stand on the steep part, without a pitched roof.

    Args:
        out: where to.
        wing: with a `gable` or `gambrel` roof along the front.
        start, end: the stretch of the front wall below them [m].
        count: of dormers, at most.
        roof: their shape.
        pitch: greatest distance between two [m].
    """
    (u0, z0), (u1, z1) = wing.line[:2]
    slope, room = (z1 - z0) / (u1 - u0), z1 - z0
    if count == 0 or slope < 0.35:
        return
    if wing.roof.kind == "gambrel":
        roof, setback, height = "flat", 0.12 / slope, min(room - 0.35, 1.8)
    else:
        setback, height = 0.2 * room / slope, min(1.4, 0.55 * room)
    step = min((end - start) / count, pitch)
    for a, b in bays.stretches(end - start, step, 0.4)[:count]:
        width = min(1.5, b - a - 0.5)
        if width > 0.9:
            add_dormer(
                out, wing.wall(0), start + (a + b) / 2, width, base=z0,
                slope=slope, ridge=wing.top, setback=setback, height=height,
                roof=roof,
            )  # fmt: skip
