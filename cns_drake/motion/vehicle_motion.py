"""Systems that move a vehicle along a trajectory."""

from __future__ import annotations

from collections.abc import Callable
import functools
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

from cns_drake.motion.trajectory import Moments, Trajectory, poses_and_motion
from cns_drake.motion.wheel_motion import JointMotion, WheelMotion

# Number of states that are computed at a time.
_BLOCK = 64
# Two directions are the same if the cosine of the angle between them is at
# least this.
_PARALLEL = 1 - 1e-9


class _State(NamedTuple):
    """Positions, velocities and accelerations of the whole plant.

    If there are several times, the arrays have a first axis for the times.
    """

    q: np.ndarray
    v: np.ndarray
    vdot: np.ndarray


class VehicleMotion(LeafSystem):
    """A system that moves a vehicle along a trajectory, wheels included.

    A MultibodyPlant of Drake cannot have a prescribed motion. This system can
    take the place of a plant: it has the kinematic output ports of a plant, to
    which sensors and a SceneGraph can be connected.

    The vehicle's floating base B follows the trajectory. Revolute joints about
    the y axis of B roll the wheels and revolute joints about z steer them, so
    that no wheel slips. Prismatic joints along z of B keep the wheels on the
    ground. The joints of all other models keep their default positions.

    .. pydrake_system::

        name: VehicleMotion
        output_ports:
        - position
        - body_poses
        - body_spatial_velocities
        - body_spatial_accelerations

    `position` is the plant's q. Each of the three other outputs is a list with
    one entry per body of the plant: its pose, spatial velocity or spatial
    acceleration in W, expressed in W. All outputs depend only on time.

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
            trajectory: motion of its base.
            period: time step at which states are usually needed [s]. States at
                many multiples of this step are then computed together, which is
                ten times as fast. None computes each state when it is needed.

        Raises:
            ValueError: a movable joint of the vehicle is neither revolute about
                y or z of B nor prismatic along z.
        """
        super().__init__()
        self._plant = plant
        self._trajectory = trajectory
        self._period = period
        self._base = plant.GetUniqueFloatingBaseBodyOrThrow(vehicle)
        # What depends on a Context is not an attribute, since threads may share
        # the system.
        self._default = plant.CreateDefaultContext()
        self._block = functools.lru_cache(maxsize=4)(self._calc_block)
        self._joints = [
            (joint, *self._find_joint_motion(joint))
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
        for name, element in (
            ("body_poses", RigidTransform()),
            ("body_spatial_velocities", SpatialVelocity()),
            ("body_spatial_accelerations", SpatialAcceleration()),
        ):
            self.DeclareAbstractOutputPort(
                name,
                lambda element=element: AbstractValue.Make([element]),
                functools.partial(self._calc_body_list, name),
                prerequisites,
            )

    def _find_joint_motion(
        self, joint: Joint
    ) -> tuple[Callable[[Moments], JointMotion], float]:
        """Returns a function for a joint's motion, and the sign of its axis."""
        base = self._base.body_frame()
        X_BJ = joint.frame_on_child().CalcPose(self._default, base)
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
        """Sets a Context of the plant, and the plant's vdot."""
        time = context.get_time()
        period = self._period
        tick = round(time / period) if period else 0
        if period is None or tick * period != time:
            states = self._calc_states(np.array([time]))
            row = 0
        else:
            number, row = divmod(tick, _BLOCK)
            states = self._block(number, period)
        q, v, vdot = (values[row] for values in states)
        now = self._default.Clone()
        self._plant.SetPositions(now, q)
        self._plant.SetVelocities(now, v)
        value.set_value((now, vdot))

    def _calc_block(self, number: int, period: float) -> _State:
        ticks = number * _BLOCK + np.arange(_BLOCK)
        return self._calc_states(ticks * period)

    def _calc_states(self, times: np.ndarray) -> _State:
        """Returns the states at times (N,); each depends only on its time."""
        plant = self._plant
        base = self._base
        scratch = self._default.Clone()
        moments = self._trajectory.at(times)
        X_WBs, motion = poses_and_motion(moments)
        q = np.empty((len(times), plant.num_positions()))
        for k, X_WB in enumerate(X_WBs):
            plant.SetFreeBodyPose(scratch, base, X_WB)
            q[k] = plant.GetPositions(scratch)
        v, vdot = np.zeros((2, len(times), plant.num_velocities()))
        # A floating base's velocities are V_WB, expressed in W.
        start = base.floating_velocities_start_in_v()
        v[:, start : start + 6] = np.hstack([motion.w, motion.v])
        vdot[:, start : start + 6] = np.hstack([motion.alpha, motion.a])
        for joint, move, sign in self._joints:
            wheel = move(moments)
            q[:, joint.position_start()] = sign * wheel.position
            v[:, joint.velocity_start()] = sign * wheel.rate
            vdot[:, joint.velocity_start()] = sign * wheel.acceleration
        return _State(q, v, vdot)

    def _calc_position(self, context: Context, output: BasicVector) -> None:
        now, _ = self._state.Eval(context)
        output.SetFromVector(self._plant.GetPositions(now))

    def _calc_body_list(
        self, name: str, context: Context, output: AbstractValue
    ) -> None:
        plant = self._plant
        now, vdot = self._state.Eval(context)
        if name == "body_spatial_accelerations":
            # The port of a plant has the accelerations of the plant's dynamics.
            output.set_value(plant.CalcSpatialAccelerationsFromVdot(now, vdot))
        else:
            output.set_value(plant.GetOutputPort(name).Eval(now))
