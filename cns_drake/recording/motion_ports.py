"""The recorder's ports of poses, and their messages."""

from __future__ import annotations

from typing import Any

from pydrake.common.value import Value
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.systems.framework import Context, InputPort, LeafSystem

from cns_drake.recording import messages
from cns_drake.recording.input_values import declare_object, value_of
from cns_drake.recording.recorded_topics import ODOMETRY_TOPIC, TF_TOPIC
from cns_drake.recording.rosbag2_metadata import Topic


class MotionPorts:
    """The port `odometry`, and a port for each moving frame of a sensor."""

    def __init__(self, system: LeafSystem):
        """Declares the port `odometry`."""
        self._odometry = declare_object(system, "odometry")
        # Frame on the map -> the port with its pose, and the pose from there.
        self._poses: dict[str, tuple[InputPort, RigidTransform]] = {}

    def add(self, system: LeafSystem, name: str, X_PC: RigidTransform) -> None:
        """Declares the port `<name>_pose`.

        Args:
            system: the recorder.
            name: of the frame C.
            X_PC: pose of C in the frame P whose pose the port has.
        """
        port = system.DeclareAbstractInputPort(
            f"{name}_pose", Value(RigidTransform())
        )
        self._poses[name] = (port, X_PC)

    def orientation(self, context: Context) -> RotationMatrix | None:
        """Returns R_WB of the vehicle; None if it is not known."""
        odometry = value_of(self._odometry, context)
        return None if odometry is None else odometry.X_WB.rotation()

    def messages(self, context: Context, stamp_ns: int) -> dict[Topic, Any]:
        """Returns the messages of odometry and transforms."""
        outgoing = {}
        odometry = value_of(self._odometry, context)
        X_WCs = {
            name: port.Eval(context) @ X_PC
            for name, (port, X_PC) in self._poses.items()
            if port.HasValue(context)
        }
        if odometry is not None:
            X_WCs = {messages.BASE_FRAME: odometry.X_WB, **X_WCs}
        if X_WCs:
            outgoing[TF_TOPIC] = messages.make_tf(
                messages.MAP_FRAME, X_WCs, stamp_ns
            )
        if odometry is not None:
            outgoing[ODOMETRY_TOPIC] = messages.make_odometry(
                odometry.X_WB, odometry.V_WB_B, stamp_ns
            )
        return outgoing
