"""Equipment on roofs: shared meshes, and their places.

These meshes have fixed names and shapes, shared by all buildings of a city;
parts vary them by scale and heading. Each stands on z = 0; chimneys reach below
it.
"""

from __future__ import annotations

from collections.abc import Sequence
import math

import numpy as np
from shapely.geometry import Point, Polygon

from cns_drake.city.buildings.parts.site import Assembly, Rgb

# Radius of the room that each piece needs [m].
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
    rgb: Rgb,
    *,
    item: str = "chimney",
    yaw: float = 0.0,
    scale: tuple[float, float, float] = (1.0, 1.0, 1.0),
) -> None:
    """Stands a shared chimney on a pitched roof.

    Args:
        out: the building.
        part: name of the visual.
        xyz: of its foot, below the roof's surface [m].
        rgb: its colour.
        item: `chimney` or `chimney_row`.
        yaw: its heading [rad].
        scale: along its axes.
    """
    out.place(part, out.shared(f"roof_{item}", scale), xyz, yaw, rgb=rgb)


def equip_roof(
    out: Assembly,
    roof: np.ndarray,
    z: float,
    items: Sequence[str],
    clear: float = 1.0,
    prefix: str = "",
) -> None:
    """Stands equipment on a flat roof without overlaps, as far as it fits.

    Args:
        out: the building; its `rng` draws places, headings, sizes.
        roof: outline of the free roof [m].
        z: height of the roof [m].
        items: what to stand there, the most important first.
        clear: distance kept from the edge [m].
        prefix: of the names of the visuals.
    """
    room, rng = Polygon(roof), out.rng
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
        for _ in range(30):
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
