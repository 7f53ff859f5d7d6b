"""What a LiDAR can see: the perception geometry that a SceneGraph holds."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from pydrake.geometry import (
    Box,
    Capsule,
    Cylinder,
    Ellipsoid,
    FrameId,
    GeometryId,
    Mesh,
    Role,
    SceneGraphInspector,
    Shape,
    Sphere,
)
from pydrake.math import RigidTransform

from cns_drake.scene.foreign_meshes import ForeignMeshes
from cns_drake.scene.mesh_files import MeshFiles
from cns_drake.scene.surfaces import (
    LARGEST_SIZE,
    CapsuleSurface,
    CylinderSurface,
    EllipsoidSurface,
    Surface,
    TriangleSurface,
)
from evaluation.support.errors import InputError

# The corners of a unit cube and its faces, counter-clockwise from outside.
_CUBE_CORNERS = np.array(
    [(x, y, z) for z in (-0.5, 0.5) for y in (-0.5, 0.5) for x in (-0.5, 0.5)]
)
_CUBE_TRIANGLES = np.array(
    [
        (0, 2, 3), (0, 3, 1), (4, 5, 7), (4, 7, 6), (0, 1, 5), (0, 5, 4),
        (2, 6, 7), (2, 7, 3), (0, 4, 6), (0, 6, 2), (1, 3, 7), (1, 7, 5),
    ]
)  # fmt: skip


@dataclass(frozen=True)
class PerceptionGeometry:
    """One geometry of `Role.kPerception`.

    Attributes:
        geometry_id: its id in the SceneGraph.
        name: scoped name, `<model>::<visual>`.
        frame_id: the frame F on which it is fixed.
        X_FG: its pose in F.
        surface: its shape in G.
        rgb: diffuse colour, None where the model gives none.
    """

    geometry_id: GeometryId
    name: str
    frame_id: FrameId
    X_FG: RigidTransform
    surface: Surface
    rgb: tuple[float, float, float] | None

    @property
    def structure(self) -> str:
        return structure_name(self.name)


def structure_name(geometry_name: str) -> str:
    """Returns the name of the structure that a geometry belongs to.

    A visual named `tower_017/storey_03` belongs to `tower_017`; a visual
    without a slash belongs to the model that it is in.
    """
    model, _, visual = geometry_name.rpartition("::")
    structure, slash, _ = visual.partition("/")
    if slash:
        return structure
    return model.rpartition("::")[2] or visual


def check_shape(name: str, shape: Shape) -> None:
    """Checks that rays can be cast on a shape, and that its size is sane.

    Args:
        name: of the geometry.
        shape: its shape.

    Raises:
        InputError: they cannot; the geometry is named.
    """
    if not isinstance(shape, (Box, Sphere, Ellipsoid, Cylinder, Capsule, Mesh)):
        raise InputError(
            f"geometry '{name}': a LiDAR cannot see a {type(shape).__name__}; "
            "use a box, sphere, cylinder, capsule, ellipsoid or mesh"
        )
    if not np.max(_dimensions(shape)) <= LARGEST_SIZE:
        raise InputError(f"geometry '{name}': larger than {LARGEST_SIZE:g} m")


def _dimensions(shape: Shape) -> Sequence[float]:
    """Returns what a shape's size is given by; of a mesh its file tells."""
    if isinstance(shape, Mesh):
        return (0.0,)
    if isinstance(shape, Box):
        return shape.size()
    if isinstance(shape, Sphere):
        return (shape.radius(),)
    if isinstance(shape, Ellipsoid):
        return (shape.a(), shape.b(), shape.c())
    return (shape.radius(), shape.length())


def read_perception_geometry(
    inspector: SceneGraphInspector,
    keep_frame: Callable[[FrameId], bool] = lambda frame_id: True,
) -> tuple[PerceptionGeometry, ...]:
    """Reads every geometry of `Role.kPerception` on the frames to keep.

    The order is that of `GetAllGeometryIds`, which Drake documents as
    stable; the result depends on nothing but the model.

    Raises:
        InputError: a shape is of a kind that no ray can be cast on, or a
            mesh file is missing or cannot be read; the geometry is named.
    """
    with ForeignMeshes() as foreign:
        return _read_geometry(inspector, keep_frame, MeshFiles(foreign))


def _read_geometry(
    inspector: SceneGraphInspector,
    keep_frame: Callable[[FrameId], bool],
    meshes: MeshFiles,
) -> tuple[PerceptionGeometry, ...]:
    geometries = []
    for geometry_id in inspector.GetAllGeometryIds(Role.kPerception):
        frame_id = inspector.GetFrameId(geometry_id)
        if not keep_frame(frame_id):
            continue
        name = inspector.GetName(geometry_id)
        geometries.append(
            PerceptionGeometry(
                geometry_id=geometry_id,
                name=name,
                frame_id=frame_id,
                X_FG=inspector.GetPoseInFrame(geometry_id),
                surface=_surface(name, inspector.GetShape(geometry_id), meshes),
                rgb=_diffuse_rgb(inspector, geometry_id),
            )
        )
    return tuple(geometries)


def _diffuse_rgb(
    inspector: SceneGraphInspector, geometry_id: GeometryId
) -> tuple[float, float, float] | None:
    properties = inspector.GetPerceptionProperties(geometry_id)
    if not properties.HasProperty("phong", "diffuse"):
        return None
    rgba = properties.GetProperty("phong", "diffuse")
    return (rgba.r(), rgba.g(), rgba.b())


def _surface(name: str, shape: Shape, meshes: MeshFiles) -> Surface:
    check_shape(name, shape)
    if isinstance(shape, Mesh):
        return meshes.read(name, shape)
    if isinstance(shape, Box):
        return TriangleSurface(_CUBE_CORNERS * shape.size(), _CUBE_TRIANGLES)
    if isinstance(shape, Sphere):
        return EllipsoidSurface((shape.radius(),) * 3)
    if isinstance(shape, Ellipsoid):
        return EllipsoidSurface((shape.a(), shape.b(), shape.c()))
    if isinstance(shape, Cylinder):
        return CylinderSurface(shape.radius(), shape.length())
    return CapsuleSurface(shape.radius(), shape.length())
