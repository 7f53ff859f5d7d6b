"""The walls of a wing: windows and doors where no other wing hides them."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
import itertools

from cns_drake.city.buildings.parts import bays, massing, wings
from cns_drake.city.buildings.parts.facades import (
    Arch,
    Band,
    Facade,
    Patch,
    Relief,
    facade_mesh,
    glass_mesh,
)
from cns_drake.city.buildings.parts.site import Assembly
from cns_drake.city.buildings.parts.wings import Wing


def free_stretches(
    wing: Wing, edge: int, others: Iterable[Wing], z: float
) -> list[tuple[float, float]]:
    """Returns the parts of a wall that no other wing hides at a height."""
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
    """The windows and doors of a wing, by edge."""

    def __init__(self, wing: Wing, others: Sequence[Wing] = ()) -> None:
        self._wing = wing
        self._others = others
        self._reliefs: dict[int, list[Relief]] = {k: [] for k in range(4)}

    def row(
        self,
        edges: Iterable[int],
        z: float,
        pitch: float,
        choices: Sequence[bays.Bay],
        margin: float = 0.5,
    ) -> None:
        """Repeats bays along the free parts of walls.

        Args:
            edges: the walls.
            z: height above which other wings hide them [m].
            pitch: about the width of a bay [m].
            choices: bays in turn, from both ends towards the middle.
            margin: kept from the ends of each free part [m].
        """
        for edge in edges:
            for a, b in free_stretches(self._wing, edge, self._others, z):
                layout = bays.rhythm(pitch, choices, margin)
                self._reliefs[edge] += [
                    r._replace(x0=r.x0 + a, x1=r.x1 + a)
                    for r in layout(edge, b - a)
                ]

    def put(self, edge: int, x: float, width: float, bay: bays.Bay) -> None:
        """Puts a bay around x, in place of the bays it meets there."""
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

    def add(self, edge: int, reliefs: Iterable[Relief]) -> None:
        """Adds reliefs given in the wall's coordinates."""
        self._reliefs[edge] += reliefs

    def clear(
        self, edge: int, x0: float, x1: float, z0: float, z1: float
    ) -> None:
        """Removes the reliefs that meet a part of a wall."""
        self._reliefs[edge] = [
            r
            for r in self._reliefs[edge]
            if r.x1 < x0 or r.x0 > x1 or r.z1 < z0 or r.z0 > z1
        ]

    def layout(self, edge: int, length: float) -> list[Relief]:
        """Returns all reliefs, for a facade.

        Bands end at arches, which need flat wall around them.
        """
        found: list[Relief] = []
        for relief in self._reliefs[edge]:
            if isinstance(relief, Arch):
                found.append(Patch(*relief[:3], relief.z1, 0.0))
            found.append(relief)
        return found

    def add_walls(
        self,
        out: Assembly,
        glass: Sequence[float],
        bands: Sequence[Band] = (),
        material: str = "walls",
    ) -> None:
        """Adds the walls on their foundation, with their panes.

        Args:
            materials: where to, the panes as `glass`.
            glass: depths of the openings that have panes [m].
            bands: strips around the wing.
            material: of the walls.
        """
        wing = self._wing
        bands, glass = tuple(bands), tuple(glass)
        facade = Facade(wing.wall_top, bands, self.layout, glass, wing.blind)
        outline = wing.outline
        out.add_to(
            material, massing.foundation(outline), facade_mesh(outline, facade)
        )
        out.add_to("glass", glass_mesh(outline, facade))

    def enclose(
        self,
        out: Assembly,
        glass: Sequence[float],
        bands: Sequence[Band] = (),
        material: str = "walls",
        attic: wings.Attic | None = None,
    ) -> None:
        """Adds the walls, see `add_walls`, and the roof on them.

        `attic` gives the windows of its gables.
        """
        self.add_walls(out, glass, bands, material)
        wings.add_roof(out, self._wing, attic, material)
