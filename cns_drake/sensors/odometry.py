"""Ground-truth odometry of a body."""

from dataclasses import dataclass, field

import numpy as np
from pydrake.common.value import AbstractValue, Value
from pydrake.geometry import SceneGraph
from pydrake.math import RigidTransform
from pydrake.multibody.math import SpatialVelocity
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import BodyIndex, Frame, RigidBody
from pydrake.systems.framework import (
    Context,
    DiagramBuilder,
    LeafSystem,
    System,
)
from pydrake.systems.lcm import LcmBuses

from cns_drake.sensors.carriers import (
    body_and_pose,
    check_new_sensor,
    find_motion,
)
from cns_drake.sensors.lidar.beams import period_of_rate
from cns_drake.sensors.published_sensor import (
    USUAL_RATE,
    Interface,
    PublishedSensor,
    carrier_frame,
    errors_of,
    find_interface,
    make_signal,
    names_of_fields_in_errors,
    publish_measurements,
)
from evaluation.base import check_type


@dataclass(frozen=True)
class Odometry:
    """The pose and velocity of a body at one time.

    Attributes:
        X_WB: pose of the body B in the world W.
        V_WB_B: spatial velocity of B in W, expressed in B [rad/s, m/s].

    Example:
        from cns_drake import Odometry

        still = Odometry()
        print(still.X_WB.translation())
    """

    X_WB: RigidTransform = field(default_factory=RigidTransform)
    V_WB_B: SpatialVelocity = field(default_factory=SpatialVelocity.Zero)


class OdometrySensor(LeafSystem):
    """Measures pose and velocity of a body, or a frame on it, without error.

    .. pydrake_system::

        name: OdometrySensor
        input_ports:
        - body_poses
        - body_spatial_velocities
        output_ports:
        - odometry

    Each input is a list with one entry per body P of a plant: the pose X_WP, or
    the spatial velocity V_WP, expressed in the world. The output is the
    `Odometry` of the observed body or frame B.

    Attributes:
        frame_id: frame of the body P in the SceneGraph; None if P has no
            geometry source.

    Example:
        from cns_drake import OdometrySensor

        sensor = builder.AddSystem(OdometrySensor(body))
        for name in ("body_poses", "body_spatial_velocities"):
            port = plant.GetOutputPort(name)
            builder.Connect(port, sensor.GetInputPort(name))
    """

    def __init__(self, body: RigidBody, X_PB: RigidTransform | None = None):
        """Makes the sensor.

        Args:
            body: the body P of a plant.
            X_PB: pose of the observed frame B in P; by default B is P.
        """
        super().__init__()
        check_type("body", body, RigidBody)
        self._body = body.index()
        self._X_PB = None if X_PB is None else RigidTransform(X_PB)
        plant = body.GetParentPlant()
        self.frame_id = plant.GetBodyFrameIdIfExists(body.index())
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

    @property
    def X_PB(self) -> RigidTransform:
        """Pose of the observed frame B in the body P."""
        return RigidTransform() if self._X_PB is None else self._X_PB

    def place_of(
        self, body: BodyIndex, X_PC: RigidTransform
    ) -> RigidTransform | None:
        """Returns the pose X_BC of a frame C in the observed frame B.

        Args:
            body: the body P to which C is fixed.
            X_PC: pose of C in P.

        Returns:
            The pose X_BC; None if B is fixed to another body than P.
        """
        return self.X_PB.inverse() @ X_PC if body == self._body else None

    def _calc_odometry(self, context: Context, output: AbstractValue) -> None:
        X_WB = RigidTransform(self._body_poses.Eval(context)[self._body])
        V_WB = self._body_velocities.Eval(context)[self._body]
        if self._X_PB is not None:
            V_WB = V_WB.Shift(X_WB.rotation() @ self._X_PB.translation())
            X_WB = X_WB @ self._X_PB
        R_BW = X_WB.rotation().inverse()
        V_WB_B = SpatialVelocity(
            R_BW @ V_WB.rotational(), R_BW @ V_WB.translational()
        )
        output.set_value(Odometry(X_WB, V_WB_B))


def add_odometry(
    builder: DiagramBuilder,
    body: RigidBody | Frame,
    *,
    X_PB: RigidTransform | None = None,
    motion: System | None = None,
    name: str = "odometry",
) -> OdometrySensor:
    """Adds a sensor for the exact odometry of a body to a diagram.

    The system is connected to the motion of the body.

    Args:
        builder: builder of a diagram with the plant, or with `motion`.
        body: the carrier P: a body of a finalized plant, or a frame that is
            fixed on such a body.
        X_PB: pose of the observed frame B in P; by default B is P.
        motion: source of body poses and velocities; by default the plant.
        name: name of the system.

    Raises:
        RuntimeError: the plant is not finalized.
        TypeError: an argument is of another type.
        ValueError: the pose is not finite, or the name is taken or empty.

    Example:
        from cns_drake import add_odometry

        odometry = add_odometry(builder, body)
    """
    check_new_sensor(builder, name)
    carrier, X_CB = body_and_pose(body, X_PB or RigidTransform())
    is_body = X_PB is None and not isinstance(body, Frame)
    names = ("body_poses", "body_spatial_velocities")
    ports = find_motion(builder, motion, carrier, *names)
    sensor = builder.AddNamedSystem(
        name, OdometrySensor(carrier, None if is_body else X_CB)
    )
    for port_name, port in zip(names, ports, strict=True):
        builder.Connect(port, sensor.GetInputPort(port_name))
    return sensor


@names_of_fields_in_errors
@dataclass(eq=False)
class OdometryConfig(PublishedSensor):
    """The configuration of exact odometry, for YAML and `ApplyOdometryConfig`.

    The fields are those of all sensors (`name`, `X_PB` and `lcm_bus`), and the
    following. B is the observed frame.

    Attributes:
        rate: messages per second; by default 20.

    Example:
        from cns_drake import OdometryConfig

        config = OdometryConfig(name="odometry", rate=100)
    """

    name: str = "odometry"
    rate: int | None = None

    def _validate(self) -> None:
        period_of_rate(self.message_rate())

    def message_rate(self) -> int:
        """Returns the number of messages per second."""
        return USUAL_RATE if self.rate is None else self.rate


def ApplyOdometryConfig(
    config: OdometryConfig,
    builder: DiagramBuilder,
    plant: MultibodyPlant | None = None,
    scene_graph: SceneGraph | None = None,
    lcm_buses: LcmBuses | None = None,
    lcm: Interface | None = None,
) -> OdometrySensor:
    """Adds exact odometry of a frame B to a diagram, published on LCM.

    The messages are `lcmt_drake_signal` on the channel `DRAKE_ODOMETRY_<name>`:
    the quaternion of R_WB (w first), p_WB [m], then angular and linear velocity
    in the world, expressed in B [rad/s, m/s].

    Args:
        config: description of the odometry.
        scene_graph: ignored, so that the function has the arguments of Drake's
            `ApplyCameraConfig`.

    The other arguments are those of `ApplyLidarConfig`.

    Raises:
        RuntimeError: there is no such plant, frame or bus, or the plant is not
            finalized.

    Example:
        from cns_drake import ApplyOdometryConfig, OdometryConfig

        ApplyOdometryConfig(OdometryConfig(rate=100), builder)
    """
    check_type("config", config, OdometryConfig)
    config.ValidateOrThrow()
    interface = find_interface(config, builder, lcm_buses, lcm)
    with errors_of(config):
        frame, X_PB = carrier_frame(config, builder, plant)
        sensor = add_odometry(builder, frame, X_PB=X_PB, name=config.name)
    axes = ["qw", "qx", "qy", "qz", "x", "y", "z"]
    axes += ["wx", "wy", "wz", "vx", "vy", "vz"]
    ports = [sensor.GetOutputPort("odometry")]
    publish_measurements(
        config,
        "ODOMETRY",
        builder,
        interface,
        ports,
        lambda time, value: make_signal(time, axes, _odometry_numbers(value)),
        period=1.0 / config.message_rate(),
    )
    return sensor


def _odometry_numbers(value: Odometry) -> np.ndarray:
    """Returns the numbers (13,) of a message, see `ApplyOdometryConfig`."""
    X_WB, V_WB_B = value.X_WB, value.V_WB_B
    return np.hstack(
        [
            X_WB.rotation().ToQuaternion().wxyz(),
            X_WB.translation(),
            V_WB_B.rotational(),
            V_WB_B.translational(),
        ]
    )
