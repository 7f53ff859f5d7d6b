"""The walls of a wing: windows and doors where no other wing hides them."""

from collections.abc import Iterable, Sequence
import itertools

from cns_drake.city.facades import bays, details, massing, wings
from cns_drake.city.facades.assembly import Assembly
from cns_drake.city.facades.walls import (
    Arch,
    Band,
    Facade,
    Patch,
    Relief,
    facade_mesh,
    glass_mesh,
)
from cns_drake.city.facades.wings import Wing
from cns_drake.city.geometry.mesh import Mesh


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

        Bays take turns from both ends towards the middle, about `pitch` wide
        and `margin` from the ends of a part. Parts that other wings hide at z
        are not free [m].
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
        """Adds the walls on their foundation, with their panes as `glass`.

        `glass` gives the depths of the openings that have panes [m].
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

        Windows of the ground floor are the widest. They are kept `margin` from
        corners; `head` is their top above the floor [m].
        """
        for k in range(count):
            z = floor + k * storey
            wide = round(width * (1.25 if k == 0 else 1.0), 2)
            choices = [sash(wide, z, 0.85, head), sash(width, z, 0.85, head)]
            self.row(edges, z + 0.7, pitch, choices, margin)

    def add_door(
        self,
        out: Assembly,
        edge: int,
        x: float,
        floor: float,
        *,
        width: float = 1.0,
        height: float = 2.1,
        lights: float = 0.0,
        material: str = "accent",
    ) -> None:
        """Adds a door with its leaf, between windows of `lights` width."""
        half, top = width / 2, round(floor + height, 2)

        def bay(x0: float, x1: float) -> list[Relief]:
            a, b = round(x - half, 2), round(x + half, 2)
            relief: list[Relief] = [Patch(a, b, floor, top, DOOR_M)]
            if lights > 0:
                for u0, u1 in ((a - lights, a - 0.08), (b + 0.08, b + lights)):
                    relief.append(
                        Patch(u0, u1, round(floor + 0.3, 2), top, GLASS_M)
                    )
            return relief

        self.put(edge, x, width + 2 * lights + 0.5, bay)
        leaf = _leaf(x - half, x + half, floor, top)
        out.add_to(
            material, *(self._wing.wall(edge).place(part) for part in leaf)
        )

    def add_garage_door(
        self,
        out: Assembly,
        edge: int,
        x: float,
        width: float,
        height: float = 2.15,
    ) -> None:
        """Adds a sectional door with ribs, as `trim`."""
        a, b = round(x - width / 2, 2), round(x + width / 2, 2)
        hole: list[Relief] = [Patch(a, b, 0.0, height, DOOR_M)]
        self.put(edge, x, width + 0.3, lambda x0, x1: hole)
        count = 4
        step = height / count
        for k in range(count):
            low, high = (
                round(k * step + 0.02, 2),
                round((k + 1) * step - 0.02, 2),
            )
            panel = details.board(a, b, low, high, 0.06)
            panel = panel.moved((0.0, -DOOR_M, 0.0))
            out.add_to("trim", self._wing.wall(edge).place(panel))

    def add_casings(
        self, out: Assembly, edges: Sequence[int], style: str
    ) -> None:
        """Frames the windows of some walls, see `details.casings`."""
        material = "accent" if style == "shutters" else "trim"
        for edge in edges:
            wall = self._wing.wall(edge)
            boards = details.casings(
                self.layout(edge, wall.length), (GLASS_M,), style
            )
            out.add_to(material, *(wall.place(board) for board in boards))

    def add_shops(
        self,
        out: Assembly,
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

        They are about `width` wide, in a ground floor of some `height`; a part
        of them has `awnings` with a reach out of the wall [m]. Fascias are
        `sign`, blades `trim`, awnings `awning`.
        """
        wall = self._wing.wall(edge)
        head = round(height - 1.15, 2)
        for a, b in bays.stretches(end - start, width, 0.1):
            x0, x1 = round(start + a, 2), round(start + b, 2)
            if x1 - x0 < 2.4:
                continue
            shop = bays.shop_front(head, SHOP_GLASS_M[0], pier=0.25)
            if out.chance(0.5):
                shop = _reversed(shop)
            self.put(edge, (x0 + x1) / 2, x1 - x0, shop)
            z, tall = head + 0.08, out.uniform(0.55, 0.8, 2)
            fascia = wall.box(x0 + 0.15, x1 - 0.15, -0.02, 0.14, z, z + tall)
            out.add_to("sign", fascia)
            if out.chance(awnings):
                shade = details.awning(
                    x0 + 0.3, x1 - 0.3, reach, max(2.4, head - 0.8), head + 0.05
                )
                out.add_to("awning", wall.place(shade))
            if out.chance(0.4):
                x = x0 + 0.25 if out.chance(0.5) else x1 - 0.25
                # Blades hang above heads, like awnings.
                z = max(2.4, head + 0.1)
                blade = wall.box(x - 0.06, x + 0.06, 0.1, 0.9, z, z + 0.8)
                out.add_to("trim", blade)


# Depths of windows and of the leaves of doors behind the wall [m].
GLASS_M, DOOR_M = 0.12, 0.2


def sash(
    width: float, z: float, sill: float, head: float, bars: int = 0
) -> bays.Bay:
    """A window of a storey whose floor is at z; sill and head above it."""
    low, high = round(z + sill, 2), round(z + head, 2)
    return bays.window(width, low, high, GLASS_M, mullions=bars, pier=0.25)


def _leaf(x0: float, x1: float, z0: float, z1: float) -> list[Mesh]:
    """A door leaf with a raised frame, in wall coordinates."""
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

    def mirrored(x0: float, x1: float) -> list[Relief]:
        return [
            r._replace(x0=round(x0 + x1 - r.x1, 2), x1=round(x0 + x1 - r.x0, 2))
            for r in bay(x0, x1)
        ]

    return mirrored
