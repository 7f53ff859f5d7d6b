"""Cuts a drive into overlapping small maps, which serve to align drives."""

from functools import lru_cache

import numpy as np

from evaluation.alignment.registration import Surface, make_surface
from evaluation.base import poses
from evaluation.drives import Drive, sample_frames, travelled
from evaluation.maps import VoxelAccumulator

# Distance between keyframes along the path [m].
_SPACING = 10.0
# Very short drives have a smaller distance, so that they get this many
# keyframes.
_FEWEST_KEYFRAMES = 20
# Very long drives have a larger distance, so that they get no more than this.
_MOST_KEYFRAMES = 400
# A submap contains the scans within this distance along the path on either side
# of its keyframe [m].
_HALF_LENGTH = 10.0
# Distance along the path between two of these scans [m].
_SCAN_SPACING = 2.5
# Greatest horizontal range of the points in a submap [m].
_RANGE = 60.0
# A submap has a point for each voxel of this side [m].
_VOXEL_SIZE = 0.7
# A submap with fewer points is not registered.
_FEWEST_POINTS = 500
# Number of keyframes at which the ground is searched.
_GROUND_KEYFRAMES = 20
# The ground is searched within this horizontal distance of a keyframe [m].
_GROUND_RANGE = 8.0
# Least z of the normals of the ground.
_LEVEL = 0.95
# Least distance of two keyframes that divides their interpolation [m].
_TINY = 1e-9
# Number of surfaces kept in memory; neighbouring surfaces are used in sequence.
_NUM_KEPT = 48


class Submaps:
    """Keyframes of a drive, with a submap around each.

    Attributes:
        drive: the drive.
        X_WS: (N, 4, 4) poses of the LiDAR at all frames of the drive.
        travelled: (N,) length of the path from the start to each frame [m].
        frames: (K,) frame numbers of the keyframes.
        X_WK: (K, 4, 4) poses of the LiDAR at the keyframes.
        surface: function that takes the index of a keyframe, and returns its
            submap with normals; None if the submap has too few points.
    """

    def __init__(self, drive: Drive):
        self.drive = drive
        self.X_WS = drive.X_WS
        p_WS = self.X_WS[:, :3, 3]
        self.travelled = travelled(p_WS)
        length = self.travelled[-1]
        spacing = max(
            min(_SPACING, length / _FEWEST_KEYFRAMES), length / _MOST_KEYFRAMES
        )
        self.frames = (
            sample_frames(p_WS, spacing) if length > 0.0 else np.array([0])
        )
        self._scans = sample_frames(p_WS, _SCAN_SPACING)
        self.X_WK = self.X_WS[self.frames]
        self.surface = lru_cache(_NUM_KEPT)(self._make_surface)

    def __len__(self) -> int:
        return len(self.frames)

    @property
    def name(self) -> str:
        """Name of the drive."""
        return self.drive.name

    @property
    def length(self) -> float:
        """Length of the path [m]."""
        return float(self.travelled[-1])

    @property
    def path(self) -> np.ndarray:
        """(K,) distances of the keyframes along the path [m]."""
        return self.travelled[self.frames]

    def bend(self, X_VK: np.ndarray) -> np.ndarray:
        """Returns poses of all frames, given new poses of the keyframes.

        Each keyframe is moved from its pose in the world W to a pose in a new
        world V. Between two keyframes, frames are moved by an interpolation of
        the two rigid motions.

        Args:
            X_VK: (K, 4, 4) new poses of the keyframes.

        Returns:
            (N, 4, 4) poses of the LiDAR in V at all frames of the drive.
        """
        moves = X_VK @ poses.inverse(self.X_WK)
        frames = np.arange(len(self.X_WS))
        before = np.searchsorted(self.frames, frames, side="right") - 1
        after = np.minimum(before + 1, len(self) - 1)
        gap = np.maximum(self.path[after] - self.path[before], _TINY)
        fraction = np.clip((self.travelled - self.path[before]) / gap, 0.0, 1.0)
        return poses.interpolate(
            moves[before] @ self.X_WS, moves[after] @ self.X_WS, fraction
        )

    def ground_height(self) -> float:
        """Returns the median height in W of the ground under the drive [m]."""
        heights = []
        number = min(_GROUND_KEYFRAMES, len(self))
        for index in np.linspace(0, len(self) - 1, number).astype(np.int64):
            points = self._ground_points(int(index))
            if len(points):
                heights.append(
                    np.median(poses.transform(self.X_WK[index], points)[:, 2])
                )
        return float(np.median(heights)) if heights else 0.0

    def _ground_points(self, index: int) -> np.ndarray:
        """Returns the points (M, 3) of the ground around a keyframe, in K [m].

        Args:
            index: index of the keyframe K.
        """
        surface = self.surface(index)
        if surface is None:
            return np.zeros((0, 3))
        near = np.hypot(*surface.points[:, :2].T) < _GROUND_RANGE
        below = surface.points[:, 2] < 0.0
        level = np.abs(surface.normals[:, 2]) > _LEVEL
        return surface.points[near & below & level]

    def _make_surface(self, index: int) -> Surface | None:
        """Returns the submap around a keyframe, in the frame of its LiDAR.

        The result is None if the submap has too few points.

        Args:
            index: index of the keyframe.
        """
        frame = self.frames[index]
        apart = np.abs(self.travelled[self._scans] - self.travelled[frame])
        chosen = {int(frame), *self._scans[apart <= _HALF_LENGTH].tolist()}
        X_KW = poses.inverse(self.X_WS[frame])
        accumulator = VoxelAccumulator(_VOXEL_SIZE)
        for other in sorted(chosen):
            points = self.drive.scan(other)
            near = np.hypot(points["x"], points["y"]) < _RANGE
            accumulator.add(points[near], X_KW @ self.X_WS[other])
        centroids = accumulator.to_map().centroids_W
        if len(centroids) < _FEWEST_POINTS:
            return None
        surface = make_surface(centroids)
        return surface if len(surface.points) >= _FEWEST_POINTS else None
