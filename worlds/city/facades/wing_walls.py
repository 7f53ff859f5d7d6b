"""Walls of a house's wings, and the openings in these walls.

`worlds.city.facades.wing_openings` adds groups of openings, such as a row of
windows in each storey.
"""

from collections.abc import Iterable, Sequence

from worlds.city.facades import bays, solids
from worlds.city.facades.reliefs import Arch, Band, Patch, Relief
from worlds.city.facades.walls import Facade, facade_mesh, glass_mesh
from worlds.city.facades.wing_roofs import Attic, add_roof
from worlds.city.facades.wings import Wing, free_stretches
from worlds.shapes import Assembly


class Openings:
    """Collects the windows and doors of one wing, and builds its walls.

    The constructor takes the building under assembly, the wing, and all wings
    of the house, because other wings can hide parts of the wing's walls. The
    edges of a wing are numbered: 0 front, 1 right, 2 back, 3 left.

    Attributes:
        out: the building under assembly.
        wing: the wing.
    """

    def __init__(
        self, out: Assembly, wing: Wing, others: Sequence[Wing] = ()
    ) -> None:
        self.out = out
        self.wing = wing
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
            for a, b in free_stretches(self.wing, edge, self._others, z):
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
        wing = self.wing
        bands, glass = tuple(bands), tuple(glass)
        facade = Facade(wing.wall_top, bands, self.layout, glass, wing.blind)
        outline = wing.outline
        self.out.add_to(
            material,
            solids.foundation(outline),
            facade_mesh(outline, facade),
        )
        self.out.add_to("glass", glass_mesh(outline, facade))

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
        add_roof(self.out, self.wing, attic, material)
