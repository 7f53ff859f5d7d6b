"""A spinning multi-beam LiDAR on the geometry that a SceneGraph holds."""

from __future__ import annotations

from collections.abc import Collection
from typing import Any

import numpy as np
from pydrake.common.value import AbstractValue, Value
from pydrake.geometry import FrameId, QueryObject, Role, SceneGraph
from pydrake.math import RigidTransform
from pydrake.multibody.tree import Frame, RigidBody
from pydrake.perception import PointCloud
from pydrake.systems.framework import (
    Context,
    DiagramBuilder,
    LeafSystem,
    ValueProducer,
)

from cns_drake.ray_casting.ray_casting_scene import RayCastingScene
from cns_drake.scene.perception_geometry import read_perception_geometry
from cns_drake.scene.structure_table import StructureTable
from cns_drake.sensors.beam_pattern import (
    POINT_DTYPE,
    BeamPattern,
    make_beam_pattern,
)
from cns_drake.sensors.measurement import IDEAL, MeasurementModel
from cns_drake.sensors.point_assembly import BeamTable, assemble_points
from evaluation.support.errors import InputError


class Lidar(LeafSystem):
    """A LiDAR that sees every perception geometry but its own vehicle's.

    .. pydrake_system::

        name: Lidar
        input_ports:
        - geometry_query
        - sweep (if it is declared)
        output_ports:
        - scan
        - point_cloud_S

    Frames: W is the world, P the parent frame, S the sensor frame (x
    forward, y left, z up). `scan` is a structured array of `POINT_DTYPE`,
    one record per return in firing order; beams whose nearest surface is
    closer than the minimum range or farther than the maximum range return
    nothing. `point_cloud_S` holds the same positions as a Drake point cloud.

    The turn starts at the time of the output. All its beams are cast from
    the pose of S at that time, by the pose of P in the SceneGraph (a deskewed
    scan). With the port `sweep`, poses come from there instead (a `Sweep` of
    P): one for the whole turn; or with motion distortion one for each column,
    at its own firing time. Its points are then expressed in S at that time,
    as a real unit reports them: X_WS(time + t) takes them to where they lie
    in the world. Other geometry that moves stays for the turn where it is at
    its start.

    Drake cannot cast rays, so the system reads shapes and poses from the
    QueryObject and casts on a hierarchy of its own, built anew only when
    perception geometry is added or removed.

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
        with_sweep: bool = False,
        structures: StructureTable | None = None,
        anchored_frames: Collection[FrameId] = (),
        num_threads: int = 1,
    ):
        """Constructs the LiDAR.

        Args:
            parent_frame_id: the frame P that carries the sensor. Geometry of
                the model that P belongs to is invisible.
            X_PS: pose of the sensor in P.
            pattern: the beams.
            measurement: what it makes of true ranges.
            with_sweep: whether the port `sweep` tells its poses.
            structures: gives labels and instance ids to returns.
            anchored_frames: frames that never move, besides the world's;
                their geometry is cheaper to cast on.
            num_threads: how many threads share its rays; what it measures
                does not depend on it.
        """
        super().__init__()
        self._parent_frame_id = parent_frame_id
        self._X_PS = X_PS
        self._pattern = pattern
        self._measurement = measurement
        structures = structures or StructureTable(())
        self._table = BeamTable(
            pattern.d_Sset.astype(np.float32),
            pattern.ring,
            pattern.t_ns,
            np.argsort(pattern.packet_order),
        )
        self._d_Sset_cast = pattern.d_Sset[pattern.packet_order]

        self._geometry_query = self.DeclareAbstractInputPort(
            "geometry_query", Value(QueryObject())
        )
        self._sweep = None
        if with_sweep:
            self._sweep = self.DeclareAbstractInputPort(
                "sweep", Value(object())
            )
        # Kept as long as nothing changes in the SceneGraph.
        self._seen = self.DeclareCacheEntry(
            description="ray-casting scene",
            value_producer=ValueProducer(
                allocate=lambda: Value(
                    _SeenGeometry(
                        parent_frame_id,
                        structures,
                        anchored_frames,
                        num_threads,
                    )
                ),
                calc=self._calc_seen,
            ),
            prerequisites_of_calc={self._geometry_query.ticket()},
        )
        scan = self.DeclareAbstractOutputPort(
            "scan",
            alloc=lambda: Value(np.empty(0, POINT_DTYPE)),
            calc=self._calc_scan,
            prerequisites_of_calc=self._scan_prerequisites(),
        )
        self._scan = scan
        self.DeclareAbstractOutputPort(
            "point_cloud_S",
            alloc=lambda: Value(PointCloud()),
            calc=self._calc_point_cloud,
            prerequisites_of_calc={
                self.cache_entry_ticket(scan.cache_entry().cache_index())
            },
        )

    @property
    def pattern(self) -> BeamPattern:
        return self._pattern

    def _calc_seen(self, context: Context, value: AbstractValue) -> None:
        value.get_value().update(self._geometry_query.Eval(context))

    def _calc_scan(self, context: Context, output: AbstractValue) -> None:
        seen = self._seen.Eval(context)
        if seen.scene is None:
            seen.update(self._geometry_query.Eval(context))
        p_WSset, R_WSset = self._calc_poses(context)
        hits = seen.scene.cast_rays(
            p_WSset,
            self._d_Sset_cast,
            self._measurement.reach(self._pattern.max_range),
            R_WSset=R_WSset,
        )
        beams, ranges, intensity = self._measurement.measure(
            hits.ranges.take(self._table.place),
            self._pattern.min_range,
            self._pattern.max_range,
            round(context.get_time() / self._pattern.period),
        )
        # Zeros, so that the padding between fields is defined, too.
        scan = np.zeros(len(beams), POINT_DTYPE)
        assemble_points(
            scan,
            self._table,
            beams,
            ranges,
            intensity,
            hits.geometry,
            seen.label,
            seen.instance,
            np.float32(self._measurement.resolution),
        )
        output.set_value(scan)

    def _scan_prerequisites(self) -> set:
        prerequisites = {self._geometry_query.ticket()}
        if self._sweep is not None:
            prerequisites.add(self._sweep.ticket())
        if self._measurement.is_random:
            prerequisites.add(self.time_ticket())
        return prerequisites

    def _calc_poses(self, context: Context) -> tuple[np.ndarray, np.ndarray]:
        """Returns positions and orientations of S: one, or each column's.

        In packet order, which takes one column after the other for each
        ring, beam i belongs to column i mod num_columns.
        """
        if self._sweep is not None:
            sweep = self._sweep.Eval(context).of_frame(self._X_PS)
            return sweep.p_WPset, sweep.R_WPset
        query_object = self._geometry_query.Eval(context)
        X_WP = query_object.GetPoseInWorld(self._parent_frame_id)
        X_WS = X_WP @ self._X_PS
        return X_WS.translation(), X_WS.rotation().matrix()

    def _calc_point_cloud(
        self, context: Context, output: AbstractValue
    ) -> None:
        scan = self._scan.Eval(context)
        point_cloud = output.get_mutable_value()
        point_cloud.resize(len(scan))
        for axis, name in enumerate("xyz"):
            point_cloud.mutable_xyzs()[axis] = scan[name]


def add_lidar(
    builder: DiagramBuilder,
    scene_graph: SceneGraph,
    body: RigidBody | Frame,
    X_PS: RigidTransform,
    pattern: BeamPattern | str,
    *,
    name: str = "lidar",
    **options: Any,
) -> Lidar:
    """Adds a LiDAR to a diagram and connects it to the SceneGraph.

    Args:
        builder: of the diagram that holds `scene_graph`.
        scene_graph: what the LiDAR sees.
        body: P, a body or a frame fixed on one, of a finalized plant that is
            registered with `scene_graph`.
        X_PS: pose of the sensor S in P.
        pattern: the beams, or the name of a preset, of which a turn then
            takes 0.05 s.
        name: of the system.
        options: further arguments of `Lidar`.

    Returns:
        The system, with the ports `scan` and `point_cloud_S`.

    Raises:
        KeyError: there is no preset of that name.
        RuntimeError: the body is not registered with a SceneGraph.

    Example:
        from cns_drake import add_lidar

        lidar = add_lidar(builder, scene_graph, body, X_BS, "os1-64")
        builder.ExportOutput(lidar.GetOutputPort("scan"), "scan")
    """
    if isinstance(body, Frame):
        X_PS = body.GetFixedPoseInBodyFrame() @ X_PS
        body = body.body()
    if isinstance(pattern, str):
        pattern = make_beam_pattern(pattern, 0.05)
    plant = body.GetParentPlant()
    frame_id = plant.GetBodyFrameIdOrThrow(body.index())
    lidar = builder.AddNamedSystem(
        name, Lidar(frame_id, X_PS, pattern, **options)
    )
    builder.Connect(
        scene_graph.get_query_output_port(),
        lidar.GetInputPort("geometry_query"),
    )
    return lidar


class _SeenGeometry:
    """What a LiDAR sees, as long as no geometry is added or removed.

    Of a cloned Context it is empty at first: a scene in which something moves
    cannot be shared.

    Attributes:
        scene: casts rays, None before the first update; its geometry indices
            select from:
        label: (num_geometries,) uint8 class of each geometry.
        instance: (num_geometries,) uint16 structure of each geometry.
    """

    def __init__(
        self,
        own_frame_id: FrameId,
        structures: StructureTable,
        anchored_frames: Collection[FrameId],
        num_threads: int,
    ):
        self._own_frame_id = own_frame_id
        self._structures = structures
        self._anchored_frames = frozenset(anchored_frames)
        self._num_threads = num_threads
        self._count: int | None = None
        self.scene: RayCastingScene | None = None

    def __deepcopy__(self, memo: dict) -> _SeenGeometry:
        return _SeenGeometry(
            self._own_frame_id,
            self._structures,
            self._anchored_frames,
            self._num_threads,
        )

    def update(self, query_object: QueryObject) -> None:
        """Rebuilds the scene if need be, and moves what moves."""
        # SceneGraph's own geometry version does not change with perception
        # geometry unless a render engine is there to accept it (measured on
        # 1.51.1), so that the count has to tell.
        count = query_object.inspector().NumGeometriesWithRole(Role.kPerception)
        if self.scene is not None and count == self._count:
            self.scene.set_frame_poses(query_object.GetPoseInWorld)
            return
        self._build(query_object)
        self._count = count

    def _build(self, query_object: QueryObject) -> None:
        inspector = query_object.inspector()
        world = inspector.world_frame_id()
        own_model = None
        if self._own_frame_id != world:
            own_model = inspector.GetFrameGroup(self._own_frame_id)
        geometries = read_perception_geometry(
            inspector,
            lambda frame_id: inspector.GetFrameGroup(frame_id) != own_model,
        )
        if not geometries:
            raise InputError(
                "the world has no perception geometry that a LiDAR can see; "
                "give its links visuals"
            )
        names = [geometry.structure for geometry in geometries]
        table = self._structures.completed(names)
        self.label = np.array([table[n].label for n in names], np.uint8)
        self.instance = np.array([table[n].instance for n in names], np.uint16)
        self.scene = RayCastingScene(
            geometries,
            self._anchored_frames | {world},
            query_object.GetPoseInWorld,
            num_threads=self._num_threads,
        )
