"""Notices changes of a SceneGraph's geometry."""

from __future__ import annotations

import itertools

from pydrake.common.value import AbstractValue, Value
from pydrake.geometry import SceneGraph
from pydrake.systems.framework import (
    AbstractParameterIndex,
    Context,
    OutputPort,
)

_PORT = "geometry_revision"
_revisions = itertools.count(1)


def geometry_revision_port(scene_graph: SceneGraph) -> OutputPort:
    """Returns a port whose value changes when geometry does, and only then.

    SceneGraph's own `geometry_version` covers only perception geometry that a
    render engine accepted, and comparing all geometries takes longer than a
    scan. A Context holds the geometry as a parameter, which Drake's cache
    tracks. A port that depends on this parameter alone is computed anew when
    geometry was added, removed, replaced, reshaped, renamed or given another
    role, in any way. The first call adds the port to the SceneGraph, and must
    come before a Diagram is built from it.

    Returns:
        An abstract port; its value is an int that no other geometry, also of
        another Context, has had in this process.

    Raises:
        RuntimeError: the SceneGraph is already part of a Diagram.
    """
    if scene_graph.HasOutputPort(_PORT):
        return scene_graph.GetOutputPort(_PORT)
    return scene_graph.DeclareAbstractOutputPort(
        _PORT,
        lambda: Value(object()),
        _calc_revision,
        # The only parameter that a SceneGraph has.
        {scene_graph.abstract_parameter_ticket(AbstractParameterIndex(0))},
    )


def _calc_revision(context: Context, output: AbstractValue) -> None:
    output.set_value(next(_revisions))
