"""Porches, and steps in front of doors."""

import numpy as np

from worlds.city.facades import roofs, solids
from worlds.city.facades.wall_frames import WallFrame
from worlds.shapes import Assembly, Mesh, merge_meshes

# Side of the square posts of a porch [m].
_POST_M = 0.16
# Height of a step, approximately [m].
RISER_M = 0.17
# Depth of a step [m].
TREAD_M = 0.29


def steps(x0: float, x1: float, reach: float, rise: float, count: int) -> Mesh:
    """Returns entrance steps that rise towards a wall.

    The mesh is in wall coordinates: x along the wall, y outwards, z up.

    Args:
        x0: left end [m].
        x1: right end [m].
        reach: distance of the lowest step from the wall [m].
        rise: height of the top step [m].
        count: number of treads.
    """
    pieces = []
    for k in range(count):
        y = reach * (count - k) / count
        top = rise * (k + 1) / count
        pieces.append(
            solids.standing(x=(x0, x1), y=(0.0, y), z1=top, bottom=True)
        )
    return merge_meshes(*pieces)


def add_porch(
    out: Assembly,
    wall: WallFrame,
    x0: float,
    x1: float,
    reach: float,
    deck: float,
    eaves: float,
    top: float,
    *,
    roof: str = "shed",
    posts: int = 2,
) -> None:
    """Adds a roofed porch in front of a wall.

    The parts have the materials `trim` and `roof`. The roof extends 0.25 m
    beyond the posts.

    Args:
        out: the building under assembly, which gets the parts.
        wall: the wall.
        x0: left end along the wall [m].
        x1: right end along the wall [m].
        reach: distance of the posts from the wall [m].
        deck: height of the floor [m].
        eaves: height of the underside of the beam on the posts [m].
        top: height of the top of the roof [m].
        roof: `shed`, `gable` (a pediment across the full width) or `flat`.
        posts: number of posts, at least 2.
    """
    pieces = [
        solids.standing(x=(x0, x1), y=(-0.05, reach), z1=deck, bottom=True)
    ]
    y, half = reach - 0.15, _POST_M / 2
    for x in np.linspace(x0 + 0.15, x1 - 0.15, posts).tolist():
        pieces.append(solids.post(x, y, half, z1=eaves + 0.02, z0=deck))
    pieces.append(
        solids.box(x=(x0, x1), y=(y - 0.1, y + 0.1), z=(eaves, eaves + 0.22))
    )
    for x in (x0 + 0.1, x1 - 0.1):
        pieces.append(
            solids.box(
                x=(x - 0.1, x + 0.1), y=(-0.05, y), z=(eaves, eaves + 0.22)
            )
        )
    lid = _porch_roof(x0, x1, reach, eaves + 0.2, top, roof)
    out.add_to("roof", wall.place(lid))
    if roof == "gable":
        z = eaves + 0.2
        line = roofs.gable_line(0.0, x1 - x0, z, top - 0.12)
        shield = roofs.gable_wall(line, 0.0, x1 - x0, z)
        pieces.append(shield.moved((x0, y + 0.08, 0.0)))
    out.add_to("trim", *(wall.place(piece) for piece in pieces))


def add_steps(
    out: Assembly,
    wall: WallFrame,
    x0: float,
    x1: float,
    start: float,
    rise: float,
    room: float = 9.0,
) -> None:
    """Adds steps of the material `base` that lead down and away from a wall.

    Args:
        out: the building under assembly, which gets the parts.
        wall: the wall.
        x0: left end along the wall [m].
        x1: right end along the wall [m].
        start: distance of the top step from the wall [m].
        rise: height of the top step [m].
        room: greatest length of the steps away from the wall [m].
    """
    count = max(1, round(rise / RISER_M))
    run = min(TREAD_M * count, room)
    if run > 0.05 and rise > 0.05:
        flight = steps(x0, x1, run, rise, count)
        out.add_to("base", wall.place(flight.moved((0.0, start, 0.0))))


def _porch_roof(
    x0: float, x1: float, reach: float, z: float, top: float, roof: str
) -> Mesh:
    a, b, out = x0 - 0.15, x1 + 0.15, reach + 0.25
    if roof == "gable":
        line = roofs.gable_line(x0, x1, z + 0.1, top)
        line = roofs.with_eaves(line, 0.2, 0.2)
        return roofs.shell(line, -0.1, out, 0.12, along_y=True)
    if roof == "flat":
        return solids.box(x=(a, b), y=(-0.05, out), z=(z, top))
    line = [(-0.05, top), (out, z + 0.1)]
    return roofs.shell(line, a, b, 0.12)
