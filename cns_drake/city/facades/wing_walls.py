"""Walls of a house's wings, with their windows and doors.

Openings are where no other wing hides the wall.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from cns_drake.city.facades import (
    bays,
    boards,
    canopies,
    solids,
)
from cns_drake.city.facades.assembly import Assembly
from cns_drake.city.facades.reliefs import Arch, Band, Patch, Relief
from cns_drake.city.facades.walls import Facade, facade_mesh, glass_mesh
from cns_drake.city.facades.wing_roofs import Attic, add_roof
from cns_drake.city.facades.wings import Wing, free_stretches
from cns_drake.city.geometry.mesh import Mesh

# Depth of windows behind the wall [m].
GLASS_M = 0.12
# Depth of the leaves of doors behind the wall [m].
DOOR_M = 0.2
# Depths of shop windows and of the doors between them [m].
SHOP_GLASS_M = (0.35, 0.95)


class Openings:
    """Collects the windows and doors of one wing, and builds its walls.

    The constructor takes the building under assembly, the wing, and all wings
    of the house, because other wings can hide parts of the wing's walls. The
    edges of a wing are numbered: 0 front, 1 right, 2 back, 3 left.
    """

    def __init__(
        self, out: Assembly, wing: Wing, others: Sequence[Wing] = ()
    ) -> None:
        self._out = out
        self._wing = wing
        self._others = others
        self._reliefs: dict[int, list[Relief]] = {k: [] for k in range(4)}

    def add_bays(
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

    def replace_by_bay(
        self, edge: int, x: float, width: float, bay: bays.Bay
    ) -> None:
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

    def add_reliefs(self, edge: int, reliefs: Iterable[Relief]) -> None:
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

    def layout(self, edge: int, length: float) -> list[Relief]:
        """Returns all reliefs of a wall, as the layout of a `Facade`.

        Bands of the facade are interrupted at arches. `edge` is the number of
        the wall. `length`, the length of the wall [m], is not used.
        """
        found: list[Relief] = []
        for relief in self._reliefs[edge]:
            if isinstance(relief, Arch):
                found.append(Patch(*relief[:3], relief.z1, 0.0))
            found.append(relief)
        return found

    def add_walls(
        self,
        glass: Sequence[float],
        bands: Sequence[Band] = (),
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
        facade = Facade(wing.wall_top, bands, self.layout, glass, wing.blind)
        outline = wing.outline
        self._out.add_to(
            material,
            solids.foundation(outline),
            facade_mesh(outline, facade),
        )
        self._out.add_to("glass", glass_mesh(outline, facade))

    def enclose(
        self,
        glass: Sequence[float],
        bands: Sequence[Band] = (),
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

    def add_window_storeys(
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
            head: height of the top of a window above the storey's floor [m].
        """
        for k in range(count):
            z = floor + k * storey
            wide = round(width * (1.25 if k == 0 else 1.0), 2)
            choices = [sash(wide, z, 0.85, head), sash(width, z, 0.85, head)]
            self.add_bays(edges, z + 0.7, pitch, choices, margin)

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
            floor: height of the threshold [m].
            width: width of the door [m].
            height: height of the door [m].
            lights: width of the window on each side; 0 for none [m].
            material: material of the leaf.
        """
        half = width / 2
        top = round(floor + height, 2)

        def bay(x0: float, x1: float) -> list[Relief]:
            a, b = round(x - half, 2), round(x + half, 2)
            relief: list[Relief] = [Patch(a, b, floor, top, DOOR_M)]
            if lights > 0:
                for u0, u1 in ((a - lights, a - 0.08), (b + 0.08, b + lights)):
                    relief.append(
                        Patch(u0, u1, round(floor + 0.3, 2), top, GLASS_M)
                    )
            return relief

        self.replace_by_bay(edge, x, width + 2 * lights + 0.5, bay)
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
        hole: list[Relief] = [Patch(a, b, 0.0, height, DOOR_M)]
        self.replace_by_bay(edge, x, width + 0.3, lambda x0, x1: hole)
        count = 4
        step = height / count
        for k in range(count):
            low = round(k * step + 0.02, 2)
            high = round((k + 1) * step - 0.02, 2)
            panel = boards.board(a, b, low, high, 0.06)
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
            pieces = boards.casings(
                self.layout(edge, wall.length), (GLASS_M,), style
            )
            self._out.add_to(material, *(wall.place(piece) for piece in pieces))

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
            end: where the shops end along the wall [m].
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
                shop = _mirrored_bay(shop)
            self.replace_by_bay(edge, (x0 + x1) / 2, x1 - x0, shop)
            z = head + 0.08
            tall = self._out.uniform(0.55, 0.8, 2)
            fascia = wall.box(x0 + 0.15, x1 - 0.15, -0.02, 0.14, z, z + tall)
            self._out.add_to("sign", fascia)
            if self._out.chance(awnings):
                shade = canopies.awning(
                    x0 + 0.3, x1 - 0.3, reach, max(2.4, head - 0.8), head + 0.05
                )
                self._out.add_to("awning", wall.place(shade))
            if self._out.chance(0.4):
                x = x0 + 0.25 if self._out.chance(0.5) else x1 - 0.25
                # Hanging signs, like awnings, are above people's heads.
                z = max(2.4, head + 0.1)
                blade = wall.box(x - 0.06, x + 0.06, 0.1, 0.9, z, z + 0.8)
                self._out.add_to("trim", blade)


def sash(
    width: float, z: float, sill: float, head: float, bars: int = 0
) -> bays.Bay:
    """Returns a bay with a window, given by heights above a floor.

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
        boards.board(x0, x1, z0, z1, 0.04),
        boards.board(x0 + 0.12, x1 - 0.12, z0 + 0.15, z0 + 0.8, 0.07),
        boards.board(x0 + 0.12, x1 - 0.12, z0 + 0.95, z1 - 0.15, 0.07),
    ]
    return [panel.moved(shift) for panel in panels]


def _mirrored_bay(bay: bays.Bay) -> bays.Bay:
    """Returns a bay mirrored left to right."""

    def mirrored(x0: float, x1: float) -> list[Relief]:
        return [
            r._replace(x0=round(x0 + x1 - r.x1, 2), x1=round(x0 + x1 - r.x0, 2))
            for r in bay(x0, x1)
        ]

    return mirrored
