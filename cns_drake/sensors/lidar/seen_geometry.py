"""The geometry of a SceneGraph that a LiDAR sees, and its ray scene."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from operator import is_
from typing import NamedTuple

import numpy as np
from pydrake.geometry import (
    FrameId,
    GeometryId,
    QueryObject,
    Role,
    SceneGraphInspector,
)
from pydrake.math import RigidTransform

from cns_drake.ray_casting.moving_groups import (
    EVERYWHERE,
    NOTHING_KNOWN,
    Ball,
    KnownPoses,
)
from cns_drake.ray_casting.ray_casting_scene import RayCastingScene
from cns_drake.ray_casting.ray_groups import NO_MOTIONS, Motion
from cns_drake.scene.perception_geometry import (
    GeometryReader,
    PerceptionGeometry,
)
from cns_drake.scene.semantics import moving_id
from cns_drake.scene.structure_table import MAX_INSTANCE, StructureTable
from cns_drake.sensors.returns.materials import Materials, find_materials


class Sight(NamedTuple):
    """The choice of geometry that a LiDAR sees.

    Attributes:
        role: role of the geometry that it sees.
        parent_frame_id: the frame that carries it.
        unseen: frames and geometries of it that it does not see; None for
            the frame that carries it, unless that is the world's.
        structures: gives labels and instance ids.
        anchored_frames: frames that never move, besides the world's; a hint for
            speed.
        num_threads: number of threads that share the rays of a cast.
    """

    role: Role
    parent_frame_id: FrameId
    unseen: frozenset[FrameId | GeometryId] | None
    structures: StructureTable
    anchored_frames: frozenset[FrameId]
    num_threads: int


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

    def __init__(self, sight: Sight):
        self._sight = sight
        self._reader = GeometryReader(sight.role)
        self._geometries: tuple[PerceptionGeometry, ...] = ()
        self._revision: int | None = None
        self._built: tuple[PerceptionGeometry, ...] = ()
        self._X_WAs: dict[FrameId, RigidTransform] = {}
        self.scene: RayCastingScene | None = None
        self._materials: Materials | None = None

    def __deepcopy__(self, memo: dict) -> SeenGeometry:
        return SeenGeometry(self._sight)

    def update(
        self,
        query_object: QueryObject,
        revision: int | None,
        motions: Mapping[FrameId, Motion] = NO_MOTIONS,
        known: KnownPoses = NOTHING_KNOWN,
        seen: Ball = EVERYWHERE,
    ) -> None:
        """Moves moving geometry, and builds changed geometry anew.

        Args:
            revision: the geometry's (`geometry_revision_port`), None if
                unknown; all geometries are then compared.
            known: poses of frames, which replace calls of `query_object`.
            seen: the ball in which beams can meet geometry.

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
            is_placed = not motions and known is NOTHING_KNOWN
        else:
            is_placed = False
        assert self.scene is not None
        if not is_placed:
            self.scene.set_frame_poses(calc_X_WF, motions, known, seen)
        self._revision = revision

    def labels(self, moving: np.ndarray) -> np.ndarray:
        """Returns the class of each geometry while some instances move."""
        moves = np.zeros(MAX_INSTANCE + 1, bool)
        moves[moving] = True
        return np.where(moves[self.instance], self.moving_label, self.label)

    def materials(self, *, is_wet: bool) -> Materials:
        """Returns the materials of the geometries of `scene`.

        Args:
            is_wet: whether the ground is wet; the same at each call.
        """
        if self._materials is None:
            self._materials = find_materials(
                self._built, self._table, is_wet=is_wet
            )
        return self._materials

    def _read(self, inspector: SceneGraphInspector) -> None:
        unseen = self._sight.unseen
        if unseen is None:
            unseen = frozenset([self._sight.parent_frame_id])
            unseen -= {inspector.world_frame_id()}
        hidden = set(unseen)
        for frame_id in inspector.GetAllFrameIds():
            if frame_id in unseen:
                hidden |= set(
                    inspector.GetGeometries(frame_id, self._sight.role)
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
        table = self._sight.structures.completed(names)
        self._table, self._materials = table, None
        self.label = np.array([table[n].label for n in names], np.uint16)
        self.moving_label = np.array(
            [moving_id(table[n].semantic_class) for n in names], np.uint16
        )
        self.instance = np.array([table[n].instance for n in names], np.uint16)
        anchored = self._sight.anchored_frames | {world}
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
            num_threads=self._sight.num_threads,
            previous=self.scene,
        )
        self._built = self._geometries
