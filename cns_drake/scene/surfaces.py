"""Surfaces that rays can meet, each in its geometry frame G, as triangles."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from pydrake.math import RigidTransform
from scipy.spatial import ConvexHull

# Rays are cast in single precision, which cannot resolve a metre beyond this
# [m].
LARGEST_SIZE = 1e7


@dataclass(frozen=True)
class TriangleSurface:
    """Triangles in the geometry frame G.

    Attributes:
        p_GVset: (N, 3) float64 vertex positions [m].
        triangles: (M, 3) int32 vertex indices, counter-clockwise seen from
            outside.
    """

    p_GVset: np.ndarray
    triangles: np.ndarray


@dataclass(frozen=True)
class EllipsoidSurface:
    """An ellipsoid (or sphere) centred on G with semi-axes along G's."""

    semi_axes: tuple[float, float, float]

    @property
    def is_sphere(self) -> bool:
        return len(set(self.semi_axes)) == 1


@dataclass(frozen=True)
class CylinderSurface:
    """A closed cylinder centred on G, its axis along z of G."""

    radius: float
    length: float


@dataclass(frozen=True)
class CapsuleSurface:
    """A capsule centred on G; `length` is that of the cylindrical part."""

    radius: float
    length: float


@dataclass(frozen=True)
class HalfSpaceSurface:
    """The plane z = 0 of G, which bounds a half space."""


Surface = (
    TriangleSurface
    | EllipsoidSurface
    | CylinderSurface
    | CapsuleSurface
    | HalfSpaceSurface
)


# Sides of a round shape in pictures; lamp posts are many and thin.
_SIDES = 12
# The shown part of an endless plane.
_PLANE_CORNERS = np.array(
    [(-100.0, -100.0, 0.0), (100.0, -100.0, 0.0),
     (100.0, 100.0, 0.0), (-100.0, 100.0, 0.0)]
)  # fmt: skip
_PLANE_TRIANGLES = np.array([(0, 1, 2), (0, 2, 3)], np.int32)


def merge_triangles(
    members: Sequence[tuple[int, RigidTransform, TriangleSurface]],
) -> tuple[TriangleSurface, np.ndarray]:
    """Returns triangles in one frame T, and their owners.

    Args:
        members: index, pose X_TG and surface of each.

    Returns:
        The surface in T, and the (M,) int32 index of each of its triangles.
    """
    vertices: list[np.ndarray] = [np.zeros((0, 3))]
    triangles: list[np.ndarray] = [np.zeros((0, 3), np.int32)]
    owners = [np.zeros(0, np.int32)]
    num_vertices = 0
    for index, X_TG, surface in members:
        vertices.append(
            surface.p_GVset @ X_TG.rotation().matrix().T + X_TG.translation()
        )
        triangles.append(surface.triangles + np.int32(num_vertices))
        owners.append(np.full(len(surface.triangles), index, np.int32))
        num_vertices += len(surface.p_GVset)
    merged = TriangleSurface(
        np.concatenate(vertices), np.concatenate(triangles, dtype=np.int32)
    )
    return merged, np.concatenate(owners)


def tessellate(surface: Surface, sides: int = _SIDES) -> TriangleSurface:
    """Returns triangles for any surface, inscribed where it is curved.

    Args:
        surface: the shape; of a plane, a square of 200 m about G.
        sides: number of sides of a circle about the z axis of G; a half sphere
            has half as many parallels.
    """
    if isinstance(surface, TriangleSurface):
        return surface
    if isinstance(surface, HalfSpaceSurface):
        return TriangleSurface(_PLANE_CORNERS, _PLANE_TRIANGLES)
    angle = np.linspace(0.0, np.pi / 2.0, sides // 2 + 1)
    radius, z = np.sin(angle), np.cos(angle)
    z[-1] = 0.0
    if isinstance(surface, EllipsoidSurface):
        unit = _revolved(radius, z, sides)
        return TriangleSurface(unit.p_GVset * surface.semi_axes, unit.triangles)
    half = surface.length / 2.0
    if isinstance(surface, CylinderSurface):
        return _revolved(np.array([surface.radius]), np.array([half]), sides)
    if isinstance(surface, CapsuleSurface):
        r = surface.radius
        return _revolved(r * radius, r * z + half, sides)
    raise TypeError(f"no triangles for {type(surface).__name__}")


def _revolved(radius: np.ndarray, z: np.ndarray, sides: int) -> TriangleSurface:
    """Returns the convex hull of circles about z, mirrored at z = 0.

    Args:
        radius, z: (N,) radii and heights of the circles, z >= 0 [m].
        sides: number of sides of each circle.
    """
    angle = 2.0 * np.pi * np.arange(sides)[:, None] / sides
    xyz = radius * np.cos(angle), radius * np.sin(angle), z
    upper = np.stack(np.broadcast_arrays(*xyz), axis=-1).reshape(-1, 3)
    vertices = np.unique(np.concatenate([upper, upper * (1, 1, -1)]), axis=0)
    hull = ConvexHull(vertices)
    triangles = hull.simplices.astype(np.int32)
    a, b, c = np.moveaxis(vertices[triangles], 1, 0)
    outward = np.cross(b - a, c - a) * hull.equations[:, :3]
    is_inside_out = outward.sum(axis=1) < 0.0
    triangles[is_inside_out] = triangles[is_inside_out, ::-1]
    return TriangleSurface(vertices, triangles)
