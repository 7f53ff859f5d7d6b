"""Reads the geometry of each structure of a loaded world."""

from collections import defaultdict
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from pydrake import geometry as drake
from pydrake.math import RigidTransform

from cns_drake.scene.perception_geometry import (
    PerceptionGeometry,
    list_geometry,
    read_geometry,
)
from cns_drake.scene.structure_names import structure_name
from cns_drake.scene.surfaces import (
    CapsuleSurface,
    EllipsoidSurface,
    HalfSpaceSurface,
    Surface,
    TriangleSurface,
)
from cns_drake.scene.world import World
from worlds.shapes import (
    BoxShape,
    CylinderShape,
    MeshShape,
    PartGeometry,
    Shape,
    SphereShape,
    StructureGeometry,
    triple,
)

# Corners of the box around a round shape of unit size.
_BOX = np.array(
    [(x, y, z) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], float
)
_NO_TRIANGLES = np.zeros((0, 3), np.int32)


@dataclass(frozen=True)
class ScenePart(PartGeometry):
    """One part of a structure, and its geometry in the SceneGraph.

    Attributes:
        geometry: the geometry.
    """

    geometry: PerceptionGeometry


SceneStructure = StructureGeometry[ScenePart]


def geometry_by_structure(
    world: World, wanted: Callable[[str], bool] = lambda name: True
) -> dict[str, SceneStructure]:
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
    inspector = world.scene_graph.model_inspector()
    records = list_geometry(inspector, drake.Role.kPerception)
    found = defaultdict(list)
    for geometry in read_geometry(
        one
        for one in records
        if one.frame_id in X_WFs and wanted(structure_name(one.name))
    ):
        X_WG = X_WFs[geometry.frame_id] @ geometry.X_FG
        entry = world.structures[geometry.structure]
        surface = geometry.surface
        part = ScenePart(
            geometry.part,
            X_WG.GetAsMatrix4(),
            _points_around(surface),
            surface.triangles
            if isinstance(surface, TriangleSurface)
            else _NO_TRIANGLES,
            entry.material(geometry.part),
            geometry.rgb,
            _shape_of_models(inspector.GetShape(geometry.geometry_id)),
            geometry,
        )
        found[geometry.structure].append(part)
    return {
        name: StructureGeometry(world.structures[name], tuple(found[name]))
        for name in sorted(found)
    }


def _points_around(surface: Surface) -> np.ndarray:
    """Returns points (N, 3) in G whose convex hull contains a surface [m].

    There are none around a half space.
    """
    if isinstance(surface, TriangleSurface):
        return surface.p_GVset
    if isinstance(surface, EllipsoidSurface):
        return _BOX * surface.semi_axes
    if isinstance(surface, HalfSpaceSurface):
        return np.zeros((0, 3))
    half = surface.length / 2
    if isinstance(surface, CapsuleSurface):
        half += surface.radius
    return _BOX * (surface.radius, surface.radius, half)


def _shape_of_models(shape: drake.Shape) -> Shape | None:
    """Returns a shape of models that equals a shape of Drake, if one does."""
    if isinstance(shape, drake.Mesh) and shape.source().is_path():
        name = Path(shape.source().path()).stem
        return MeshShape(name, triple(shape.scale3()))
    if isinstance(shape, drake.Box):
        return BoxShape(triple(shape.size()))
    if isinstance(shape, drake.Cylinder):
        return CylinderShape(shape.radius(), shape.length())
    if isinstance(shape, drake.Sphere):
        return SphereShape(shape.radius())
    return None
