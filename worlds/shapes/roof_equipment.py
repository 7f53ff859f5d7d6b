"""Equipment on roofs: chimneys, and pieces on flat roofs."""

from collections.abc import Sequence
import math

import numpy as np
from shapely.geometry import Point, Polygon

from worlds.shapes.assembly import Assembly
from worlds.shapes.models import Finish

# Random places at which a piece is tried before it is left out.
_PLACE_TRIES = 30
# Radius of the free area that each piece needs [m].
_RADIUS = {
    "ac_unit": 1.6,
    "air_handler": 3.8,
    "cooling_tower": 2.2,
    "water_tower": 2.3,
    "stair_house": 2.1,
    "lift_house": 3.6,
    "tank": 1.4,
    "mast": 0.9,
    "skylight": 2.4,
    "vents": 1.3,
    "dish": 1.1,
}


def add_chimney(
    out: Assembly,
    part: str,
    xyz: tuple[float, float, float],
    finish: Finish,
    *,
    item: str = "chimney",
    yaw: float = 0.0,
    scale: tuple[float, float, float] = (1.0, 1.0, 1.0),
) -> None:
    """Adds a chimney, one of the shared meshes, to a pitched roof.

    Args:
        out: the building under assembly, which gets the parts.
        part: name of the part.
        xyz: position of the chimney's foot, below the roof's surface, in the
            building's frame [m].
        finish: colour and material.
        item: `chimney` or `chimney_row`.
        yaw: heading of the chimney [rad].
        scale: scale factors along x, y and z.
    """
    out.place(part, out.shared(f"roof_{item}", scale), xyz, yaw, finish=finish)


def equip_roof(
    out: Assembly,
    roof: np.ndarray,
    z: float,
    items: Sequence[str],
    clear: float = 1.0,
    prefix: str = "",
) -> None:
    """Adds equipment to a flat roof; leaves out pieces that do not fit.

    Pieces do not overlap. Places, headings and sizes are random.

    Args:
        out: the building under assembly, which gets the parts.
        roof: (N, 2) outline of the roof in the building's frame [m].
        z: height of the roof [m].
        items: names of the equipment, the most important first.
        clear: least distance to the edge of the roof [m].
        prefix: beginning of the names of the parts.
    """
    room = Polygon(roof)
    rng = out.rng
    x0, y0, x1, y1 = room.bounds
    along = np.subtract(roof[1], roof[0])
    heading = math.atan2(along[1], along[0])
    taken: list[tuple[float, float, float]] = []
    for number, item in enumerate(items):
        scale = round(float(rng.uniform(0.85, 1.25)), 2)
        stretch = round(scale * float(rng.uniform(0.9, 1.2)), 2)
        turn = heading + int(rng.integers(4)) * math.pi / 2
        radius = _RADIUS[item] * max(scale, stretch)
        free = room.buffer(-radius - clear)
        for _ in range(_PLACE_TRIES):
            x, y = rng.uniform(x0, x1), rng.uniform(y0, y1)
            fits = all(
                math.hypot(x - a, y - b) > radius + r for a, b, r in taken
            )
            if fits and free.contains(Point(x, y)):
                taken.append((x, y, radius))
                size = (stretch, scale, scale)
                shape = out.shared(f"roof_{item}", size)
                part = f"{prefix}roof_{number:02d}"
                out.place(part, shape, (x, y, z), turn)
                break
