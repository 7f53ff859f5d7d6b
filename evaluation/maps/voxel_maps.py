"""Maps of whole drives: the points of all scans, thinned to voxels.

Voxels are on a grid that is fixed in the world, since its place influences a
coarse voxel map. The grid has multiples of the voxel size in x and y, and
starts at z = -2.5 m, so that ground at z = 0 is in the middle of a 5 m voxel. A
voxel is represented by the centroid of its points.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cns_drake.base.drives.drive import Drive
from cns_drake.base.progress import Track, silent
from evaluation.geometry.sorting import cell_order
from evaluation.maps.voxel_table import SLOT, enter, locate, move

VOXEL_SIZE = 5.0
Z_ORIGIN = -2.5

# Number of points in a batch; the table grows between batches.
_BATCH = 1 << 15
# A table is at most this full, as a fraction (numerator, denominator).
_LOAD = (3, 5)


@dataclass(frozen=True)
class VoxelMap:
    """The occupied voxels of a cloud, sorted by index.

    Attributes:
        indices: (V, 3) int32 voxel number along x, y, z.
        centroids_W: (V, 3) float64 mean of each voxel's points [m].
        counts: (V,) int64 points in each voxel.
        voxel_size: length of a voxel's side [m].
        num_ignored: number of points left out as not finite.

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

    def __len__(self) -> int:
        return len(self.counts)

    @property
    def centres_W(self) -> np.ndarray:
        """(V, 3) middle of each voxel [m]."""
        return _corners(self.indices, self.voxel_size) + 0.5 * self.voxel_size

    def find(self, points_W: np.ndarray) -> np.ndarray:
        """Returns the voxels of points (N, 3) [m].

        Returns:
            (N,) index into the map, -1 where its voxel is not occupied.
        """
        if len(self) == 0 or len(points_W) == 0:
            return np.full(len(points_W), -1)
        lifted = points_W - np.array([0.0, 0.0, Z_ORIGIN])
        wanted = np.floor(lifted / self.voxel_size).astype(np.int64)
        # Both become numbers with the order of rows of indices.
        low, high = self.indices.min(axis=0), self.indices.max(axis=0)
        spans = (high - low).astype(np.int64) + 1
        weights = np.array([spans[1] * spans[2], spans[2], 1])
        keys = (self.indices - low) @ weights
        sought = (wanted - low) @ weights
        places = np.minimum(np.searchsorted(keys, sought), len(keys) - 1)
        inside = ((wanted >= low) & (wanted <= high)).all(axis=1)
        return np.where(inside & (keys[places] == sought), places, -1)


class VoxelAccumulator:
    """Sums points into voxels; its memory grows with the number of voxels.

    Sums are kept relative to each voxel's corner, so that coordinates far
    from the origin (UTM) lose nothing. The result depends only on the points
    and their order.

    For pictures, samples of the points can be kept on a finer grid. Centroids
    there would take twice as long: their table would not fit into the cache.
    """

    def __init__(self, voxel_size: float = VOXEL_SIZE, divisions: int = 0):
        """Starts an empty map.

        Args:
            voxel_size: length of a voxel's side [m].
            divisions: of a voxel's side into parts that have a sample each;
                0 for no samples.
        """
        self._voxel_size = voxel_size
        self._divisions = divisions
        self._table = np.zeros(2 * _BATCH, dtype=SLOT)
        self._size = 0
        # One bit for each part of a slot's voxel: whether it has a sample.
        num_bytes = (divisions**3 + 7) // 8
        self._sampled = np.zeros((len(self._table), num_bytes), dtype=np.uint8)
        self._samples = np.empty((0, 3))
        self._num_samples = 0
        self._num_ignored = 0
        self._columns = np.zeros((3, _BATCH))
        self._located = np.empty((3, 3, _BATCH))
        self._parts = np.empty(_BATCH)

    def add(self, points: np.ndarray, X_WS: np.ndarray | None = None) -> int:
        """Adds a cloud.

        Args:
            points: structured array of shape (N,) with x, y, z [m].
            X_WS: (4, 4) pose of the frame in which they are expressed;
                identity if left out.

        Returns:
            How many points were left out because they are not finite, or
            farther away than voxels can be numbered.
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
            locate(
                self._columns,
                len(batch),
                X,
                self._voxel_size,
                self._divisions,
                self._located,
                self._parts,
            )
            self._size, self._num_samples, skipped = enter(
                self._located,
                self._parts,
                len(batch),
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
        order = cell_order(indices)
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
        """Returns the first point in each part of a voxel.

        Returns:
            (K, 3), in the order in which they came [m].
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
            move(self._table, self._sampled, table, sampled)
            self._table, self._sampled = table, sampled
        needed = self._num_samples + number
        if self._divisions and needed > len(self._samples):
            samples = np.empty((2 * needed, 3))
            samples[: self._num_samples] = self._samples[: self._num_samples]
            self._samples = samples


def voxelise(
    points: np.ndarray, voxel_size: float = VOXEL_SIZE
) -> tuple[VoxelMap, int]:
    """Returns the voxel map of one cloud in the world frame.

    Returns:
        The map, and how many points were left out as not finite.

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
    track: Track = silent,
) -> VoxelMap:
    """Returns the world-frame map of all scans of a drive.

    One pass over the scans, one in memory at a time. The default grid is
    the one on which structural change is defined.

    Raises:
        InputError: if a scan or a pose cannot be read.

    Example:
        from evaluation import map_drive, open_drive

        voxels = map_drive(open_drive("recordings/downtown_01"))
    """
    accumulator = VoxelAccumulator(voxel_size)
    X_WS = drive.X_WS
    indices = track(range(len(drive)), f"mapping {drive.name}", len(drive))
    for index in indices:
        accumulator.add(drive.scan(index), X_WS[index])
    return accumulator.to_map()


def _corners(indices: np.ndarray, voxel_size: float) -> np.ndarray:
    return np.array([0.0, 0.0, Z_ORIGIN]) + indices * voxel_size
