"""Systems that move a vehicle along a trajectory."""

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

from cns_drake.motion.path_geometry import PathJet
from cns_drake.motion.trajectory import Moments, Trajectory, poses_and_motion
from evaluation.base import arctan2

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


class _JointMotion(NamedTuple):
    """The motion of a joint at N times: three arrays (N,).

    `position` is the angle [rad] or the distance [m]; `rate` and `acceleration`
    are its first and second time derivatives.
    """

    position: np.ndarray
    rate: np.ndarray
    acceleration: np.ndarray


class WheelMotion:
    """Steering, rolling and suspension travel of a wheel without slip.

    The wheel's centre is at p_BC = (x, y, r) in the vehicle frame, where r is
    the wheel's radius. Let s be the vehicle's speed and m its turn rate about
    the z axis, both per unit of the path parameter. The velocity of the wheel
    over the ground is then v = (s - m y, m x), expressed in the vehicle frame.
    The wheel rolls in this direction: tan(d) = m x / (s - m y) gives its
    steering angle d, so that a wheel on the rear axle (x = 0) is not steered.
    The rolling rate is the length of v divided by r.

    While the body moves on its springs, the wheel stays on the road's surface
    in the world: relative to the body, it moves up by as much as the body moves
    down at the wheel. The error of this relation vanishes for small angles, and
    is within a millimetre at 3 degrees. Steering and rolling do not depend on
    the motion on springs.
    """

    def __init__(self, trajectory: Trajectory, p_BC: np.ndarray):
        """Takes the trajectory, and the wheel's centre p_BC (3,) [m]."""
        self._x, self._y, self._radius = p_BC
        self._rolled = trajectory.path.integral(
            lambda jet: np.hypot(*self._ground_velocity(jet))
        )

    def _ground_velocity(self, jet: PathJet) -> tuple[np.ndarray, np.ndarray]:
        return jet.speed - jet.turn * self._y, jet.turn * self._x

    def steering(self, moments: Moments) -> _JointMotion:
        """Returns the wheel's steering angle at N times, with derivatives.

        The angle [rad] is positive to the left.
        """
        rate, acceleration, jet = moments[1:4]
        a, b, da, db, dda, ddb = self._ground_motion(jet)
        squared = a**2 + b**2
        dsquared = 2.0 * (a * da + b * db)
        dsteer = (a * db - b * da) / squared
        ddsteer = (a * ddb - b * dda - dsteer * dsquared) / squared
        return _JointMotion(
            position=arctan2(b, a),
            rate=dsteer * rate,
            acceleration=ddsteer * rate**2 + dsteer * acceleration,
        )

    def rolling(self, moments: Moments) -> _JointMotion:
        """Returns the wheel's rolling angle at N times, with derivatives.

        The angle [rad] is zero at the start and grows when the vehicle drives
        forwards.
        """
        u, rate, acceleration, jet = moments[:4]
        a, b, da, db, _, _ = self._ground_motion(jet)
        g = np.hypot(a, b)
        dg = (a * da + b * db) / g
        return _JointMotion(
            position=self._rolled(u) / self._radius,
            rate=g * rate / self._radius,
            acceleration=(dg * rate**2 + g * acceleration) / self._radius,
        )

    def travel(self, moments: Moments) -> _JointMotion:
        """Returns the suspension travel of the wheel at N times [m].

        This is the upward motion of the wheel relative to the body. The travel
        is zero for a vehicle without springs.
        """
        ride = moments.ride
        if ride is None:
            still = np.zeros_like(moments.u)
            return _JointMotion(still, still, still)
        # In a fixed order, since the rounding of a matrix product depends on
        # the number of rows.
        return _JointMotion(
            *(
                (self._x - ride.pivot) * pitch - self._y * roll - heave
                for heave, roll, pitch in (ride.q.T, ride.dq.T, ride.ddq.T)
            )
        )

    def _ground_motion(self, jet: PathJet) -> tuple[np.ndarray, ...]:
        """Returns the velocity of the ground, and two derivatives by u."""
        return (
            *self._ground_velocity(jet),
            jet.dspeed - jet.dturn * self._y,
            jet.dturn * self._x,
            jet.ddspeed - jet.ddturn * self._y,
            jet.ddturn * self._x,
        )


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
    ) -> tuple[Callable[[Moments], _JointMotion], float]:
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
