"""The geometry that a LiDAR sees, as a scene for ray casting.

The scene is kept from scan to scan, until the geometry changes.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass
from numbers import Integral
import operator
from types import NoneType
from typing import (
    TYPE_CHECKING,
    Protocol,
    TypeAlias,
    cast,
    get_args,
    runtime_checkable,
)
import weakref

import numpy as np
from pydrake.geometry import FrameId, GeometryId, QueryObject, Role
from pydrake.math import RigidTransform
from pydrake.multibody.tree import Frame, RigidBody

from cns_drake.ray_casting import Ball, KnownPoses, Motion, RayCastingScene
from cns_drake.scene import (
    GeometryList,
    PerceptionGeometry,
    list_geometry,
    number_structures,
    read_geometry,
    structure_name,
)
from evaluation.base import MAX_INSTANCE, check_type, doing

if TYPE_CHECKING:
    # Slow to import, and ideal returns do without.
    from cns_drake.sensors.returns.calibrated import CalibratedReturns
    from cns_drake.sensors.returns.materials import Materials


# What a LiDAR can leave out.
Place: TypeAlias = FrameId | GeometryId | RigidBody | Frame


@runtime_checkable
class Structures(Protocol):
    """A table from which a LiDAR takes the labels and ids of what it hits."""

    def labels(
        self, names: Sequence[str]
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Returns the labels and instance ids of structures, by their names.

        The arrays (G,) have the class, the class while it moves, and the id.
        """


@dataclass(frozen=True, kw_only=True)
class GeometryView:
    """Which geometry a LiDAR sees, and how its rays are cast.

    Attributes:
        role: role of the geometry that is seen.
        unseen: bodies, frames and geometries that are not seen; by default the
            frame that carries the LiDAR, unless this is the frame of the world.
            A body, or a frame on it, stands for the whole body. A FrameId
            stands for its own geometry only, because a SceneGraph does not
            contain welds.
        structures: table of the structures' labels and instance ids. By
            default, structures have no class, and their ids follow the
            alphabetical order of their names.
        anchored_frames: frames that never move, besides the frame of the world;
            rays are cast faster on their geometry than on geometry that can
            move. If such a frame moves after all, all static geometry is
            rebuilt.
        num_threads: number of threads that share the rays; the measurement does
            not depend on this number.

    Raises:
        TypeError: the role is no role of geometry, or another field is of
            another type.
        ValueError: there is no thread.
    """

    role: Role = Role.kPerception
    unseen: Collection[Place] | None = None
    structures: Structures | None = None
    anchored_frames: Collection[FrameId] = ()
    num_threads: int = 1

    def __post_init__(self) -> None:
        if not isinstance(self.role, Role) or self.role == Role.kUnassigned:
            raise TypeError(
                f"role: {self.role!r} is not a role of geometry; give "
                "Role.kPerception, Role.kIllustration or Role.kProximity of "
                "pydrake.geometry"
            )
        for name, kinds in (
            ("unseen", get_args(Place)),
            ("anchored_frames", (FrameId,)),
        ):
            found = getattr(self, name)
            check_type(name, found, Collection, NoneType)
            # A text would be a collection of letters.
            for one in [found] if isinstance(found, str) else found or ():
                check_type(name, one, *kinds)
        check_type("structures", self.structures, Structures, NoneType)
        check_type("num_threads", self.num_threads, Integral)
        if self.num_threads < 1:
            raise ValueError(f"num_threads: {self.num_threads} is less than 1")
        # The caller's collections may go on changing.
        if self.unseen is not None:
            ids = frozenset(map(_id_of, self.unseen))
            object.__setattr__(self, "unseen", ids)
        anchored = frozenset(self.anchored_frames)
        object.__setattr__(self, "anchored_frames", anchored)


class SeenGeometry:
    """The geometry that a LiDAR sees in a Context, kept until it changes.

    A clone of a Context starts with an empty scene, because a scene with moving
    geometry cannot be shared.

    Attributes:
        scene: scene on which rays are cast; None before the first update. A hit
            on geometry i of the scene is a hit on `built[i]`.
        built: the geometries in the scene.
        label: (num_geometries,) uint16 class of each geometry.
        moving_label: (num_geometries,) uint16 class of each geometry while it
            moves.
        instance: (num_geometries,) uint16 structure of each geometry.
    """

    def __init__(self, parent_frame_id: FrameId, view: GeometryView):
        """Begins without a scene.

        Args:
            parent_frame_id: the frame P that carries the LiDAR.
            view: which geometry is seen.
        """
        self._parent_frame_id = parent_frame_id
        self._view = view
        self._geometries: tuple[PerceptionGeometry, ...] = ()
        self._records = GeometryList()
        self.built: tuple[PerceptionGeometry, ...] = ()
        self._X_WAs: dict[FrameId, RigidTransform] = {}
        self.scene: RayCastingScene | None = None
        self._materials: Materials | None = None

    def __deepcopy__(self, memo: dict) -> SeenGeometry:
        return SeenGeometry(self._parent_frame_id, self._view)

    def update(
        self,
        query_object: QueryObject,
        records: GeometryList | None,
        motions: Mapping[FrameId, Motion],
        known: KnownPoses,
        seen: Ball,
        p_WS: np.ndarray,
    ) -> None:
        """Moves geometry whose frame has moved, and rebuilds changed geometry.

        Args:
            query_object: query object of the SceneGraph, with geometry and
                poses.
            records: all geometry with the LiDAR's role; if None, this function
                lists the geometry.
            motions: motions of frames that move during the revolution.
            known: known poses, for which the SceneGraph is not queried.
            seen: the ball within which beams can hit geometry.
            p_WS: the position of the sensor in the world, (3,) [m].

        Raises:
            InputError: a geometry cannot be read; see
                `cns_drake.scene.perception_geometry.read_geometry`.
        """
        inspector = query_object.inspector()

        def calc_X_WF(frame: FrameId) -> RigidTransform:
            return known.find(frame, query_object.GetPoseInWorld)

        if records is None:
            records = list_geometry(inspector, self._view.role, self._records)
        if self.scene is None or records is not self._records:
            self._read_geometry(records, inspector.world_frame_id())
        try:
            if self.scene is None or not (
                self._is_up_to_date(calc_X_WF) and self.scene.serves(p_WS)
            ):
                self._build_scene(
                    records, inspector.world_frame_id(), calc_X_WF, p_WS
                )
            assert self.scene is not None
            self.scene.set_frame_poses(calc_X_WF, motions, known, seen)
        except BaseException:
            # Some of its geometry may have moved already.
            self.scene = None
            raise
        self._records = records

    def labels(self, moving: np.ndarray) -> np.ndarray:
        """Returns the present class of each geometry, (num_geometries,) uint16.

        Args:
            moving: instance ids of the structures that are moving.

        Raises:
            ValueError: a number is no instance id.
        """
        moving = np.asarray(moving)
        if len(moving) and not (
            moving.dtype.kind in "iu"
            and 0 <= moving.min() <= moving.max() <= MAX_INSTANCE
        ):
            raise ValueError(
                f"moving_instances: {moving.tolist()} are no instance ids,"
                f" whole numbers from 0 to {MAX_INSTANCE}"
            )
        moves = np.zeros(MAX_INSTANCE + 1, bool)
        moves[moving] = True
        return np.where(moves[self.instance], self.moving_label, self.label)

    def materials(self, returns: CalibratedReturns) -> Materials:
        """Returns the material of each geometry of `scene`."""
        if self._materials is None:
            self._materials = returns.materials(
                self.built, self._view.structures
            )
        return self._materials

    def _read_geometry(self, records: GeometryList, world: FrameId) -> None:
        unseen = {self._parent_frame_id} - {world}
        if self._view.unseen is not None:
            unseen = set(self._view.unseen)
        doing("reading meshes")
        with records.lock:
            self._geometries = read_geometry(
                record
                for record in records
                if record.frame_id not in unseen
                and record.geometry_id not in unseen
            )

    def _is_up_to_date(
        self, calc_X_WF: Callable[[FrameId], RigidTransform]
    ) -> bool:
        """Returns whether the scene is up to date."""
        if self.built is not self._geometries and (
            len(self.built) != len(self._geometries)
            or not all(map(operator.is_, self.built, self._geometries))
        ):
            return False
        return all(
            X_WA.IsExactlyEqualTo(calc_X_WF(frame_id))
            for frame_id, X_WA in self._X_WAs.items()
        )

    def _build_scene(
        self,
        records: GeometryList,
        world: FrameId,
        calc_X_WF: Callable[[FrameId], RigidTransform],
        p_WS: np.ndarray,
    ) -> None:
        """Makes the scene of the geometry that was read.

        What stands still is taken from the scene of another LiDAR or Context,
        if there is one.

        Args:
            records: the records of the geometry.
            calc_X_WF: returns the pose of a frame.
            p_WS: the position of the sensor in the world, (3,) [m].
        """
        doing("preparing the ray casting")
        structures = self._view.structures
        self._materials = None
        names = [
            structure_name(geometry.name, is_scoped=structures is None)
            for geometry in self._geometries
        ]
        self.label, self.moving_label, self.instance = (
            number_structures(names)
            if structures is None
            else structures.labels(names)
        )
        anchored = {*self._view.anchored_frames, world}
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
            num_threads=self._view.num_threads,
            previous=self.scene
            or cast("RayCastingScene | None", records.scene()),
            p_WS=p_WS,
        )
        records.scene = weakref.ref(self.scene)
        self.built = self._geometries


def _id_of(place: Place) -> FrameId | GeometryId:
    """Returns an id unchanged, or the frame id of a body or a frame's body."""
    if isinstance(place, Frame):
        place = place.body()
    if isinstance(place, RigidBody):
        return place.GetParentPlant().GetBodyFrameIdOrThrow(place.index())
    return place
