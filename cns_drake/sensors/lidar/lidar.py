"""A LiDAR that scans the geometry of a SceneGraph."""

from __future__ import annotations

from collections.abc import Collection, Mapping
import math
from types import NoneType
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from pydrake.common.value import AbstractValue, Value
from pydrake.geometry import FrameId, GeometryId, QueryObject, Role
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.multibody.math import SpatialVelocity
from pydrake.perception import BaseField, Fields, PointCloud
from pydrake.systems.framework import (
    BasicVector,
    BusValue,
    CacheEntry,
    Context,
    InputPort,
    LeafSystem,
    OutputPort,
    State,
    ValueProducer,
)

from cns_drake.ray_casting import (
    EVERYWHERE,
    NOTHING_KNOWN,
    Ball,
    KnownPoses,
    Motion,
    RayCastingScene,
)
from cns_drake.scene import (
    listed_geometry,
    nearest_ns,
    optional_value,
    shortly_before,
    starts_late,
)
from cns_drake.sensors.lidar.beams import BeamPattern, period_of_rate
from cns_drake.sensors.lidar.measurement import IDEAL, MeasurementModel
from cns_drake.sensors.lidar.ray_queries import (
    RayHits,
    cast_free_rays,
    geometry_ids,
)
from cns_drake.sensors.lidar.scan_assembly import POINT_DTYPE, set_points
from cns_drake.sensors.lidar.scanner import MeasuredReturns, Scanner
from cns_drake.sensors.lidar.seen_geometry import (
    GeometryView,
    Place,
    SeenGeometry,
    Structures,
)
from evaluation.base import NS_PER_S, check_type, of_type, product, rotated

if TYPE_CHECKING:
    # Slow to import, and ideal returns do without.
    from cns_drake.sensors.returns.calibrated import CalibratedReturns

_WITHOUT_GREY = Fields(BaseField.kXYZs)
_WITH_GREY = Fields(BaseField.kXYZs | BaseField.kRGBs)
# A pose in the port `sweep`: three rows of four numbers.
_POSE_SIZE = 12


class _Capture(NamedTuple):
    """A scan that a discrete LiDAR has taken.

    Attributes:
        time_ns: time of the capture [ns]; None if no scan has been taken.
        points: points of the scan.
        measured: returns, with the geometry that each comes from.
        instance: (num_geometries,) uint16 structure of each geometry.
        poses: positions (K, 3) and rotations (K, 3, 3) of S.
        X_WS: pose of S.
    """

    time_ns: int | None
    points: np.ndarray
    measured: MeasuredReturns | None
    instance: np.ndarray
    poses: tuple[np.ndarray, np.ndarray]
    X_WS: RigidTransform


_NO_CAPTURE = _Capture(
    None,
    np.empty(0, POINT_DTYPE),
    None,
    np.empty(0, np.uint16),
    (np.zeros((1, 3)), np.eye(3)[None]),
    RigidTransform(),
)


class _Held(NamedTuple):
    """The state of a discrete LiDAR.

    Attributes:
        taken: the last scan that was taken.
        shown: the scan on the output ports: the same, after `output_delay`.
    """

    taken: _Capture = _NO_CAPTURE
    shown: _Capture = _NO_CAPTURE

    def __deepcopy__(self, memo: dict) -> _Held:
        # A Context is cloned together with this value, which never changes.
        return self


class SampleTimes(NamedTuple):
    """When a discrete LiDAR takes scans, and when its ports show them.

    Attributes:
        period: time between two scans [s].
        offset: time of the first periodic scan [s].
        delay: time from a scan to its appearance on the ports [s].
    """

    period: float
    offset: float
    delay: float


def sample_times(
    rate: float | None, capture_offset: float, output_delay: float
) -> SampleTimes | None:
    """Returns when a discrete LiDAR takes scans; None for a continuous one.

    Args:
        rate: scans per second; None for a continuous LiDAR.
        capture_offset: time of the first periodic scan [s].
        output_delay: time from a scan to its appearance on the ports [s].

    Raises:
        TypeError: an argument is no number.
        ValueError: the rate is not positive or too high, the offset or delay
            is out of range, or is given without a rate.
    """
    period = math.inf if rate is None else period_of_rate(rate)
    for name, time, end in (
        ("capture_offset", capture_offset, math.inf),
        ("output_delay", output_delay, period),
    ):
        if not 0.0 <= of_type(time, float, name) < end:
            raise ValueError(
                f"{name}: {time!r} is not a time from 0 to below {end:g} s"
            )
        if rate is None and time:
            raise ValueError(f"{name}: only a LiDAR with a rate has one")
    if rate is None:
        return None
    return SampleTimes(period, float(capture_offset), float(output_delay))


class Lidar(LeafSystem):
    """A LiDAR that sees all geometry with a given role, except its own body.

    .. pydrake_system::

        name: Lidar
        input_ports:
        - geometry_query
        - geometry (optional)
        - moving_instances (optional)
        - sweep (optional)
        - frame_poses (optional)
        - noise_draw (optional)
        - body_spatial_velocities (with `moving_bodies`)
        output_ports:
        - scan
        - point_cloud_S
        - point_cloud_W
        - positions_W
        - X_WS
        - scan_time

    Frames: W is the world, P the parent frame, B the body of the sensor, and S
    the frame of the measurements, which coincides with B (x forward, y left, z
    up). `scan` is a structured array of `POINT_DTYPE`, one record per
    return in firing order; beams whose nearest surface is closer than the
    minimum range or farther than the maximum range return nothing.
    `point_cloud_S` holds the same positions as a Drake point cloud, whose
    colours are the intensities as greys. Grey 255 stands for an intensity of 1,
    or of 255 with calibrated returns. `point_cloud_W` has the same points in
    the world frame; `positions_W` is `point_cloud_W` without the colours.
    `X_WS` is the pose of S at the time of the output. `scan_time` is this time
    [s], like RgbdSensor's `image_time`.

    A scan is one revolution of the LiDAR, which starts at the time of the
    output or, with a causal LiDAR, ends at this time. By default all beams are
    cast from the pose of S at the time of the output (a deskewed scan), which
    follows from the pose of P in the SceneGraph.

    A LiDAR with a `rate` is discrete, like RgbdSensorDiscrete. A periodic event
    takes a scan and holds it in the state of the Context. All output ports,
    `EvalGeometryIds` and `EvalInstances` show what is held, and depend on
    nothing else; before the first scan, they are empty, and `scan_time` is NaN.
    A scan comes some roundings before its nominal time: an event at this time
    that reads it, such as that of a publisher, finds it. Its `scan_time` is
    the nominal time in whole nanoseconds. `Simulator.Initialize` takes a scan
    at once. With an `output_delay`, a second event shows the scan later, and
    `Simulator.Initialize` takes one only at the time of a periodic scan.
    `CastRays` and `EvalScene` always use the present geometry.

    If the port `sweep` is connected, the poses of P come from this port and not
    from the SceneGraph: one pose for each column, at the column's firing time,
    for motion distortion. The port is a vector of 12 numbers per column: the
    three rows of the matrix [R_WP p_WP]. With motion distortion, a point is
    expressed in S at the firing time t of its beam, as a real unit reports the
    point: X_WS(start of the revolution + t) transforms it to the world. During
    the revolution, all other moving geometry stays where it is at the time of
    the output.

    If the LiDAR was made with the argument `moving_bodies`, P and all other
    bodies of a plant move during the revolution, with the velocities that they
    have at the time of the output. The port `body_spatial_velocities` supplies
    these velocities as a MultibodyPlant does: a list of V_WB over the plant's
    bodies, expressed in the world. Each beam is cast at its own firing time,
    with S and the geometry at their poses of that time. The point that the beam
    measures is expressed in S at that time.

    The field `instance` of a point is the number of the structure that was hit.
    A structure is a model, or all geometries whose names are equal up to the
    first slash. `EvalInstances` maps the number to geometries.
    `EvalGeometryIds` returns the geometry of each single point.

    `moving_instances` (abstract) lists the instance ids of the structures that
    are moving: their points get the label of the moving class.

    `noise_draw` (one number) chooses the random numbers: each value other than
    0 stands for other noise. Without it, and with 0, they follow from the seed
    alone. `add_lidar` connects the port to a system whose state is 0 by default
    and random after `SetRandomContext`.

    `frame_poses` (abstract, `KnownPoses`) repeats poses X_WF of the SceneGraph
    in one array. Many poses are read faster from this array than from the
    SceneGraph.

    The system casts rays on a hierarchy of its own, of which it rebuilds the
    parts that have changed. `geometry` lists the geometry; the output port of
    `geometry_port` computes this list only after a change. If `geometry` is not
    connected, the LiDAR lists all geometry at every scan, which takes longer
    than the scan in a world of thousands of geometries.

    Attributes:
        parent_frame_id: the frame P that carries the LiDAR.
        X_PB: the pose of B in P, named as in Drake's RgbdSensor.
        pattern: the beams of a revolution.
        role: the role of the geometry that the LiDAR sees.
        causal: whether a scan is the revolution that ends at the time of the
            output.
        samples: when a discrete LiDAR takes scans; None for a continuous one.

    Example:
        from cns_drake import Lidar, make_beam_pattern

        lidar = Lidar(frame_id, X_PB, make_beam_pattern("os1-64", 0.1))
    """

    def __init__(
        self,
        parent_frame_id: FrameId,
        X_PB: RigidTransform,
        pattern: BeamPattern,
        *,
        measurement: MeasurementModel = IDEAL,
        returns: CalibratedReturns | None = None,
        causal: bool = False,
        rate: float | None = None,
        capture_offset: float = 0.0,
        output_delay: float = 0.0,
        moving_bodies: Mapping[FrameId, int] | None = None,
        role: Role = Role.kPerception,
        unseen: Collection[Place] | None = None,
        structures: Structures | None = None,
        anchored_frames: Collection[FrameId] = (),
        num_threads: int = 1,
    ):
        """Constructs the LiDAR.

        Args:
            parent_frame_id: the frame P that carries the sensor.
            X_PB: pose of the sensor's body B in P.
            pattern: the beams.
            measurement: the model of noise, losses and rounding.
            returns: the model of a real unit; None for ideal returns. With a
                model, only the resolution is taken from `measurement`.
            causal: see `add_lidar`, as for the following arguments.
            rate: scans per second, at most 1000 and one per revolution.
            capture_offset: time of the first periodic scan [s].
            output_delay: time until a scan is on the ports [s].
            moving_bodies: frame -> index of its body in the port
                `body_spatial_velocities`. The LiDAR has this port only if this
                argument is given.
            role: see `GeometryView`, as for the following arguments.
            unseen: what is not seen.
            structures: table of labels and instance ids.
            anchored_frames: frames that never move.
            num_threads: number of threads that share the rays.

        Raises:
            TypeError: an argument is of another type.
            ValueError: limits or period of the pattern are impossible, the pose
                is not finite, or an argument is out of range.
        """
        super().__init__()
        view = GeometryView(
            role=role,
            unseen=unseen,
            structures=structures,
            anchored_frames=anchored_frames,
            num_threads=num_threads,
        )
        check_type("parent_frame_id", parent_frame_id, FrameId)
        check_type("X_PB", X_PB, RigidTransform)
        check_type("pattern", pattern, BeamPattern)
        check_type("measurement", measurement, MeasurementModel)
        check_type("causal", causal, bool)
        check_type("moving_bodies", moving_bodies, Mapping, NoneType)
        pattern.check()
        if not np.isfinite(X_PB.GetAsMatrix34()).all():
            raise ValueError("X_PB: not finite")
        self.parent_frame_id = parent_frame_id
        self.X_PB = RigidTransform(X_PB)
        self.pattern = pattern
        self.causal = causal
        self.role = role
        self.samples = sample_times(rate, capture_offset, output_delay)
        # A rate that was computed from the duration of a revolution is allowed.
        if self.samples and self.samples.period < pattern.period * (1 - 1e-9):
            raise ValueError(
                f"rate: {rate:g} scans per second, but a revolution takes "
                f"{pattern.period:g} s; give a pattern with a shorter period"
            )
        self._scanner = Scanner(pattern, measurement, returns)
        self._moving_bodies = dict(moving_bodies or {})
        self._declare_inputs(has_velocities=moving_bodies is not None)
        self._declare_samples()
        self._declare_caches(view)
        self._declare_outputs()

    def _declare_inputs(self, *, has_velocities: bool) -> None:
        """Declares the input ports, in the order of their indices."""
        declare = self.DeclareAbstractInputPort
        self._geometry_query = declare("geometry_query", Value(QueryObject()))
        self._geometry = declare("geometry", Value(BusValue()))
        self._moving = declare(
            "moving_instances", Value(np.zeros(0, np.uint16))
        )
        self._sweep = self.DeclareVectorInputPort(
            "sweep", _POSE_SIZE * len(self._scanner.column_times)
        )
        self._frame_poses = declare("frame_poses", Value(object()))
        self._noise_draw = self.DeclareVectorInputPort("noise_draw", 1)
        self._velocities: InputPort | None = None
        if has_velocities:
            self._velocities = declare(
                "body_spatial_velocities",
                AbstractValue.Make([SpatialVelocity()]),
            )

    def _declare_samples(self) -> None:
        """Declares the scan that a discrete LiDAR holds."""
        if self.samples is None:
            return
        self._state = self.DeclareAbstractState(Value[object](_Held()))
        period, offset, delay = self.samples
        events = [(offset, self._take)]
        if delay:
            events.append((offset + delay, self._show))
        # Before the events of those who read the scan, such as a recorder.
        for time, update in events:
            self.DeclarePeriodicUnrestrictedUpdateEvent(
                period_sec=shortly_before(period, 2),
                offset_sec=shortly_before(time, 2),
                update=update,
            )
        self.DeclareInitializationUnrestrictedUpdateEvent(self._initialize)

    def _declare_caches(self, view: GeometryView) -> None:
        """Declares the scenes for ray casting, the returns, and the scan."""
        self._pose_inputs = {
            port.ticket()
            for port in (self._geometry_query, self._sweep, self._frame_poses)
        }
        self._poses_inputs = self._pose_inputs | (
            {self._velocities.ticket()} if self._velocities else set()
        )
        # Kept until the SceneGraph changes. Beams of a scan cannot hit geometry
        # beyond their range, so the scene of scans may leave such geometry at
        # an old pose.
        self._seen_in_reach, self._seen_everywhere = (
            self.DeclareCacheEntry(
                description=f"ray-casting scene, {what}",
                value_producer=ValueProducer(
                    allocate=lambda: Value(
                        SeenGeometry(self.parent_frame_id, view)
                    ),
                    calc=lambda context, seen, calc_ball=calc_ball: (
                        self._update_seen(
                            context, seen.get_value(), calc_ball(context)
                        )
                    ),
                ),
                prerequisites_of_calc=self._poses_inputs
                | {self._geometry.ticket()},
            )
            for what, calc_ball in (
                ("within reach of the beams", self._calc_ball),
                ("complete", lambda context: EVERYWHERE),
            )
        )
        seen = {self._seen_in_reach.ticket()}
        varying = {self.time_ticket()} if self._scanner.varies else set()
        if self._scanner.is_random:
            varying.add(self._noise_draw.ticket())
        self._measured = self.DeclareCacheEntry(
            description="returns, with their geometry",
            value_producer=ValueProducer(
                allocate=lambda: Value(object()), calc=self._calc_measured
            ),
            prerequisites_of_calc=seen | self._poses_inputs | varying,
        )
        # Apart from the returns: which structures move changes labels only.
        self._points = self.DeclareCacheEntry(
            description="points of the scan",
            value_producer=ValueProducer(
                allocate=lambda: Value(object()), calc=self._calc_points
            ),
            prerequisites_of_calc=seen
            | {self._measured.ticket(), self._moving.ticket()},
        )

    def _declare_outputs(self) -> None:
        """Declares the output ports, in the order of their indices."""
        scan = {self._points.ticket()}
        time = {self.time_ticket()}
        poses, pose = self._poses_inputs, self._pose_inputs
        if self.samples is not None:
            scan = time = {self.abstract_state_ticket(self._state)}
            poses = pose = scan
        self.DeclareAbstractOutputPort(
            "scan",
            alloc=lambda: Value(np.empty(0, POINT_DTYPE)),
            calc=lambda context, output: output.set_value(
                self._eval_points(context)
            ),
            prerequisites_of_calc=scan,
        )
        for name, in_world, fields in (
            ("point_cloud_S", False, _WITH_GREY),
            ("point_cloud_W", True, _WITH_GREY),
            ("positions_W", True, _WITHOUT_GREY),
        ):
            self.DeclareAbstractOutputPort(
                name,
                alloc=lambda fields=fields: Value(PointCloud(0, fields)),
                calc=lambda context, output, in_world=in_world: self._set_cloud(
                    output.get_mutable_value(),
                    self._eval_points(context),
                    self._eval_poses(context) if in_world else None,
                ),
                prerequisites_of_calc=scan | (poses if in_world else set()),
            )
        self.DeclareAbstractOutputPort(
            "X_WS",
            alloc=lambda: Value(RigidTransform()),
            calc=self._calc_X_WS,
            prerequisites_of_calc=pose,
        )
        self.DeclareVectorOutputPort(
            "scan_time",
            1,
            self._calc_scan_time,
            prerequisites_of_calc=time,
        )

    @property
    def is_random(self) -> bool:
        """Whether scans depend on a seed."""
        return self._scanner.is_random

    def query_object_input_port(self) -> InputPort:
        """Returns the port `geometry_query`, to connect to a SceneGraph."""
        return self._geometry_query

    def scan_output_port(self) -> OutputPort:
        """Returns the port `scan`."""
        return self.GetOutputPort("scan")

    def point_cloud_S_output_port(self) -> OutputPort:
        """Returns the port `point_cloud_S`."""
        return self.GetOutputPort("point_cloud_S")

    def point_cloud_W_output_port(self) -> OutputPort:
        """Returns the port `point_cloud_W`."""
        return self.GetOutputPort("point_cloud_W")

    def positions_W_output_port(self) -> OutputPort:
        """Returns the port `positions_W`."""
        return self.GetOutputPort("positions_W")

    def X_WS_output_port(self) -> OutputPort:
        """Returns the port `X_WS`."""
        return self.GetOutputPort("X_WS")

    def scan_time_output_port(self) -> OutputPort:
        """Returns the port `scan_time`."""
        return self.GetOutputPort("scan_time")

    def EvalScene(self, context: Context) -> RayCastingScene:
        """Returns the scene of all geometry that the LiDAR sees in a Context.

        Rays can be cast on this scene.

        Raises:
            RuntimeError: the Context does not belong to this LiDAR.
        """
        scene = self._eval_all(context).scene
        assert scene is not None
        return scene

    def EvalGeometryIds(self, context: Context) -> list[GeometryId | None]:
        """Returns the geometry of each point of `scan` in a Context.

        The geometry is None for a point without a surface, such as rain. To
        find the body of a geometry, ask the SceneGraph's inspector for the
        geometry's frame, and the plant for this frame's body.

        Raises:
            RuntimeError: the Context does not belong to this LiDAR.
        """
        self._check_context(context)
        held = self._shown(context)
        measured = self._measured.Eval(context) if not held else held.measured
        if measured is None:
            return []
        return geometry_ids(measured.geometries, measured.geometry)

    def EvalInstances(
        self, context: Context
    ) -> dict[int, tuple[GeometryId, ...]]:
        """Returns the visible geometries of each structure, by instance id.

        Raises:
            RuntimeError: the Context does not belong to this LiDAR.

        Example:
            gids = lidar.EvalInstances(lidar_context)[scan["instance"][0]]
            frame_id = scene_graph.model_inspector().GetFrameId(gids[0])
            body = plant.GetBodyFromFrameId(frame_id)
            print(plant.GetModelInstanceName(body.model_instance()))
        """
        self._check_context(context)
        held = self._shown(context)
        if held is None:
            seen = _eval_seen(self._seen_in_reach, context)
            instances, shapes = seen.instance, seen.built
        else:
            instances = held.instance
            shapes = held.measured.geometries if held.measured else ()
        found: dict[int, tuple[GeometryId, ...]] = {}
        for instance, shape in zip(instances.tolist(), shapes, strict=True):
            found[instance] = (*found.get(instance, ()), shape.geometry_id)
        return found

    def CastRays(
        self,
        context: Context,
        p_WR: np.ndarray,
        d_W: np.ndarray,
        max_range: float | np.ndarray = np.inf,
    ) -> RayHits:
        """Casts N rays on the geometry that the LiDAR sees in a Context.

        The rays do not depend on the LiDAR's pattern or noise. For rays that
        start within 1 km of the LiDAR, ranges of up to 1 km are exact to 1e-4
        m.

        Args:
            context: context of the LiDAR.
            p_WR: (N, 3) origins in the world, or (3,) if all rays have the same
                origin [m].
            d_W: (N, 3) unit directions in the world.
            max_range: greatest range [m], one for all rays or (N,).

        Raises:
            RuntimeError: the Context does not belong to this LiDAR.
            ValueError: shapes do not match, a direction has another length than
                1, or a number is not finite (ranges may be infinite).
        """
        seen = self._eval_all(context)
        # The time of the output.
        time = float(self.causal)
        return cast_free_rays(seen, p_WR, d_W, max_range, time)

    def _check_context(self, context: Context) -> None:
        """Checks that a Context belongs to this LiDAR.

        With another Context, Drake would read the cache entries of another
        system, or invalid memory.

        Raises:
            RuntimeError: the Context does not belong to this LiDAR.
        """
        try:
            self.ValidateContext(context)
        except RuntimeError:
            name = self.get_name()
            raise RuntimeError(
                f"context: not the Context of the LiDAR '{name}'; give "
                "lidar.GetMyContextFromRoot(context of the Diagram)"
            ) from None

    def _eval_all(self, context: Context) -> SeenGeometry:
        """Returns all that the LiDAR sees, at the poses of a Context.

        Raises:
            RuntimeError: the Context does not belong to this LiDAR.
        """
        self._check_context(context)
        is_limited = self._frame_poses.HasValue(context)
        return _eval_seen(
            self._seen_everywhere if is_limited else self._seen_in_reach,
            context,
        )

    def _take(self, context: Context, state: State) -> None:
        """Takes a scan, and shows it unless there is a delay."""
        assert self.samples is not None
        taken = self._capture(context, 2)
        held = context.get_abstract_state(self._state).get_value()
        shown = held.shown if self.samples.delay else taken
        self._hold(state, _Held(taken, shown))

    def _show(self, context: Context, state: State) -> None:
        """Shows the last scan after its delay."""
        taken = context.get_abstract_state(self._state).get_value().taken
        self._hold(state, _Held(taken, taken))

    def _initialize(self, context: Context, state: State) -> None:
        """Forgets the scans of an earlier simulation, and takes the first."""
        assert self.samples is not None
        period, offset, delay = self.samples
        taken = _NO_CAPTURE
        if not delay or starts_late(context.get_time(), period, offset, 2):
            taken = self._capture(context, 0)
        self._hold(state, _Held(taken, _NO_CAPTURE if delay else taken))

    def _capture(self, context: Context, times: int) -> _Capture:
        """Returns the scan of an event that comes `times` before its time."""
        return _Capture(
            nearest_ns(context.get_time(), times),
            self._points.Eval(context),
            self._measured.Eval(context),
            _eval_seen(self._seen_in_reach, context).instance,
            self._calc_poses(context),
            self._calc_pose(context),
        )

    def _hold(self, state: State, held: _Held) -> None:
        state.get_mutable_abstract_state(self._state).set_value(held)

    def _shown(self, context: Context) -> _Capture | None:
        """Returns the scan that a discrete LiDAR shows; None if continuous."""
        if self.samples is None:
            return None
        return context.get_abstract_state(self._state).get_value().shown

    def _eval_points(self, context: Context) -> np.ndarray:
        """Returns the points of `scan`."""
        held = self._shown(context)
        return self._points.Eval(context) if held is None else held.points

    def _eval_poses(self, context: Context) -> tuple[np.ndarray, np.ndarray]:
        """Returns the poses of S during the revolution of `scan`."""
        held = self._shown(context)
        return self._calc_poses(context) if held is None else held.poses

    def _update_seen(
        self, context: Context, seen: SeenGeometry, ball: Ball
    ) -> None:
        """Updates the geometry that the LiDAR sees in a ball."""
        listed = optional_value(self._geometry, context)
        seen.update(
            self._geometry_query.Eval(context),
            None if listed is None else listed_geometry(listed),
            self._calc_motions(context),
            self._known_poses(context),
            ball,
            self._calc_pose(context).translation(),
        )

    def _known_poses(self, context: Context) -> KnownPoses:
        known = optional_value(self._frame_poses, context)
        if known is None:
            return NOTHING_KNOWN
        if not isinstance(known, KnownPoses):
            raise TypeError(
                f"frame_poses: the port gives a {type(known).__name__}, "
                "not KnownPoses"
            )
        return known

    def _calc_ball(self, context: Context) -> Ball:
        """Returns the ball in which beams can meet geometry.

        The ball is infinite if no poses are known without the SceneGraph.
        """
        if not self._frame_poses.HasValue(context):
            return EVERYWHERE
        p_WSset, _ = self._calc_poses(context)
        middle = p_WSset[0]
        way = 0.0
        if len(p_WSset) > 1:
            middle = p_WSset.mean(axis=0)
            way = np.linalg.norm(p_WSset - middle, axis=1).max()
        # A metre of margin for rounding and merged beams.
        return Ball(middle, float(self._scanner.reach() + way) + 1.0)

    def _calc_motions(self, context: Context) -> dict[FrameId, Motion]:
        """Returns moving frame -> its motion during the revolution."""
        if self._velocities is None:
            return {}
        V_WBs = self._velocities.Eval(context)
        duration = self.pattern.period
        start = -duration if self.causal else 0.0
        motions = {
            frame_id: Motion(
                V_WBs[body].rotational(),
                V_WBs[body].translational(),
                duration,
                start,
            )
            for frame_id, body in self._moving_bodies.items()
        }
        return {f: m for f, m in motions.items() if m.w.any() or m.v.any()}

    def _calc_measured(self, context: Context, output: AbstractValue) -> None:
        time = context.get_time()
        if not math.isfinite(time):
            raise ValueError(f"time of the LiDAR's Context: {time} is no time")
        if self.samples is not None:
            time = nearest_ns(time) / NS_PER_S
        # Not `round`: of two scans a period apart, it gives half numbers one.
        revolution = math.floor(time / self.pattern.period + 0.5)
        draw = 0.0
        if self._noise_draw.HasValue(context):
            draw = self._noise_draw.Eval(context)[0]
        output.set_value(
            self._scanner.measure(
                _eval_seen(self._seen_in_reach, context),
                *self._calc_poses(context),
                frame=revolution - self.causal,
                # Its bits; minus 0 is 0, too.
                draw=int(np.float64(draw + 0.0).view(np.uint64)),
            )
        )

    def _calc_points(self, context: Context, output: AbstractValue) -> None:
        seen = _eval_seen(self._seen_in_reach, context)
        moving = optional_value(self._moving, context)
        labels = seen.label if moving is None else seen.labels(moving)
        measured = self._measured.Eval(context)
        output.set_value(
            self._scanner.assemble(measured, labels, seen.instance)
        )

    def _calc_pose(self, context: Context) -> RigidTransform:
        """Returns the pose of S at the time of the output."""
        return self._calc_carrier_pose(context) @ self.X_PB

    def _calc_carrier_pose(self, context: Context) -> RigidTransform:
        """Returns the pose of P at the time of the output."""
        sweep = self._swept_poses(context)
        if sweep is not None and len(sweep[0]) == 1:
            return RigidTransform(RotationMatrix(sweep[1][0]), sweep[0][0])
        query_object = self._geometry_query.Eval(context)
        return self._known_poses(context).find(
            self.parent_frame_id, query_object.GetPoseInWorld
        )

    def _swept_poses(
        self, context: Context
    ) -> tuple[np.ndarray, np.ndarray] | None:
        """Returns the poses of P in the port `sweep`, if it is connected.

        Returns:
            Positions (K, 3) and rotations (K, 3, 3), one for each column.
        """
        numbers = optional_value(self._sweep, context)
        if numbers is None:
            return None
        X_WPset = numbers.reshape(-1, 3, 4)
        return (
            np.ascontiguousarray(X_WPset[:, :, 3]),
            np.ascontiguousarray(X_WPset[:, :, :3]),
        )

    def _calc_poses(self, context: Context) -> tuple[np.ndarray, np.ndarray]:
        """Returns S's positions (K, 3) and rotations (K, 3, 3) in a revolution.

        With motion distortion, K is the number of columns; otherwise K is 1.
        """
        sweep = self._swept_poses(context)
        if sweep is not None:
            p_WPset, R_WPset = sweep
            return (
                p_WPset + rotated(R_WPset, self.X_PB.translation()),
                product(R_WPset, self.X_PB.rotation().matrix()),
            )
        X_WP = self._calc_carrier_pose(context)
        X_WS = X_WP @ self.X_PB
        motion = self._calc_motions(context).get(self.parent_frame_id)
        if motion is not None:
            R_WW0, way_P = motion.at(self._scanner.column_times)
            p_PS_W = X_WS.translation() - X_WP.translation()
            return (
                X_WP.translation() + way_P + rotated(R_WW0, p_PS_W),
                product(R_WW0, X_WS.rotation().matrix()),
            )
        # Copies have the same memory layout as several poses. For Drake's views
        # of its own memory, numba would compile every function of poses again.
        p_WS, R_WS = X_WS.translation(), X_WS.rotation().matrix()
        return np.array([p_WS]), np.array([R_WS])

    def _calc_X_WS(self, context: Context, output: AbstractValue) -> None:
        held = self._shown(context)
        output.set_value(
            self._calc_pose(context) if held is None else held.X_WS
        )

    def _calc_scan_time(self, context: Context, output: BasicVector) -> None:
        held = self._shown(context)
        if held is None:
            output[0] = context.get_time()
        else:
            output[0] = (
                np.nan if held.time_ns is None else held.time_ns / NS_PER_S
            )

    def _set_cloud(
        self,
        cloud: PointCloud,
        scan: np.ndarray,
        poses: tuple[np.ndarray, np.ndarray] | None,
    ) -> None:
        """Sets the points of a scan as a cloud.

        Args:
            scan: (N,) points of `POINT_DTYPE`.
            poses: poses of S if the cloud is in the world; None for S.
        """
        greys = self._scanner.greys(scan["intensity"])
        if poses is None:
            p_SRset = np.stack([scan["x"], scan["y"], scan["z"]])
            set_points(cloud, p_SRset, greys)
            return
        p_WSset, R_WSset = poses
        # The pose of S when each point was measured: one, or each column's.
        columns = self._scanner.column_t_ns
        pose = np.searchsorted(columns, scan["t"]) % len(p_WSset)
        p_SRset = np.stack([scan["x"], scan["y"], scan["z"]], axis=1)
        p_SRset_W = np.einsum("nij,nj->ni", R_WSset[pose], p_SRset)
        set_points(cloud, (p_WSset[pose] + p_SRset_W).T, greys)


def _eval_seen(entry: CacheEntry, context: Context) -> SeenGeometry:
    """Returns the geometry that a cache entry contains in a Context."""
    seen = entry.Eval(context)
    if seen.scene is not None:
        return seen
    # In a cloned Context, whose entry Drake holds to be up to date.
    entry.disable_caching(context)
    try:
        return entry.Eval(context)
    finally:
        entry.enable_caching(context)
