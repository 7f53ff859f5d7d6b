"""Wings of houses: boxes that can overlap, each with its own roof.

The edges of a wing are numbered: 0 front, 1 right, 2 back, 3 left.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable
from dataclasses import dataclass, field, replace
import itertools

import numpy as np

from evaluation.base import dot
from worlds.city.facades import bays, roofs
from worlds.city.facades.wall_frames import WallFrame
from worlds.shapes import outlines

# Overlap of a roof's underside with the top of the walls [m].
SEAT = 0.02


@dataclass(frozen=True)
class Roof:
    """The shape of a roof.

    Attributes:
        kind: `gable`, `gambrel`, `barrel`, `shed`, `hip` or `flat`.
        along_y: whether the ridge runs from the front to the back. A shed roof
            rises across this direction.
        eaves: overhang at the lower ends of the slopes [m].
        verge: overhang at the gables [m].
        thickness: vertical thickness of the roof [m].
        parapet: height of a flat roof's parapet [m].
        falling: whether a shed roof falls towards the back instead of rising
            towards the back. With `along_y`, whether it falls towards the right
            instead of rising towards the right.
    """

    kind: str = "gable"
    along_y: bool = False
    eaves: float = 0.4
    verge: float = 0.3
    thickness: float = 0.22
    parapet: float = 0.4
    falling: bool = False


@dataclass(frozen=True)
class Wing:
    """A box-shaped part of a house with its own roof; all lengths in [m].

    The walls stand on the rectangle from (x0, y0) to (x1, y1) in the building's
    frame. `wall_top` is the height of the walls. `top` is the height of the
    ridge or, for a flat roof, of the parapet. The walls at the edges `blind`
    are built against a neighbour: they are plain, and the roof does not
    overhang them.
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
        area: outlines.Area, wall_top: float, top: float, roof: Roof,
        blind: Collection[int] = (),
    ) -> Wing:  # fmt: skip
        """Returns a wing, with lengths rounded to centimetres.

        Args:
            area: x0, y0, x1, y1 in the building's frame [m].
            wall_top: height of the walls [m].
            top: height of the ridge or, for a flat roof, of the parapet [m].
            roof: shape of the roof.
            blind: numbers of the edges built against a neighbour.
        """
        a, b, c, d, e = (round(float(v), 2) for v in (*area, wall_top))
        return Wing(a, b, c, d, e, round(float(top), 3), roof, frozenset(blind))

    @staticmethod
    def flat(
        area: outlines.Area, top: float, parapet: float, rim: float = 0.1
    ) -> Wing:
        """Returns a wing with a flat roof and a parapet.

        Args:
            area: x0, y0, x1, y1 in the building's frame [m].
            top: height of the parapet's top above the ground [m].
            parapet: height of the parapet above the roof [m].
            rim: distance from the parapet's top down to the top of the walls
                [m].
        """
        return Wing.at(area, top - rim, top, Roof("flat", parapet=parapet))

    def mirrored(self, width: float) -> Wing:
        """Returns the wing mirrored left to right: x becomes `width` - x."""
        blind = frozenset((0, 3, 2, 1)[k] for k in self.blind)
        x0, x1 = round(width - self.x1, 2), round(width - self.x0, 2)
        return replace(self, x0=x0, x1=x1, blind=blind)

    @property
    def width(self) -> float:
        """Width along x [m]."""
        return self.x1 - self.x0

    @property
    def depth(self) -> float:
        """Depth along y [m]."""
        return self.y1 - self.y0

    @property
    def center(self) -> outlines.Point:
        """Middle of the wing in the building's frame [m]."""
        return (self.x0 + self.x1) / 2, (self.y0 + self.y1) / 2

    @property
    def ridge(self) -> bays.Span:
        """Start and end of the ridge, along x or y [m]."""
        along_y = self.roof.along_y
        return (self.y0, self.y1) if along_y else (self.x0, self.x1)

    @property
    def floor(self) -> float:
        """Height of a flat roof's surface inside its parapet [m]."""
        return self.top - self.roof.parapet

    @property
    def outline(self) -> np.ndarray:
        return outlines.rectangle(self.x0, self.y0, self.x1, self.y1)

    def wall(self, edge: int) -> WallFrame:
        """Returns the `WallFrame` of the wall at an edge."""
        return WallFrame(self.outline, edge)

    @property
    def roof_line(self) -> list[tuple[float, float]]:
        """The roof line as (across, z) points [m], without eaves.

        `across` is the coordinate perpendicular to the ridge: y, or x if the
        ridge runs along y.
        """
        roof = self.roof
        a, b = (self.x0, self.x1) if roof.along_y else (self.y0, self.y1)
        z = self.wall_top + roof.thickness - SEAT
        if roof.kind == "gable":
            return roofs.gable_line(a, b, z, self.top)
        if roof.kind == "gambrel":
            return roofs.gambrel_line(a, b, z, self.top)
        if roof.kind == "barrel":
            return roofs.barrel_line(a, b, z, self.top)
        if roof.kind == "shed":
            heights = (self.top, z) if roof.falling else (z, self.top)
            return [(a, heights[0]), (b, heights[1])]
        # A flat roof. A hipped roof, which has no gables, counts as flat.
        return [(a, self.top), (b, self.top)]

    @property
    def gables(self) -> tuple[int, int]:
        """The numbers of the two edges at the ends of the ridge."""
        return (0, 2) if self.roof.along_y else (3, 1)

    def covers(self, x: float, y: float) -> bool:
        """Returns whether a place (x, y) lies within the walls of the wing."""
        return self.x0 < x < self.x1 and self.y0 < y < self.y1


def free_stretches(
    wing: Wing, edge: int, others: Iterable[Wing], z: float
) -> list[tuple[float, float]]:
    """Returns the stretches of a wing's wall that no other wing hides [m].

    Each stretch is a pair: start and end along the wall. A blind wall has no
    such stretch.

    Args:
        wing: the wing.
        edge: number of the wall.
        others: the wings of the house.
        z: height at which the wall is examined [m]; wings lower than this
            height hide nothing.
    """
    wall = wing.wall(edge)
    cuts = {0.0, wall.length}
    hiding = [w for w in others if w is not wing and w.top > z]
    for other in hiding:
        for corner in other.outline:
            along = wall.point(0.0, 0.0), wall.point(1.0, 0.0)
            x = float(dot(corner - along[0], along[1] - along[0]))
            if 0.0 < x < wall.length:
                cuts.add(x)
    free: list[tuple[float, float]] = []
    bounds = sorted(cuts)
    for a, b in itertools.pairwise(bounds):
        x, y = wall.point((a + b) / 2, 0.05)
        if edge in wing.blind or any(w.covers(x, y) for w in hiding):
            continue
        if free and abs(free[-1][1] - a) < 1e-9:
            free[-1] = (free[-1][0], b)
        else:
            free.append((a, b))
    return free
