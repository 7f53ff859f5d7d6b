"""Traffic in a diagram: a system that moves vehicles and pedestrians."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from pydrake import geometry
from pydrake.common.value import AbstractValue, Value
from pydrake.geometry import FrameId, FramePoseVector, SceneGraph, SourceId
from pydrake.math import RigidTransform
from pydrake.multibody.math import SpatialVelocity
from pydrake.systems.framework import (
    Context,
    DiagramBuilder,
    LeafSystem,
    System,
    ValueProducer,
)
from scipy.spatial.transform import Rotation

from cns_drake.ray_casting import KnownPoses
from cns_drake.recording import RecordedObjects
from cns_drake.sensors import check_unused_names
from cns_drake.traffic.body_shapes import Limb, vehicle_limbs, walker_limbs
from cns_drake.traffic.traffic_plan import WALKER_SIZE, TrafficPlan
from evaluation.base import MAX_INSTANCE, InputError, cos, product, sin
from worlds.shapes import StructureEntry, StructureTable

# Faster bodies are labelled as moving, all others as standing [m/s].
MOVING_SPEED = 0.5
# Speed at which limbs swing with their full amplitude [m/s].
_FULL_SWING = 1.2
# Place of bodies that are absent [m].
_AWAY = np.array([0.0, 0.0, -10_000.0])


class TrafficBody(NamedTuple):
    """A vehicle or a pedestrian that is registered with a SceneGraph.

    Attributes:
        instance: instance id.
        name: name of the structure.
        semantic_class: class of the structure.
        limbs: rigid parts of the body.
        frames: frame of each limb.
    """

    instance: int
    name: str
    semantic_class: str
    limbs: tuple[Limb, ...]
    frames: tuple[FrameId, ...]


class TrafficMotion(LeafSystem):
    """A system that moves vehicles and pedestrians; it has no state.

    .. pydrake_system::

        name: TrafficMotion
        output_ports:
        - geometry_pose
        - frame_poses
        - body_spatial_velocities
        - moving_instances
        - objects

    A limb L is a rigid part of a vehicle or pedestrian. All outputs depend only
    on time; all except the first are abstract:

    - `geometry_pose`: the poses X_WL of all limbs, for the SceneGraph in which
      they are registered.
    - `frame_poses`: the same poses as a `KnownPoses`, one array for all limbs.
    - `body_spatial_velocities`: list of the velocities V_WL of all limbs,
      expressed in W. From these velocities, a LiDAR computes where the limbs
      are at each moment of a revolution.
    - `moving_instances`: (N,) instance ids of the vehicles and pedestrians that
      are faster than `MOVING_SPEED`.
    - `objects`: a `RecordedObjects`, for recorders.

    Attributes:
        source_id: geometry source of the bodies.
        bodies: the vehicles of the plan, and then its pedestrians.
        moving_frames: frame of a limb in the SceneGraph -> number of the limb.
    """

    def __init__(
        self,
        plan: TrafficPlan,
        bodies: Sequence[TrafficBody],
        source_id: SourceId,
        turn: float,
    ):
        """Declares the ports.

        Args:
            plan: their motion.
            bodies: the vehicles of the plan, and then its pedestrians.
            source_id: geometry source of the bodies.
            turn: time over which the output `body_spatial_velocities` is
                averaged [s]: the duration of a LiDAR's revolution.
        """
        super().__init__()
        self.source_id = source_id
        self._plan = plan
        self.bodies = tuple(bodies)
        self._limbs = LimbTable([body.limbs for body in bodies])
        frames = (frame for body in self.bodies for frame in body.frames)
        # Frame of a limb -> its row in the ports of all limbs.
        self.moving_frames: dict[FrameId, int] = {
            frame: row for row, frame in enumerate(frames)
        }
        self._turn = turn
        self._instances = np.array([b.instance for b in bodies], np.uint16)
        self._sizes = np.array(
            [kind.size for kind in plan.kinds]
            + [WALKER_SIZE] * (len(bodies) - len(plan.kinds))
        ).reshape(-1, 3)
        now = {self.time_ticket()}
        self._states = self.DeclareCacheEntry(
            description="where bodies are",
            value_producer=ValueProducer(
                allocate=lambda: Value(object()),
                calc=lambda context, value: value.set_value(
                    bodies_at(plan, context.get_time())
                ),
            ),
            prerequisites_of_calc=now,
        )
        for name, model, calc in (
            ("frame_poses", Value(object()), self._calc_frame_poses),
            ("geometry_pose", Value(FramePoseVector()), self._calc_pose),
            ("moving_instances", Value(np.zeros(0, int)), self._calc_moving),
            ("objects", Value(()), self._calc_objects),
            (
                "body_spatial_velocities",
                AbstractValue.Make([SpatialVelocity()]),
                self._calc_velocities,
            ),
        ):
            self.DeclareAbstractOutputPort(name, model.Clone, calc, now)

    def _calc_frame_poses(
        self, context: Context, output: AbstractValue
    ) -> None:
        X_WLs = self._limbs.poses(self._states.Eval(context))
        output.set_value(KnownPoses(self.moving_frames, X_WLs))

    def _calc_pose(self, context: Context, output: AbstractValue) -> None:
        poses = FramePoseVector()
        X_WLs = self._limbs.poses(self._states.Eval(context))
        for frame, row in self.moving_frames.items():
            poses.set_value(frame, RigidTransform(X_WLs[row]))
        output.set_value(poses)

    def _calc_velocities(self, context: Context, output: AbstractValue) -> None:
        now: BodyStates = self._states.Eval(context)
        later = bodies_at(self._plan, context.get_time() + self._turn)
        # A body appears and disappears only between two revolutions.
        later = later._replace(present=now.present)
        X_0, X_1 = map(self._limbs.poses, (now, later))
        R_0, R_1 = X_0[:, :3, :3].copy(), X_1[:, :3, :3].copy()
        turned = Rotation.from_matrix(product(R_1, R_0.transpose(0, 2, 1)))
        w = turned.as_rotvec() / self._turn
        v = (X_1 - X_0)[:, :3, 3] / self._turn
        output.set_value(list(map(SpatialVelocity, w, v)))

    def _calc_moving(self, context: Context, output: AbstractValue) -> None:
        states: BodyStates = self._states.Eval(context)
        output.set_value(self._instances[states.is_moving])

    def _calc_objects(self, context: Context, output: AbstractValue) -> None:
        states: BodyStates = self._states.Eval(context)
        here = np.flatnonzero(states.present)
        bodies = [self.bodies[k] for k in here]
        p_WO = states.p_WB + states.up_W * self._sizes[:, 2:] / 2
        output.set_value(
            RecordedObjects(
                self._instances[here],
                tuple(body.name for body in bodies),
                tuple(body.semantic_class for body in bodies),
                p_WO[here],
                states.quat_xyzw[here],
                self._sizes[here],
                states.v_WB[here],
                states.yaw_rate[here],
                states.is_moving[here],
            )
        )


def traffic_structures(plan: TrafficPlan, first: int = 1) -> StructureTable:
    """Returns a table with name, instance id and class of all bodies.

    Args:
        plan: the traffic.
        first: instance id of the first body; the ids of the other bodies
            follow.

    Raises:
        InputError: there are not enough ids.
    """
    names = [
        (f"traffic_{kind.name}_{k:03d}", kind.semantic_class)
        for k, kind in enumerate(plan.kinds, 1)
    ]
    num_walkers = plan.walkers.values.shape[1]
    names += [(f"walker_{k:03d}", "person") for k in range(1, num_walkers + 1)]
    if first + len(names) - 1 > MAX_INSTANCE:
        raise InputError(
            f"traffic: {len(names)} bodies and {first - 1} structures are "
            f"more than instance ids can count ({MAX_INSTANCE})"
        )
    return StructureTable(
        StructureEntry(
            first + k, name, semantic_class, materials={"trim": "trim"}
        )
        for k, (name, semantic_class) in enumerate(names)
    )


def add_traffic(
    builder: DiagramBuilder,
    scene_graph: SceneGraph,
    plan: TrafficPlan,
    *,
    seed: int = 0,
    structures: StructureTable | None = None,
    turn: float = 0.05,
    name: str = "traffic",
) -> TrafficMotion:
    """Adds moving vehicles and pedestrians to a diagram.

    Args:
        builder: builder of a diagram with `scene_graph`.
        scene_graph: SceneGraph to which the geometry is added.
        plan: the traffic.
        seed: seed of colours and sizes.
        structures: table with an instance id for each body; by default
            `traffic_structures` of the plan.
        turn: time over which the output `body_spatial_velocities` is averaged
            [s]: the revolution time of a LiDAR with motion distortion.
        name: name of the system and of the geometry source.

    Returns:
        The system that moves the bodies, connected to the SceneGraph.

    Raises:
        ValueError: the diagram has a system of that name.

    Example:
        from cns_drake import add_traffic

        traffic = add_traffic(builder, scene_graph, plan)
    """
    check_unused_names(builder, name)
    if structures is None:
        structures = traffic_structures(plan)
    entries = [structures[entry.name] for entry in traffic_structures(plan)]
    source = scene_graph.RegisterSource(name)
    bodies = []
    for k, entry in enumerate(entries):
        rng = np.random.default_rng([seed, k])
        if k < len(plan.kinds):
            limbs = vehicle_limbs(plan.kinds[k], rng)
        else:
            limbs = walker_limbs(rng)
        frames = _register(scene_graph, source, entry.name, limbs)
        bodies.append(
            TrafficBody(
                entry.instance, entry.name, entry.semantic_class, limbs, frames
            )
        )
    traffic = TrafficMotion(plan, bodies, source, turn)
    builder.AddNamedSystem(name, traffic)
    builder.Connect(
        traffic.GetOutputPort("geometry_pose"),
        scene_graph.get_source_pose_port(traffic.source_id),
    )
    return traffic


def connect_traffic(
    builder: DiagramBuilder,
    traffic: TrafficMotion,
    lidar: System,
    goes_on: bool = False,
) -> None:
    """Connects traffic to a LiDAR, which then labels the bodies as moving.

    Args:
        builder: builder of a diagram with both systems.
        traffic: system that moves the traffic.
        lidar: LiDAR, whose port `frame_poses` may be connected already.
        goes_on: whether bodies keep moving during a revolution of the LiDAR. If
            so, the LiDAR's `moving_bodies` must be the `moving_frames` of
            `traffic`.
    """
    for name in ("moving_instances", "frame_poses", "body_spatial_velocities"):
        if goes_on or name != "body_spatial_velocities":
            port = lidar.GetInputPort(name)
            if not builder.IsConnectedOrExported(port):
                builder.Connect(traffic.GetOutputPort(name), port)


def _register(
    scene_graph: SceneGraph, source: SourceId, name: str, limbs: Sequence[Limb]
) -> tuple[FrameId, ...]:
    """Registers a geometry frame for each limb, and returns these frames.

    Args:
        scene_graph: SceneGraph in which the frames are registered.
        source: geometry source of the bodies.
        name: name of the body, with which the names of its frames begin.
        limbs: rigid parts of the body.
    """
    frames = []
    for limb in limbs:
        frame = geometry.GeometryFrame(f"{name}_{limb.name}")
        frames.append(scene_graph.RegisterFrame(source, frame))
        for shape in limb.shapes:
            label = f"{name}/{limb.name}_{shape.name}"
            number = scene_graph.RegisterGeometry(
                source,
                frames[-1],
                geometry.GeometryInstance(shape.X_LS, shape.shape, label),
            )
            for properties in (
                geometry.PerceptionProperties(),
                geometry.IllustrationProperties(),
            ):
                rgba = geometry.Rgba(*shape.rgb, 1.0)
                properties.AddProperty("phong", "diffuse", rgba)
                scene_graph.AssignRole(source, number, properties)
    return tuple(frames)


class BodyStates(NamedTuple):
    """The states of N bodies at one time: first vehicles, then pedestrians.

    Attributes:
        p_WB: (N, 3) centre of the base of each body's box, on the ground [m].
        v_WB: (N, 3) velocity [m/s].
        yaw, pitch: (N,) yaw and pitch [rad].
        yaw_rate: (N,) yaw rate [rad/s].
        present: (N,) bool, whether the body exists at this time.
        swing: (N,) position of a pedestrian in its gait, from -1 to 1.
    """

    p_WB: np.ndarray
    v_WB: np.ndarray
    yaw: np.ndarray
    pitch: np.ndarray
    yaw_rate: np.ndarray
    present: np.ndarray
    swing: np.ndarray

    @property
    def up_W(self) -> np.ndarray:
        """The upward axes (N, 3) of the bodies."""
        (cy, sy), (cp, sp) = ((cos(a), sin(a)) for a in (self.yaw, self.pitch))
        return np.stack([cy * sp, sy * sp, cp], axis=-1)

    @property
    def quat_xyzw(self) -> np.ndarray:
        """The orientations (N, 4) of the bodies as quaternions (x, y, z, w)."""
        (cy, sy), (cp, sp) = (
            (cos(a / 2), sin(a / 2)) for a in (self.yaw, self.pitch)
        )
        return np.stack([-sy * sp, cy * sp, sy * cp, cy * cp], axis=-1)

    @property
    def is_moving(self) -> np.ndarray:
        """(N,) bool: which bodies are labelled as moving."""
        return np.linalg.norm(self.v_WB, axis=-1) > MOVING_SPEED


def bodies_at(plan: TrafficPlan, t: float) -> BodyStates:
    """Returns the states of all bodies at a time.

    Args:
        plan: the traffic.
        t: time since the start of the drive [s].
    """
    vehicles, vehicle_rates = plan.vehicles.at(t)
    walkers, walker_rates = plan.walkers.at(t)
    both = np.concatenate([vehicles[:, :4], walkers[:, :4]])
    rates = np.concatenate([vehicle_rates[:, :4], walker_rates[:, :4]])
    speed = np.hypot(walker_rates[:, 0], walker_rates[:, 1])
    swing = sin(walkers[:, 4]) * np.minimum(speed / _FULL_SWING, 1.0)
    return BodyStates(
        p_WB=both[:, :3],
        v_WB=rates[:, :3],
        yaw=both[:, 3],
        pitch=np.append(vehicles[:, 4], np.zeros(len(walkers))),
        yaw_rate=rates[:, 3],
        present=np.append(
            plan.vehicles.is_present(t), plan.walkers.is_present(t)
        ),
        swing=np.append(np.zeros(len(vehicles)), swing),
    )


class LimbTable:
    """The M rigid limbs of N bodies, in the order of the bodies.

    Attributes:
        body: (M,) number of the body to which each limb belongs.
    """

    def __init__(self, bodies: Sequence[tuple[Limb, ...]]):
        """Takes the limbs of each body."""
        self.body = np.repeat(np.arange(len(bodies)), [len(b) for b in bodies])
        limbs = [limb for limbs in bodies for limb in limbs]
        self._joint = np.array([limb.joint for limb in limbs]).reshape(-1, 3)
        self._swing = np.array([limb.swing for limb in limbs])

    def poses(self, states: BodyStates) -> np.ndarray:
        """Returns the poses X_WL (M, 4, 4) of all limbs in the world.

        The limbs of a body that has not arrived yet, or has left, are far below
        the ground.
        """
        body, p = self.body, self._joint.T
        # A forward swing is a rotation about -y.
        pitch = states.pitch[body] - self._swing * states.swing[body]
        cy, sy = cos(states.yaw)[body], sin(states.yaw)[body]
        X_WLs = np.zeros((len(body), 4, 4))
        X_WLs[:, 3, 3] = 1.0
        p_WB = np.where(states.present[:, None], states.p_WB, _AWAY)[body]
        cp, sp = cos(states.pitch)[body], sin(states.pitch)[body]
        X_WLs[:, 0, 3] = cy * cp * p[0] - sy * p[1] + cy * sp * p[2]
        X_WLs[:, 1, 3] = sy * cp * p[0] + cy * p[1] + sy * sp * p[2]
        X_WLs[:, 2, 3] = cp * p[2] - sp * p[0]
        X_WLs[:, :3, 3] += p_WB
        cp, sp = cos(pitch), sin(pitch)
        X_WLs[:, 0, 0], X_WLs[:, 0, 1], X_WLs[:, 0, 2] = cy * cp, -sy, cy * sp
        X_WLs[:, 1, 0], X_WLs[:, 1, 1], X_WLs[:, 1, 2] = sy * cp, cy, sy * sp
        X_WLs[:, 2, 0], X_WLs[:, 2, 2] = -sp, cp
        return X_WLs
