"""Windows, doors and shops of a house's wings, as groups of openings."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from worlds.city.facades import bays, boards, canopies
from worlds.city.facades.reliefs import Patch, Relief
from worlds.city.facades.wing_walls import Openings
from worlds.shapes import Mesh

# Depth of windows behind the wall [m].
GLASS_M = 0.12
# Depth of the leaves of doors behind the wall [m].
_DOOR_M = 0.2
# Depths of shop windows and of the doors between them [m].
SHOP_GLASS_M = (0.35, 0.95)


def add_window_storeys(
    openings: Openings,
    pitches: Iterable[tuple[Sequence[int], float]],
    floor: float,
    storey: float,
    count: int,
    width: float,
    margin: float = 0.6,
    head: float = 2.15,
) -> None:
    """Adds a row of windows to each storey of a wing.

    Windows of the ground floor are wider by a quarter.

    Args:
        openings: the openings of the wing.
        pitches: numbers of walls, and the approximate distance from one of
            their windows to the next [m].
        floor: height of the lowest floor [m].
        storey: height of a storey [m].
        count: number of storeys.
        width: width of a window [m].
        margin: least distance of windows from corners [m].
        head: height of the top of a window above the storey's floor [m].
    """
    for edges, pitch in pitches:
        for k in range(count):
            z = floor + k * storey
            wide = round(width * (1.25 if k == 0 else 1.0), 2)
            choices = [sash(wide, z, 0.85, head), sash(width, z, 0.85, head)]
            openings.add_bays(edges, z + 0.7, pitch, choices, margin)


def add_door(
    openings: Openings,
    x: float,
    floor: float,
    *,
    width: float = 1.0,
    height: float = 2.1,
    lights: float = 0.0,
    material: str = "accent",
) -> None:
    """Adds a front door with its leaf and, if `lights` is set, side windows.

    Args:
        openings: the openings of the wing.
        x: middle of the door along the front [m].
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
        relief: list[Relief] = [Patch(a, b, floor, top, _DOOR_M)]
        if lights > 0:
            for u0, u1 in ((a - lights, a - 0.08), (b + 0.08, b + lights)):
                relief.append(
                    Patch(u0, u1, round(floor + 0.3, 2), top, GLASS_M)
                )
        return relief

    openings.replace_by_bay(0, x, width + 2 * lights + 0.5, bay)
    leaf = _leaf(x - half, x + half, floor, top)
    openings.out.add_to(
        material, *(openings.wing.wall(0).place(part) for part in leaf)
    )


def add_garage_door(openings: Openings, x: float, width: float) -> None:
    """Adds a garage door with ribs to the front, in the material `trim`.

    Args:
        openings: the openings of the wing.
        x: middle of the door along the front [m].
        width: width of the door [m].
    """
    height = 2.15
    a, b = round(x - width / 2, 2), round(x + width / 2, 2)
    hole: list[Relief] = [Patch(a, b, 0.0, height, _DOOR_M)]
    openings.replace_by_bay(0, x, width + 0.3, lambda x0, x1: hole)
    count = 4
    step = height / count
    for k in range(count):
        low = round(k * step + 0.02, 2)
        high = round((k + 1) * step - 0.02, 2)
        panel = boards.board(a, b, low, high, 0.06)
        panel = panel.moved((0.0, -_DOOR_M, 0.0))
        openings.out.add_to("trim", openings.wing.wall(0).place(panel))


def add_casings(openings: Openings, style: str) -> None:
    """Adds frames, sills or shutters to the windows of the front.

    Args:
        openings: the openings of the wing.
        style: `frame`, `sill` or `shutters`.
    """
    material = "accent" if style == "shutters" else "trim"
    wall = openings.wing.wall(0)
    pieces = boards.casings(openings.layout(0, wall.length), (GLASS_M,), style)
    openings.out.add_to(material, *(wall.place(piece) for piece in pieces))


def add_shops(
    openings: Openings,
    start: float,
    end: float,
    height: float,
    *,
    width: float = 5.5,
    awnings: float = 0.6,
    reach: float = 1.2,
) -> None:
    """Adds shops side by side between two points of the front.

    Fascias have the material `sign`, hanging signs `trim`, and awnings
    `awning`.

    Args:
        openings: the openings of the wing.
        start: where the shops begin along the front [m].
        end: where the shops end along the front [m].
        height: height of the ground floor [m].
        width: approximate width of a shop [m].
        awnings: share of the shops that have an awning.
        reach: how far an awning reaches out of the wall [m].
    """
    wall = openings.wing.wall(0)
    out = openings.out
    head = round(height - 1.15, 2)
    for a, b in bays.stretches(end - start, width, 0.1):
        x0, x1 = round(start + a, 2), round(start + b, 2)
        if x1 - x0 < 2.4:
            continue
        shop = bays.shop_front(head, SHOP_GLASS_M[0], pier=0.25)
        if out.chance(0.5):
            shop = _mirrored_bay(shop)
        openings.replace_by_bay(0, (x0 + x1) / 2, x1 - x0, shop)
        z = head + 0.08
        tall = out.uniform(0.55, 0.8, 2)
        fascia = wall.box(
            x=(x0 + 0.15, x1 - 0.15), y=(-0.02, 0.14), z=(z, z + tall)
        )
        out.add_to("sign", fascia)
        if out.chance(awnings):
            shade = canopies.awning(
                x0 + 0.3, x1 - 0.3, reach, max(2.4, head - 0.8), head + 0.05
            )
            out.add_to("awning", wall.place(shade))
        if out.chance(0.4):
            x = x0 + 0.25 if out.chance(0.5) else x1 - 0.25
            # Hanging signs, like awnings, are above people's heads.
            z = max(2.4, head + 0.1)
            blade = wall.box(
                x=(x - 0.06, x + 0.06), y=(0.1, 0.9), z=(z, z + 0.8)
            )
            out.add_to("trim", blade)


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
    shift = (0.0, -_DOOR_M, 0.0)
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
