"""The geometry of each structure of a world, as a LiDAR sees it."""

from dataclasses import dataclass
from functools import cached_property
from typing import Generic, TypeVar, cast

import numpy as np
import shapely

from evaluation.base import product
from worlds.shapes.materials import Material
from worlds.shapes.models import Shape
from worlds.shapes.polygons import Area
from worlds.shapes.structure_table import StructureEntry

# Cars and people can pass below parts that are higher than this above a
# structure's foot [m].
_HEADROOM = 2.2


@dataclass(frozen=True)
class PartGeometry:
    """The geometry of one part of a structure in a world.

    Attributes:
        name: the part's name within its structure.
        X_WG: (4, 4) pose of the geometry G in W.
        p_GPs: (N, 3) points in G whose convex hull contains the part [m].
        triangles: (M, 3) indices of these points; M is 0 for a curved surface.
        material: material of the part.
        rgb: colour; None if the part has none of its own.
        shape: the same geometry as a shape of models; None if these have no
            shape of its kind.
    """

    name: str
    X_WG: np.ndarray
    p_GPs: np.ndarray
    triangles: np.ndarray
    material: Material
    rgb: tuple[float, float, float] | None
    shape: Shape | None

    @cached_property
    def p_WPs(self) -> np.ndarray:
        """Points (N, 3) in W whose convex hull contains the part [m]."""
        return product(self.p_GPs, self.X_WG[:3, :3].T) + self.X_WG[:3, 3]

    @property
    def triangle_corners(self) -> np.ndarray:
        """Corners (M, 3, 3) of the part's triangles in W [m]."""
        return self.p_WPs[self.triangles]


AnyPart = TypeVar("AnyPart", bound=PartGeometry, covariant=True)


@dataclass(frozen=True)
class StructureGeometry(Generic[AnyPart]):
    """The geometry of one structure in a world.

    This is what a LiDAR can see of the structure. What the structure is, its
    entry in the world's structure table says.

    Attributes:
        entry: entry of the structure in the world's structure table.
        parts: geometry of each part of the structure.
    """

    entry: StructureEntry
    parts: tuple[AnyPart, ...]

    @property
    def name(self) -> str:
        """Name of the structure."""
        return self.entry.name

    @property
    def semantic_class(self) -> str:
        """Class of the structure, a key of `semantics.CLASS_IDS`."""
        return self.entry.semantic_class

    @property
    def kind(self) -> str:
        """What the structure is, such as `row_house` or `bench`."""
        return self.entry.kind

    @cached_property
    def p_WPs(self) -> np.ndarray:
        """Points (N, 3) in W whose convex hull contains the structure [m]."""
        return np.concatenate([part.p_WPs for part in self.parts])

    @cached_property
    def bottom(self) -> float:
        """Height of the structure's lowest point in W [m]."""
        return float(self.p_WPs[:, 2].min(initial=np.inf))

    @cached_property
    def top(self) -> float:
        """Height of the structure's highest point in W [m]."""
        return float(self.p_WPs[:, 2].max(initial=self.bottom))

    @cached_property
    def outline(self) -> Area:
        """The convex hull of the whole structure, seen from above [m]."""
        return _hull(self.p_WPs)

    @cached_property
    def footprint(self) -> Area:
        """The convex hull of the parts near the ground, seen from above [m]."""
        p_WPs = self.p_WPs
        return _hull(p_WPs[p_WPs[:, 2] <= self.bottom + _HEADROOM])


def _hull(p_WPs: np.ndarray) -> Area:
    points = shapely.multipoints(p_WPs[:, :2])
    return cast(Area, shapely.convex_hull(points))
