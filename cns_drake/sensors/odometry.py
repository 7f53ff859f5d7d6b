"""Ground-truth odometry of a body."""

from __future__ import annotations

from dataclasses import dataclass, field

from pydrake.common.value import AbstractValue, Value
from pydrake.math import RigidTransform
from pydrake.multibody.math import SpatialVelocity
from pydrake.multibody.tree import RigidBody
from pydrake.systems.framework import (
    Context,
    DiagramBuilder,
    LeafSystem,
    System,
)


@dataclass(frozen=True)
class Odometry:
    """Where a body is and how it moves.

    Attributes:
        X_WB: its pose in the world.
        V_WB_B: its spatial velocity in the world, expressed in the body
            [rad/s, m/s].

    Example:
        from cns_drake import Odometry

        still = Odometry()
        print(still.X_WB.translation())
    """

    X_WB: RigidTransform = field(default_factory=RigidTransform)
    V_WB_B: SpatialVelocity = field(default_factory=SpatialVelocity.Zero)


class OdometrySensor(LeafSystem):
    """Measures pose and velocity of a body without error.

    .. pydrake_system::

        name: OdometrySensor
        input_ports:
        - body_poses
        - body_spatial_velocities
        output_ports:
        - odometry

    The inputs are lists over a plant's bodies of X_WB and V_WB, expressed in
    the world; the output is an `Odometry`.
    """

    def __init__(self, body: RigidBody):
        """Makes a sensor on the given body."""
        super().__init__()
        self._body = body.index()
        self._body_poses = self.DeclareAbstractInputPort(
            "body_poses", AbstractValue.Make([RigidTransform()])
        )
        self._body_velocities = self.DeclareAbstractInputPort(
            "body_spatial_velocities", AbstractValue.Make([SpatialVelocity()])
        )
        self.DeclareAbstractOutputPort(
            "odometry",
            lambda: Value(Odometry()),
            self._calc_odometry,
            {self._body_poses.ticket(), self._body_velocities.ticket()},
        )

    def _calc_odometry(self, context: Context, output: AbstractValue) -> None:
        X_WB = self._body_poses.Eval(context)[self._body]
        V_WB = self._body_velocities.Eval(context)[self._body]
        R_BW = X_WB.rotation().inverse()
        V_WB_B = SpatialVelocity(
            R_BW @ V_WB.rotational(), R_BW @ V_WB.translational()
        )
        output.set_value(Odometry(RigidTransform(X_WB), V_WB_B))


def add_odometry(
    builder: DiagramBuilder,
    motion: System,
    body: RigidBody,
    name: str = "odometry",
) -> OdometrySensor:
    """Adds odometry of a body to a diagram and connects it to the motion.

    Args:
        builder: of the diagram that holds `motion`.
        motion: the source of body poses and velocities.
        body: the body to observe.
        name: name of the system.

    Example:
        from cns_drake import add_odometry

        odometry = add_odometry(builder, plant, body)
    """
    sensor = builder.AddNamedSystem(name, OdometrySensor(body))
    for port in ("body_poses", "body_spatial_velocities"):
        builder.Connect(motion.GetOutputPort(port), sensor.GetInputPort(port))
    return sensor
