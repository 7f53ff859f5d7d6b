"""What stands on roofs: shared meshes, and where they go.

These meshes have fixed names and shapes, shared by all buildings of a city;
parts vary them by scale and heading. Each stands on z = 0, chimneys in it.
"""

from __future__ import annotations

from collections.abc import Sequence
import functools
import math

import numpy as np
from shapely.geometry import Point, Polygon

from cns_drake.city.buildings.parts import massing
from cns_drake.city.buildings.parts.site import Assembly, Rgb
from cns_drake.city.geometry.mesh import Mesh, box_mesh, boxes, merge_meshes
from cns_drake.city.geometry.structures import MeshShape


def _ac_unit() -> Mesh:
    fans = [
        massing.prism(massing.regular_polygon(0.42, 8, (x, 0.0)), 1.3, 1.5)
        for x in (-0.6, 0.6)
    ]
    skids = boxes((2.6, 0.15, 0.25), (0.0,), (-0.5, 0.5), (0.125,))
    return merge_meshes(box_mesh((2.4, 1.4, 1.1), (0, 0, 0.75)), *fans, *skids)


def _air_handler() -> Mesh:
    """A long unit with an intake hood and a duct that dives into the roof."""
    return merge_meshes(
        box_mesh((4.2, 1.8, 1.7), (0, 0, 1.05)),
        box_mesh((0.9, 1.5, 0.9), (-2.5, 0, 1.2)),
        box_mesh((1.4, 0.8, 0.8), (2.7, 0, 1.3)),
        box_mesh((0.8, 0.8, 1.7), (3.2, 0, 0.85)),
        box_mesh((4.0, 0.2, 0.2), (0, 0.7, 0.1)),
        box_mesh((4.0, 0.2, 0.2), (0, -0.7, 0.1)),
    )


def _cooling_tower() -> Mesh:
    ring = massing.regular_polygon(1.1, 10)
    legs = boxes((0.2, 0.2, 0.4), (-1.2, 1.2), (-1.2, 1.2), (0.2,))
    foot, head = massing.square(0.0, 0.0, 1.3), massing.square(0.0, 0.0, 1.15)
    return merge_meshes(
        box_mesh((2.8, 2.8, 0.3), (0, 0, 0.55)),
        *legs,
        massing.frustum(foot, head, 0.7, 2.6),
        massing.roof_pan(ring, 2.7, 3.3, 0.12),
        massing.skirt(ring, ring, 2.6, 3.3),
    )


def _water_tower() -> Mesh:
    """A barrel under a cone on four braced legs."""
    barrel = massing.regular_polygon(1.9, 12)
    eaves = massing.regular_polygon(2.1, 12)
    sides = (-1.15, 1.15)
    legs = boxes((0.22, 0.22, 3.6), sides, sides, (1.8,))
    for z in (1.2, 2.4):
        legs += boxes((2.3, 0.1, 0.14), (0,), sides, (z,))
        legs += boxes((0.1, 2.3, 0.14), sides, (0,), (z,))
    return merge_meshes(
        *legs,
        box_mesh((3.2, 3.2, 0.25), (0, 0, 3.6)),
        massing.prism(barrel, 3.7, 7.0, bottom=True),
        massing.spire(eaves, (0, 0), 7.0, 8.4),
        massing.flat(eaves, 7.0, up=False),
    )


def _stair_house() -> Mesh:
    """A roof exit under a slanted lid, with its door."""
    side = np.array([(-1.4, 0.0), (1.4, 0.0), (1.4, 2.9), (-1.4, 1.9)])
    walls = []
    for y, order in ((-1.3, 1), (1.3, -1)):
        v = np.column_stack([side[:, 0], np.full(4, y), side[:, 1]])
        walls.append(Mesh(v[::order], ((0, 1, 2, 3),)))
    v = np.array([(x, y, z) for y in (-1.3, 1.3) for x, z in side], dtype=float)
    band = Mesh(v, ((1, 5, 6, 2), (2, 6, 7, 3), (3, 7, 4, 0)))
    door = box_mesh((0.12, 1.1, 2.1), (1.4, 0, 1.05))
    return merge_meshes(*walls, band, door)


def _lift_house() -> Mesh:
    return merge_meshes(
        box_mesh((5.0, 4.0, 3.4), (0, 0, 1.7)),
        box_mesh((5.4, 4.4, 0.25), (0, 0, 3.5)),
        box_mesh((0.12, 1.2, 2.1), (2.5, 0.8, 1.05)),
        box_mesh((1.6, 0.15, 1.0), (-0.8, -2.0, 2.2)),
        box_mesh((1.6, 0.15, 1.0), (-0.8, 2.0, 2.2)),
    )


def _tank() -> Mesh:
    body = massing.regular_polygon(1.2, 10)
    return merge_meshes(
        massing.prism(body, 0.3, 2.3, bottom=True),
        box_mesh((2.2, 0.3, 0.3), (0, 0.6, 0.15)),
        box_mesh((2.2, 0.3, 0.3), (0, -0.6, 0.15)),
        massing.prism(massing.regular_polygon(0.35, 6), 2.3, 2.6),
    )


def _mast() -> Mesh:
    """A slender stepped aerial with cross arms, 12 m."""
    stages = []
    for z0, z1, r in ((0.0, 4.5, 0.28), (4.5, 8.5, 0.18), (8.5, 12.0, 0.09)):
        stages.append(massing.prism(massing.regular_polygon(r, 6), z0, z1))
    arms = [
        box_mesh((1.6, 0.08, 0.08), (0, 0, 5.2)),
        box_mesh((0.08, 1.6, 0.08), (0, 0, 6.4)),
        box_mesh((1.0, 0.06, 0.06), (0, 0, 9.6)),
    ]
    return merge_meshes(*stages, *arms)


def _skylight() -> Mesh:
    curb = massing.rectangle(-2.0, -1.0, 2.0, 1.0)
    return merge_meshes(
        massing.skirt(curb, curb, 0.0, 0.4),
        massing.gable_roof(-2.0, -1.0, 2.0, 1.0, 0.4, 0.7),
    )


def _vents() -> Mesh:
    pieces = []
    for k, x in enumerate((-0.9, 0.0, 0.9)):
        pipe = massing.regular_polygon(0.16, 6, (x, 0.2 * (k % 2)))
        cap = massing.regular_polygon(0.3, 6, (x, 0.2 * (k % 2)))
        z = 0.7 + 0.15 * k
        pieces += [
            massing.skirt(pipe, pipe, 0.0, z),
            massing.prism(cap, z, z + 0.2, bottom=True),
        ]
    return merge_meshes(*pieces)


def _dish() -> Mesh:
    """A satellite dish looking up at 45 degrees."""
    rim = massing.regular_polygon(0.9, 10)
    front = massing.spire(rim[::-1], (0, 0), 0.0, -0.3)
    back = massing.spire(rim, (0, 0), 0.0, -0.38)
    back = Mesh(back.vertices, tuple(f[::-1] for f in back.faces))
    front = Mesh(front.vertices, tuple(f[::-1] for f in front.faces))
    bowl = merge_meshes(front, back)
    c = s = math.sqrt(0.5)
    tilt = np.array([[c, 0.0, s], [0.0, 1.0, 0.0], [-s, 0.0, c]])
    bowl = Mesh(bowl.vertices @ tilt.T + (0.15, 0.0, 1.5), bowl.faces)
    return merge_meshes(
        bowl, massing.prism(massing.regular_polygon(0.08, 6), 0.0, 1.35)
    )


def _chimney() -> Mesh:
    """A brick stack with a corbelled head and two pots, up to 2.4 m."""
    pots = [
        massing.prism(massing.regular_polygon(0.13, 6, (x, 0.0)), 2.1, 2.4)
        for x in (-0.2, 0.2)
    ]
    return merge_meshes(
        massing.skirt(_CHIMNEY_PLAN, _CHIMNEY_PLAN, -_ROOT_M, 1.8),
        massing.box(-0.52, 0.52, -0.34, 0.34, 1.8, 2.1),
        *pots,
    )


def _chimney_row() -> Mesh:
    """A wide stack that two houses share, with five pots, up to 2.3 m."""
    pots = [
        massing.prism(massing.regular_polygon(0.12, 6, (x, 0.0)), 2.0, 2.3)
        for x in np.linspace(-0.8, 0.8, 5).tolist()
    ]
    body = massing.rectangle(-1.0, -0.28, 1.0, 0.28)
    return merge_meshes(
        massing.skirt(body, body, -_ROOT_M, 1.7),
        massing.box(-1.08, 1.08, -0.36, 0.36, 1.7, 2.0),
        *pots,
    )


# Chimneys reach this far below their foot, into the slope that they stand on
# [m].
_ROOT_M = 1.5
_CHIMNEY_PLAN = massing.rectangle(-0.44, -0.26, 0.44, 0.26)

_MAKERS = {
    "chimney": (_chimney, 0.6),
    "chimney_row": (_chimney_row, 1.1),
    "ac_unit": (_ac_unit, 1.6),
    "air_handler": (_air_handler, 3.8),
    "cooling_tower": (_cooling_tower, 2.2),
    "water_tower": (_water_tower, 2.3),
    "stair_house": (_stair_house, 2.1),
    "lift_house": (_lift_house, 3.6),
    "tank": (_tank, 1.4),
    "mast": (_mast, 0.9),
    "skylight": (_skylight, 2.4),
    "vents": (_vents, 1.3),
    "dish": (_dish, 1.1),
}


@functools.cache
def _mesh(item: str) -> Mesh:
    return _MAKERS[item][0]()


def _shared(
    out: Assembly, item: str, scale: tuple[float, float, float]
) -> MeshShape:
    """Returns the shape of an item, whose mesh all buildings share."""
    name = f"roof_{item}"
    out.share(name, _mesh(item))
    return MeshShape(name, scale)


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
    out.place(part, _shared(out, item, scale), xyz, yaw, rgb=rgb)


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
        items: names of `_MAKERS`, the most important first.
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
        radius = _MAKERS[item][1] * max(scale, stretch)
        free = room.buffer(-radius - clear)
        for _ in range(30):
            x, y = rng.uniform(x0, x1), rng.uniform(y0, y1)
            fits = all(
                math.hypot(x - a, y - b) > radius + r for a, b, r in taken
            )
            if fits and free.contains(Point(x, y)):
                taken.append((x, y, radius))
                shape = _shared(out, item, (stretch, scale, scale))
                part = f"{prefix}roof_{number:02d}"
                out.place(part, shape, (x, y, z), turn)
                break
