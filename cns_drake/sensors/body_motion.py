"""The source of the motion of a plant's bodies."""

from __future__ import annotations

from pydrake.math import RigidTransform
from pydrake.multibody.tree import Frame, RigidBody
from pydrake.systems.framework import DiagramBuilder, InputPort, System


def body_and_pose(
    place: RigidBody | Frame, X_PS: RigidTransform
) -> tuple[RigidBody, RigidTransform]:
    """Returns the body B of a place P, and X_BS.

    Args:
        place: P, a body or a frame fixed on one.
        X_PS: pose of a sensor in P.
    """
    if isinstance(place, Frame):
        return place.body(), place.GetFixedPoseInBodyFrame() @ X_PS
    return place, X_PS


def connect_motion(
    builder: DiagramBuilder,
    motion: System | None,
    body: RigidBody,
    inputs: dict[str, InputPort],
) -> None:
    """Connects inputs to the source of the bodies' motion.

    Args:
        builder: of the diagram.
        motion: a system with the kinematic output ports of a MultibodyPlant;
            None for the body's plant itself.
        body: of the plant.
        inputs: name of an output port -> the input to connect.
    """
    source = body.GetParentPlant() if motion is None else motion
    for name, port in inputs.items():
        builder.Connect(source.GetOutputPort(name), port)
