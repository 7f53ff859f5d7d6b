"""Groups of geometry that moves together rigidly, for ray casting."""

from collections import Counter
from collections.abc import Callable, Collection, Iterable, Sequence
from dataclasses import dataclass, field
import math
from typing import NamedTuple

import numpy as np
from pydrake.geometry import FrameId
from pydrake.math import RigidTransform

from cns_drake.scene import (
    MOST_COPIED_TRIANGLES,
    HalfSpaceSurface,
    PerceptionGeometry,
    Surface,
    TriangleSurface,
)
from evaluation.base import cos, product, rotated, sin

# Largest rotation in a step: Embree interpolates along the shorter rotation.
_LARGEST_STEP_RAD = 2.0
# Greatest number of time steps that Embree supports.
_MOST_STEPS = 129
# Space is divided into cubes, each with an origin O. Side of the cubes for
# scenes with merged geometry [m].
_MERGED_CUBE = 2000.0
# Side of the cubes for other scenes, which are quick to rebuild [m].
_MOVING_CUBE = 256.0
# A member of a group: index of a geometry, its pose, its surface.
Member = tuple[int, RigidTransform, Surface]


class Motion(NamedTuple):
    """Motion of a frame F in the scene's frame O during a revolution.

    The velocities are constant.

    Attributes:
        w: (3,) angular velocity of F, expressed in O [rad/s].
        v: (3,) velocity of the origin of F, expressed in O [m/s].
        duration: duration of the LiDAR's revolution [s].
        start: time at which the revolution starts, counted from the time at
            which the pose of F is known [s].
    """

    w: np.ndarray
    v: np.ndarray
    duration: float
    start: float = 0.0

    @property
    def num_steps(self) -> int:
        """Number of evenly spaced poses that Embree needs for the motion.

        Raises:
            ValueError: F turns too fast.
        """
        angle = math.hypot(*self.w) * self.duration
        steps = 1 + max(1, int(np.ceil(angle / _LARGEST_STEP_RAD)))
        if steps > _MOST_STEPS:
            raise ValueError(
                f"a body turns by {angle:.0f} rad during one revolution"
                " of the LiDAR"
            )
        return steps

    def at(self, times: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Returns the motion of F at given times of the revolution.

        Args:
            times: (N,) fractions of the revolution, from 0 to 1.

        Returns:
            (N, 3, 3) rotations, and (N, 3) displacements of F's origin [m],
            relative to the given pose of F.
        """
        t = self.duration * np.asarray(times, float)[:, None] + self.start
        return _turns(t * self.w), t * self.v


@dataclass
class RayGroup:
    """Geometry that moves as one, in a local frame L.

    Attributes:
        frame_id: the frame F to which the group is fixed; None for the world.
        X_FL: (4, 4) pose of L in F.
        members: the geometry of the group, expressed in L. A half space has a
            group of its own; its surface is z = 0 in L.
        is_merged_world: whether the group is the merged geometry that never
            moves; L then has the axes of the world and the origin of O.
        X_OL: (3, 4) pose of L in the scene's frame O, at the start of a
            revolution; missing until `place` is called.
        motion: motion of F during the revolution; None if F does not move.
        in_sight: whether rays can meet the group. If rays cannot meet the
            group, `X_OL` and `motion` are from an earlier revolution.
    """

    frame_id: FrameId | None
    X_FL: np.ndarray
    members: list[Member]
    is_merged_world: bool = False
    X_OL: np.ndarray = field(init=False)
    motion: Motion | None = None
    in_sight: bool = True

    @property
    def is_half_space(self) -> bool:
        return isinstance(self.members[0][2], HalfSpaceSurface)

    def place(
        self, p_WO: np.ndarray, calc_X_WF: Callable[[FrameId], RigidTransform]
    ) -> None:
        """Sets `X_OL`, the group's placement in the scene, for current poses.

        Args:
            p_WO: (3,) origin of the scene's frame O in the world [m].
            calc_X_WF: function that returns the pose of a frame in the world.
        """
        X_WL = self.X_FL
        if self.frame_id is not None:
            X_WL = calc_X_WF(self.frame_id).GetAsMatrix4() @ X_WL
        self.X_OL = X_WL[:3].copy()
        self.X_OL[:, 3] -= p_WO

    def X_OL_at(self, times: np.ndarray) -> np.ndarray:
        """Returns `X_OL` at several times of the revolution, (N, 3, 4).

        Args:
            times: (N,) fractions of the revolution, from 0 to 1.
        """
        if self.motion is None:
            return np.broadcast_to(self.X_OL, (len(times), 3, 4))
        R_OL0, way_F = self.motion.at(times)
        # L in axes of O, relative to F's origin, which moves in a straight
        # line.
        p_FL_L = rotated(self.X_FL[:3, :3].T, self.X_FL[:3, 3])
        p_FL = rotated(self.X_OL[:, :3], p_FL_L)
        X_OL = product(R_OL0, self.X_OL)
        X_OL[:, :, 3] = self.X_OL[:, 3] - p_FL + way_F + rotated(R_OL0, p_FL)
        return X_OL

    def content(self) -> tuple:
        """Returns a key of the group's shapes and their poses in the group.

        Groups with equal keys can share one Embree scene. A key is valid as
        long as the surfaces of the group exist in memory.
        """
        return tuple(
            (
                # Comparing all triangles would take too long.
                id(surface)
                if isinstance(surface, TriangleSurface)
                else surface,
                X_LG.GetAsMatrix34().tobytes(),
            )
            for _, X_LG, surface in self.members
        )


def group_geometries(
    geometries: Iterable[tuple[int, PerceptionGeometry]],
    anchored_frames: Collection[FrameId],
    calc_X_WF: Callable[[FrameId], RigidTransform],
    *,
    p_WS: np.ndarray | None = None,
) -> tuple[np.ndarray, list[RayGroup]]:
    """Divides geometries into groups that move rigidly, and chooses an origin.

    Ranges are most precise near the origin of a scene.

    A large surface with many copies gets a group for each copy, and these
    groups share the surface.

    Args:
        geometries: pairs of an index and a geometry.
        anchored_frames: frames that never move.
        calc_X_WF: function that returns the pose of a frame in the world.
        p_WS: (3,) position of the sensor [m]; None if it is not known.

    Returns:
        p_WO, (3,) [m]: the middle of the geometry that never moves or, if the
        sensor is far from this middle, a point near the sensor. The groups:
        first the geometry that never moves (if there is any), last the half
        spaces.
    """
    geometries = list(geometries)
    shared = _find_shared(geometries)
    by_frame, half_spaces = _members_by_frame(
        geometries, anchored_frames, calc_X_WF
    )
    world = by_frame.pop(None, [])
    p_WO = _choose_origin(world, p_WS)
    groups, alone = [], []
    for frame_id, members in [(None, world), *by_frame.items()]:
        # Coordinates are relative to O before they are rounded to float32,
        # and relative to F where F moves.
        shift = p_WO if frame_id is None else np.zeros(3)
        X_FL, X_LF = RigidTransform(shift), RigidTransform(-shift)
        merged: list[Member] = []
        for index, X_FG, surface in members:
            if id(surface) in shared:
                one: Member = (index, RigidTransform(), surface)
                alone.append(RayGroup(frame_id, X_FG.GetAsMatrix4(), [one]))
            else:
                merged.append((index, X_LF @ X_FG, surface))
        if merged:
            groups.append(
                RayGroup(
                    frame_id, X_FL.GetAsMatrix4(), merged, frame_id is None
                )
            )
    return p_WO, groups + alone + half_spaces


def _members_by_frame(
    geometries: Iterable[tuple[int, PerceptionGeometry]],
    anchored_frames: Collection[FrameId],
    calc_X_WF: Callable[[FrameId], RigidTransform],
) -> tuple[dict[FrameId | None, list[Member]], list[RayGroup]]:
    """Returns the members of each frame F, and the groups of half spaces.

    Members are expressed in F; F is None for the world, to which the geometry
    of anchored frames belongs.
    """
    by_frame: dict[FrameId | None, list[Member]] = {}
    half_spaces = []
    for index, geometry in geometries:
        frame_id, X_FG = geometry.frame_id, geometry.X_FG
        if frame_id in anchored_frames:
            X_FG = calc_X_WF(frame_id) @ X_FG
            frame_id = None
        if isinstance(geometry.surface, HalfSpaceSurface):
            plane: Member = (index, RigidTransform(), geometry.surface)
            half_spaces.append(RayGroup(frame_id, X_FG.GetAsMatrix4(), [plane]))
            continue
        by_frame.setdefault(frame_id, []).append(
            (index, X_FG, geometry.surface)
        )
    return by_frame, half_spaces


def _choose_origin(
    world: Sequence[Member], p_WS: np.ndarray | None
) -> np.ndarray:
    """Returns p_WO, (3,) [m]; see `group_geometries`.

    Args:
        world: the geometry that never moves, expressed in the world.
        p_WS: (3,) position of the sensor [m]; None if it is not known.
    """
    p_WO = np.zeros(3)
    if world:
        places = np.array([X_WG.translation() for _, X_WG, _ in world])
        p_WO = np.round((places.min(axis=0) + places.max(axis=0)) / 2.0)
    if p_WS is not None:
        cube = _MERGED_CUBE if world else _MOVING_CUBE
        p_WO += cube * np.round((p_WS - p_WO) / cube)
    return p_WO


def serves(
    p_WO: np.ndarray, groups: Sequence[RayGroup], p_WS: np.ndarray
) -> bool:
    """Returns whether a scene gives precise ranges for a sensor's position.

    A scene casts rays in float32 relative to its origin O. Ranges are precise
    as long as the sensor is in a cube around O.

    Args:
        p_WO: (3,) position of O in the world [m].
        groups: groups of the scene.
        p_WS: (3,) position of the sensor in the world [m].
    """
    has_world = any(group.is_merged_world for group in groups)
    cube = _MERGED_CUBE if has_world else _MOVING_CUBE
    return bool((np.abs(p_WS - p_WO) <= cube / 2.0).all())


def _find_shared(
    geometries: Iterable[tuple[int, PerceptionGeometry]],
) -> frozenset[int]:
    """Returns the `id` of each surface that is stored once for all copies."""
    num_triangles: Counter[int] = Counter()
    copies: Counter[int] = Counter()
    for _, geometry in geometries:
        if isinstance(geometry.surface, TriangleSurface):
            key = id(geometry.surface)
            copies[key] += 1
            num_triangles[key] += len(geometry.surface.triangles)
    return frozenset(
        key
        for key, count in num_triangles.items()
        if count > MOST_COPIED_TRIANGLES and copies[key] > 1
    )


def _turns(rotvecs: np.ndarray) -> np.ndarray:
    """Returns the rotation matrices (N, 3, 3) of rotation vectors (N, 3).

    The length of a rotation vector is its angle [rad]. The matrices follow from
    Rodrigues' formula.
    """
    x, y, z = rotvecs.T
    half = np.sqrt(x * x + y * y + z * z) / 2.0
    # sin(half) / half.
    part = np.where(half > 0.0, sin(half) / np.where(half > 0.0, half, 1), 1.0)
    along, across = part * cos(half), part * part / 2.0
    zero = np.zeros_like(x)
    K = np.array([[zero, -z, y], [z, zero, -x], [-y, x, zero]])
    K = np.moveaxis(K, 2, 0)
    return (
        np.eye(3)
        + along[:, None, None] * K
        + across[:, None, None] * product(K, K)
    )
