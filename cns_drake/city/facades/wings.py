"""Houses of several wings: boxes that may overlap, each under its own roof.

A wing's edges count like those of a rectangle: 0 front, 1 right, 2 back,
3 left.
"""

from __future__ import annotations

from collections.abc import Callable, Collection
from dataclasses import dataclass, field, replace
import math

import numpy as np

from cns_drake.city.facades import bays, details, massing, roofs
from cns_drake.city.facades.assembly import Assembly
from cns_drake.city.facades.walls import Patch
from cns_drake.city.geometry.mesh import Mesh

# The windows of a gable: (from, to) -> holes.
Attic = Callable[[float, float], list[Patch]]
# Overlap of a roof's underside with the top of the walls [m].
_SEAT = 0.02


@dataclass(frozen=True)
class Roof:
    """The shape of a roof.

    Attributes:
        kind: `gable`, `gambrel`, `barrel`, `shed`, `hip` or `flat`.
        along_y: whether the ridge runs from the front to the back; a shed
            roof rises across the ridge's direction.
        eaves: overhang below the slopes [m].
        verge: overhang beyond the gables [m].
        thickness: thickness of the roof, measured upright [m].
        ridge: place of a gable roof's ridge as a part of the span.
        parapet: parapet of a flat roof [m].
        falling: whether a shed roof falls along its line instead of rising:
            to the back, or to the right if `along_y`.
    """

    kind: str = "gable"
    along_y: bool = False
    eaves: float = 0.4
    verge: float = 0.3
    thickness: float = 0.22
    ridge: float = 0.5
    parapet: float = 0.4
    falling: bool = False


@dataclass(frozen=True)
class Wing:
    """A box of a house.

    Attributes:
        x0, y0, x1, y1: its walls [m].
        wall_top: top of its walls [m].
        top: top of its roof [m]; of a flat roof, the parapet.
        roof: shape of its roof.
        blind: edges built against a neighbour: flush and plain.
    """

    x0: float
    y0: float
    x1: float
    y1: float
    wall_top: float
    top: float
    roof: Roof = field(default_factory=Roof)
    blind: frozenset[int] = frozenset()

    @staticmethod
    def at(
        area: massing.Area, wall_top: float, top: float, roof: Roof,
        blind: Collection[int] = (),
    ) -> Wing:  # fmt: skip
        """Returns a wing with its walls on whole centimetres.

        Whole centimetres keep the meshes' text short.
        """
        a, b, c, d, e = (round(float(v), 2) for v in (*area, wall_top))
        return Wing(a, b, c, d, e, round(float(top), 3), roof, frozenset(blind))

    @staticmethod
    def flat(
        area: massing.Area, top: float, parapet: float, rim: float = 0.1
    ) -> Wing:
        """Returns a wing under a flat roof; its walls end `rim` below."""
        return Wing.at(area, top - rim, top, Roof("flat", parapet=parapet))

    def mirrored(self, width: float) -> Wing:
        """Returns the wing with x replaced by `width` - x."""
        blind = frozenset((0, 3, 2, 1)[k] for k in self.blind)
        x0, x1 = round(width - self.x1, 2), round(width - self.x0, 2)
        return replace(self, x0=x0, x1=x1, blind=blind)

    @property
    def width(self) -> float:
        """Along x [m]."""
        return self.x1 - self.x0

    @property
    def depth(self) -> float:
        """Along y [m]."""
        return self.y1 - self.y0

    @property
    def center(self) -> massing.Point:
        """Its middle [m]."""
        return (self.x0 + self.x1) / 2, (self.y0 + self.y1) / 2

    @property
    def ridge(self) -> bays.Span:
        """Start and end of the ridge, along x or y [m]."""
        along_y = self.roof.along_y
        return (self.y0, self.y1) if along_y else (self.x0, self.x1)

    @property
    def floor(self) -> float:
        """Height of a flat roof within its parapet [m]."""
        return self.top - self.roof.parapet

    @property
    def outline(self) -> np.ndarray:
        return massing.rectangle(self.x0, self.y0, self.x1, self.y1)

    def wall(self, edge: int) -> details.WallFrame:
        """Returns the frame of one of the walls."""
        return details.WallFrame(self.outline, edge)

    @property
    def line(self) -> list[tuple[float, float]]:
        """The upper surface of the roof between the walls, without eaves."""
        roof = self.roof
        a, b = (self.x0, self.x1) if roof.along_y else (self.y0, self.y1)
        z = self.wall_top + roof.thickness - _SEAT
        if roof.kind == "gable":
            return roofs.gable_line(a, b, z, self.top, roof.ridge)
        if roof.kind == "gambrel":
            return roofs.gambrel_line(a, b, z, self.top)
        if roof.kind == "barrel":
            return roofs.barrel_line(a, b, z, self.top)
        if roof.kind == "shed":
            heights = (self.top, z) if roof.falling else (z, self.top)
            return [(a, heights[0]), (b, heights[1])]
        return [(a, self.top), (b, self.top)]

    @property
    def gables(self) -> tuple[int, int]:
        """The edges below the ends of the ridge, at its start and end."""
        return (0, 2) if self.roof.along_y else (3, 1)

    def covers(self, x: float, y: float) -> bool:
        """Whether a point lies within the walls."""
        return self.x0 < x < self.x1 and self.y0 < y < self.y1


def add_roof(
    out: Assembly,
    wing: Wing,
    attic: Attic | None = None,
    material: str = "walls",
) -> None:
    """Adds a wing's roof, as `roof`, and gables of a material.

    `attic` gives the windows of the gables.
    """
    roof, outline, line = wing.roof, wing.outline, wing.line
    is_free = [k not in wing.blind for k in range(4)]
    if roof.kind == "flat":
        floor = round(wing.top - roof.parapet, 3)
        out.add_to(
            material,
            massing.skirt(outline, outline, wing.wall_top, wing.top),
            massing.roof_pan(outline, floor, wing.top, 0.25),
        )
        return
    if roof.kind == "hip":
        reach, z = np.where(is_free, roof.eaves, 0.0), wing.wall_top - _SEAT
        solid = roofs.hip(outline, z, wing.top, reach, roof.thickness)
        out.add_to("roof", solid)
        return
    low_edge, high_edge = (3, 1) if roof.along_y else (0, 2)
    start_edge, end_edge = wing.gables
    start, end = wing.ridge
    start -= roof.verge * is_free[start_edge]
    end += roof.verge * is_free[end_edge]
    # A shed roof has no eaves at its upper end: its top is the wing's.
    ends = [is_free[low_edge], is_free[high_edge]]
    if roof.kind == "shed":
        ends[0 if roof.falling else 1] = False
    covering = roofs.with_eaves(line, *(roof.eaves * e for e in ends))
    shell = roofs.shell(
        covering, start, end, roof.thickness, along_y=roof.along_y
    )
    out.add_to("roof", shell)
    for edge in wing.gables:
        wall = wing.wall(edge)
        under = _seen_from(wing, edge, line)
        holes: list[Patch] = []
        if attic is not None and is_free[edge]:
            holes = [
                hole for hole in attic(0.0, wall.length) if _fits(hole, under)
            ]
        gable = roofs.gable_wall(under, 0.0, wall.length, wing.wall_top, holes)
        out.add_to(material, wall.place(gable))
        if holes:
            out.add_to("glass", wall.place(roofs.gable_glass(holes)))
    if roof.kind == "shed":
        # The tall side, from the walls up to the roof.
        wall = wing.wall(low_edge if roof.falling else high_edge)
        top = [(x, wing.top - roof.thickness) for x in (0.0, wall.length)]
        shield = roofs.gable_wall(top, 0.0, wall.length, wing.wall_top)
        out.add_to(material, wall.place(shield))


def _seen_from(
    wing: Wing, edge: int, line: list[bays.Span]
) -> list[tuple[float, float]]:
    """Returns the underside of the roof in a gable's wall coordinates."""
    thickness = wing.roof.thickness
    start, end = line[0][0], line[-1][0]
    # Walls run counter-clockwise: seen from the front and from the right
    # side the line keeps its sense.
    if edge in (0, 1):
        return [(u - start, z - thickness) for u, z in line]
    return [(end - u, z - thickness) for u, z in reversed(line)]


def _fits(hole: Patch, under: list[bays.Span]) -> bool:
    return all(
        hole.z1 < roofs.line_height(under, x) - 0.15 for x in (hole.x0, hole.x1)
    )


def attic_window(
    width: float, z0: float, z1: float, depth: float, count: int = 1
) -> Attic:
    """Returns windows side by side in the middle of a gable."""

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
    """Returns how high a ridge rises over a span at a pitch [m]."""
    return span / 2 * math.tan(math.radians(pitch_deg))


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
        x, width: its middle and width along the wall [m].
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
        line = roofs.gable_line(a, b, edge, edge + rise)
        wide = roofs.with_eaves(line, 0.15, 0.15)
        lid = roofs.shell(wide, -back, 0.2 - setback, _THICKNESS, along_y=True)
    else:
        line = [(a, edge), (b, edge)]
        fall = [(-back, edge + rise), (-setback, edge)]
        fall = roofs.with_eaves(fall, 0.0, 0.25)
        lid = roofs.shell(fall, a - 0.15, b + 0.15, _THICKNESS)
    under = [(u, z - _THICKNESS) for u, z in line]
    low = foot - _SUNK
    hole = Patch(
        round(a + 0.15, 2), round(b - 0.15, 2),
        round(foot + 0.25, 2), round(eaves - 0.15, 2), _RECESS,
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

    They stand above the stretch from `start` to `end` of the front wall, at
    most `count`, and `pitch` apart [m]. The wing has a `gable` or `gambrel`
    roof along the front. On a gambrel roof they stand on the steep part,
    without a pitched roof.
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
