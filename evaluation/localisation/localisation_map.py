"""Maps in which scans are localised: made of drives, or of files of clouds."""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np
import small_gicp

from evaluation.alignment import Surface, make_surface
from evaluation.base import InputError, poses, track, xyz
from evaluation.clouds import OnNote, no_note, read_blocks, read_cloud
from evaluation.drives import (
    NOT_FINITE,
    Drive,
    FileDrive,
    JoinedDrive,
    PosedFiles,
    sample_frames,
    within_cube,
)
from evaluation.localisation.settings import HALF_EXTENT, Settings
from evaluation.maps import VoxelAccumulator
from evaluation.recognition import KEEP_ALL, kept_places

# Distance between the scans of a drive that enter the map [m].
_MAP_SPACING = 1.0
# Least number of points of a map, and of a downsampled scan that is aligned.
FEWEST_POINTS = 10
# Shift of the voxels of VGICP, as a fraction of their side.
_VOXEL_SHIFT = 0.37


@dataclass(frozen=True, eq=False)
class LocalisationMap:
    """A map in which scans are localised.

    Attributes:
        name: name of the drive or file from which the map was made.
        surface: the downsampled points in W, with normals and covariances.
    """

    name: str
    surface: Surface

    @cached_property
    def _voxels(self) -> dict[float, small_gicp.GaussianVoxelMap]:
        return {}

    def voxels(self, resolution: float) -> small_gicp.GaussianVoxelMap:
        """Returns the map with one Gaussian per voxel, for VGICP.

        The frame of this map is W, shifted by a fraction of a voxel, so that
        walls and ground at round coordinates do not lie on the border of
        voxels.

        Args:
            resolution: side of a voxel [m].
        """
        if resolution not in self._voxels:
            voxels = small_gicp.GaussianVoxelMap(resolution)
            voxels.insert(self.surface.cloud, voxel_shift(resolution))
            self._voxels[resolution] = voxels
        return self._voxels[resolution]

    def around(self, p_W: np.ndarray, distance: float) -> np.ndarray:
        """Returns the map points (M, 3) in a box around a position.

        Args:
            p_W: (3,) the position [m].
            distance: half the side of the box [m].
        """
        offsets = self.surface.points - p_W
        return self.surface.points[within_cube(offsets, distance)]

    def distances(self, points_W: np.ndarray) -> np.ndarray:
        """Returns the distances (N,) of points from the nearest map point [m].

        Args:
            points_W: (N, 3) the points [m].
        """
        _, squares = self.surface.tree.batch_nearest_neighbor_search(points_W)
        return np.sqrt(np.asarray(squares))


def voxel_shift(resolution: float) -> np.ndarray:
    """Returns the pose of W in the frame of the voxels of VGICP.

    Without this shift, the ground at height 0 and walls at round coordinates
    would lie on the sides of voxels, where rounding chooses between two voxels.
    """
    return poses.make_pose(np.eye(3), np.full(3, _VOXEL_SHIFT * resolution))


def make_map(
    source: Drive | Path,
    settings: Settings,
    columns: int | None = None,
    on_note: OnNote = no_note,
    keep: str | int = KEEP_ALL,
) -> LocalisationMap:
    """Returns the localisation map of a drive or of a cloud in W.

    A drive's scans are placed at their ground-truth poses.

    Args:
        source: the drive, or the cloud's file.
        settings: settings for downsampling and for normals.
        columns: number of columns of a `.bin` file, see `read_cloud`.
        on_note: is called with notes on how a cloud's file was read, and on
            points that are not finite.
        keep: which frames of a `JoinedDrive` are used, see `map_frames`.

    Raises:
        InputError: the source cannot be read, or has too few points.
    """
    if isinstance(source, Drive):
        blocks = _scans_of_map(source, keep)
    else:
        parts = read_blocks(source, columns, on_note)
        blocks = ((part, None) for part in parts)
    accumulator = VoxelAccumulator(settings.voxel)
    for block, X_WS in blocks:
        accumulator.add(block, X_WS)
    cells = accumulator.to_map()
    if cells.num_ignored:
        on_note(f"{source.name}: {cells.num_ignored} {NOT_FINITE}")
    points = cells.centroids_W
    if len(points) < FEWEST_POINTS:
        raise InputError(
            f"{source.name}: a map of {len(points)} points, fewer than"
            f" {FEWEST_POINTS}"
        )
    return map_of(points, source.name, settings.neighbours)


def _scans_of_map(
    drive: Drive, keep: str | int
) -> Iterator[tuple[np.ndarray, np.ndarray | None]]:
    """Yields the cropped scans of which a map is made, each with its X_WS."""
    frames = map_frames(drive, keep).tolist()
    for frame in track(frames, f"mapping {drive.name}", len(frames), "scans"):
        scan = drive.scan(frame)
        p_S = xyz(scan)
        # The map counts the points that are not finite.
        kept = within_cube(p_S, HALF_EXTENT) | ~np.isfinite(p_S).all(axis=1)
        yield scan[kept], drive.X_WS[frame]


def map_frames(drive: Drive, keep: str | int = KEEP_ALL) -> np.ndarray:
    """Returns the frames (K,) of a drive that are used for its map.

    Args:
        drive: the drive.
        keep: which frames are used if the drive is a `JoinedDrive`, see
            `evaluation.recognition.place_selection.kept_places`.
    """
    if not isinstance(drive, JoinedDrive):
        return sample_frames(drive.X_WS[:, :3, 3], _MAP_SPACING)
    frames = drive.sampled(_MAP_SPACING)
    p_WSs = drive.X_WS[frames, :3, 3]
    kept = kept_places(p_WSs, drive.drive_of(frames), keep, _MAP_SPACING)
    return frames[kept]


def map_of(points: np.ndarray, name: str, neighbours: int) -> LocalisationMap:
    """Returns a localisation map made of points.

    Args:
        points: (M, 3) points in W [m], at least `FEWEST_POINTS`.
        name: name of the map.
        neighbours: number of points that a normal or a covariance is fitted to.
    """
    surface = make_surface(points, neighbours)
    return LocalisationMap(name, surface)


class OneScan(FileDrive):
    """A point cloud that is read as a drive: one scan at the origin of W."""

    def __init__(self, path: Path, columns: int | None = None):
        """Opens the point cloud.

        Args:
            path: its file.
            columns: number of columns of a `.bin` file, see `read_cloud`.
        """
        notes: list[str] = []
        scan = read_cloud(path, columns, notes.append)
        super().__init__(
            path,
            scans=PosedFiles(
                [path],
                np.zeros(1, np.int64),
                np.eye(4)[None],
                notes=tuple(notes),
                world_frame="map",
            ),
            read=lambda path, stamp_ns: scan,
        )

    def scan(self, index: int) -> np.ndarray:
        """Returns all points of the cloud, including points at the origin.

        Other drives leave out points at the origin, which stand for beams
        without a return. In this cloud, such a point can be real.
        """
        return self._read(self._files[index], 0)
