"""Checks of the arguments of `add_lidar`: a slip is found at the call."""

from __future__ import annotations

import warnings

from pydrake.geometry import FrameId, Role, SceneGraph
from pydrake.math import RigidTransform
from pydrake.multibody.tree import Frame, RigidBody
from pydrake.systems.framework import DiagramBuilder

from cns_drake.sensors.beam_pattern import BeamPattern


def check_lidar_arguments(
    builder: DiagramBuilder,
    scene_graph: object,
    name: str,
    body: object,
    X_PS: object,
    pattern: object,
) -> None:
    """Checks the arguments of `add_lidar`.

    Raises:
        TypeError: the SceneGraph, the body, the pose or the pattern has the
            wrong type.
        ValueError: the diagram has a system of that name.
    """
    if not isinstance(scene_graph, SceneGraph):
        raise TypeError(
            f"scene_graph: {type(scene_graph).__name__} is not a SceneGraph; "
            "AddMultibodyPlantSceneGraph returns one beside the plant"
        )
    if not isinstance(body, RigidBody | Frame | FrameId):
        cure = ""
        if isinstance(body, str):
            cure = f"; plant.GetBodyByName({body!r}) finds the body of a name"
        raise TypeError(
            f"body: {body!r} is not a RigidBody, Frame or FrameId{cure}"
        )
    if not isinstance(X_PS, RigidTransform):
        raise TypeError(f"X_PS: {X_PS!r} is not a RigidTransform")
    if not isinstance(pattern, BeamPattern | str):
        raise TypeError(
            f"pattern: {pattern!r} is neither a BeamPattern nor the name of a "
            "preset"
        )
    if builder.HasSubsystemNamed(name):
        raise ValueError(
            f"name: the diagram has a system '{name}'; give each LiDAR a name "
            "of its own"
        )


def warn_of_nothing_to_see(scene_graph: SceneGraph, role: Role) -> None:
    """Warns if no registered geometry has the role yet."""
    if scene_graph.model_inspector().NumGeometriesWithRole(role) == 0:
        warnings.warn(
            f"the SceneGraph holds no geometry of {role}: so far the LiDAR "
            "has nothing to see. RegisterVisualGeometry of a plant gives the "
            "perception role.",
            stacklevel=3,
        )
