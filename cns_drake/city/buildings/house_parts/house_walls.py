"""The openings of houses: rows of windows, doors with leaves, garage doors."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from cns_drake.city.buildings.house_parts import porches
from cns_drake.city.buildings.house_parts.openings import Openings
from cns_drake.city.buildings.parts import bays
from cns_drake.city.buildings.parts.facades import Patch, Relief
from cns_drake.city.buildings.parts.site import Assembly
from cns_drake.city.buildings.parts.wings import Wing
from cns_drake.city.geometry.mesh import Mesh

# Depths of windows and of the leaves of doors behind the wall [m].
GLASS_M, DOOR_M = 0.12, 0.2


def sash(
    width: float, z: float, sill: float, head: float, bars: int = 0
) -> bays.Bay:
    """A window of a storey whose floor is at z; sill and head above it."""
    low, high = round(z + sill, 2), round(z + head, 2)
    return bays.window(width, low, high, GLASS_M, mullions=bars, pier=0.25)


def add_rows(
    openings: Openings,
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

    Windows of the ground floor are the widest.

    Args:
        openings: of the wing.
        edges: its walls with windows.
        floor: height of the ground floor [m].
        storey: height of a storey [m].
        count: of storeys.
        pitch, width: of the windows [m].
        margin: kept from corners [m].
        head: of the windows above the floor [m].
    """
    for k in range(count):
        z = floor + k * storey
        wide = round(width * (1.25 if k == 0 else 1.0), 2)
        choices = [sash(wide, z, 0.85, head), sash(width, z, 0.85, head)]
        openings.row(edges, z + 0.7, pitch, choices, margin)


def add_door(
    out: Assembly,
    wing: Wing,
    openings: Openings,
    edge: int,
    x: float,
    floor: float,
    *,
    width: float = 1.0,
    height: float = 2.1,
    lights: float = 0.0,
    material: str = "accent",
) -> None:
    """Adds a door with its leaf, and windows of `lights` width beside it."""
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

    openings.put(edge, x, width + 2 * lights + 0.5, bay)
    leaf = _leaf(x - half, x + half, floor, top)
    out.add_to(material, *(wing.wall(edge).place(part) for part in leaf))


def _leaf(x0: float, x1: float, z0: float, z1: float) -> list[Mesh]:
    """A door leaf with a raised frame, in wall coordinates."""
    shift = (0.0, -DOOR_M, 0.0)
    panels = [
        porches.board(x0, x1, z0, z1, 0.04),
        porches.board(x0 + 0.12, x1 - 0.12, z0 + 0.15, z0 + 0.8, 0.07),
        porches.board(x0 + 0.12, x1 - 0.12, z0 + 0.95, z1 - 0.15, 0.07),
    ]
    return [panel.moved(shift) for panel in panels]


def add_garage_door(
    out: Assembly,
    wing: Wing,
    openings: Openings,
    edge: int,
    x: float,
    width: float,
    height: float = 2.15,
) -> None:
    """Adds a sectional door with ribs, as `trim`."""
    a, b = round(x - width / 2, 2), round(x + width / 2, 2)
    hole: list[Relief] = [Patch(a, b, 0.0, height, DOOR_M)]
    openings.put(edge, x, width + 0.3, lambda x0, x1: hole)
    count = 4
    step = height / count
    for k in range(count):
        low, high = round(k * step + 0.02, 2), round((k + 1) * step - 0.02, 2)
        panel = porches.board(a, b, low, high, 0.06)
        panel = panel.moved((0.0, -DOOR_M, 0.0))
        out.add_to("trim", wing.wall(edge).place(panel))


def add_casings(
    out: Assembly,
    wing: Wing,
    openings: Openings,
    edges: Sequence[int],
    style: str,
) -> None:
    """Frames the windows of some walls, see `porches.casings`."""
    material = "accent" if style == "shutters" else "trim"
    for edge in edges:
        wall = wing.wall(edge)
        boards = porches.casings(
            openings.layout(edge, wall.length), (GLASS_M,), style
        )
        out.add_to(material, *(wall.place(board) for board in boards))
