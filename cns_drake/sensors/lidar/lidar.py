"""A LiDAR that scans the geometry of a SceneGraph."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from operator import is_
from typing import Any, NamedTuple

import numpy as np
from pydrake.common.value import AbstractValue, Value
from pydrake.geometry import (
    FrameId,
    GeometryId,
    QueryObject,
    Role,
    SceneGraphInspector,
)
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.multibody.math import SpatialVelocity
from pydrake.perception import PointCloud
from pydrake.systems.framework import (
    Context,
    InputPort,
    LeafSystem,
    ValueProducer,
)

from cns_drake.base.compiled import compiled
from cns_drake.base.elementary import product, rotated
from cns_drake.ray_casting import moving_groups
from cns_drake.ray_casting.ray_casting_scene import RayCastingScene
from cns_drake.ray_casting.ray_groups import Motion
from cns_drake.scene.perception_geometry import (
    GeometryReader,
    PerceptionGeometry,
)
from cns_drake.scene.semantics import CLASS_IDS, moving_id
from cns_drake.scene.structure_table import MAX_INSTANCE, StructureTable
from cns_drake.sensors.lidar.measurement import IDEAL, MeasurementModel, Returns
from cns_drake.sensors.lidar.patterns import POINT_DTYPE, BeamPattern, Beams
from cns_drake.sensors.returns.calibrated import CalibratedReturns
from cns_drake.sensors.returns.materials import Materials, find_materials

# The class of points without a structure.
SCATTERED_LABEL = CLASS_IDS["outlier"]


class Lidar(LeafSystem):
    """A LiDAR that sees all geometry of a role except its own body's.

    .. pydrake_system::

        name: Lidar
        input_ports:
        - geometry_query
        - geometry_revision (optional)
        - sweep (optional)
        - frame_poses (optional)
        - moving_instances (optional)
        - body_spatial_velocities (with `moving_bodies`)
        output_ports:
        - scan
        - point_cloud_S
        - point_cloud_W
        - X_WS

    Frames: W is the world, P the parent frame, S the sensor frame (x
    forward, y left, z up). `scan` is a structured array of `POINT_DTYPE`,
    one record per return in firing order; beams whose nearest surface is
    closer than the minimum range or farther than the maximum range return
    nothing. `point_cloud_S` holds the same positions as a Drake point cloud,
    `point_cloud_W` those in the world, and `X_WS` is the pose of S at the
    time of the output.

    The turn starts at the time of the output. All its beams are cast from
    the pose of S at that time, by the pose of P in the SceneGraph (a deskewed
    scan). With the port `sweep`, poses come from there instead (a `Sweep` of
    P): one for the whole turn; or with motion distortion one for each column,
    at its own firing time. Its points are then expressed in S at that time, as
    a real unit reports them: X_WS(time + t) takes them to their places in the
    world. Other moving geometry stays, for the turn, at its place at the start.

    With `moving_bodies` and the port `body_spatial_velocities` (a list over a
    plant's bodies of V_WB, expressed in the world, as a MultibodyPlant gives
    it), P and all other bodies of that plant keep their velocities for the
    turn: each beam is cast at its own firing time, from the place of S then, on
    the geometry at its place then. Points are expressed in S at that time, too.

    `moving_instances` (abstract, the instance ids of structures) lists the
    moving structures: their points have the label of the moving class.

    `frame_poses` (abstract, `KnownPoses`) has poses X_WF that the SceneGraph
    has as well; a LiDAR takes many of them from one array faster.

    Drake cannot cast rays, so the system reads shapes and poses from the
    QueryObject and casts on its own hierarchy, whose changed parts are built
    anew. `geometry_revision` (from `geometry_revision_port`) shows when
    geometry has changed; without it the LiDAR compares all geometry at every
    scan, which in a world of thousands of geometries takes longer than the
    scan.

    Attributes:
        parent_frame_id: the frame P that carries the LiDAR.
        X_PS: the pose of the LiDAR in P.
        pattern: the beams of a turn.

    Example:
        from cns_drake import Lidar, make_beam_pattern

        lidar = Lidar(frame_id, X_PS, make_beam_pattern("os1-64", 0.1))
    """

    def __init__(
        self,
        parent_frame_id: FrameId,
        X_PS: RigidTransform,
        pattern: BeamPattern,
        *,
        measurement: MeasurementModel = IDEAL,
        returns: CalibratedReturns | None = None,
        moving_bodies: Mapping[FrameId, int] | None = None,
        role: Role = Role.kPerception,
        unseen: Collection[FrameId | GeometryId] | None = None,
        structures: StructureTable | None = None,
        anchored_frames: Collection[FrameId] = (),
        num_threads: int = 1,
    ):
        """Constructs the LiDAR.

        Args:
            parent_frame_id: the frame P that carries the sensor.
            X_PS: pose of the sensor in P.
            pattern: the beams.
            measurement: the model of noise, losses and rounding.
            returns: the model of a real unit; then `measurement` gives only the
                resolution. None for ideal returns.
            moving_bodies: frame -> index of its body in the port
                `body_spatial_velocities`, which only a LiDAR with this has.
            role: role of the geometry that it sees.
            unseen: frames and geometries that it does not see; by default
                P, unless that is the world's frame.
            structures: gives labels and instance ids to returns.
            anchored_frames: frames that never move, besides the world's; their
                geometry is cheaper to cast on. If one moves after all, all
                static geometry is built anew.
            num_threads: number of threads that share its rays; the measurement
                does not depend on it.

        Raises:
            TypeError: the role is no role of geometry.
        """
        super().__init__()
        if not isinstance(role, Role) or role == Role.kUnassigned:
            raise TypeError(
                f"role: {role!r} is not a role of geometry; give "
                "Role.kPerception, Role.kIllustration or Role.kProximity of "
                "pydrake.geometry"
            )
        self.parent_frame_id = parent_frame_id
        self.X_PS = X_PS
        self.pattern = pattern
        self._measurement = measurement
        self._returns = returns
        self.role = role
        self.unseen = None if unseen is None else frozenset(unseen)
        self.structures = structures or StructureTable(())
        self.anchored_frames = frozenset(anchored_frames)
        self.num_threads = num_threads
        self._first = self._latest = _Turn(0, pattern.beams(0), returns)
        # When each column fires, as a part of a turn.
        self._times = self._first.beams.column_t_ns / (pattern.period * 1e9)

        declare = self.DeclareAbstractInputPort
        self._geometry_query = declare("geometry_query", Value(QueryObject()))
        self._revision = declare("geometry_revision", Value(object()))
        self._moving = declare(
            "moving_instances", Value(np.zeros(0, np.uint16))
        )
        self._sweep = declare("sweep", Value(object()))
        self._frame_poses = declare("frame_poses", Value(object()))
        self._velocities: InputPort | None = None
        self._moving_bodies = dict(moving_bodies or {})
        if moving_bodies is not None:
            self._velocities = declare(
                "body_spatial_velocities",
                AbstractValue.Make([SpatialVelocity()]),
            )
        inputs = {self.all_input_ports_ticket()}
        # Kept until the SceneGraph changes.
        self._seen = self.DeclareCacheEntry(
            description="ray-casting scene",
            value_producer=ValueProducer(
                allocate=lambda: Value(SeenGeometry(self)),
                calc=lambda context, seen: self._update(
                    context, seen.get_value()
                ),
            ),
            prerequisites_of_calc=inputs,
        )
        changes = (
            measurement.is_random or returns is not None or not pattern.repeats
        )
        self._scan = self.DeclareAbstractOutputPort(
            "scan",
            alloc=lambda: Value(np.empty(0, POINT_DTYPE)),
            calc=self._calc_scan,
            prerequisites_of_calc=(
                inputs | ({self.time_ticket()} if changes else set())
            ),
        )
        scan = {self.cache_entry_ticket(self._scan.cache_entry().cache_index())}
        for name, calc, prerequisites in (
            ("point_cloud_S", self._calc_point_cloud_S, scan),
            ("point_cloud_W", self._calc_point_cloud_W, scan | inputs),
        ):
            self.DeclareAbstractOutputPort(
                name,
                alloc=lambda: Value(PointCloud()),
                calc=calc,
                prerequisites_of_calc=prerequisites,
            )
        self.DeclareAbstractOutputPort(
            "X_WS",
            alloc=lambda: Value(RigidTransform()),
            calc=self._calc_X_WS,
            prerequisites_of_calc=inputs,
        )

    def EvalScene(self, context: Context) -> RayCastingScene:
        """Returns what the LiDAR sees in a Context, to cast other rays on."""
        scene = self._eval_seen(context).scene
        assert scene is not None
        return scene

    def _eval_seen(self, context: Context) -> SeenGeometry:
        seen = self._seen.Eval(context)
        if seen.scene is None:  # In a cloned Context.
            self._update(context, seen)
        return seen

    def _update(self, context: Context, seen: SeenGeometry) -> None:
        known, ball = self._known_poses(context), moving_groups.EVERYWHERE
        if known is not moving_groups.NOTHING_KNOWN:
            # Geometry out of sight is not moved.
            ball = self._calc_ball(context)
        seen.update(
            self._geometry_query.Eval(context),
            _value(self._revision, context),
            self._calc_motions(context),
            known,
            ball,
        )

    def _known_poses(self, context: Context) -> moving_groups.KnownPoses:
        return _value(self._frame_poses, context, moving_groups.NOTHING_KNOWN)

    def _calc_ball(self, context: Context) -> moving_groups.Ball:
        """Returns the ball in which beams can meet geometry."""
        model = self._returns or self._measurement
        reach = model.reach(self.pattern.max_range)
        p_WSset, _ = self._calc_poses(context)
        middle, way = p_WSset[0], 0.0
        if len(p_WSset) > 1:
            middle = p_WSset.mean(axis=0)
            way = np.linalg.norm(p_WSset - middle, axis=1).max()
        # A metre of margin for rounding and merged beams.
        return moving_groups.Ball(middle, float(reach + way) + 1.0)

    def _calc_motions(self, context: Context) -> dict[FrameId, Motion]:
        """Returns the motion of each frame that does not stay."""
        if self._velocities is None:
            return {}
        V_WBs = self._velocities.Eval(context)
        duration = self.pattern.period
        motions = {
            frame_id: Motion(
                V_WBs[body].rotational(), V_WBs[body].translational(), duration
            )
            for frame_id, body in self._moving_bodies.items()
        }
        return {f: m for f, m in motions.items() if m.w.any() or m.v.any()}

    def _calc_scan(self, context: Context, output: AbstractValue) -> None:
        seen = self._eval_seen(context)
        frame, turn = self._turn_at(context.get_time())
        p_WSset, R_WSset = self._calc_poses(context)
        columns = turn.beams.cast_columns
        times = self._times
        if columns is not None:
            times = times[columns]
            if len(p_WSset) > 1:
                p_WSset, R_WSset = p_WSset[columns], R_WSset[columns]
        met, returns = self._measure(seen, turn, p_WSset, R_WSset, times, frame)
        labels = seen.label
        moving = _value(self._moving, context)
        if moving is not None:
            labels = seen.labels(moving)
        # Zeros, so that the padding between fields is defined, too.
        scan = np.zeros(len(returns.beams), POINT_DTYPE)
        step = np.float32(self._measurement.resolution)
        assemble_points(
            scan, turn.table, returns, met, labels, seen.instance, step
        )
        output.set_value(scan)

    def _measure(
        self,
        seen: SeenGeometry,
        turn: _Turn,
        p_WSset: np.ndarray,
        R_WSset: np.ndarray,
        times: np.ndarray,
        frame: int,
    ) -> tuple[np.ndarray, Returns]:
        """Returns the hit geometry of each return, and the returns."""
        assert seen.scene is not None
        if self._returns is not None:
            assert turn.calibrated is not None
            reported = self._returns.measure(
                seen.scene,
                seen.materials(is_wet=self._returns.is_wet),
                self.pattern,
                turn.calibrated,
                p_WSset,
                R_WSset,
                times,
                frame,
            )
            return reported.geometry, Returns(*reported[:3])
        hits = seen.scene.cast_rays(
            p_WSset,
            turn.d_Sset_cast,
            self._measurement.reach(self.pattern.max_range),
            R_WSset=R_WSset,
            times=times,
        )
        returns = self._measurement.measure(
            hits.ranges.take(turn.table.place),
            self.pattern.min_range,
            self.pattern.max_range,
            frame,
        )
        return hits.geometry.take(turn.table.place.take(returns.beams)), returns

    def _turn_at(self, time: float) -> tuple[int, _Turn]:
        """Returns number and beams of the turn that starts at a time [s]."""
        frame = round(time / self.pattern.period)
        if self.pattern.repeats:
            return frame, self._first
        # Two threads may ask for different turns.
        turn = self._latest
        if turn.frame != frame:
            beams = self.pattern.beams(frame)
            turn = self._latest = _Turn(frame, beams, self._returns)
        return frame, turn

    def _calc_poses(self, context: Context) -> tuple[np.ndarray, np.ndarray]:
        """Returns positions and orientations of S: one, or each column's."""
        sweep = _value(self._sweep, context)
        if sweep is not None:
            sweep = sweep.of_frame(self.X_PS)
            return sweep.p_WPset, sweep.R_WPset
        query_object = self._geometry_query.Eval(context)
        X_WP = self._known_poses(context).find(
            self.parent_frame_id, query_object.GetPoseInWorld
        )
        X_WS = X_WP @ self.X_PS
        motion = self._calc_motions(context).get(self.parent_frame_id)
        if motion is not None:
            R_WW0, way_P = motion.at(self._times)
            p_PS_W = X_WS.translation() - X_WP.translation()
            return (
                X_WP.translation() + way_P + rotated(R_WW0, p_PS_W),
                product(R_WW0, X_WS.rotation().matrix()),
            )
        # Copies are laid out like many poses: for Drake's views of its own
        # memory, numba would compile all that takes poses once more.
        p_WS, R_WS = X_WS.translation(), X_WS.rotation().matrix()
        return np.array([p_WS]), np.array([R_WS])

    def _calc_X_WS(self, context: Context, output: AbstractValue) -> None:
        p_WSset, R_WSset = self._calc_poses(context)
        output.set_value(RigidTransform(RotationMatrix(R_WSset[0]), p_WSset[0]))

    def _calc_point_cloud_S(
        self, context: Context, output: AbstractValue
    ) -> None:
        scan = self._scan.Eval(context)
        p_SRset = np.stack([scan["x"], scan["y"], scan["z"]])
        _fill(output.get_mutable_value(), p_SRset)

    def _calc_point_cloud_W(
        self, context: Context, output: AbstractValue
    ) -> None:
        scan = self._scan.Eval(context)
        p_WSset, R_WSset = self._calc_poses(context)
        # The pose of S when each point was measured: one, or each column's.
        columns = self._first.beams.column_t_ns
        pose = np.searchsorted(columns, scan["t"]) % len(p_WSset)
        p_SRset = np.stack([scan["x"], scan["y"], scan["z"]], axis=1)
        p_SRset_W = np.einsum("nij,nj->ni", R_WSset[pose], p_SRset)
        _fill(output.get_mutable_value(), (p_WSset[pose] + p_SRset_W).T)


def _value(port: InputPort, context: Context, default: Any = None) -> Any:
    """Returns the value of a port, or the default if it is not connected."""
    return port.Eval(context) if port.HasValue(context) else default


def _fill(point_cloud: PointCloud, p_FRset: np.ndarray) -> None:
    point_cloud.resize(p_FRset.shape[1])
    point_cloud.mutable_xyzs()[:] = p_FRset


class SeenGeometry:
    """The geometry that a LiDAR sees in a Context, kept until it changes.

    In a cloned Context it is empty at first: a scene with moving geometry
    cannot be shared.

    Attributes:
        scene: casts rays, None before the first update; its geometry indices
            select from:
        label: (num_geometries,) uint16 class of each geometry.
        moving_label: (num_geometries,) uint16 its class while it moves.
        instance: (num_geometries,) uint16 structure of each geometry.
    """

    def __init__(self, lidar: Lidar):
        self._lidar = lidar
        self._reader = GeometryReader(lidar.role)
        self._geometries: tuple[PerceptionGeometry, ...] = ()
        self._revision: int | None = None
        self._built: tuple[PerceptionGeometry, ...] = ()
        self._X_WAs: dict[FrameId, RigidTransform] = {}
        self.scene: RayCastingScene | None = None
        self._materials: Materials | None = None

    def __deepcopy__(self, memo: dict) -> SeenGeometry:
        return SeenGeometry(self._lidar)

    def update(
        self,
        query_object: QueryObject,
        revision: int | None,
        motions: Mapping[FrameId, Motion],
        known: moving_groups.KnownPoses,
        seen: moving_groups.Ball,
    ) -> None:
        """Moves moving geometry, and builds changed geometry anew.

        Without a revision (`geometry_revision_port`), all geometries are
        compared. Known poses of frames replace calls of the query object. Beams
        can meet geometry only in the ball `seen`.

        Raises:
            InputError: see `GeometryReader.read`.
        """
        inspector = query_object.inspector()

        def calc_X_WF(frame: FrameId) -> RigidTransform:
            return known.find(frame, query_object.GetPoseInWorld)

        if self.scene is None or revision is None or revision != self._revision:
            self._read(inspector)
        if self.scene is None or not self._is_built(calc_X_WF):
            self._build(inspector.world_frame_id(), calc_X_WF)
        assert self.scene is not None
        self.scene.set_frame_poses(calc_X_WF, motions, known, seen)
        self._revision = revision

    def labels(self, moving: np.ndarray) -> np.ndarray:
        """Returns the class of each geometry while some instances move."""
        moves = np.zeros(MAX_INSTANCE + 1, bool)
        moves[moving] = True
        return np.where(moves[self.instance], self.moving_label, self.label)

    def materials(self, *, is_wet: bool) -> Materials:
        """Returns the materials of `scene`; wet at each call, or at none."""
        if self._materials is None:
            self._materials = find_materials(
                self._built, self._table, is_wet=is_wet
            )
        return self._materials

    def _read(self, inspector: SceneGraphInspector) -> None:
        unseen = self._lidar.unseen
        if unseen is None:
            unseen = frozenset([self._lidar.parent_frame_id])
            unseen -= {inspector.world_frame_id()}
        hidden = set(unseen)
        for frame_id in inspector.GetAllFrameIds():
            if frame_id in unseen:
                hidden |= set(
                    inspector.GetGeometries(frame_id, self._lidar.role)
                )
        self._geometries = self._reader.read(inspector, hidden)

    def _is_built(self, calc_X_WF: Callable[[FrameId], RigidTransform]) -> bool:
        """Returns whether the scene is up to date."""
        if self._built is not self._geometries and (
            len(self._built) != len(self._geometries)
            or not all(map(is_, self._built, self._geometries))
        ):
            return False
        return all(
            X_WA.IsExactlyEqualTo(calc_X_WF(frame_id))
            for frame_id, X_WA in self._X_WAs.items()
        )

    def _build(
        self, world: FrameId, calc_X_WF: Callable[[FrameId], RigidTransform]
    ) -> None:
        names = [geometry.structure for geometry in self._geometries]
        table = self._lidar.structures.completed(names)
        self._table, self._materials = table, None
        self.label = np.array([table[n].label for n in names], np.uint16)
        self.moving_label = np.array(
            [moving_id(table[n].semantic_class) for n in names], np.uint16
        )
        self.instance = np.array([table[n].instance for n in names], np.uint16)
        anchored = self._lidar.anchored_frames | {world}
        # Copies: Drake's references go on changing.
        self._X_WAs = {
            frame_id: RigidTransform(calc_X_WF(frame_id))
            for frame_id in {g.frame_id for g in self._geometries}
            if frame_id in anchored and frame_id != world
        }
        self.scene = RayCastingScene(
            self._geometries,
            anchored,
            calc_X_WF,
            num_threads=self._lidar.num_threads,
            previous=self.scene,
        )
        self._built = self._geometries


class BeamTable(NamedTuple):
    """Constants of all scans, for all beams in firing order.

    Attributes:
        d_Sset: (num_beams, 3) float32 unit directions, expressed in S.
        p_Sset: (num_beams, 3) float32 where beams start [m]; (0, 3) if that is
            the origin of S.
        ring: (num_beams,) uint16.
        t_ns: (num_beams,) uint32 firing time since the start of the turn.
        place: (num_beams,) position of each beam in the order of casting.
    """

    d_Sset: np.ndarray
    p_Sset: np.ndarray
    ring: np.ndarray
    t_ns: np.ndarray
    place: np.ndarray


class _Turn:
    """The beams of a turn of a number, ready for casting and assembling.

    `d_Sset_cast` has (N, 3) directions in the order of casting, `table` what
    beams add to points, and `calibrated` the same for calibrated returns, None
    for ideal ones. `beams` are in firing order.
    """

    def __init__(
        self, frame: int, beams: Beams, returns: CalibratedReturns | None
    ):
        self.frame = frame
        self.beams = beams
        self.d_Sset_cast = beams.d_Sset[beams.packet_order]
        d_Sset, p_Sset = beams.d_Sset, np.zeros((0, 3))
        self.calibrated = None if returns is None else returns.turn(beams)
        if self.calibrated is not None:
            d_Sset = self.calibrated.reported
            p_Sset = self.calibrated.p_SLset
        self.table = BeamTable(
            d_Sset.astype(np.float32),
            p_Sset.astype(np.float32),
            beams.ring,
            beams.t_ns,
            np.argsort(beams.packet_order),
        )


@compiled
def assemble_points(
    scan: np.ndarray,
    table: BeamTable,
    returns: Returns,
    met: np.ndarray,
    label: np.ndarray,
    instance: np.ndarray,
    step: np.float32,
) -> None:
    """Fills a scan, one point of `POINT_DTYPE` for each of N returns.

    `met` has the (N,) int32 index of the hit geometry in the uint16 labels and
    instances; negative for the weather. Coordinates are rounded to multiples of
    the step [m]; not rounded if it is 0. NumPy takes a fifth of a frame.
    """
    # As names of their own, fields are fast.
    beams, ranges, intensity = returns.beams, returns.ranges, returns.intensity
    for k in range(len(beams)):
        # For a signed index, numba looks at each use whether it counts from
        # the end.
        beam, point = np.uint64(beams[k]), scan[k]
        x = table.d_Sset[beam, 0] * ranges[k]
        y = table.d_Sset[beam, 1] * ranges[k]
        z = table.d_Sset[beam, 2] * ranges[k]
        if len(table.p_Sset):
            x += table.p_Sset[beam, 0]
            y += table.p_Sset[beam, 1]
            z += table.p_Sset[beam, 2]
        if step > 0:
            x = np.rint(x / step) * step
            y = np.rint(y / step) * step
            z = np.rint(z / step) * step
        point.x, point.y, point.z = x, y, z
        point.intensity = intensity[k]
        point.ring, point.t = table.ring[beam], table.t_ns[beam]
        if met[k] < 0:
            point.label, point.instance = SCATTERED_LABEL, 0
        else:
            geometry = np.uint64(met[k])
            point.label = label[geometry]
            point.instance = instance[geometry]
