"""Roofs of a house's wings, with their gables and dormers."""

from __future__ import annotations

from collections.abc import Callable
import math

import numpy as np

from worlds.city.facades import bays, roofs, solids
from worlds.city.facades.reliefs import Patch
from worlds.city.facades.wall_frames import WallFrame
from worlds.city.facades.wings import SEAT, Wing
from worlds.shapes import Assembly, Mesh

# Returns the windows of a gable between two places along its wall.
Attic = Callable[[float, float], list[Patch]]
# Thickness of a dormer's roof [m].
_DORMER_THICKNESS = 0.14
# Depth of a dormer's window behind its front [m].
_DORMER_RECESS = 0.1
# How far a dormer's walls and roof reach into the slope behind them [m].
_SUNK = 0.25
_QUAD = ((0, 1, 2, 3),)


def add_roof(
    out: Assembly,
    wing: Wing,
    attic: Attic | None = None,
    material: str = "walls",
) -> None:
    """Adds the roof of a wing, and the walls of its gables.

    Args:
        out: the building under assembly, which gets the parts.
        wing: the wing.
        attic: function that returns the windows of a gable, such as
            `attic_window` makes; None for no windows.
        material: material of the gables.
    """
    if wing.roof.kind == "flat":
        _add_flat_roof(out, wing, material)
    elif wing.roof.kind == "hip":
        _add_hipped_roof(out, wing)
    else:
        _add_covering(out, wing)
        for edge in wing.gables:
            _add_gable(out, wing, edge, attic, material)
        if wing.roof.kind == "shed":
            _add_tall_side(out, wing, material)


def _add_flat_roof(out: Assembly, wing: Wing, material: str) -> None:
    """Adds a flat roof and its parapet."""
    outline = wing.outline
    floor = round(wing.top - wing.roof.parapet, 3)
    out.add_to(
        material,
        solids.skirt(outline, outline, wing.wall_top, wing.top),
        solids.roof_pan(outline, floor, wing.top, 0.25),
    )


def _add_hipped_roof(out: Assembly, wing: Wing) -> None:
    is_free = [k not in wing.blind for k in range(4)]
    reach = np.where(is_free, wing.roof.eaves, 0.0)
    z = wing.wall_top - SEAT
    solid = roofs.hip(wing.outline, z, wing.top, reach, wing.roof.thickness)
    out.add_to("roof", solid)


def _add_covering(out: Assembly, wing: Wing) -> None:
    """Adds the slopes of a gabled roof, including eaves and verges."""
    roof = wing.roof
    start_edge, end_edge = wing.gables
    start, end = wing.ridge
    start -= roof.verge * (start_edge not in wing.blind)
    end += roof.verge * (end_edge not in wing.blind)
    # A shed roof has no eaves at its upper end, which is at the top of the
    # wing.
    ends = [edge not in wing.blind for edge in _sides(wing)]
    if roof.kind == "shed":
        ends[0 if roof.falling else 1] = False
    line = roofs.with_eaves(wing.roof_line, *(roof.eaves * e for e in ends))
    shell = roofs.shell(line, start, end, roof.thickness, along_y=roof.along_y)
    out.add_to("roof", shell)


def _add_gable(
    out: Assembly, wing: Wing, edge: int, attic: Attic | None, material: str
) -> None:
    """Adds the wall below the roof at one end of the ridge."""
    wall = wing.wall(edge)
    under = _underside(wing, edge)
    holes: list[Patch] = []
    if attic is not None and edge not in wing.blind:
        holes = [
            hole for hole in attic(0.0, wall.length) if _fits_under(hole, under)
        ]
    gable = roofs.gable_wall(under, 0.0, wall.length, wing.wall_top, holes)
    out.add_to(material, wall.place(gable))
    if holes:
        out.add_to("glass", wall.place(roofs.gable_glass(holes)))


def _add_tall_side(out: Assembly, wing: Wing, material: str) -> None:
    """Adds the wall of a shed roof's tall side above the other walls."""
    roof = wing.roof
    low_edge, high_edge = _sides(wing)
    wall = wing.wall(low_edge if roof.falling else high_edge)
    top = [(x, wing.top - roof.thickness) for x in (0.0, wall.length)]
    shield = roofs.gable_wall(top, 0.0, wall.length, wing.wall_top)
    out.add_to(material, wall.place(shield))


def _sides(wing: Wing) -> tuple[int, int]:
    """Returns the edges where the roof line begins and ends."""
    return (3, 1) if wing.roof.along_y else (0, 2)


def _underside(wing: Wing, edge: int) -> list[tuple[float, float]]:
    """Returns the underside of the roof in the wall coordinates of a gable."""
    line, thickness = wing.roof_line, wing.roof.thickness
    start, end = line[0][0], line[-1][0]
    # Walls run counter-clockwise. Seen from the front and from the right, the
    # line therefore keeps its direction.
    if edge in (0, 1):
        return [(u - start, z - thickness) for u, z in line]
    return [(end - u, z - thickness) for u, z in reversed(line)]


def _fits_under(hole: Patch, under: list[bays.Span]) -> bool:
    return all(
        hole.z1 < roofs.line_height(under, x) - 0.15 for x in (hole.x0, hole.x1)
    )


def attic_window(
    width: float, z0: float, z1: float, depth: float, count: int = 1
) -> Attic:
    """Returns a function that places windows in a gable, for `add_roof`.

    The windows are side by side in the middle of the gable.

    Args:
        width: width of each window [m].
        z0: height of the windows' sills [m].
        z1: height of the windows' tops [m].
        depth: distance of the glass behind the wall [m].
        count: number of windows.
    """

    def holes(a: float, b: float) -> list[Patch]:
        step = 1.5 * width
        first = (a + b) / 2 - step * (count - 1) / 2
        return [
            Patch(
                round(x - width / 2, 2), round(x + width / 2, 2), z0, z1, depth
            )
            for x in (first + k * step for k in range(count))
        ]

    return holes


def ridge_rise(span: float, pitch_deg: float) -> float:
    """Returns the height of a ridge above the eaves [m].

    `span` is the width of the roof [m], and `pitch_deg` its pitch [deg].
    """
    return span / 2 * math.tan(math.radians(pitch_deg))


def add_dormer(
    out: Assembly,
    wall: WallFrame,
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
    """Adds a dormer to the roof slope behind a wall, if it fits.

    Args:
        out: the building under assembly, which gets the parts.
        wall: the wall.
        x: middle of the dormer along the wall [m].
        width: width of the dormer along the wall [m].
        base: height of the slope's upper surface at the wall [m].
        slope: rise of the slope per run.
        ridge: height of the ridge [m].
        setback: distance of the dormer's front behind the wall [m].
        height: height of the front above the slope [m].
        roof: `gable`, `shed` or `flat`.
    """
    a, b = x - width / 2, x + width / 2
    foot = base + slope * setback
    rise = {"gable": 0.42 * width, "shed": 0.35, "flat": 0.0}[roof]
    eaves = min(foot + height, ridge - rise - _DORMER_THICKNESS - 0.1)
    if eaves < foot + 0.8:
        return
    edge = eaves + _DORMER_THICKNESS
    back = (edge + rise - base) / slope + _SUNK
    if roof == "gable":
        line = roofs.gable_line(a, b, edge, edge + rise)
        lid = _gable_lid(line, -back, -setback)
    else:
        line = [(a, edge), (b, edge)]
        fall = [(-back, edge + rise), (-setback, edge)]
        lid = _sloping_lid(fall, a, b)
    under = [(u, z - _DORMER_THICKNESS) for u, z in line]
    low = foot - _SUNK
    hole = Patch(
        round(a + 0.15, 2), round(b - 0.15, 2),
        round(foot + 0.25, 2), round(eaves - 0.15, 2), _DORMER_RECESS,
    )  # fmt: skip
    front = roofs.gable_wall(under, a, b, low, [hole])
    pane = roofs.gable_glass([hole])
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


def _gable_lid(line: roofs.Line, back: float, front: float) -> Mesh:
    """Returns the gable roof of a dormer, in wall coordinates.

    Args:
        line: (x, z) points of the roof line, without eaves [m].
        back: y of the roof's back [m].
        front: y of the dormer's front [m].
    """
    wide = roofs.with_eaves(line, 0.15, 0.15)
    return roofs.shell(wide, back, 0.2 + front, _DORMER_THICKNESS, along_y=True)


def _sloping_lid(line: roofs.Line, a: float, b: float) -> Mesh:
    """Returns the shed or flat roof of a dormer, in wall coordinates.

    Args:
        line: (y, z) points of the roof line, without eaves [m].
        a, b: x of the dormer's two sides [m].
    """
    fall = roofs.with_eaves(line, 0.0, 0.25)
    return roofs.shell(fall, a - 0.15, b + 0.15, _DORMER_THICKNESS)


def add_dormers(
    out: Assembly,
    wing: Wing,
    start: float,
    end: float,
    count: int,
    roof: str,
    pitch: float = 9.0,
) -> None:
    """Adds dormers side by side to the front slope of a wing.

    The wing has a `gable` or `gambrel` roof along the front. On a gambrel roof
    the dormers stand on the steep part, and have no pitched roof.

    Args:
        out: the building under assembly, which gets the parts.
        wing: the wing.
        start: where the dormers begin along the front wall [m].
        end: where the dormers end along the front wall [m].
        count: greatest number of dormers.
        roof: roof of the dormers: `gable`, `shed` or `flat`.
        pitch: greatest distance from the middle of one dormer to the next [m].
    """
    (u0, z0), (u1, z1) = wing.roof_line[:2]
    slope = (z1 - z0) / (u1 - u0)
    room = z1 - z0
    if count == 0 or slope < 0.35:
        return
    if wing.roof.kind == "gambrel":
        roof = "flat"
        setback = 0.12 / slope
        height = min(room - 0.35, 1.8)
    else:
        setback = 0.2 * room / slope
        height = min(1.4, 0.55 * room)
    step = min((end - start) / count, pitch)
    for a, b in bays.stretches(end - start, step, 0.4)[:count]:
        width = min(1.5, b - a - 0.5)
        if width > 0.9:
            add_dormer(
                out, wing.wall(0), start + (a + b) / 2, width, base=z0,
                slope=slope, ridge=wing.top, setback=setback, height=height,
                roof=roof,
            )  # fmt: skip
