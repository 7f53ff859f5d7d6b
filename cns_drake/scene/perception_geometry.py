"""Reads the surfaces of a SceneGraph's geometry, as a LiDAR sees them."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
import functools
import operator
from pathlib import Path
import threading
import warnings
import weakref

import numpy as np
from pydrake import geometry as shapes
from pydrake.common.value import AbstractValue, Value
from pydrake.geometry import (
    FrameId,
    GeometryId,
    GeometryProperties,
    RenderLabel,
    Role,
    SceneGraph,
    SceneGraphInspector,
    Shape,
)
from pydrake.math import RigidTransform
from pydrake.multibody.plant import MultibodyPlant
from pydrake.systems.framework import (
    AbstractParameterIndex,
    BusValue,
    Context,
    OutputPort,
)

from cns_drake.scene import surfaces
from cns_drake.scene.foreign_meshes import ForeignMeshes
from cns_drake.scene.mesh_files import MeshFiles, mesh_shape_key
from cns_drake.scene.obj_files import ObjFiles
from cns_drake.scene.structure_names import part_name, structure_name
from cns_drake.scene.surfaces import LARGEST_SIZE, Surface, TriangleSurface
from evaluation.base import InputError, cos, reading, sin

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
# Colour of geometry without one in camera images.
GREY = (0.5, 0.5, 0.5)
# Name of a `GeometryList` in a BusValue.
_LISTED = "list"
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
        rgb: diffuse colour; None if the model has no colour.
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
        """Name of the structure."""
        return structure_name(self.name)

    @property
    def part(self) -> str:
        """Name of the part of the structure, such as `storey_03`."""
        return part_name(self.name)


def check_shape(name: str, shape: Shape) -> None:
    """Checks that a shape is not too large.

    Meshes are not checked, because only the mesh files contain the size.

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
            geometry on all frames is wanted.

    Raises:
        InputError: a geometry cannot be read; see
            `cns_drake.scene.perception_geometry.read_geometry`.
    """
    records = list_geometry(inspector, Role.kPerception)
    return read_geometry(one for one in records if keep_frame(one.frame_id))


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


@dataclass(eq=False)
class _GeometryRecord:
    """The data of one geometry in a SceneGraph; mesh files are not read.

    Attributes:
        geometry_id: id of the geometry.
        name: scoped name.
        frame_id: the frame F to which the geometry is fixed.
        X_FG: pose of the geometry G in F.
        shape: the shape.
        is_deformable: whether the geometry is deformable.
        rgb: diffuse colour; None if the geometry has no colour.
        reflectivity: the property ("lidar", "reflectivity"); None if the
            geometry does not have it.
        read: the geometry, once `read_geometry` has read it.
        is_told: whether a user knows that the geometry is left out.
    """

    geometry_id: GeometryId
    name: str
    frame_id: FrameId
    X_FG: RigidTransform
    shape: Shape
    is_deformable: bool
    rgb: tuple[float, float, float] | None
    reflectivity: float | None
    read: PerceptionGeometry | None = None
    is_told: bool = False

    @functools.cached_property
    def key(self) -> tuple:
        """A key that is equal only for equal data."""
        return (
            self.name,
            self.frame_id,
            self.X_FG.GetAsMatrix34().tobytes(),
            self.is_deformable or _shape_key(self.shape),
            self.rgb,
            self.reflectivity,
        )


class GeometryList:
    """The records of all geometry with a role, in the order of the SceneGraph.

    The order is the order of `GetAllGeometryIds`. Drake documents this order as
    stable, so the list depends only on the SceneGraph. Whoever sees the same
    geometry of a SceneGraph, also in another Context, shares the list.

    Attributes:
        lock: held while records are read.
        scene: what was last made of the geometry, if somebody still has it.
    """

    def __init__(self, records: Iterable[_GeometryRecord] = ()):
        """Makes a list of records, of which nothing is made yet."""
        self._records = tuple(records)
        self.lock = threading.Lock()
        self.scene: Callable[[], object] = lambda: None

    def __iter__(self) -> Iterator[_GeometryRecord]:
        return iter(self._records)

    def __len__(self) -> int:
        return len(self._records)

    def __deepcopy__(self, memo: dict) -> GeometryList:
        # A Context is cloned together with this value. Its geometry never
        # changes, and ids cannot be copied.
        return self


_NOTHING = GeometryList()


def list_geometry(
    inspector: SceneGraphInspector,
    role: Role,
    previous: GeometryList = _NOTHING,
) -> GeometryList:
    """Returns the records of all geometry with a role.

    Geometry with the render label `kDoNotRender` is left out, as in images of
    Drake's cameras.

    Args:
        inspector: inspector of the SceneGraph.
        role: the role.
        previous: an earlier list, from which equal records are taken; the list
            itself if all are equal.
    """
    known = {record.geometry_id: record for record in previous}
    records = []
    for geometry_id in inspector.GetAllGeometryIds(role):
        properties = inspector.GetProperties(geometry_id, role)
        if _is_hidden(properties):
            continue
        record = _GeometryRecord(
            geometry_id,
            inspector.GetName(geometry_id),
            inspector.GetFrameId(geometry_id),
            # Copies, because Drake returns references.
            RigidTransform(inspector.GetPoseInFrame(geometry_id)),
            inspector.GetShape(geometry_id).Clone(),
            inspector.IsDeformableGeometry(geometry_id),
            *_appearance(properties),
        )
        earlier = known.get(geometry_id, record)
        records.append(earlier if earlier.key == record.key else record)
    is_same = len(records) == len(previous) and all(
        map(operator.is_, records, previous)
    )
    # An empty list is nobody's to share.
    return previous if records and is_same else GeometryList(records)


def _is_hidden(properties: GeometryProperties) -> bool:
    return bool(
        properties.HasProperty("label", "id")
        and properties.GetProperty("label", "id") == RenderLabel.kDoNotRender
    )


def _appearance(
    properties: GeometryProperties,
) -> tuple[tuple[float, float, float] | None, float | None]:
    """Returns colour and reflectivity, each None if the model has none."""
    rgb = reflectivity = None
    if properties.HasProperty("lidar", "reflectivity"):
        reflectivity = float(properties.GetProperty("lidar", "reflectivity"))
    if properties.HasProperty("phong", "diffuse"):
        rgba = properties.GetProperty("phong", "diffuse")
        rgb = rgba.r(), rgba.g(), rgba.b()
    return rgb, reflectivity


def geometry_port(scene_graph: SceneGraph, role: Role) -> OutputPort:
    """Returns an output port for the `GeometryList` of a role.

    The port's value is a BusValue, see `listed_geometry`, which is empty at
    first: Drake's RgbdSensorAsync allocates Contexts of the SceneGraph on
    threads that must not make Python objects. The value is a function of
    the Context. It is computed anew only after geometry has been added,
    removed, replaced, reshaped, or given another role. A new pose of a frame
    does not count. Drake has no other way to tell:
    with 1.51 and 1.58, `ChangeShape` of perception geometry does not change
    `geometry_version` if the SceneGraph has no renderer, and to list 3,000
    geometries anew takes 20 to 50 ms, three to seven times as long as a scan.

    The first call with a role adds the port to the SceneGraph, and must come
    before a Diagram is built from this SceneGraph.

    Raises:
        RuntimeError: the SceneGraph is already part of a Diagram.
    """
    name = f"{role.name.removeprefix('k').lower()}_geometry"
    if scene_graph.HasOutputPort(name):
        return scene_graph.GetOutputPort(name)
    # The lists belong to Contexts: the SceneGraph may never be freed.
    latest = weakref.ref(_NOTHING)

    def calc(context: Context, output: AbstractValue) -> None:
        nonlocal latest
        query_object = scene_graph.get_query_output_port().Eval(context)
        found = list_geometry(
            query_object.inspector(), role, latest() or _NOTHING
        )
        latest = weakref.ref(found)
        output.get_mutable_value().Set(_LISTED, Value[object](found))

    return scene_graph.DeclareAbstractOutputPort(
        name,
        lambda: Value(BusValue()),
        calc,
        # The first parameter is the geometry. The second, the configuration,
        # concerns only proximity.
        {scene_graph.abstract_parameter_ticket(AbstractParameterIndex(0))},
    )


def listed_geometry(value: BusValue) -> GeometryList:
    """Returns the list in a value of a port of `geometry_port`."""
    return value.Find(_LISTED)


def read_geometry(
    records: Iterable[_GeometryRecord],
) -> tuple[PerceptionGeometry, ...]:
    """Returns recorded geometry, in the order of the records.

    Each record is read once: later calls return the same object. Deformable
    geometry is left out.

    Args:
        records: records of the geometry; see `list_geometry`.

    Raises:
        InputError: the reflectivity of a geometry is not within 0 to 1, a mesh
            file is missing or cannot be read, or a size is too large; the
            message names the geometry.

    Warns:
        UserWarning: a deformable geometry is left out, told once.
    """
    found = []
    with (
        reading(Path("the world's meshes")),
        ForeignMeshes() as foreign,
        ObjFiles() as objs,
    ):
        meshes = MeshFiles(foreign, objs)
        for record in records:
            if record.is_deformable:
                _leave_out(record)
                continue
            if record.read is None:
                _check_record(record)
                record.read = PerceptionGeometry(
                    record.geometry_id,
                    record.name,
                    record.frame_id,
                    record.X_FG,
                    _surface(record.name, record.shape, meshes),
                    record.rgb,
                    record.reflectivity,
                )
            found.append(record.read)
    return tuple(found)


def _leave_out(record: _GeometryRecord) -> None:
    if not record.is_told:
        record.is_told = True
        warnings.warn(
            f"geometry '{record.name}': left out, because a LiDAR cannot "
            "see deformable geometry",
            stacklevel=2,
        )


def _check_record(record: _GeometryRecord) -> None:
    where = f"geometry '{record.name}'"
    reflectivity = record.reflectivity
    if reflectivity is not None and not 0.0 <= reflectivity <= 1.0:
        raise InputError(
            f"{where}: lidar/reflectivity: {reflectivity} is not within 0 to 1"
        )


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
    corners[2:, 0] = shape.a() * cos(angle)
    corners[2:, 1] = shape.b() * sin(angle)
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
