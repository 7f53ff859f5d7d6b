"""Surfaces that rays can hit, each in its geometry's frame G."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from pydrake.math import RigidTransform

from evaluation.base import cos, revolved, sin

# Rays are cast in single precision, which cannot resolve a metre beyond this
# [m].
LARGEST_SIZE = 1e7
# If the copies of a mesh have more triangles than this together, the mesh is
# stored once and each copy is an instance. Rays on instances are slower; the
# many small objects of a city stay merged.
MOST_COPIED_TRIANGLES = 2**18


@dataclass(frozen=True)
class TriangleSurface:
    """A surface of triangles.

    Attributes:
        p_GVset: (N, 3) float64 vertices in the geometry frame G [m].
        triangles: (M, 3) int32 indices of vertices, counter-clockwise seen from
            outside.
    """

    p_GVset: np.ndarray
    triangles: np.ndarray


@dataclass(frozen=True)
class EllipsoidSurface:
    """An ellipsoid (or sphere) centred on G, with its axes along the axes of G.

    Attributes:
        semi_axes: half lengths along x, y and z [m].
    """

    semi_axes: tuple[float, float, float]


@dataclass(frozen=True)
class CylinderSurface:
    """A closed cylinder centred on G, its axis along z of G.

    Attributes:
        radius: its radius [m].
        length: its length [m].
    """

    radius: float
    length: float


@dataclass(frozen=True)
class CapsuleSurface:
    """A capsule centred on G, whose axis is the z axis of G.

    Attributes:
        radius: radius of the cylinder and of the two half spheres [m].
        length: length of the cylinder, without the half spheres [m].
    """

    radius: float
    length: float


@dataclass(frozen=True)
class HalfSpaceSurface:
    """The plane z = 0 of G, the boundary of a half space."""


Surface = (
    TriangleSurface
    | EllipsoidSurface
    | CylinderSurface
    | CapsuleSurface
    | HalfSpaceSurface
)


# Number of sides of a round shape in pictures; lamp posts are many and thin.
_SIDES = 12
# The part of an infinite plane that is shown.
_PLANE_CORNERS = np.array(
    [(-100.0, -100.0, 0.0), (100.0, -100.0, 0.0),
     (100.0, 100.0, 0.0), (-100.0, 100.0, 0.0)]
)  # fmt: skip
_PLANE_TRIANGLES = np.array([(0, 1, 2), (0, 2, 3)], np.int32)


def merge_triangles(
    members: Sequence[tuple[int, RigidTransform, TriangleSurface]],
) -> tuple[TriangleSurface, np.ndarray]:
    """Returns the triangles of many geometries in one frame T.

    Args:
        members: an index, the pose X_TG and the surface of each geometry.

    Returns:
        The surface in T; and (M,) int32, for each of the surface's M triangles
        the index that was given with the triangle's geometry.
    """
    surfaces = [surface for *_, surface in members]
    num_vertices = [len(one.p_GVset) for one in surfaces]
    num_triangles = [len(one.triangles) for one in surfaces]
    x, y, z = np.concatenate(
        [np.zeros((0, 3)), *(one.p_GVset for one in surfaces)]
    ).T
    X_TGs = np.reshape([X.GetAsMatrix34() for _, X, _ in members], (-1, 3, 4))
    p_TVset = np.empty((len(x), 3))
    for axis in range(3):
        # In a fixed order: the result of a matrix library depends on the
        # processor.
        a, b, c, d = np.repeat(X_TGs[:, axis].T, num_vertices, axis=1)
        p_TVset[:, axis] = x * a + y * b + z * c + d
    triangles = np.concatenate(
        [np.zeros((0, 3), np.int32), *(one.triangles for one in surfaces)],
        dtype=np.int32,
    )
    first = np.cumsum([0, *num_vertices[:-1]])[: len(surfaces)]
    triangles += np.repeat(first, num_triangles).astype(np.int32)[:, None]
    owners = np.array([index for index, *_ in members], np.int32)
    return TriangleSurface(p_TVset, triangles), np.repeat(owners, num_triangles)


def tessellate(surface: Surface, sides: int = _SIDES) -> TriangleSurface:
    """Returns any surface as triangles, with their corners on the surface.

    A plane becomes a square of 200 m centred on G. A circle around the z axis
    of G has `sides` sides; a half sphere has half as many circles of latitude.
    """
    if isinstance(surface, TriangleSurface):
        return surface
    if isinstance(surface, HalfSpaceSurface):
        return TriangleSurface(_PLANE_CORNERS, _PLANE_TRIANGLES)
    angle = np.linspace(0.0, np.pi / 2.0, sides // 2 + 1)
    radius, z = sin(angle), cos(angle)
    z[-1] = 0.0
    if isinstance(surface, EllipsoidSurface):
        corners, triangles = revolved(radius, z, sides)
        return TriangleSurface(corners * surface.semi_axes, triangles)
    half = surface.length / 2.0
    if isinstance(surface, CylinderSurface):
        radius, z = np.array([surface.radius]), np.array([half])
    else:
        radius = surface.radius * radius
        z = surface.radius * z + half
    return TriangleSurface(*revolved(radius, z, sides))


def is_closed(surface: Surface) -> bool:
    """Returns whether a surface encloses a volume.

    A surface of triangles is closed if each edge belongs to an even number of
    triangles. Edges are compared by the positions of their ends.
    """
    if isinstance(surface, HalfSpaceSurface):
        return False
    if not isinstance(surface, TriangleSurface):
        return True
    _, place = np.unique(
        np.round(surface.p_GVset, 6), axis=0, return_inverse=True
    )
    corners = np.reshape(place, -1)[surface.triangles]
    edges = np.sort(
        np.concatenate(
            [corners[:, [0, 1]], corners[:, [1, 2]], corners[:, [2, 0]]]
        ),
        axis=1,
    )
    _, count = np.unique(edges, axis=0, return_counts=True)
    return bool(len(edges) > 0 and np.all(count % 2 == 0))
