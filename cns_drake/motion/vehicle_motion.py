"""A system that moves a vehicle along a trajectory."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from pydrake.common.value import AbstractValue, Value
from pydrake.math import RigidTransform
from pydrake.multibody.math import SpatialAcceleration, SpatialVelocity
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import (
    Joint,
    ModelInstanceIndex,
    PrismaticJoint,
    RevoluteJoint,
)
from pydrake.systems.framework import (
    BasicVector,
    Context,
    LeafSystem,
    ValueProducer,
)

from cns_drake.motion.tick_blocks import TickBlocks
from cns_drake.motion.trajectory import (
    JointMotion,
    Moments,
    Trajectory,
    WheelMotion,
    poses_and_motion,
)

# Two directions are equal if the cosine of their angle is at least this.
_PARALLEL = 1 - 1e-9
# States computed at a time.
_BLOCK = 64


class _State(NamedTuple):
    """Positions, velocities and accelerations of the whole plant.

    Arrays of one more dimension are those of many times.
    """

    q: np.ndarray
    v: np.ndarray
    vdot: np.ndarray


class VehicleMotion(LeafSystem):
    """Prescribes the motion of a vehicle, wheels included.

    It has the kinematic output ports of a MultibodyPlant, and can feed sensors
    and a SceneGraph in its place: a plant has no port for prescribed motion.
    The vehicle's floating base B follows the trajectory; each revolute joint
    about B's y rolls, each about B's z steers, so that no wheel slips; each
    prismatic joint along B's z keeps its wheel on the ground. All other joints
    keep their default positions.

    .. pydrake_system::

        name: VehicleMotion
        output_ports:
        - position
        - body_poses
        - body_spatial_velocities
        - body_spatial_accelerations

    `position` is the plant's q; the others are lists over its bodies of
    X_WB, V_WB and A_WB, expressed in the world. They depend on time only.

    Example:
        from cns_drake import VehicleMotion

        motion = VehicleMotion(world.plant, world.vehicle, trajectory)
    """

    def __init__(
        self,
        plant: MultibodyPlant,
        vehicle: ModelInstanceIndex,
        trajectory: Trajectory,
        *,
        period: float | None = None,
    ):
        """Prepares the motion.

        Args:
            plant: a finalized plant; only its model is used.
            vehicle: the model instance that moves.
            trajectory: of its base.
            period: at multiples of it many states are computed at a time, in a
                tenth of the time [s].

        Raises:
            ValueError: a joint of the vehicle is of another kind.
        """
        super().__init__()
        self._plant = plant
        self._trajectory = trajectory
        self._blocks = TickBlocks(self._states, period, _BLOCK)
        self._base = plant.GetUniqueFloatingBaseBodyOrThrow(vehicle)
        # Scratch to compute the motion of bodies from q and v; every use sets
        # all values that it reads.
        self._plant_context = plant.CreateDefaultContext()
        self._default_q = plant.GetPositions(self._plant_context).copy()
        self._joints = [
            (joint, *self._describe(joint))
            for joint in map(plant.get_joint, plant.GetJointIndices(vehicle))
            if joint.num_velocities() > 0
            and joint.child_body().index() != self._base.index()
        ]
        self._state = self.DeclareCacheEntry(
            "state",
            ValueProducer(
                allocate=lambda: Value(object()), calc=self._calc_state
            ),
            {self.time_ticket()},
        )
        prerequisites = {self.cache_entry_ticket(self._state.cache_index())}
        self.DeclareVectorOutputPort(
            "position",
            plant.num_positions(),
            self._calc_position,
            prerequisites,
        )
        for name, element, calc in (
            ("body_poses", RigidTransform(), self._calc_poses),
            (
                "body_spatial_velocities",
                SpatialVelocity(),
                self._calc_velocities,
            ),
            (
                "body_spatial_accelerations",
                SpatialAcceleration(),
                self._calc_accelerations,
            ),
        ):
            self.DeclareAbstractOutputPort(
                name,
                lambda element=element: AbstractValue.Make([element]),
                calc,
                prerequisites,
            )

    def _describe(
        self, joint: Joint
    ) -> tuple[Callable[[Moments], JointMotion], float]:
        """Returns the kind of motion of a joint, and its sign."""
        context = self._plant_context
        frame = joint.frame_on_child()
        X_BJ = frame.CalcPose(context, self._base.body_frame())
        R_BJ = X_BJ.rotation().matrix()
        wheel = WheelMotion(self._trajectory, X_BJ.translation())
        if isinstance(joint, RevoluteJoint):
            axis_B = R_BJ @ joint.revolute_axis()
            if abs(axis_B[1]) > _PARALLEL:
                return wheel.rolling, np.sign(axis_B[1])
            if abs(axis_B[2]) > _PARALLEL:
                return wheel.steering, np.sign(axis_B[2])
        if isinstance(joint, PrismaticJoint):
            axis_B = R_BJ @ joint.translation_axis()
            if abs(axis_B[2]) > _PARALLEL:
                return wheel.travel, np.sign(axis_B[2])
        raise ValueError(
            f"joint {joint.name()} neither turns about the vehicle's y (a "
            "wheel) or z (its steering) nor slides along z (its spring)"
        )

    def _calc_state(self, context: Context, value: AbstractValue) -> None:
        value.set_value(_State(*self._blocks.at(context.get_time())))

    def _states(self, times: np.ndarray) -> _State:
        """Returns the states at (N,) times."""
        plant, base = self._plant, self._base
        moments = self._trajectory.at(times)
        X_WBs, motion = poses_and_motion(moments)
        q = np.empty((len(times), plant.num_positions()))
        plant.SetPositions(self._plant_context, self._default_q)
        for k, X_WB in enumerate(X_WBs):
            plant.SetFreeBodyPose(self._plant_context, base, X_WB)
            q[k] = plant.GetPositions(self._plant_context)
        v = np.zeros((len(times), plant.num_velocities()))
        vdot = np.zeros_like(v)
        # A floating base's velocities are V_WB, expressed in the world.
        start = base.floating_velocities_start_in_v()
        columns = slice(start, start + 6)
        v[:, columns] = np.hstack([motion.w, motion.v])
        vdot[:, columns] = np.hstack([motion.alpha, motion.a])
        for joint, move, sign in self._joints:
            wheel = move(moments)
            q[:, joint.position_start()] = sign * wheel.position
            v[:, joint.velocity_start()] = sign * wheel.rate
            vdot[:, joint.velocity_start()] = sign * wheel.acceleration
        return _State(q, v, vdot)

    def _set_plant_context(self, context: Context) -> _State:
        state = self._state.Eval(context)
        self._plant.SetPositions(self._plant_context, state.q)
        self._plant.SetVelocities(self._plant_context, state.v)
        return state

    def _calc_position(self, context: Context, output: BasicVector) -> None:
        output.SetFromVector(self._state.Eval(context).q)

    def _calc_poses(self, context: Context, output: AbstractValue) -> None:
        self._set_plant_context(context)
        port = self._plant.get_body_poses_output_port()
        output.set_value(port.Eval(self._plant_context))

    def _calc_velocities(self, context: Context, output: AbstractValue) -> None:
        self._set_plant_context(context)
        port = self._plant.get_body_spatial_velocities_output_port()
        output.set_value(port.Eval(self._plant_context))

    def _calc_accelerations(
        self, context: Context, output: AbstractValue
    ) -> None:
        state = self._set_plant_context(context)
        output.set_value(
            self._plant.CalcSpatialAccelerationsFromVdot(
                self._plant_context, state.vdot
            )
        )
