"""Reads the geometry with a given Drake role, as a LiDAR sees it."""

from collections.abc import Callable, Collection, Iterable, Sequence
from dataclasses import dataclass
import itertools

import numpy as np
from pydrake import geometry as shapes
from pydrake.common.value import Value
from pydrake.geometry import (
    FrameId,
    GeometryId,
    Role,
    SceneGraph,
    SceneGraphInspector,
    Shape,
)
from pydrake.math import RigidTransform
from pydrake.multibody.plant import MultibodyPlant
from pydrake.systems.framework import AbstractParameterIndex, OutputPort

from cns_drake.base.errors import InputError
from cns_drake.scene import surfaces
from cns_drake.scene.foreign_meshes import ForeignMeshes
from cns_drake.scene.mesh_files import MeshFiles, mesh_shape_key
from cns_drake.scene.surfaces import LARGEST_SIZE, Surface, TriangleSurface

# The corners of a unit cube, and its faces, counter-clockwise from outside.
_CUBE_CORNERS = np.array(
    [(x, y, z) for z in (-0.5, 0.5) for y in (-0.5, 0.5) for x in (-0.5, 0.5)]
)
_CUBE_TRIANGLES = np.array(
    [
        (0, 2, 3), (0, 3, 1), (4, 5, 7), (4, 7, 6), (0, 1, 5), (0, 5, 4),
        (2, 6, 7), (2, 7, 3), (0, 4, 6), (0, 6, 2), (1, 3, 7), (1, 7, 5),
    ]
)  # fmt: skip
# Number of sides of a cone; its surface is then exact to 5e-6 of its radius.
_CONE_SIDES = 1024


@dataclass(frozen=True)
class PerceptionGeometry:
    """One geometry that rays can hit.

    Attributes:
        geometry_id: id of the geometry in the SceneGraph.
        name: scoped name, `<model>::<visual>`.
        frame_id: the frame F to which the geometry is fixed.
        X_FG: pose of the geometry G in F.
        surface: shape of the geometry, in G.
        rgb: diffuse colour; None if the model has none.
        reflectivity: the property ("lidar", "reflectivity"), from 0 to 1; None
            if the geometry does not have it.
    """

    geometry_id: GeometryId
    name: str
    frame_id: FrameId
    X_FG: RigidTransform
    surface: Surface
    rgb: tuple[float, float, float] | None
    reflectivity: float | None = None

    @property
    def structure(self) -> str:
        return structure_name(self.name)


def structure_name(geometry_name: str, *, is_scoped: bool = False) -> str:
    """Returns the name of the structure to which a geometry belongs.

    A visual named `tower_017/storey_03` belongs to `tower_017`; a visual
    without a slash belongs to its model.

    Args:
        geometry_name: scoped name of the geometry, such as
            `left::gripper::finger`.
        is_scoped: whether a model has its whole name, such as `left::gripper`.
            By default it is `gripper`, as in structure tables.
    """
    model, _, visual = geometry_name.rpartition("::")
    structure, slash, _ = visual.partition("/")
    if slash:
        return structure
    return (model if is_scoped else model.rpartition("::")[2]) or visual


def check_shape(name: str, shape: Shape) -> None:
    """Checks that a shape is not too large.

    Meshes are not checked, since only their files contain their size.

    Raises:
        InputError: the shape is too large; the message names the geometry.
    """
    if isinstance(shape, shapes.Mesh | shapes.Convex | shapes.HalfSpace):
        return
    if not np.max(_dimensions(shape)) <= LARGEST_SIZE:
        raise InputError(f"geometry '{name}': larger than {LARGEST_SIZE:g} m")


def anchored_frames(plant: MultibodyPlant) -> frozenset[FrameId]:
    """Returns those geometry frames of a plant that are fixed to the world."""
    bodies = plant.GetBodiesWeldedTo(plant.world_body())
    frames = (plant.GetBodyFrameIdIfExists(body.index()) for body in bodies)
    return frozenset(frame for frame in frames if frame is not None)


def read_perception_geometry(
    inspector: SceneGraphInspector,
    keep_frame: Callable[[FrameId], bool] = lambda frame_id: True,
) -> tuple[PerceptionGeometry, ...]:
    """Returns every geometry with `Role.kPerception` on selected frames.

    Args:
        inspector: inspector of the SceneGraph.
        keep_frame: returns whether geometry on a frame is wanted; by default
            all frames are.

    Raises:
        InputError: a geometry cannot be read; see
            `cns_drake.scene.perception_geometry.GeometryReader.read`.
    """
    reader = GeometryReader(Role.kPerception)
    hidden = {
        geometry_id
        for frame_id in inspector.GetAllFrameIds()
        if not keep_frame(frame_id)
        for geometry_id in inspector.GetGeometries(frame_id, Role.kPerception)
    }
    return reader.read(inspector, hidden)


def merge_surfaces(
    geometries: Iterable[PerceptionGeometry],
    calc_X_TF: Callable[[FrameId], RigidTransform],
) -> TriangleSurface:
    """Returns the triangles of many geometries as one surface in a frame T.

    Curved shapes are tessellated.

    Args:
        geometries: the geometries.
        calc_X_TF: function that returns the pose of a frame F in T.
    """
    members = [
        (
            index,
            calc_X_TF(geometry.frame_id) @ geometry.X_FG,
            surfaces.tessellate(geometry.surface),
        )
        for index, geometry in enumerate(geometries)
    ]
    return surfaces.merge_triangles(members)[0]


class GeometryReader:
    """Reads all geometry with a given Drake role from a SceneGraph.

    The first call of `read` reads everything. Each later call reads only the
    geometry that has changed since the previous call.
    """

    def __init__(self, role: Role):
        """Makes a reader of the geometry with a role; nothing is read yet."""
        self._role = role
        self._known: dict[GeometryId, tuple[tuple, PerceptionGeometry]] = {}

    def read(
        self,
        inspector: SceneGraphInspector,
        hidden: Collection[GeometryId] = frozenset(),
    ) -> tuple[PerceptionGeometry, ...]:
        """Returns all geometry with the reader's role, except hidden geometry.

        The order is that of `GetAllGeometryIds`, which Drake documents as
        stable, so the result depends only on the SceneGraph. For a geometry
        that has not changed since the last call, the same object is returned.

        Args:
            inspector: inspector of the SceneGraph.
            hidden: geometries to leave out.

        Raises:
            InputError: a geometry is deformable, a mesh file is missing or
                cannot be read, or a size is too large; the message names the
                geometry.
        """
        known, self._known = self._known, {}
        with ForeignMeshes() as foreign:
            meshes = MeshFiles(foreign)
            for geometry_id in inspector.GetAllGeometryIds(self._role):
                if geometry_id in hidden:
                    continue
                name = inspector.GetName(geometry_id)
                if inspector.IsDeformableGeometry(geometry_id):
                    raise InputError(
                        f"geometry '{name}': a LiDAR cannot see deformable "
                        "geometry; hide it, or remove its role"
                    )
                shape = inspector.GetShape(geometry_id)
                frame_id = inspector.GetFrameId(geometry_id)
                # A copy, because Drake returns references.
                X_FG = RigidTransform(inspector.GetPoseInFrame(geometry_id))
                look = self._appearance(name, inspector, geometry_id)
                pose = X_FG.GetAsMatrix34().tobytes()
                record = name, frame_id, pose, _shape_key(shape), look
                entry = known.get(geometry_id)
                if entry is None or entry[0] != record:
                    surface = _surface(name, shape, meshes)
                    entry = (
                        record,
                        PerceptionGeometry(
                            geometry_id, name, frame_id, X_FG, surface, *look
                        ),
                    )
                self._known[geometry_id] = entry
        return tuple(geometry for _, geometry in self._known.values())

    def _appearance(
        self, name: str, inspector: SceneGraphInspector, geometry_id: GeometryId
    ) -> tuple[tuple[float, float, float] | None, float | None]:
        """Returns colour and reflectivity, each None if the model has none."""
        properties = inspector.GetProperties(geometry_id, self._role)
        rgb = reflectivity = None
        if properties.HasProperty("lidar", "reflectivity"):
            reflectivity = float(
                properties.GetProperty("lidar", "reflectivity")
            )
            if not 0.0 <= reflectivity <= 1.0:
                raise InputError(
                    f"geometry '{name}': lidar/reflectivity: {reflectivity} "
                    "is not within 0 to 1"
                )
        if properties.HasProperty("phong", "diffuse"):
            rgba = properties.GetProperty("phong", "diffuse")
            rgb = rgba.r(), rgba.g(), rgba.b()
        return rgb, reflectivity


def _shape_key(shape: Shape) -> tuple:
    """Returns a key that is equal only for equal shapes."""
    if isinstance(shape, shapes.Mesh | shapes.Convex):
        return mesh_shape_key(shape)
    if isinstance(shape, shapes.HalfSpace):
        return (shapes.HalfSpace,)
    return type(shape), *_dimensions(shape)


def _dimensions(shape: Shape) -> Sequence[float]:
    """Returns the numbers that define the size of a shape."""
    if isinstance(shape, shapes.Box):
        return shape.size()
    if isinstance(shape, shapes.Sphere):
        return (shape.radius(),)
    if isinstance(shape, shapes.Ellipsoid):
        return (shape.a(), shape.b(), shape.c())
    if isinstance(shape, shapes.MeshcatCone):
        return (shape.a(), shape.b(), shape.height())
    return (shape.radius(), shape.length())


def _surface(name: str, shape: Shape, meshes: MeshFiles) -> Surface:
    check_shape(name, shape)
    if isinstance(shape, shapes.Mesh | shapes.Convex):
        return meshes.read(name, shape)
    if isinstance(shape, shapes.HalfSpace):
        return surfaces.HalfSpaceSurface()
    if isinstance(shape, shapes.Box):
        return TriangleSurface(_CUBE_CORNERS * shape.size(), _CUBE_TRIANGLES)
    if isinstance(shape, shapes.Sphere):
        return surfaces.EllipsoidSurface((shape.radius(),) * 3)
    if isinstance(shape, shapes.Ellipsoid):
        return surfaces.EllipsoidSurface((shape.a(), shape.b(), shape.c()))
    if isinstance(shape, shapes.Cylinder):
        return surfaces.CylinderSurface(shape.radius(), shape.length())
    if isinstance(shape, shapes.Capsule):
        return surfaces.CapsuleSurface(shape.radius(), shape.length())
    return _cone(shape)


def _cone(shape: shapes.MeshcatCone) -> TriangleSurface:
    """Returns a pyramid with many sides for a cone; its apex is the origin."""
    angle = 2.0 * np.pi * np.arange(_CONE_SIDES) / _CONE_SIDES
    corners = np.zeros((2 + _CONE_SIDES, 3))
    corners[1:, 2] = shape.height()
    corners[2:, 0] = shape.a() * np.cos(angle)
    corners[2:, 1] = shape.b() * np.sin(angle)
    first = 2 + np.arange(_CONE_SIDES)
    second = np.roll(first, -1)
    point, middle = np.zeros_like(first), np.ones_like(first)
    return TriangleSurface(
        corners,
        np.concatenate(
            [
                np.column_stack([point, second, first]),
                np.column_stack([middle, first, second]),
            ]
        ).astype(np.int32),
    )


_PORT = "geometry_revision"
_revisions = itertools.count(1)


def geometry_revision_port(scene_graph: SceneGraph) -> OutputPort:
    """Returns a port whose value changes when, and only when, geometry does.

    Geometry changes if it is added, removed, replaced, reshaped, renamed or
    given another role. A new pose of a frame does not count.

    The first call adds the port to the SceneGraph, and must come before a
    Diagram is built from it.

    Returns:
        An abstract port with an int as its value. Within this process, two
        values are equal only if the geometry is the same, even in different
        Contexts.

    Raises:
        RuntimeError: the SceneGraph is already part of a Diagram.
    """
    if scene_graph.HasOutputPort(_PORT):
        return scene_graph.GetOutputPort(_PORT)
    return scene_graph.DeclareAbstractOutputPort(
        _PORT,
        lambda: Value(object()),
        lambda context, output: output.set_value(next(_revisions)),
        # The first parameter is the geometry. The second, the configuration,
        # concerns only proximity.
        {scene_graph.abstract_parameter_ticket(AbstractParameterIndex(0))},
    )
