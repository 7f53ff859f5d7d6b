"""Poses of sensors on their carriers, and the motion of the carriers."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from pydrake.math import RigidTransform, RollPitchYaw
from pydrake.multibody.tree import Frame, RigidBody
from pydrake.systems.framework import DiagramBuilder, InputPort, System

if TYPE_CHECKING:
    from cns_drake.sensors.sensor_config import Mount


def sensor_pose(mount: Mount) -> RigidTransform:
    """Returns the pose X_BS of a sensor in base_link."""
    roll, pitch, yaw = map(math.radians, mount.rpy_deg)
    return RigidTransform(RollPitchYaw(roll, pitch, yaw), mount.xyz)


def body_and_pose(
    place: RigidBody | Frame, X_PS: RigidTransform
) -> tuple[RigidBody, RigidTransform]:
    """Returns the body that carries a sensor, and the pose on this body.

    Args:
        place: the carrier P: a body of a finalized plant, or a frame that is
            fixed on such a body.
        X_PS: pose of the sensor S in P.

    Returns:
        The body B: `place` itself, or the body on which the frame is fixed; and
        the pose X_BS of the sensor.

    Raises:
        RuntimeError: the plant is not finalized.
        TypeError: `place` is of another type.
    """
    if not isinstance(place, RigidBody | Frame):
        cure = ""
        if isinstance(place, str):
            cure = f"; plant.GetBodyByName({place!r}) finds the body of a name"
        raise TypeError(f"body: {place!r} is not a RigidBody or Frame{cure}")
    # Bodies that are welded to it later would be unknown.
    if not place.GetParentPlant().is_finalized():
        raise RuntimeError(
            "body: its plant is not finalized; call plant.Finalize() before "
            "sensors are added"
        )
    if isinstance(place, Frame):
        return place.body(), place.GetFixedPoseInBodyFrame() @ X_PS
    return place, X_PS


def connect_motion(
    builder: DiagramBuilder,
    motion: System | None,
    body: RigidBody,
    inputs: dict[str, InputPort],
) -> None:
    """Connects a system's inputs to the motion of the bodies of a plant.

    Args:
        builder: builder of a diagram with all these systems.
        motion: system with the kinematic output ports of a MultibodyPlant, such
            as `body_poses`; None for the plant itself.
        body: any body of the plant; not used if `motion` is given.
        inputs: name of an output port of `motion` -> the input port to connect
            to this output port.
    """
    source = body.GetParentPlant() if motion is None else motion
    for name, port in inputs.items():
        builder.Connect(source.GetOutputPort(name), port)
