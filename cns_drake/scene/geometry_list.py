"""Lists the geometry in a SceneGraph, and notices when it changes."""

from __future__ import annotations

from typing import NamedTuple

from pydrake.common.value import AbstractValue, Value
from pydrake.geometry import (
    FrameId,
    GeometryId,
    Role,
    SceneGraph,
    SceneGraphInspector,
    Shape,
)
from pydrake.math import RigidTransform
from pydrake.systems.framework import (
    AbstractParameterIndex,
    Context,
    OutputPort,
)


class GeometryRecord(NamedTuple):
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
    """

    geometry_id: GeometryId
    name: str
    frame_id: FrameId
    X_FG: RigidTransform
    shape: Shape
    is_deformable: bool
    rgb: tuple[float, float, float] | None
    reflectivity: float | None


class GeometryList(tuple[GeometryRecord, ...]):
    """The records of all geometry with a role, in the order of the SceneGraph.

    The order is the order of `GetAllGeometryIds`. Drake documents this order as
    stable, so the list depends only on the SceneGraph.
    """

    def __deepcopy__(self, memo: dict) -> GeometryList:
        # A Context is cloned together with this value. It never changes, and
        # ids cannot be copied.
        return self


def list_geometry(inspector: SceneGraphInspector, role: Role) -> GeometryList:
    """Returns the records of all geometry with a role."""
    return GeometryList(
        GeometryRecord(
            geometry_id,
            inspector.GetName(geometry_id),
            inspector.GetFrameId(geometry_id),
            # Copies, because Drake returns references.
            RigidTransform(inspector.GetPoseInFrame(geometry_id)),
            inspector.GetShape(geometry_id).Clone(),
            inspector.IsDeformableGeometry(geometry_id),
            *_appearance(inspector, geometry_id, role),
        )
        for geometry_id in inspector.GetAllGeometryIds(role)
    )


def _appearance(
    inspector: SceneGraphInspector, geometry_id: GeometryId, role: Role
) -> tuple[tuple[float, float, float] | None, float | None]:
    """Returns colour and reflectivity, each None if the model has none."""
    properties = inspector.GetProperties(geometry_id, role)
    rgb = reflectivity = None
    if properties.HasProperty("lidar", "reflectivity"):
        reflectivity = float(properties.GetProperty("lidar", "reflectivity"))
    if properties.HasProperty("phong", "diffuse"):
        rgba = properties.GetProperty("phong", "diffuse")
        rgb = rgba.r(), rgba.g(), rgba.b()
    return rgb, reflectivity


def geometry_port(scene_graph: SceneGraph, role: Role) -> OutputPort:
    """Returns an output port whose value is a `GeometryList` of a role.

    The value is a function of the Context. The value is computed anew only
    after geometry has been added, removed, replaced, reshaped, or given another
    role. A new pose of a frame does not count. Drake's own `geometry_version`
    cannot replace this port, because some changes of perception geometry do not
    change `geometry_version`.

    The first call with a role adds the port to the SceneGraph, and must come
    before a Diagram is built from this SceneGraph.

    Raises:
        RuntimeError: the SceneGraph is already part of a Diagram.
    """
    name = f"{role.name.removeprefix('k').lower()}_geometry"
    if scene_graph.HasOutputPort(name):
        return scene_graph.GetOutputPort(name)

    def calc(context: Context, output: AbstractValue) -> None:
        query_object = scene_graph.get_query_output_port().Eval(context)
        output.set_value(list_geometry(query_object.inspector(), role))

    return scene_graph.DeclareAbstractOutputPort(
        name,
        lambda: Value(object()),
        calc,
        # The first parameter is the geometry. The second, the configuration,
        # concerns only proximity.
        {scene_graph.abstract_parameter_ticket(AbstractParameterIndex(0))},
    )
