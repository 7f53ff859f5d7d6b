"""Canopies and awnings, in the coordinates of their wall."""

from collections.abc import Iterable, Sequence
import math
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from worlds.city.facades import bays, solids
from worlds.city.facades.building import Building
from worlds.city.facades.wall_frames import WallFrame
from worlds.shapes import Mesh, box_mesh, merge_meshes


def canopy(x0: float, x1: float, reach: float, z: float) -> Mesh:
    """Returns a flat canopy with a fascia, hung on two slanted rods.

    The mesh is in wall coordinates [m]. The canopy extends from x0 to x1 along
    the wall, and by `reach` out of the wall; the underside of the canopy is at
    the height `z`.
    """
    rods = [
        solids.beam((x, 0.05, z + 1.2), (x, reach - 0.3, z + 0.3), 0.08)
        for x in (x0 + 0.4, x1 - 0.4)
    ]
    slab = box_mesh((x1 - x0, reach, 0.3), ((x0 + x1) / 2, reach / 2, z + 0.15))
    return merge_meshes(slab, *rods)


def front_canopy(
    outline: ArrayLike, half: float, reach: float, z: float
) -> Mesh:
    """Returns a canopy above a door in the middle of the front wall.

    The mesh is in the building's frame.

    Args:
        outline: (N, 2) corners of the walls [m]; the front is the first edge.
        half: half the width of the canopy [m].
        reach: how far the canopy extends out of the wall [m].
        z: height of the canopy's underside [m].
    """
    front = WallFrame(outline, 0)
    middle = front.length / 2
    return front.place(canopy(middle - half, middle + half, reach, z))


def awning(x0: float, x1: float, reach: float, z0: float, z1: float) -> Mesh:
    """Returns a sloped shop awning with a hanging front edge.

    The mesh is in wall coordinates: x along the wall, y outwards, z up.

    Args:
        x0: left end [m].
        x1: right end [m].
        reach: how far it reaches out of the wall [m].
        z0: lower edge of the front [m].
        z1: height at the wall [m].
    """
    lip = 0.25
    profile = [(0.0, z1), (reach, z0 + lip), (reach, z0), (0.0, z1 - 0.12)]
    vertices = [(x, y, z) for x in (x0, x1) for y, z in profile]
    faces: list[tuple[int, ...]]
    faces = [(k, (k + 1) % 4, 4 + (k + 1) % 4, 4 + k) for k in range(4)]
    faces += [(3, 2, 0), (2, 1, 0), (4, 5, 6), (4, 6, 7)]
    return Mesh(np.array(vertices), tuple(faces)).inside_out()


class AwningShape(NamedTuple):
    """The lengths of the awnings along a wall [m].

    Attributes:
        narrower: how much narrower an awning is than its shop, on each side.
        reach: how far an awning reaches out of the wall.
        z0: height of the lower edge.
        z1: height at the wall.
    """

    narrower: float
    reach: float
    z0: float
    z1: float


def awnings(
    wall: WallFrame,
    cells: Iterable[bays.Span],
    rng: np.random.Generator,
    share: float,
    shape: AwningShape,
    door: float = -math.inf,
) -> list[Mesh]:
    """Returns awnings above some of the shops along a wall.

    Args:
        wall: the wall.
        cells: start and end of each shop along the wall [m].
        rng: random generator that chooses the shops with an awning.
        share: probability that a shop has an awning.
        shape: lengths of the awnings.
        door: half the width of the stretch for the door in the middle of the
            wall [m]. Shops that reach into this stretch get no awning. By
            default there is no stretch for a door.
    """
    narrower, reach, z0, z1 = shape
    middle = wall.length / 2
    pieces = []
    for a, b in cells:
        free = b < middle - door or a > middle + door
        if rng.random() < share and free:
            shade = awning(a + narrower, b - narrower, reach, z0, z1)
            pieces.append(wall.place(shade))
    return pieces


def add_awnings(building: Building, pieces: Sequence[Mesh]) -> None:
    """Adds awnings to a building, all in the same random colour.

    `pieces` contains the awnings in the building's frame. Without awnings,
    nothing is added.
    """
    if pieces:
        finish = building.pick(building.kind.choices["awnings"])
        building.add("awnings", *pieces, finish=finish)
