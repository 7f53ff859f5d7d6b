"""The geometry of each structure in a loaded world, as a LiDAR sees it."""

from collections import defaultdict
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import cast

import numpy as np
from pydrake.geometry import Role
from pydrake.math import RigidTransform
import shapely
from shapely.geometry.base import BaseGeometry

from cns_drake.scene import (
    CapsuleSurface,
    CylinderSurface,
    EllipsoidSurface,
    HalfSpaceSurface,
    PerceptionGeometry,
    TriangleSurface,
    World,
    list_geometry,
    read_geometry,
    structure_name,
)
from evaluation.base import product
from worlds.shapes import (
    Material,
    StructureEntry,
)

# Cars and people can pass below parts that are higher than this above a
# structure's foot [m].
_HEADROOM = 2.2
# Corners of the box around a round shape of unit size.
_BOX = np.array(
    [(x, y, z) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], float
)


@dataclass(frozen=True)
class PartGeometry:
    """The geometry of one part of a structure in a loaded world.

    Attributes:
        geometry: the geometry G.
        X_WG: pose of G in W.
        material: material of the part.
    """

    geometry: PerceptionGeometry
    X_WG: RigidTransform
    material: Material

    @property
    def name(self) -> str:
        """The part's name within its structure."""
        return self.geometry.part

    @cached_property
    def p_WPs(self) -> np.ndarray:
        """Points (N, 3) in W whose convex hull contains the part [m]."""
        surface = self.geometry.surface
        if isinstance(surface, TriangleSurface):
            p_GPs = surface.p_GVset
        elif isinstance(surface, EllipsoidSurface):
            p_GPs = _BOX * surface.semi_axes
        elif isinstance(surface, CylinderSurface | CapsuleSurface):
            r = surface.radius
            half = surface.length / 2
            if isinstance(surface, CapsuleSurface):
                half += r
            p_GPs = _BOX * (r, r, half)
        else:
            assert isinstance(surface, HalfSpaceSurface)
            p_GPs = np.zeros((0, 3))
        R, p = self.X_WG.rotation().matrix(), self.X_WG.translation()
        return product(p_GPs, R.T) + p


@dataclass(frozen=True)
class StructureGeometry:
    """The geometry of one structure in a loaded world.

    This is what a LiDAR can see of the structure. What the structure is, its
    entry in the world's structure table says.

    Attributes:
        entry: entry of the structure in the world's structure table.
        parts: geometry of each part of the structure.
    """

    entry: StructureEntry
    parts: tuple[PartGeometry, ...]

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
    def outline(self) -> BaseGeometry:
        """The convex hull of the whole structure, seen from above [m]."""
        return _hull(self.p_WPs)

    @cached_property
    def footprint(self) -> BaseGeometry:
        """The convex hull of the parts near the ground, seen from above [m]."""
        p_WPs = self.p_WPs
        return _hull(p_WPs[p_WPs[:, 2] <= self.bottom + _HEADROOM])


def _hull(p_WPs: np.ndarray) -> BaseGeometry:
    points = shapely.multipoints(p_WPs[:, :2])
    return cast(BaseGeometry, shapely.convex_hull(points))


def geometry_by_structure(
    world: World, wanted: Callable[[str], bool] = lambda name: True
) -> dict[str, StructureGeometry]:
    """Returns the geometry of a world's static structures, by name.

    The names are sorted.

    Args:
        world: the world, not yet part of a diagram.
        wanted: function that returns whether the structure with a name is
            wanted; by default all structures are wanted.

    Raises:
        InputError: a mesh cannot be read.
    """
    plant = world.plant
    context = plant.CreateDefaultContext()
    X_WFs = {
        frame: plant.GetBodyFromFrameId(frame).EvalPoseInWorld(context)
        for frame in world.anchored_frames()
    }
    X_WFs[world.scene_graph.world_frame_id()] = RigidTransform()
    records = list_geometry(
        world.scene_graph.model_inspector(), Role.kPerception
    )
    found = defaultdict(list)
    for geometry in read_geometry(
        one
        for one in records
        if one.frame_id in X_WFs and wanted(structure_name(one.name))
    ):
        X_WG = X_WFs[geometry.frame_id] @ geometry.X_FG
        entry = world.structures[geometry.structure]
        part = PartGeometry(geometry, X_WG, entry.material(geometry.part))
        found[geometry.structure].append(part)
    return {
        name: StructureGeometry(world.structures[name], tuple(found[name]))
        for name in sorted(found)
    }


def triangle_corners(part: PartGeometry) -> np.ndarray:
    """Returns the corners (M, 3, 3) of a part's triangles in W [m].

    A part with a curved surface has no triangles.
    """
    surface = part.geometry.surface
    if not isinstance(surface, TriangleSurface):
        return np.zeros((0, 3, 3))
    return part.p_WPs[surface.triangles]
