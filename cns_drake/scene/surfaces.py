"""Surfaces that rays can meet, each in its geometry frame G, as triangles."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from pydrake.math import RigidTransform

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
    if isinstance(surface, EllipsoidSurface):
        radius, z = _arc(sides // 2)
        unit = _revolve(
            np.concatenate([radius, radius[-2::-1]]),
            np.concatenate([z, -z[-2::-1]]),
            sides,
        )
        return TriangleSurface(unit.p_GVset * surface.semi_axes, unit.triangles)
    half = surface.length / 2.0
    if isinstance(surface, CylinderSurface):
        r = surface.radius
        z = np.array([1, 1, -1, -1]) * half
        return _revolve(np.array([0, r, r, 0]), z, sides)
    if isinstance(surface, CapsuleSurface):
        radius, z = _arc(sides // 2)
        radius, z = radius * surface.radius, z * surface.radius + half
        return _revolve(
            np.concatenate([radius, radius[::-1]]),
            np.concatenate([z, -z[::-1]]),
            sides,
        )
    raise TypeError(f"no triangles for {type(surface).__name__}")


def _arc(num_steps: int) -> tuple[np.ndarray, np.ndarray]:
    """Returns radius and z of the unit circle from the pole to z = 0."""
    angle = np.linspace(0.0, np.pi / 2.0, num_steps + 1)
    return np.sin(angle), np.cos(angle)


def _revolve(radius: np.ndarray, z: np.ndarray, sides: int) -> TriangleSurface:
    """Returns the surface that a profile sweeps about z.

    Args:
        radius: (N,) radii from the upper to the lower pole, both of which
            have radius zero [m].
        z: (N,) heights [m].
        sides: number of sides of each circle.
    """
    angle = 2.0 * np.pi * np.arange(sides) / sides
    circle = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    inner = range(1, len(radius) - 1)
    vertices = [np.array([(0.0, 0.0, z[0])])]
    vertices += [
        np.column_stack([radius[i] * circle, np.full(len(circle), z[i])])
        for i in inner
    ]
    vertices += [np.array([(0.0, 0.0, z[-1])])]

    first = np.arange(sides)
    second = (first + 1) % sides
    upper_ring, lower_pole = 1, 1 + len(inner) * sides
    triangles = [
        np.column_stack(
            [np.zeros_like(first), upper_ring + first, upper_ring + second]
        )
    ]
    for _ in inner[:-1]:
        lower_ring = upper_ring + sides
        a, b = upper_ring + first, upper_ring + second
        c, d = lower_ring + first, lower_ring + second
        triangles += [np.column_stack([a, c, d]), np.column_stack([a, d, b])]
        upper_ring = lower_ring
    triangles.append(
        np.column_stack(
            [
                np.full_like(first, lower_pole),
                upper_ring + second,
                upper_ring + first,
            ]
        )
    )
    return TriangleSurface(
        np.concatenate(vertices),
        np.concatenate(triangles).astype(np.int32),
    )
