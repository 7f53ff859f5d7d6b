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

from evaluation.base import compiled, from_xyz, poses, track
from evaluation.drives import Drive

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

    def merged(
        self,
        voxel_size: float = VOXEL_SIZE,
        shift: tuple[float, float, float] = (0.0, 0.0, 0.0),
        X_NW: np.ndarray | None = None,
    ) -> VoxelMap:
        """Returns the map on a grid of larger voxels.

        All points of a voxel count in the larger voxel that contains the
        centroid of these points.

        Args:
            voxel_size: length of a larger voxel's side [m].
            shift: distances along x, y and z from the origin of this map's grid
                to the origin of the grid of larger voxels [m].
            X_NW: (4, 4) pose of the world in another frame, the world of the
                result; by default both are one.
        """
        x, y, z = np.add(self.origin_W, shift).tolist()
        origin = x, y, z
        centroids = self.centroids_W
        if X_NW is not None:
            centroids = poses.transform(X_NW, centroids)
        found = np.floor((centroids - origin) / voxel_size)
        order = np.lexsort(found.T[::-1])
        indices = found[order].astype(np.int32)
        # NaN counts as a difference: the first row belongs to a new voxel.
        is_first = np.diff(found[order], axis=0, prepend=np.nan).any(axis=1)
        rows = np.cumsum(is_first) - 1
        counts = np.zeros(int(is_first.sum()), np.int64)
        np.add.at(counts, rows, self.counts[order])
        corners = _corners(indices, voxel_size, origin)
        sums = np.zeros((len(counts), 3))
        offsets = centroids[order] - corners
        np.add.at(sums, rows, offsets * self.counts[order, None])
        return VoxelMap(
            indices[is_first],
            corners[is_first] + sums / counts[:, None],
            counts,
            voxel_size,
            self.num_ignored,
            origin,
        )


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
        # Hash table of the occupied voxels; see `_SLOT`.
        self._table = np.zeros(2 * _BATCH, dtype=_SLOT)
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
            self._size, self._num_samples, skipped = _add_points(
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
            table = np.zeros(slots, dtype=_SLOT)
            sampled = np.zeros((slots, self._sampled.shape[1]), dtype=np.uint8)
            _copy_voxels(self._table, self._sampled, table, sampled)
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
    """Returns the voxel map of a cloud in the world frame.

    Args:
        points: structured array (N,) with the fields x, y and z [m], as a drive
            has them; `evaluation.from_xyz` makes one of an array (N, 3).
        voxel_size: length of a voxel's side [m].

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


# One slot of the hash table of voxels: the number of a voxel, how many points
# it has (0: the slot is free), and their sum relative to its corner [m]. A slot
# is one record, because fetching slots from memory takes most of the time.
_SLOT = np.dtype(
    [
        ("ix", "i4"),
        ("iy", "i4"),
        ("iz", "i4"),
        ("count", "u4"),
        ("sx", "f8"),
        ("sy", "f8"),
        ("sz", "f8"),
    ],
    align=True,
)
# Voxels have numbers below this along each axis, positive or negative.
_NUMBER_LIMIT = 2.0**31


@compiled
def _find_slot(
    table: np.ndarray, ix: np.int32, iy: np.int32, iz: np.int32
) -> np.uint64:
    """Returns the slot of a voxel, or the free slot for it.

    The number of slots must be a power of two. If the table does not contain
    the voxel, a slot must be free; otherwise the search does not end.

    The index of the slot is unsigned: at each use of a signed index, numba
    tests whether the index counts from the end.
    """
    mask = len(table) - 1
    # Large odd factors spread neighbouring voxels, as in the hash function of
    # Teschner et al. (VMV 2003); products wrap around.
    mixed = (
        np.int64(ix) * np.int64(73856093)
        ^ np.int64(iy) * np.int64(19349669)
        ^ np.int64(iz) * np.int64(83492791)
    )
    mixed ^= mixed >> 15
    slot = np.uint64(mixed & mask)
    while table[slot].count != 0 and not (
        table[slot].ix == ix and table[slot].iy == iy and table[slot].iz == iz
    ):
        slot = np.uint64((np.int64(slot) + 1) & mask)
    return slot


@compiled
def _copy_voxels(
    table: np.ndarray,
    sampled: np.ndarray,
    larger: np.ndarray,
    larger_sampled: np.ndarray,
) -> None:
    """Copies all voxels of a hash table to a larger, empty table.

    Args:
        table: (S,) slots of type `_SLOT`.
        sampled: (S, B) uint8, for each slot one bit per cell: whether the cell
            has a sample, see `_add_points`.
        larger: (L,) empty slots, to which the voxels are copied. L is a power
            of two.
        larger_sampled: (L, B) uint8, to which `sampled` is copied.
    """
    for i in range(len(table)):
        if table[i].count != 0:
            slot = _find_slot(larger, table[i].ix, table[i].iy, table[i].iz)
            larger[slot] = table[i]
            larger_sampled[slot] = sampled[i]


@compiled
def _locate(
    p: tuple[float, float, float], X: np.ndarray, voxel_size: float
) -> tuple[float, float, float]:
    """Returns a coordinate, its voxel, and its offset in the voxel [m]."""
    coordinate = X[0] * p[0] + X[1] * p[1] + X[2] * p[2] + X[3]
    cell = np.floor(coordinate / voxel_size)
    return coordinate, cell, coordinate - cell * voxel_size


@compiled
def _add_points(
    points: np.ndarray,
    number: int,
    X: np.ndarray,
    voxel_size: float,
    divisions: int,
    table: np.ndarray,
    size: int,
    sampled: np.ndarray,
    samples: np.ndarray,
    num_samples: int,
) -> tuple[int, int, int]:
    """Adds points to a hash table of voxels.

    A finer grid divides each voxel into cells. The first point in each cell is
    kept as a sample. Voxels and samples are in the moved world: the world
    frame, but with heights greater by `-Z_ORIGIN`, so that voxels begin at
    height 0.

    Args:
        points: (3, N) points in the frame of a sensor [m].
        number: number of points to add, beginning with the first.
        X: (4, 4) pose of the sensor in the moved world.
        voxel_size: length of a voxel's side [m].
        divisions: number of cells along a voxel's side; 0 to keep no samples.
        table: (S,) slots of type `_SLOT`; changed here. S is a power of two.
            The table needs room for all voxels.
        sampled: (S, B) uint8, for each slot one bit per cell: whether the cell
            has a sample; changed here.
        samples: (K, 3) the samples [m]; changed here. The array needs room for
            all samples.
        num_samples: number of samples that `samples` already contains.

    Returns:
        Number of voxels and number of samples afterwards, and number of points
        left out because they are not finite or too far away.
    """
    scale = divisions / voxel_size
    last = np.int64(divisions - 1)
    skipped = 0
    for i in range(number):
        p = points[0, i], points[1, i], points[2, i]
        x, fx, sx = _locate(p, X[0], voxel_size)
        y, fy, sy = _locate(p, X[1], voxel_size)
        z, fz, sz = _locate(p, X[2], voxel_size)
        # A comparison with NaN is false.
        if not (
            abs(fx) < _NUMBER_LIMIT
            and abs(fy) < _NUMBER_LIMIT
            and abs(fz) < _NUMBER_LIMIT
        ):
            skipped += 1
            continue
        ix, iy, iz = np.int32(fx), np.int32(fy), np.int32(fz)
        slot = _find_slot(table, ix, iy, iz)
        voxel = table[slot]
        if voxel.count == 0:
            voxel.ix = ix
            voxel.iy = iy
            voxel.iz = iz
            size += 1
        voxel.count += 1
        voxel.sx += sx
        voxel.sy += sy
        voxel.sz += sz
        if divisions > 0:
            # Rounding may put a point just outside the voxel: clip the index to
            # the last part; -0.1 is truncated to 0.
            a, b, c = (
                np.int64(sx * scale),
                np.int64(sy * scale),
                np.int64(sz * scale),
            )
            a = a if a < last else last
            b = b if b < last else last
            c = c if c < last else last
            part = np.uint64((a * divisions + b) * divisions + c)
            byte = part >> np.uint64(3)
            bit = np.uint8(np.uint64(1) << (part & np.uint64(7)))
            if not sampled[slot, byte] & bit:
                sampled[slot, byte] |= bit
                samples[num_samples, 0] = x
                samples[num_samples, 1] = y
                samples[num_samples, 2] = z
                num_samples += 1
    return size, num_samples, skipped
