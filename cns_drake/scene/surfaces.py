"""Surfaces that rays can meet, each in its geometry frame G."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

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
