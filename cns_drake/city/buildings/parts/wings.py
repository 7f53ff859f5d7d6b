"""Houses of several wings: boxes that may overlap, each under its own roof.

A wing's edges count like those of a rectangle: 0 front, 1 right, 2 back,
3 left.
"""

from __future__ import annotations

from collections.abc import Callable, Collection
from dataclasses import dataclass, field, replace
import math

import numpy as np

from cns_drake.city.buildings.parts import bays, details, massing, pitched_roofs
from cns_drake.city.buildings.parts.pitched_roofs import Hole
from cns_drake.city.buildings.parts.site import Assembly

# The windows of a gable: (from, to) -> holes.
Attic = Callable[[float, float], list[Hole]]

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
        thickness: of the roof, measured upright [m].
        ridge: place of a gable roof's ridge as a part of the span.
        parapet: of a flat roof [m].
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
        top: of its roof [m]; of a flat roof, the parapet.
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
        x0: float,
        y0: float,
        x1: float,
        y1: float,
        wall_top: float,
        top: float,
        roof: Roof,
        blind: Collection[int] = (),
    ) -> Wing:
        """Returns a wing with its walls on whole centimetres.

        Whole centimetres keep the meshes' text short.
        """
        a, b, c, d, e = (round(float(v), 2) for v in (x0, y0, x1, y1, wall_top))
        return Wing(a, b, c, d, e, round(float(top), 3), roof, frozenset(blind))

    @staticmethod
    def flat(
        x0: float,
        y0: float,
        x1: float,
        y1: float,
        top: float,
        parapet: float,
        rim: float = 0.1,
        blind: Collection[int] = (),
    ) -> Wing:
        """Returns a wing under a flat roof; its walls end `rim` below."""
        roof = Roof("flat", parapet=parapet)
        return Wing.at(x0, y0, x1, y1, top - rim, top, roof, blind)

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
            return pitched_roofs.gable_line(a, b, z, self.top, roof.ridge)
        if roof.kind == "gambrel":
            return pitched_roofs.gambrel_line(a, b, z, self.top)
        if roof.kind == "barrel":
            return pitched_roofs.barrel_line(a, b, z, self.top)
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
    """Adds a wing's roof and gables.

    Args:
        out: where to, the roof as `roof`.
        wing: the wing.
        attic: (x0, x1) -> holes for the windows of a gable, or None.
        material: of the gables.
    """
    roof, outline = wing.roof, wing.outline
    blind = np.array([k in wing.blind for k in range(4)])
    reach = np.where(blind, 0.0, roof.eaves)
    if roof.kind == "flat":
        floor = round(wing.top - roof.parapet, 3)
        out.add_to(
            material,
            massing.skirt(outline, outline, wing.wall_top, wing.top),
            massing.roof_pan(outline, floor, wing.top, 0.25),
        )
        return
    z = wing.wall_top - _SEAT
    if roof.kind == "hip":
        solid = pitched_roofs.hip(outline, z, wing.top, reach, roof.thickness)
        out.add_to("roof", solid)
        return
    _add_shell(out, wing, attic, material)


def _add_shell(
    out: Assembly, wing: Wing, attic: Attic | None, material: str
) -> None:
    roof, line = wing.roof, wing.line
    blind = [k in wing.blind for k in range(4)]
    low_edge, high_edge = (3, 1) if roof.along_y else (0, 2)
    start_edge, end_edge = wing.gables
    start, end = wing.ridge
    start -= roof.verge * (not blind[start_edge])
    end += roof.verge * (not blind[end_edge])
    # A shed roof has no eaves at its upper end: its top is the wing's.
    ends = [not blind[low_edge], not blind[high_edge]]
    if roof.kind == "shed":
        ends[0 if roof.falling else 1] = False
    covering = pitched_roofs.with_eaves(line, *(roof.eaves * e for e in ends))
    shell = pitched_roofs.shell(
        covering, start, end, roof.thickness, along_y=roof.along_y
    )
    out.add_to("roof", shell)
    for edge in wing.gables:
        wall = wing.wall(edge)
        under = _seen_from(wing, edge, line)
        holes: list[Hole] = []
        if attic is not None and edge not in wing.blind:
            holes = [
                hole for hole in attic(0.0, wall.length) if _fits(hole, under)
            ]
        gable = pitched_roofs.gable_wall(
            under, 0.0, wall.length, wing.wall_top, holes
        )
        out.add_to(material, wall.place(gable))
        if holes:
            glass = pitched_roofs.gable_glass(holes)
            out.add_to("glass", wall.place(glass))
    if roof.kind == "shed":
        # The tall side, from the walls up to the roof.
        wall = wing.wall(low_edge if roof.falling else high_edge)
        top = wing.top - roof.thickness
        shield = pitched_roofs.gable_wall(
            [(0.0, top), (wall.length, top)], 0.0, wall.length, wing.wall_top
        )
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


def _fits(hole: Hole, under: list[bays.Span]) -> bool:
    return all(
        hole.z1 < pitched_roofs.line_height(under, x) - 0.15
        for x in (hole.x0, hole.x1)
    )


def attic_window(
    width: float, z0: float, z1: float, depth: float, count: int = 1
) -> Attic:
    """Returns windows side by side in the middle of a gable."""

    def holes(a: float, b: float) -> list[Hole]:
        step = 1.5 * width
        first = (a + b) / 2 - step * (count - 1) / 2
        return [
            Hole(
                round(x - width / 2, 2), round(x + width / 2, 2), z0, z1, depth
            )
            for x in (first + k * step for k in range(count))
        ]

    return holes


def ridge_rise(span: float, pitch_deg: float) -> float:
    """Returns how high a ridge rises over a span at a pitch [m]."""
    return span / 2 * math.tan(math.radians(pitch_deg))
