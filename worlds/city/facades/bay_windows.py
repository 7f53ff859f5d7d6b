"""Bay windows in front of walls."""

import numpy as np

from worlds.city.facades import bays, solids
from worlds.city.facades.reliefs import Band, Relief
from worlds.city.facades.wall_frames import WallFrame
from worlds.city.facades.walls import Facade, facade_mesh, glass_mesh
from worlds.shapes import Assembly, outlines

# Depth of the windows in bay windows [m].
_RECESS = 0.1


def add_bay_window(
    out: Assembly,
    wall: WallFrame,
    x: float,
    width: float,
    reach: float,
    z0: float,
    z1: float,
    *,
    storeys: int = 1,
    canted: bool = True,
) -> None:
    """Adds a bay window that stands on the ground or hangs on the wall.

    The bay window has a row of windows for each storey, and the materials
    `glass`, `roof` and `walls`.

    Args:
        out: the building under assembly, which gets the parts.
        wall: the wall.
        x: middle of the window along the wall [m].
        width: width along the wall [m].
        reach: how far it reaches out of the wall [m].
        z0: height of the foot of the bay window [m]; at 0 the bay window stands
            on the ground.
        z1: height of its top [m].
        storeys: number of storeys between foot and top.
        canted: whether the sides are slanted; otherwise the bay window is a
            box.
    """
    corners, flush = _plan(x, width, reach, canted=canted)
    points = np.array([wall.point(*corner) for corner in corners])
    facade = _storeys(round(z1 - z0, 3), storeys, flush)
    if z0 == 0.0:
        under = solids.foundation(points)
    else:
        under = solids.flat(points, z0, up=False)
    out.add_to("walls", facade_mesh(points, facade, z0), under)
    out.add_to("glass", glass_mesh(points, facade, z0))
    reaches = [-0.12 * (k not in flush) for k in range(len(points))]
    eaves = outlines.inset(points, reaches)
    tip = (eaves[0] + eaves[-1]) / 2
    out.add_to(
        "roof",
        solids.flat(eaves, z1, up=False),
        solids.skirt(eaves, eaves, z1, z1 + 0.15),
        solids.spire(eaves, tip, z1 + 0.15, z1 + 0.15 + 0.7 * reach),
    )


def _plan(
    x: float, width: float, reach: float, *, canted: bool
) -> tuple[list[outlines.Point], frozenset[int]]:
    """Returns a bay window's corners, and the numbers of edges in the wall.

    The corners are distances along the wall and out of the wall [m].
    """
    a, b = x - width / 2, x + width / 2
    if not canted:
        plan = [(a, -0.1), (a, reach), (b, reach), (b, -0.1)]
        return plan, frozenset({3})
    slant = min(reach, 0.28 * width)
    plan = [(a, -0.1), (a, 0.0), (a + slant, reach), (b - slant, reach),
            (b, 0.0), (b, -0.1)]  # fmt: skip
    return plan, frozenset({0, 4, 5})


def _storeys(height: float, count: int, flush: frozenset[int]) -> Facade:
    """Returns walls with windows in each storey.

    `height` is the height of all storeys together [m]. The walls on the edges
    `flush` have no windows.
    """
    step = height / count

    def layout(edge: int, length: float) -> list[Relief]:
        relief: list[Relief] = []
        for k in range(count if edge not in flush and length >= 0.7 else 0):
            z = k * step
            pane = bays.window(
                length - 0.3, round(z + 0.75, 2), round(z + step - 0.45, 2),
                _RECESS, mullions=1 if length > 1.5 else 0, pier=0.15,
            )  # fmt: skip
            relief += pane(0.0, length)
        return relief

    bands = (Band(height - 0.2, height, -0.08),)
    return Facade(height, bands, layout, (_RECESS,), flush)
