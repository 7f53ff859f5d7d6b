"""Houses with several wings: boxes that can overlap, each with its own roof.

Walls have windows and doors where no other wing hides them.

The edges of a wing are numbered: 0 front, 1 right, 2 back, 3 left.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Sequence
from dataclasses import dataclass, field, replace
import itertools
import math

import numpy as np

from cns_drake.city.facades import bays, details, massing, roofs, walls
from cns_drake.city.facades.assembly import Assembly
from cns_drake.city.geometry.mesh import Mesh

# Returns the windows of a gable between two places along its wall.
Attic = Callable[[float, float], list[walls.Patch]]
# Overlap of a roof's underside with the top of the walls [m].
_SEAT = 0.02


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
        ridge: place of a gable roof's ridge, as a share of the span.
        parapet: height of a flat roof's parapet [m].
        falling: whether a shed roof falls to the back (to the right if
            `along_y`) instead of rising.
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
        area: massing.Area, wall_top: float, top: float, roof: Roof,
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
        area: massing.Area, top: float, parapet: float, rim: float = 0.1
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
    def center(self) -> massing.Point:
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
        return massing.rectangle(self.x0, self.y0, self.x1, self.y1)

    def wall(self, edge: int) -> details.WallFrame:
        """Returns the `WallFrame` of the wall at an edge."""
        return details.WallFrame(self.outline, edge)

    @property
    def line(self) -> list[tuple[float, float]]:
        """The roof line as (across, z) points [m], without eaves.

        `across` is the coordinate perpendicular to the ridge: y, or x if the
        ridge runs along y.
        """
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
        """The numbers of the two edges at the ends of the ridge."""
        return (0, 2) if self.roof.along_y else (3, 1)

    def covers(self, x: float, y: float) -> bool:
        """Returns whether a place (x, y) lies within the walls of the wing."""
        return self.x0 < x < self.x1 and self.y0 < y < self.y1


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
        reach = np.where(is_free, roof.eaves, 0.0)
        z = wing.wall_top - _SEAT
        solid = roofs.hip(outline, z, wing.top, reach, roof.thickness)
        out.add_to("roof", solid)
        return
    low_edge, high_edge = (3, 1) if roof.along_y else (0, 2)
    start_edge, end_edge = wing.gables
    start, end = wing.ridge
    start -= roof.verge * is_free[start_edge]
    end += roof.verge * is_free[end_edge]
    # A shed roof has no eaves at its upper end, which is at the top of the
    # wing.
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
        holes: list[walls.Patch] = []
        if attic is not None and is_free[edge]:
            holes = [
                hole for hole in attic(0.0, wall.length) if _fits(hole, under)
            ]
        gable = roofs.gable_wall(under, 0.0, wall.length, wing.wall_top, holes)
        out.add_to(material, wall.place(gable))
        if holes:
            out.add_to("glass", wall.place(roofs.gable_glass(holes)))
    if roof.kind == "shed":
        # The tall side of a shed roof: the wall above the other walls.
        wall = wing.wall(low_edge if roof.falling else high_edge)
        top = [(x, wing.top - roof.thickness) for x in (0.0, wall.length)]
        shield = roofs.gable_wall(top, 0.0, wall.length, wing.wall_top)
        out.add_to(material, wall.place(shield))


def _seen_from(
    wing: Wing, edge: int, line: list[bays.Span]
) -> list[tuple[float, float]]:
    """Returns the underside of the roof in the wall coordinates of a gable."""
    thickness = wing.roof.thickness
    start, end = line[0][0], line[-1][0]
    # Walls run counter-clockwise. Seen from the front and from the right, the
    # line therefore keeps its direction.
    if edge in (0, 1):
        return [(u - start, z - thickness) for u, z in line]
    return [(end - u, z - thickness) for u, z in reversed(line)]


def _fits(hole: walls.Patch, under: list[bays.Span]) -> bool:
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

    def holes(a: float, b: float) -> list[walls.Patch]:
        step = 1.5 * width
        first = (a + b) / 2 - step * (count - 1) / 2
        return [
            walls.Patch(
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


_THICKNESS = 0.14
_DORMER_RECESS = 0.1
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
    hole = walls.Patch(
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
    (u0, z0), (u1, z1) = wing.line[:2]
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


def free_stretches(
    wing: Wing, edge: int, others: Iterable[Wing], z: float
) -> list[tuple[float, float]]:
    """Returns the stretches of a wing's wall that no other wing hides [m].

    Each stretch is a pair: start and end along the wall. A blind wall has none.

    Args:
        wing: the wing.
        edge: number of the wall.
        others: the wings of the house.
        z: height at which the wall is examined; lower wings hide nothing [m].
    """
    wall = wing.wall(edge)
    cuts = {0.0, wall.length}
    hiding = [w for w in others if w is not wing and w.top > z]
    for other in hiding:
        for corner in other.outline:
            along = wall.point(0.0, 0.0), wall.point(1.0, 0.0)
            x = float((corner - along[0]) @ (along[1] - along[0]))
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


class Openings:
    """Collects the windows and doors of one wing, and builds its walls.

    The constructor takes the building under assembly, the wing, and all wings
    of the house, which can hide parts of its walls. The edges of a wing are
    numbered: 0 front, 1 right, 2 back, 3 left.
    """

    def __init__(
        self, out: Assembly, wing: Wing, others: Sequence[Wing] = ()
    ) -> None:
        self._out = out
        self._wing = wing
        self._others = others
        self._reliefs: dict[int, list[walls.Relief]] = {k: [] for k in range(4)}

    def row(
        self,
        edges: Iterable[int],
        z: float,
        pitch: float,
        choices: Sequence[bays.Bay],
        margin: float = 0.5,
    ) -> None:
        """Adds rows of bays to the free parts of walls.

        The bays in `choices` alternate, from both ends towards the middle. A
        part of a wall is free if no other wing hides it at the height z.

        Args:
            edges: numbers of the walls.
            z: height at which a wall must be free [m].
            pitch: approximate width of a bay [m].
            choices: bays that alternate.
            margin: distance of the bays from the ends of a free part [m].
        """
        for edge in edges:
            for a, b in free_stretches(self._wing, edge, self._others, z):
                layout = bays.rhythm(pitch, choices, margin)
                self._reliefs[edge] += [
                    r._replace(x0=r.x0 + a, x1=r.x1 + a)
                    for r in layout(edge, b - a)
                ]

    def put(self, edge: int, x: float, width: float, bay: bays.Bay) -> None:
        """Adds a bay to a wall, in place of the openings that it touches.

        Args:
            edge: number of the wall.
            x: distance from the start of the wall to the middle of the bay [m].
            width: width of the bay [m].
            bay: the bay.
        """
        x0, x1 = x - width / 2, x + width / 2
        new = bay(x0, x1)
        if not new:
            return
        low = min(r.z0 for r in new)
        high = max(r.z1 for r in new)
        self._reliefs[edge] = [
            r
            for r in self._reliefs[edge]
            if r.x1 < x0 + 0.01 or r.x0 > x1 - 0.01 or r.z1 < low or r.z0 > high
        ] + new

    def add(self, edge: int, reliefs: Iterable[walls.Relief]) -> None:
        """Adds reliefs, given in wall coordinates, to the wall `edge`."""
        self._reliefs[edge] += reliefs

    def clear(
        self, edge: int, x0: float, x1: float, z0: float, z1: float
    ) -> None:
        """Removes the openings that touch a rectangle of a wall.

        Args:
            edge: number of the wall.
            x0: start of the rectangle along the wall [m].
            x1: end of the rectangle along the wall [m].
            z0: height of the rectangle's lower edge [m].
            z1: height of the rectangle's upper edge [m].
        """
        self._reliefs[edge] = [
            r
            for r in self._reliefs[edge]
            if r.x1 < x0 or r.x0 > x1 or r.z1 < z0 or r.z0 > z1
        ]

    def layout(self, edge: int, length: float) -> list[walls.Relief]:
        """Returns all reliefs of a wall, as the layout of a `Facade`.

        Bands of the facade are interrupted at arches. `edge` is the number of
        the wall. `length`, the length of the wall [m], is not used.
        """
        found: list[walls.Relief] = []
        for relief in self._reliefs[edge]:
            if isinstance(relief, walls.Arch):
                found.append(walls.Patch(*relief[:3], relief.z1, 0.0))
            found.append(relief)
        return found

    def add_walls(
        self,
        glass: Sequence[float],
        bands: Sequence[walls.Band] = (),
        material: str = "walls",
    ) -> None:
        """Adds the walls, their foundation and their panes to the building.

        Args:
            glass: depths behind the wall at which openings have panes [m].
            bands: strips of the walls that run around the wing.
            material: name of the material of the walls. The panes have the
                material named "glass".
        """
        wing = self._wing
        bands, glass = tuple(bands), tuple(glass)
        facade = walls.Facade(
            wing.wall_top, bands, self.layout, glass, wing.blind
        )
        outline = wing.outline
        self._out.add_to(
            material,
            massing.foundation(outline),
            walls.facade_mesh(outline, facade),
        )
        self._out.add_to("glass", walls.glass_mesh(outline, facade))

    def enclose(
        self,
        glass: Sequence[float],
        bands: Sequence[walls.Band] = (),
        material: str = "walls",
        attic: Attic | None = None,
    ) -> None:
        """Adds the walls, their panes and the roof to the building.

        Args:
            glass: depths behind the wall at which openings have panes [m].
            bands: strips of the walls that run around the wing.
            material: name of the material of walls and gables. The panes have
                the material named "glass".
            attic: function that returns the windows of a gable, such as
                `attic_window` makes; None for no windows.
        """
        self.add_walls(glass, bands, material)
        add_roof(self._out, self._wing, attic, material)

    def add_rows(
        self,
        edges: Iterable[int],
        floor: float,
        storey: float,
        count: int,
        pitch: float,
        width: float,
        margin: float = 0.6,
        head: float = 2.15,
    ) -> None:
        """Adds a row of windows to each storey of a wing.

        Windows of the ground floor are wider by a quarter.

        Args:
            edges: numbers of the walls.
            floor: height of the lowest floor [m].
            storey: height of a storey [m].
            count: number of storeys.
            pitch: approximate distance from one window to the next [m].
            width: width of a window [m].
            margin: least distance of windows from corners [m].
            head: height of the top of a window above its floor [m].
        """
        for k in range(count):
            z = floor + k * storey
            wide = round(width * (1.25 if k == 0 else 1.0), 2)
            choices = [sash(wide, z, 0.85, head), sash(width, z, 0.85, head)]
            self.row(edges, z + 0.7, pitch, choices, margin)

    def add_door(
        self,
        edge: int,
        x: float,
        floor: float,
        *,
        width: float = 1.0,
        height: float = 2.1,
        lights: float = 0.0,
        material: str = "accent",
    ) -> None:
        """Adds a door with its leaf and, if `lights` is set, side windows.

        Args:
            edge: number of the wall.
            x: middle of the door along the wall [m].
            floor: height of its threshold [m].
            width: width of the door [m].
            height: height of the door [m].
            lights: width of the window on each side; 0 for none [m].
            material: material of the leaf.
        """
        half = width / 2
        top = round(floor + height, 2)

        def bay(x0: float, x1: float) -> list[walls.Relief]:
            a, b = round(x - half, 2), round(x + half, 2)
            relief: list[walls.Relief] = [walls.Patch(a, b, floor, top, DOOR_M)]
            if lights > 0:
                for u0, u1 in ((a - lights, a - 0.08), (b + 0.08, b + lights)):
                    relief.append(
                        walls.Patch(u0, u1, round(floor + 0.3, 2), top, GLASS_M)
                    )
            return relief

        self.put(edge, x, width + 2 * lights + 0.5, bay)
        leaf = _leaf(x - half, x + half, floor, top)
        self._out.add_to(
            material, *(self._wing.wall(edge).place(part) for part in leaf)
        )

    def add_garage_door(
        self, edge: int, x: float, width: float, height: float = 2.15
    ) -> None:
        """Adds a garage door with horizontal ribs, in the material `trim`.

        Args:
            edge: number of the wall.
            x: middle of the door along the wall [m].
            width: width of the door [m].
            height: height of the door [m].
        """
        a, b = round(x - width / 2, 2), round(x + width / 2, 2)
        hole: list[walls.Relief] = [walls.Patch(a, b, 0.0, height, DOOR_M)]
        self.put(edge, x, width + 0.3, lambda x0, x1: hole)
        count = 4
        step = height / count
        for k in range(count):
            low = round(k * step + 0.02, 2)
            high = round((k + 1) * step - 0.02, 2)
            panel = details.board(a, b, low, high, 0.06)
            panel = panel.moved((0.0, -DOOR_M, 0.0))
            self._out.add_to("trim", self._wing.wall(edge).place(panel))

    def add_casings(self, edges: Sequence[int], style: str) -> None:
        """Adds frames, sills or shutters to the windows of some walls.

        `edges` are the numbers of the walls, and `style` is `frame`, `sill` or
        `shutters`.
        """
        material = "accent" if style == "shutters" else "trim"
        for edge in edges:
            wall = self._wing.wall(edge)
            boards = details.casings(
                self.layout(edge, wall.length), (GLASS_M,), style
            )
            self._out.add_to(material, *(wall.place(board) for board in boards))

    def add_shops(
        self,
        edge: int,
        start: float,
        end: float,
        height: float,
        *,
        width: float = 5.5,
        awnings: float = 0.6,
        reach: float = 1.2,
    ) -> None:
        """Adds shops side by side between two points of a wall.

        Fascias have the material `sign`, hanging signs `trim`, and awnings
        `awning`.

        Args:
            edge: number of the wall.
            start: where the shops begin along the wall [m].
            end: where they end along the wall [m].
            height: height of the ground floor [m].
            width: approximate width of a shop [m].
            awnings: share of the shops that have an awning.
            reach: how far an awning reaches out of the wall [m].
        """
        wall = self._wing.wall(edge)
        head = round(height - 1.15, 2)
        for a, b in bays.stretches(end - start, width, 0.1):
            x0, x1 = round(start + a, 2), round(start + b, 2)
            if x1 - x0 < 2.4:
                continue
            shop = bays.shop_front(head, SHOP_GLASS_M[0], pier=0.25)
            if self._out.chance(0.5):
                shop = _reversed(shop)
            self.put(edge, (x0 + x1) / 2, x1 - x0, shop)
            z = head + 0.08
            tall = self._out.uniform(0.55, 0.8, 2)
            fascia = wall.box(x0 + 0.15, x1 - 0.15, -0.02, 0.14, z, z + tall)
            self._out.add_to("sign", fascia)
            if self._out.chance(awnings):
                shade = details.awning(
                    x0 + 0.3, x1 - 0.3, reach, max(2.4, head - 0.8), head + 0.05
                )
                self._out.add_to("awning", wall.place(shade))
            if self._out.chance(0.4):
                x = x0 + 0.25 if self._out.chance(0.5) else x1 - 0.25
                # Hanging signs, like awnings, are above people's heads.
                z = max(2.4, head + 0.1)
                blade = wall.box(x - 0.06, x + 0.06, 0.1, 0.9, z, z + 0.8)
                self._out.add_to("trim", blade)


# Depth of windows behind the wall [m].
GLASS_M = 0.12
# Depth of the leaves of doors behind the wall [m].
DOOR_M = 0.2


def sash(
    width: float, z: float, sill: float, head: float, bars: int = 0
) -> bays.Bay:
    """Returns a bay with a window, given by heights above its floor.

    The glass is 0.12 m behind the wall.

    Args:
        width: width of the window [m].
        z: height of the floor [m].
        sill: height of the bottom of the glass above the floor [m].
        head: height of the top of the glass above the floor [m].
        bars: number of mullions.
    """
    low, high = round(z + sill, 2), round(z + head, 2)
    return bays.window(width, low, high, GLASS_M, mullions=bars, pier=0.25)


def _leaf(x0: float, x1: float, z0: float, z1: float) -> list[Mesh]:
    """Returns a door leaf with a raised frame, in wall coordinates."""
    shift = (0.0, -DOOR_M, 0.0)
    panels = [
        details.board(x0, x1, z0, z1, 0.04),
        details.board(x0 + 0.12, x1 - 0.12, z0 + 0.15, z0 + 0.8, 0.07),
        details.board(x0 + 0.12, x1 - 0.12, z0 + 0.95, z1 - 0.15, 0.07),
    ]
    return [panel.moved(shift) for panel in panels]


# Depths of shop windows and of the doors between them [m].
SHOP_GLASS_M = (0.35, 0.95)


def _reversed(bay: bays.Bay) -> bays.Bay:
    """Returns a bay mirrored left to right."""

    def mirrored(x0: float, x1: float) -> list[walls.Relief]:
        return [
            r._replace(x0=round(x0 + x1 - r.x1, 2), x1=round(x0 + x1 - r.x0, 2))
            for r in bay(x0, x1)
        ]

    return mirrored
