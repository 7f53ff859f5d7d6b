"""What adding any sensor to a diagram takes: its name, pose and motion."""

from __future__ import annotations

from collections.abc import Collection
import math
from typing import TYPE_CHECKING

import numpy as np
from pydrake.math import RigidTransform, RollPitchYaw
from pydrake.multibody.tree import Frame, RigidBody
from pydrake.systems.framework import DiagramBuilder, OutputPort, System

from evaluation.base import check_type, of_type

if TYPE_CHECKING:
    from cns_drake.sensors.sensor_config import Mount

# Endings of the names of an IMU's systems.
IMU_PARTS = ("accelerometer", "gyroscope", "noise")


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
        TypeError: an argument is of another type.
        ValueError: the pose is not finite.
    """
    check_type("X_PB", X_PS, RigidTransform)
    if not np.isfinite(X_PS.GetAsMatrix34()).all():
        raise ValueError("X_PB: not finite")
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


def find_motion(
    builder: DiagramBuilder,
    motion: System | None,
    body: RigidBody,
    *names: str,
) -> list[OutputPort]:
    """Returns output ports with the motion of the bodies of a plant.

    Args:
        builder: builder of a diagram with the plant, or with `motion`.
        motion: system with the kinematic output ports of a MultibodyPlant, such
            as `body_poses`; None for the plant itself.
        body: any body of the plant; not used if `motion` is given.
        names: names of the ports.

    Raises:
        RuntimeError: the diagram has no such system, or the system no such
            port.
    """
    source = body.GetParentPlant() if motion is None else motion
    check_in_diagram(builder, source, "motion" if motion else "body: its plant")
    return [source.GetOutputPort(name) for name in names]


def check_in_diagram(
    builder: DiagramBuilder, system: System, argument: str
) -> None:
    """Checks that a system has been added to a diagram.

    Raises:
        RuntimeError: the builder has no such system.
        TypeError: it is no DiagramBuilder.
    """
    check_type("builder", builder, DiagramBuilder)
    if not any(system is one for one in builder.GetSystems()):
        raise RuntimeError(
            f"{argument}: {type(system).__name__} '{system.get_name()}' is not "
            "in this builder's diagram"
        )


def check_new_sensor(
    builder: DiagramBuilder, name: str, parts: Collection[str] = ()
) -> None:
    """Checks the name of a sensor that is added to a diagram.

    Only a recorder asks more of a name: it becomes a part of a ROS 2 topic.

    Args:
        builder: builder of the diagram.
        name: the name.
        parts: endings of the names of the sensor's systems; an underscore
            stands between the sensor's name and the ending.

    Raises:
        TypeError: the name is no text.
        ValueError: the name is empty, or another system or sensor of the
            diagram has it.
    """
    if not of_type(name, str, "name"):
        raise ValueError("name: it is empty")
    # An IMU has the first part, but no system of the name itself.
    endings = dict.fromkeys((IMU_PARTS[0], *parts))
    check_unused_names(builder, name, *(f"{name}_{part}" for part in endings))


def check_unused_names(builder: DiagramBuilder, *names: str) -> None:
    """Checks that a diagram has no systems of certain names yet.

    A diagram with two systems of one name ends the process when it is built.

    Raises:
        TypeError: the builder is no DiagramBuilder, or a name no text.
        ValueError: the diagram has a system of one of these names.
    """
    check_type("builder", builder, DiagramBuilder)
    for name in names:
        of_type(name, str, "name")
        if builder.HasSubsystemNamed(name):
            raise ValueError(
                f"name: the diagram has a system '{name}'; give each a name "
                "of its own"
            )
