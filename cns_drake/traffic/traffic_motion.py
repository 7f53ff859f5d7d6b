"""A system that moves vehicles and walkers as they were planned."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from pydrake.common.value import AbstractValue, Value
from pydrake.geometry import FrameId, FramePoseVector, SourceId
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.multibody.math import SpatialVelocity
from pydrake.systems.framework import Context, LeafSystem
from scipy.spatial.transform import Rotation

from cns_drake.traffic.body_shapes import Limb
from cns_drake.traffic.body_states import LimbTable, bodies_at
from cns_drake.traffic.traffic_plan import WALKER_SIZE, TrafficPlan

# What is faster is labelled as moving, what is slower as standing [m/s].
MOVING_SPEED = 0.5


class TrafficObject(NamedTuple):
    """A vehicle or a walker at a time.

    Attributes:
        instance: its id in points and tables.
        name: of its structure.
        semantic_class: a key of `CLASS_IDS`.
        X_WO: pose of the middle of its box.
        size: length, width, height of its box [m].
        v_WO: velocity [m/s].
        yaw_rate: [rad/s].
        is_moving: whether it is faster than `MOVING_SPEED`.
    """

    instance: int
    name: str
    semantic_class: str
    X_WO: RigidTransform
    size: tuple[float, float, float]
    v_WO: np.ndarray
    yaw_rate: float
    is_moving: bool


class TrafficBody(NamedTuple):
    """What a vehicle or a walker is.

    Attributes:
        instance, name, semantic_class: see `TrafficObject`.
        limbs: what moves as one.
        frames: of the limbs.
    """

    instance: int
    name: str
    semantic_class: str
    limbs: tuple[Limb, ...]
    frames: tuple[FrameId, ...]


class TrafficMotion(LeafSystem):
    """Moves vehicles and walkers; it has no state.

    .. pydrake_system::

        name: TrafficMotion
        output_ports:
        - geometry_pose
        - body_spatial_velocities
        - moving_instances
        - objects

    `geometry_pose` is for the SceneGraph with which the bodies are
    registered. `body_spatial_velocities` is abstract, a list over all limbs
    of V_WL, expressed in the world: those that take a limb from where it is
    to where it is a turn later, as a LiDAR wants them that goes on turning
    meanwhile. `moving_instances` is abstract, the (N,) instance ids of who is
    faster than `MOVING_SPEED`; `objects` a tuple of `TrafficObject`, of
    everybody who is there. All depend on time alone.
    """

    def __init__(
        self,
        plan: TrafficPlan,
        bodies: Sequence[TrafficBody],
        source_id: SourceId,
        turn: float,
    ):
        """Prepares the motion.

        Args:
            plan: who is where.
            bodies: of the vehicles, then of the walkers of the plan.
            source_id: of their geometry.
            turn: how long a LiDAR's turn takes [s].
        """
        super().__init__()
        self.source_id = source_id
        self._plan = plan
        self._bodies = tuple(bodies)
        self._limbs = LimbTable([body.limbs for body in bodies])
        self._frames = [frame for body in bodies for frame in body.frames]
        self._turn = turn
        self._sizes = [kind.size for kind in plan.kinds]
        self._sizes += [WALKER_SIZE] * (len(bodies) - len(plan.kinds))
        for name, model, calc in (
            ("geometry_pose", FramePoseVector(), self._calc_pose),
            ("moving_instances", np.zeros(0, np.uint16), self._calc_moving),
            ("objects", (), self._calc_objects),
        ):
            self.DeclareAbstractOutputPort(
                name,
                lambda model=model: Value(model),
                calc,
                {self.time_ticket()},
            )
        self.DeclareAbstractOutputPort(
            "body_spatial_velocities",
            lambda: AbstractValue.Make([SpatialVelocity()]),
            self._calc_velocities,
            {self.time_ticket()},
        )

    @property
    def moving_frames(self) -> dict[FrameId, int]:
        """Limb's frame -> its row in `body_spatial_velocities`."""
        return {frame: k for k, frame in enumerate(self._frames)}

    def _calc_pose(self, context: Context, output: AbstractValue) -> None:
        states = bodies_at(self._plan, context.get_time())
        poses = FramePoseVector()
        for frame, R_WL, p_WL in zip(
            self._frames, *self._limbs.poses(states), strict=True
        ):
            rotation = RotationMatrix(R_WL)
            poses.set_value(frame, RigidTransform(rotation, p_WL))
        output.set_value(poses)

    def _calc_velocities(self, context: Context, output: AbstractValue) -> None:
        t = context.get_time()
        (R_0, p_0), (R_1, p_1) = (
            self._limbs.poses(bodies_at(self._plan, time))
            for time in (t, t + self._turn)
        )
        turned = Rotation.from_matrix(R_1 @ R_0.transpose(0, 2, 1))
        w = turned.as_rotvec() / self._turn
        v = (p_1 - p_0) / self._turn
        output.set_value(list(map(SpatialVelocity, w, v)))

    def _calc_moving(self, context: Context, output: AbstractValue) -> None:
        states = bodies_at(self._plan, context.get_time())
        instances = np.array([b.instance for b in self._bodies], np.uint16)
        output.set_value(instances[states.speed > MOVING_SPEED])

    def _calc_objects(self, context: Context, output: AbstractValue) -> None:
        states = bodies_at(self._plan, context.get_time())
        R_WBs = states.R_WB
        objects = []
        for k, (body, size) in enumerate(
            zip(self._bodies, self._sizes, strict=True)
        ):
            if states.present[k]:
                R_WO = RotationMatrix(R_WBs[k])
                up = R_WBs[k] @ (0.0, 0.0, size[2] / 2)
                objects.append(
                    TrafficObject(
                        body.instance,
                        body.name,
                        body.semantic_class,
                        RigidTransform(R_WO, states.p_WB[k] + up),
                        size,
                        states.v_WB[k],
                        float(states.yaw_rate[k]),
                        bool(states.speed[k] > MOVING_SPEED),
                    )
                )
        output.set_value(tuple(objects))
