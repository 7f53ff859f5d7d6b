"""Reliefs of walls: what protrudes from a wall or lies behind its surface.

Bands and reliefs are given in panel coordinates: x along the wall from left to
right, as seen from outside, z up, and depth inwards. What has a negative depth
protrudes.
"""

from typing import NamedTuple, TypeVar


class Band(NamedTuple):
    """A strip of wall that runs around the building at one depth [m].

    The band extends from the height z0 to the height z1, and protrudes if the
    depth is negative.
    """

    z0: float
    z1: float
    depth: float


def foot_band(height: float, reach: float) -> Band:
    """Returns the band at the foot of a wall, such as a plinth.

    The band is `height` high, and protrudes by `reach` [m].
    """
    return Band(0.0, height, -reach)


def top_band(wall_height: float, height: float, reach: float) -> Band:
    """Returns the band at the top of a wall, such as a coping.

    Args:
        wall_height: height of the wall [m].
        height: height of the band [m].
        reach: how far the band protrudes [m].
    """
    return Band(wall_height - height, wall_height, -reach)


class Patch(NamedTuple):
    """A rectangle of the wall, pushed in by `depth` [m].

    The patch extends from x0 to x1 along the wall, and from the height z0 to
    z1. If the depth is negative, the patch protrudes.
    """

    x0: float
    x1: float
    z0: float
    z1: float
    depth: float


class Arch(NamedTuple):
    """A recess [m] with a round head: half an ellipse from z_spring to z1.

    The recess extends from x0 to x1 along the wall, and begins at the height
    z0. The recess must lie where the wall has depth 0, and no later relief may
    cover it.
    """

    x0: float
    x1: float
    z0: float
    z_spring: float
    z1: float
    depth: float


Relief = Patch | Arch
_Strip = TypeVar("_Strip", Band, Relief)


def lifted(item: _Strip, dz: float) -> _Strip:
    """Returns a band or a relief raised by `dz` [m]."""
    moved = {
        name: getattr(item, name) + dz
        for name in item._fields
        if name.startswith("z")
    }
    return item._replace(**moved)
