"""Groups of geometry that move, and which of their poses to update."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import NamedTuple

import numpy as np
from pydrake.geometry import FrameId
from pydrake.math import RigidTransform

from cns_drake.ray_casting.known_poses import NOTHING_KNOWN, KnownPoses
from cns_drake.ray_casting.ray_groups import Motion, RayGroup
from cns_drake.scene import EllipsoidSurface, HalfSpaceSurface, TriangleSurface


class Ball(NamedTuple):
    """A ball in the world: its centre [m] and its radius [m]."""

    p_W: np.ndarray
    radius: float


class Placed(NamedTuple):
    """P groups of a scene whose poses were updated.

    Attributes:
        rows: (P,) indices of these groups among all groups of the scene.
        X_OLs: (P, 3, 4) maps from each group's local frame L to the scene's
            frame O; see `cns_drake.ray_casting.ray_groups.RayGroup`.
        in_sight: (P,) bool, whether rays can meet each group.
        moves: (P,) bool, whether each group has a `motion`.
    """

    rows: np.ndarray
    X_OLs: np.ndarray
    in_sight: np.ndarray
    moves: np.ndarray

    @classmethod
    def of(cls, groups: Sequence[RayGroup], rows: Sequence[int]) -> Placed:
        """Returns the current poses of the groups with the indices `rows`."""
        chosen = [groups[row] for row in rows]
        return cls(
            np.array(rows, int),
            np.reshape([group.X_OL for group in chosen], (-1, 3, 4)),
            np.array([group.in_sight for group in chosen], bool),
            np.array([group.motion is not None for group in chosen], bool),
        )

    def below(self, row: int) -> Placed:
        """Returns only the groups with row numbers less than `row`."""
        kept = self.rows < row
        return Placed(*(column[kept] for column in self))


NO_MOTIONS: Mapping[FrameId, Motion] = {}
EVERYWHERE = Ball(np.zeros(3), np.inf)
NOTHING_PLACED = Placed.of((), ())


class MovingGroups:
    """The groups of a scene that can move."""

    def __init__(self, groups: Sequence[RayGroup], p_WO: np.ndarray):
        """Finds the groups that can move.

        Args:
            groups: all groups of the scene, already placed (see
                `RayGroup.place`).
            p_WO: (3,) origin of the scene in the world [m].
        """
        self._groups = groups
        self._p_WO = p_WO
        self._rows = np.array(
            [
                row
                for row, group in enumerate(groups)
                if group.frame_id is not None
            ],
            int,
        )
        moving = [groups[row] for row in self._rows]
        self._frames = [group.frame_id for group in moving]
        self._X_FLs = np.array([group.X_FL for group in moving])
        # The poses of the groups are views of this array, so that all can be
        # updated at once.
        self._X_OLs = np.array([group.X_OL for group in moving])
        for group, X_OL in zip(moving, self._X_OLs, strict=True):
            group.X_OL = X_OL
        self._radii = np.array([_radius_about_F(group) for group in moving])
        self._known: Mapping[FrameId, int] = NOTHING_KNOWN.rows
        self._known_rows = np.full(len(moving), -1)
        self._unknown = np.arange(len(moving))
        self._in_sight = np.ones(len(moving), bool)
        self._was_in_motion = np.zeros(len(moving), bool)

    def place(
        self,
        calc_X_WF: Callable[[FrameId], RigidTransform],
        motions: Mapping[FrameId, Motion] = NO_MOTIONS,
        known: KnownPoses = NOTHING_KNOWN,
        seen: Ball = EVERYWHERE,
    ) -> Placed:
        """Updates the poses, motions and visibility of moving groups.

        Groups outside the ball `seen` are marked as out of sight and keep their
        old poses.

        Args:
            calc_X_WF: function that returns the pose of a frame in the world.
            motions: motions of frames that move during the LiDAR's revolution.
            known: known poses, for which `calc_X_WF` is not called.
            seen: ball in the world that contains all rays.

        Returns:
            The groups whose poses were updated.
        """
        if not len(self._rows):
            return NOTHING_PLACED
        frames = self._frames
        X_WFs, rows = self._find_poses(calc_X_WF, known)
        moves = np.zeros(len(frames), bool)
        reaches = self._radii
        if motions:
            moves = np.array([frame in motions for frame in frames])
            reaches = reaches.copy()
            for k in np.flatnonzero(moves):
                motion = motions[frames[k]]
                reaches[k] += np.linalg.norm(motion.v) * motion.duration
        away = X_WFs[rows, :3, 3] - seen.p_W
        sees = np.linalg.norm(away, axis=1) <= seen.radius + reaches
        shown = sees != self._in_sight
        self._in_sight = sees
        near = np.flatnonzero(sees | shown)
        # Whether each pose is updated even if the frame has not moved.
        anew = (shown | moves | self._was_in_motion)[near]
        X_WF, X_FL = X_WFs[rows[near], :3], self._X_FLs[near]
        # In a fixed order: the result of a matrix library depends on the
        # processor.
        X_OLs = sum(X_WF[:, :, n, None] * X_FL[:, n, None] for n in range(4))
        X_OLs[:, :, 3] -= self._p_WO
        has_moved = (X_OLs != self._X_OLs[near]).any(axis=(1, 2))
        self._X_OLs[near] = X_OLs
        placed, changed = near[anew | has_moved], near[anew]
        for k in changed:
            group = self._groups[self._rows[k]]
            group.motion = motions[frames[k]] if moves[k] else None
            group.in_sight = bool(self._in_sight[k])
        self._was_in_motion[placed] = moves[placed]
        return Placed(
            self._rows[placed],
            self._X_OLs[placed],
            self._in_sight[placed],
            moves[placed],
        )

    def _find_poses(
        self, calc_X_WF: Callable[[FrameId], RigidTransform], known: KnownPoses
    ) -> tuple[np.ndarray, np.ndarray]:
        """Returns poses (M, 4, 4), and each group's row (G,) in the poses."""
        if known.rows is not self._known:
            self._known = known.rows
            self._known_rows = np.array(
                [known.rows.get(frame, -1) for frame in self._frames]
            )
            self._unknown = np.flatnonzero(self._known_rows < 0)
        if not len(self._unknown):
            return known.X_WFs, self._known_rows
        rows = self._known_rows.copy()
        rows[self._unknown] = len(known.X_WFs) + np.arange(len(self._unknown))
        others = [
            calc_X_WF(self._frames[k]).GetAsMatrix4() for k in self._unknown
        ]
        return np.concatenate([known.X_WFs, others]), rows


def _radius_about_F(group: RayGroup) -> float:
    """Returns the greatest distance of a group's geometry from origin F [m]."""
    radii = []
    for _, X_LG, surface in group.members:
        if isinstance(surface, TriangleSurface):
            p_LVset = surface.p_GVset @ X_LG.rotation().matrix().T
            p_LVset = p_LVset + X_LG.translation()
            radii.append(float(np.linalg.norm(p_LVset, axis=1).max(initial=0)))
            continue
        if isinstance(surface, EllipsoidSurface):
            radius = max(surface.semi_axes)
        elif isinstance(surface, HalfSpaceSurface):
            radius = np.inf
        else:
            radius = surface.radius + surface.length / 2.0
        radii.append(float(np.linalg.norm(X_LG.translation())) + radius)
    stretch = float(np.linalg.norm(group.X_FL[:3, :3], 2))
    return float(np.linalg.norm(group.X_FL[:3, 3])) + stretch * max(radii)
