"""A system that moves vehicles and walkers along their planned tracks."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from pydrake.common.value import AbstractValue, Value
from pydrake.geometry import FrameId, FramePoseVector
from pydrake.multibody.math import SpatialVelocity
from pydrake.multibody.plant import MultibodyPlant
from pydrake.systems.framework import Context, LeafSystem, ValueProducer
from scipy.spatial.transform import Rotation

from cns_drake.motion.tick_blocks import TickBlocks
from cns_drake.traffic.body_shapes import Limb
from cns_drake.traffic.body_states import BodyStates, LimbTable, bodies_at
from cns_drake.traffic.traffic_plan import WALKER_SIZE, TrafficPlan

# Faster bodies are labelled as moving, slower ones as standing [m/s].
MOVING_SPEED = 0.5
# Times at which bodies are computed together.
_BLOCK = 16


class TrafficObjects(NamedTuple):
    """The vehicles and walkers that are there at a time: N of them.

    Attributes:
        instance: (N,) uint16 ids in points and tables.
        names: of their structures.
        semantic_classes: keys of `CLASS_IDS`.
        p_WO: (N, 3) middles of their boxes [m].
        quat_xyzw: (N, 4) orientations of their boxes.
        sizes: (N, 3) length, width, height of their boxes [m].
        v_WO: (N, 3) velocities [m/s].
        yaw_rate: (N,) [rad/s].
        is_moving: (N,) whether each is faster than `MOVING_SPEED`.
    """

    instance: np.ndarray
    names: tuple[str, ...]
    semantic_classes: tuple[str, ...]
    p_WO: np.ndarray
    quat_xyzw: np.ndarray
    sizes: np.ndarray
    v_WO: np.ndarray
    yaw_rate: np.ndarray
    is_moving: np.ndarray

    def select(self, rows: np.ndarray) -> TrafficObjects:
        """Returns those of some rows."""
        return TrafficObjects(
            self.instance[rows],
            tuple(self.names[row] for row in rows),
            tuple(self.semantic_classes[row] for row in rows),
            self.p_WO[rows],
            self.quat_xyzw[rows],
            self.sizes[rows],
            self.v_WO[rows],
            self.yaw_rate[rows],
            self.is_moving[rows],
        )


class TrafficBody(NamedTuple):
    """A vehicle or a walker.

    Attributes:
        instance: its id in points and tables.
        name: of its structure.
        semantic_class: a key of `CLASS_IDS`.
        limbs: its rigid parts.
        frames: of the limbs.
    """

    instance: int
    name: str
    semantic_class: str
    limbs: tuple[Limb, ...]
    frames: tuple[FrameId, ...]


class _Moment(NamedTuple):
    """The N bodies at a time; at T times, arrays have one more dimension.

    Attributes:
        states: of the bodies.
        p_WO: (N, 3) middles of their boxes [m].
        quat_xyzw: (N, 4) orientations of the boxes.
        is_moving: (N,) whether each is labelled as moving.
    """

    states: BodyStates
    p_WO: np.ndarray
    quat_xyzw: np.ndarray
    is_moving: np.ndarray


class TrafficMotion(LeafSystem):
    """Moves vehicles and walkers; it has no state.

    .. pydrake_system::

        name: TrafficMotion
        output_ports:
        - geometry_pose
        - frame_poses
        - body_spatial_velocities
        - moving_instances
        - objects

    `geometry_pose` is for the SceneGraph with which the bodies are
    registered. `frame_poses` is abstract, the same poses as one (M, 4, 4)
    array over all limbs: X_WL. `body_spatial_velocities` is abstract, a list
    over all limbs of V_WL, expressed in the world: they take a limb to its
    place a turn later, for a LiDAR that keeps turning meanwhile.
    `moving_instances` is abstract, the (N,) instance ids of bodies faster than
    `MOVING_SPEED`; `objects` the `TrafficObjects`. All depend only on time.
    """

    def __init__(
        self,
        plan: TrafficPlan,
        bodies: Sequence[TrafficBody],
        plant: MultibodyPlant,
        turn: float,
    ):
        """Prepares the motion.

        Args:
            plan: of the traffic.
            bodies: of the vehicles, then of the walkers of the plan.
            plant: has a free body for each limb, in the same order, and is
                the source of their geometry.
            turn: duration of a LiDAR's turn [s].
        """
        super().__init__()
        self.source_id = plant.get_source_id()
        self._plan = plan
        self._bodies = tuple(bodies)
        self._limbs = LimbTable([body.limbs for body in bodies])
        self._frames = [frame for body in bodies for frame in body.frames]
        # Drake's own kinematics fill a FramePoseVector ten times as fast as one
        # call from Python for each frame.
        self._plant = plant
        self._plant_context = plant.CreateDefaultContext()
        self._turn = turn
        self._instances = np.array([b.instance for b in bodies], np.uint16)
        self._names = tuple(b.name for b in bodies)
        self._classes = tuple(b.semantic_class for b in bodies)
        self._sizes = np.array(
            [kind.size for kind in plan.kinds]
            + [WALKER_SIZE] * (len(bodies) - len(plan.kinds))
        ).reshape(-1, 3)
        now = {self.time_ticket()}
        self._blocks = TickBlocks(self._moments, turn, _BLOCK)
        self._moment = self.DeclareCacheEntry(
            description="where bodies are",
            value_producer=ValueProducer(
                allocate=lambda: Value(object()), calc=self._calc_moment
            ),
            prerequisites_of_calc=now,
        )
        self._poses = self.DeclareAbstractOutputPort(
            "frame_poses",
            lambda: Value(np.zeros((0, 4, 4))),
            self._calc_frame_poses,
            now,
        )
        for name, model, calc in (
            ("geometry_pose", FramePoseVector(), self._calc_pose),
            ("moving_instances", np.zeros(0, np.uint16), self._calc_moving),
            ("objects", (), self._calc_objects),
        ):
            self.DeclareAbstractOutputPort(
                name, lambda model=model: Value(model), calc, now
            )
        self.DeclareAbstractOutputPort(
            "body_spatial_velocities",
            lambda: AbstractValue.Make([SpatialVelocity()]),
            self._calc_velocities,
            now,
        )

    @property
    def bodies(self) -> tuple[TrafficBody, ...]:
        """The vehicles, then the walkers."""
        return self._bodies

    @property
    def moving_frames(self) -> dict[FrameId, int]:
        """Limb's frame -> its row in the ports of all limbs."""
        return {frame: k for k, frame in enumerate(self._frames)}

    def _calc_moment(self, context: Context, value: AbstractValue) -> None:
        rows = self._blocks.at(context.get_time())
        num_states = len(BodyStates._fields)
        states = BodyStates(*rows[:num_states])
        value.set_value(_Moment(states, *rows[num_states:]))

    def _moments(self, times: np.ndarray) -> tuple[np.ndarray, ...]:
        """Returns the states, and what is left of a `_Moment`, at (T,) times.

        Poses of limbs are left out: those of many times do not fit a cache.
        """
        states = bodies_at(self._plan, times)
        p_WO = states.p_WB + states.up_W * self._sizes[:, 2:] / 2
        is_moving = states.speed > MOVING_SPEED
        return (*states, p_WO, states.quat_xyzw, is_moving)

    def _calc_frame_poses(
        self, context: Context, output: AbstractValue
    ) -> None:
        moment: _Moment = self._moment.Eval(context)
        output.set_value(self._limbs.poses(moment.states))

    def _calc_pose(self, context: Context, output: AbstractValue) -> None:
        states = bodies_at(self._plan, context.get_time())
        # Each free body has a quaternion (real part first) and a position.
        q = np.empty((len(self._frames), 7))
        q[:, :4] = self._limbs.quat_xyzw(states)[:, [3, 0, 1, 2]]
        q[:, 4:] = self._limbs.poses(states)[:, :3, 3]
        self._plant.SetPositions(self._plant_context, q.ravel())
        port = self._plant.get_geometry_pose_output_port()
        output.SetFrom(port.EvalAbstract(self._plant_context))

    def _calc_velocities(self, context: Context, output: AbstractValue) -> None:
        t = context.get_time()
        X_0, X_1 = (
            self._limbs.poses(bodies_at(self._plan, time))
            for time in (t, t + self._turn)
        )
        R_0, R_1 = X_0[:, :3, :3].copy(), X_1[:, :3, :3].copy()
        turned = Rotation.from_matrix(R_1 @ R_0.transpose(0, 2, 1))
        w = turned.as_rotvec() / self._turn
        v = (X_1 - X_0)[:, :3, 3] / self._turn
        output.set_value(list(map(SpatialVelocity, w, v)))

    def _calc_moving(self, context: Context, output: AbstractValue) -> None:
        is_moving = self._moment.Eval(context).is_moving
        output.set_value(self._instances[is_moving])

    def _calc_objects(self, context: Context, output: AbstractValue) -> None:
        moment: _Moment = self._moment.Eval(context)
        states = moment.states
        objects = TrafficObjects(
            self._instances,
            self._names,
            self._classes,
            moment.p_WO,
            moment.quat_xyzw,
            self._sizes,
            states.v_WB,
            states.yaw_rate,
            moment.is_moving,
        )
        if not states.present.all():
            objects = objects.select(np.flatnonzero(states.present))
        output.set_value(objects)
