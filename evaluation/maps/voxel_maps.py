"""Maps of whole drives: the points of all scans, downsampled to voxels.

The grid of the voxels is fixed in the world, because its position influences a
coarse voxel map. In x and y, the borders of voxels are multiples of the voxel
size. In z they start at -2.5 m, so that ground at z = 0 is in the middle of a 5
m voxel. Each voxel is represented by the centroid of its points.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from cns_drake.base import from_xyz, track
from cns_drake.drives import Drive
from evaluation.maps.voxel_table import SLOT, add_points, copy_voxels

# Side of a voxel [m].
VOXEL_SIZE = 5.0
# Height of the lower faces of a layer of voxels [m], half a side below zero.
Z_ORIGIN = -2.5
_ORIGIN = (0.0, 0.0, Z_ORIGIN)
# Side of the cells that are merged into larger voxels, on any grid [m].
CELL_SIZE = 1.0

# Number of points in a batch; the table grows between batches.
_BATCH = 1 << 15
# A table is at most this full, as a fraction (numerator, denominator).
_LOAD = (3, 5)


@dataclass(frozen=True)
class VoxelMap:
    """A map as its occupied voxels, sorted by index.

    Attributes:
        indices: (V, 3) int32 number of each voxel along x, y, z.
        centroids_W: (V, 3) float64 mean of each voxel's points in the world
            [m].
        counts: (V,) int64 number of points in each voxel.
        voxel_size: length of a voxel's side [m].
        num_ignored: number of points that were left out because they are not
            finite.
        origin_W: a corner of voxel (0, 0, 0) [m].

    Example:
        from evaluation import map_drive, open_drive

        voxels = map_drive(open_drive(path))
        print(voxels.centroids_W.shape)
    """

    indices: np.ndarray
    centroids_W: np.ndarray
    counts: np.ndarray
    voxel_size: float
    num_ignored: int = 0
    origin_W: tuple[float, float, float] = _ORIGIN

    def __len__(self) -> int:
        return len(self.counts)

    @property
    def centres_W(self) -> np.ndarray:
        """(V, 3) middle of each voxel [m]."""
        corners = _corners(self.indices, self.voxel_size, self.origin_W)
        return corners + 0.5 * self.voxel_size

    def merged(
        self,
        voxel_size: float = VOXEL_SIZE,
        shift: tuple[float, float, float] = (0.0, 0.0, 0.0),
    ) -> VoxelMap:
        """Returns the map on a grid of larger voxels.

        All points of a voxel count in the larger voxel that contains the
        centroid of these points.

        Args:
            voxel_size: length of a larger voxel's side [m].
            shift: distances along x, y and z from the origin of this map's grid
                to the origin of the grid of larger voxels [m].
        """
        x, y, z = np.add(self.origin_W, shift).tolist()
        origin = x, y, z
        found = np.floor((self.centroids_W - origin) / voxel_size)
        order = np.lexsort(found.T[::-1])
        indices = found[order].astype(np.int32)
        # NaN counts as a difference: the first row belongs to a new voxel.
        is_first = np.diff(found[order], axis=0, prepend=np.nan).any(axis=1)
        rows = np.cumsum(is_first) - 1
        counts = np.zeros(int(is_first.sum()), np.int64)
        np.add.at(counts, rows, self.counts[order])
        corners = _corners(indices, voxel_size, origin)
        sums = np.zeros((len(counts), 3))
        offsets = self.centroids_W[order] - corners
        np.add.at(sums, rows, offsets * self.counts[order, None])
        return VoxelMap(
            indices[is_first],
            corners[is_first] + sums / counts[:, None],
            counts,
            voxel_size,
            self.num_ignored,
            origin,
        )

    def find(self, points_W: np.ndarray) -> np.ndarray:
        """Returns the voxel that contains each point.

        The points (N, 3) are in the world [m].

        Returns:
            (N,) index of each point's voxel in the map; -1 if the map has no
            such voxel.
        """
        if len(self) == 0 or len(points_W) == 0:
            return np.full(len(points_W), -1)
        lifted = points_W - np.array(self.origin_W)
        wanted = np.floor(lifted / self.voxel_size).astype(np.int64)
        # Both are encoded as numbers that sort like rows of indices.
        low, high = self.indices.min(axis=0), self.indices.max(axis=0)
        spans = (high - low).astype(np.int64) + 1
        weights = np.array([spans[1] * spans[2], spans[2], 1])
        keys = (self.indices - low) @ weights
        sought = (wanted - low) @ weights
        rows = np.minimum(np.searchsorted(keys, sought), len(keys) - 1)
        inside = ((wanted >= low) & (wanted <= high)).all(axis=1)
        return np.where(inside & (keys[rows] == sought), rows, -1)


class VoxelAccumulator:
    """Makes a voxel map of clouds that are added one by one.

    Coordinates far from the origin (UTM) lose no precision. Memory grows with
    the number of voxels, not with the number of points.

    For pictures, one point per cell of a finer grid can be kept.
    """

    def __init__(self, voxel_size: float = VOXEL_SIZE, divisions: int = 0):
        """Starts an empty map.

        Args:
            voxel_size: length of a voxel's side [m].
            divisions: number of cells of a finer grid along a voxel's side,
                each of which keeps one point, see `samples`; 0 for no finer
                grid.
        """
        self._voxel_size = voxel_size
        self._divisions = divisions
        # Hash table of the occupied voxels; see `SLOT`.
        self._table = np.zeros(2 * _BATCH, dtype=SLOT)
        # Number of slots in use: the occupied voxels.
        self._size = 0
        # One bit for each cell of a slot's voxel: whether it has a sample.
        num_bytes = (divisions**3 + 7) // 8
        self._sampled = np.zeros((len(self._table), num_bytes), dtype=np.uint8)
        # The samples [m], with room for more; heights are above `Z_ORIGIN`.
        self._samples = np.empty((0, 3))
        self._num_samples = 0
        self._num_ignored = 0
        # The x, y and z of a batch of points in the frame of their cloud [m].
        self._columns = np.zeros((3, _BATCH))

    def add(self, points: np.ndarray, X_WS: np.ndarray | None = None) -> int:
        """Adds a cloud to the map.

        Args:
            points: structured array of shape (N,) with x, y, z [m].
            X_WS: (4, 4) pose of the frame in which the points are expressed; by
                default the points are in the world.

        Returns:
            Number of points left out because they are not finite, or lie 2^31
            voxels or more from the origin along an axis.
        """
        X = np.array(np.eye(4) if X_WS is None else X_WS, dtype=np.float64)
        X[2, 3] -= Z_ORIGIN
        ignored = 0
        for start in range(0, len(points), _BATCH):
            batch = points[start : start + _BATCH]
            # NumPy warns when it converts some NaN.
            with np.errstate(invalid="ignore"):
                for column, name in zip(self._columns, "xyz", strict=True):
                    column[: len(batch)] = batch[name]
            self._reserve(len(batch))
            self._size, self._num_samples, skipped = add_points(
                self._columns,
                len(batch),
                X,
                self._voxel_size,
                self._divisions,
                self._table,
                self._size,
                self._sampled,
                self._samples,
                self._num_samples,
            )
            ignored += skipped
        self._num_ignored += ignored
        return ignored

    def to_map(self) -> VoxelMap:
        """Returns the map of all points so far."""
        # NumPy takes records much faster this way than by an index.
        cells = self._table.compress(self._table["count"] > 0)
        indices = np.stack([cells[name] for name in ("ix", "iy", "iz")], axis=1)
        order = np.lexsort(indices.T[::-1])
        cells, indices = cells.take(order), indices.take(order, axis=0)
        counts = cells["count"].astype(np.int64)
        sums = np.stack([cells[name] for name in ("sx", "sy", "sz")], axis=1)
        return VoxelMap(
            indices=indices,
            centroids_W=_corners(indices, self._voxel_size)
            + sums / counts[:, None],
            counts=counts,
            voxel_size=self._voxel_size,
            num_ignored=self._num_ignored,
        )

    def samples(self) -> np.ndarray:
        """Returns the first point in each cell of the finer grid.

        Returns:
            (K, 3) points in the world [m], in the order in which they were
            added.
        """
        lift = np.array([0.0, 0.0, Z_ORIGIN])
        return self._samples[: self._num_samples] + lift

    def _reserve(self, number: int) -> None:
        """Makes room for new voxels, and for samples if used."""
        slots = len(self._table)
        while _LOAD[1] * (self._size + number) > _LOAD[0] * slots:
            # Sizes are powers of two, because slots are found by masking.
            slots *= 2
        if slots > len(self._table):
            table = np.zeros(slots, dtype=SLOT)
            sampled = np.zeros((slots, self._sampled.shape[1]), dtype=np.uint8)
            copy_voxels(self._table, self._sampled, table, sampled)
            self._table = table
            self._sampled = sampled
        needed = self._num_samples + number
        if self._divisions and needed > len(self._samples):
            samples = np.empty((2 * needed, 3))
            samples[: self._num_samples] = self._samples[: self._num_samples]
            self._samples = samples


def voxelise(
    points: np.ndarray, voxel_size: float = VOXEL_SIZE
) -> tuple[VoxelMap, int]:
    """Returns the voxel map of a cloud (N, 3) in the world frame [m].

    Returns:
        The map, and the number of points left out because they are not finite.

    Example:
        from evaluation import voxelise

        voxels, _ = voxelise(points)
    """
    accumulator = VoxelAccumulator(voxel_size)
    ignored = accumulator.add(points)
    return accumulator.to_map(), ignored


def map_drive(
    drive: Drive,
    voxel_size: float = VOXEL_SIZE,
    frames: Sequence[int] | None = None,
) -> VoxelMap:
    """Returns the voxel map of scans of a drive, in the world frame.

    Each scan is read once. The measure of structural change (TCR) uses the
    default voxel size. By default all frames are mapped.

    Raises:
        InputError: if a scan or a pose cannot be read.

    Example:
        from evaluation import map_drive, open_drive

        voxels = map_drive(open_drive("recordings/downtown_01"))
    """
    accumulator = VoxelAccumulator(voxel_size)
    X_WS = drive.X_WS
    frames = range(len(drive)) if frames is None else frames
    for frame in track(frames, f"mapping {drive.name}", len(frames), "scans"):
        accumulator.add(drive.scan(frame), X_WS[frame])
    return accumulator.to_map()


def _corners(
    indices: np.ndarray,
    voxel_size: float,
    origin_W: tuple[float, float, float] = _ORIGIN,
) -> np.ndarray:
    return np.array(origin_W) + indices * voxel_size


def downsample(points: np.ndarray, voxel_size: float) -> np.ndarray:
    """Returns a cloud with one point per voxel, the centroid.

    Points are in the frame of a sensor.

    Args:
        points: (N, 3) points [m]; points that are not finite are left out.
        voxel_size: length of a voxel's side [m].

    Returns:
        (V, 3), sorted by voxel.
    """
    cloud = from_xyz(np.asarray(points, np.float64))
    return voxelise(cloud, voxel_size)[0].centroids_W
