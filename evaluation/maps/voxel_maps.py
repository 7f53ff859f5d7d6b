"""Maps of whole sequences: the points of all scans, thinned to voxels.

Voxels are on a grid that is fixed in the world, since its place influences a
coarse voxel map. The grid has multiples of the voxel size in x and y, and
starts at z = -2.5 m, so that ground at z = 0 is in the middle of a 5 m voxel. A
voxel is represented by the centroid of its points.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cns_drake.base import points as point_arrays
from cns_drake.base.compiled import compiled
from cns_drake.base.progress import Track, silent
from cns_drake.base.recordings.sequence import Sequence
from evaluation.geometry.sorting import cell_order

VOXEL_SIZE = 5.0
Z_ORIGIN = -2.5

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
        from evaluation import map_sequence, open_sequence

        voxels = map_sequence(open_sequence(path))
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
        self._table = np.zeros(2 * _BATCH, dtype=_SLOT)
        self._size = 0
        # One bit for each part of a slot's voxel: whether it has a sample.
        num_bytes = (divisions**3 + 7) // 8
        self._sampled = np.zeros((len(self._table), num_bytes), dtype=np.uint8)
        self._samples = np.empty((0, 3))
        self._num_samples = 0
        self._num_ignored = 0

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
            batch = point_arrays.xyz(points[start : start + _BATCH])
            self._reserve(len(batch))
            self._size, self._num_samples, skipped = _add_points(
                batch,
                X,
                self._voxel_size,
                self._table,
                self._size,
                self._divisions,
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
            table = np.zeros(slots, dtype=_SLOT)
            sampled = np.zeros((slots, self._sampled.shape[1]), dtype=np.uint8)
            _move(self._table, self._sampled, table, sampled)
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


def map_sequence(
    sequence: Sequence,
    voxel_size: float = VOXEL_SIZE,
    track: Track = silent,
) -> VoxelMap:
    """Returns the world-frame map of all scans of a sequence.

    One pass over the scans, one in memory at a time. The default grid is
    the one on which structural change is defined.

    Raises:
        InputError: if a scan or a pose cannot be read.

    Example:
        from evaluation import map_sequence, open_sequence

        voxels = map_sequence(open_sequence("recordings/downtown_01"))
    """
    accumulator = VoxelAccumulator(voxel_size)
    X_WS = sequence.X_WS
    indices = track(
        range(len(sequence)), f"mapping {sequence.name}", len(sequence)
    )
    for index in indices:
        accumulator.add(sequence.scan(index), X_WS[index])
    return accumulator.to_map()


def _corners(indices: np.ndarray, voxel_size: float) -> np.ndarray:
    return np.array([0.0, 0.0, Z_ORIGIN]) + indices * voxel_size


@compiled
def _find(
    table: np.ndarray, ix: np.int32, iy: np.int32, iz: np.int32
) -> np.int64:
    """Returns the slot of a voxel, or its free slot."""
    mask = len(table) - 1
    # Large odd factors spread neighbouring voxels; products wrap around.
    mixed = (
        np.int64(ix) * np.int64(73856093)
        ^ np.int64(iy) * np.int64(19349669)
        ^ np.int64(iz) * np.int64(83492791)
    )
    mixed ^= mixed >> 15
    slot = mixed & mask
    while table[slot].count != 0 and not (
        table[slot].ix == ix and table[slot].iy == iy and table[slot].iz == iz
    ):
        slot = (slot + 1) & mask
    return slot


@compiled
def _move(
    table: np.ndarray,
    sampled: np.ndarray,
    larger: np.ndarray,
    larger_sampled: np.ndarray,
) -> None:
    """Enters all voxels of one table into another, empty one."""
    for i in range(len(table)):
        if table[i].count != 0:
            slot = _find(larger, table[i].ix, table[i].iy, table[i].iz)
            larger[slot] = table[i]
            larger_sampled[slot] = sampled[i]


@compiled
def _add_points(
    points: np.ndarray,
    X: np.ndarray,
    voxel_size: float,
    table: np.ndarray,
    size: int,
    divisions: int,
    sampled: np.ndarray,
    samples: np.ndarray,
    num_samples: int,
) -> tuple[int, int, int]:
    """Adds points (N, 3).

    Returns the new size and number of samples, and how many were skipped.
    """
    limit = 2.0**31
    scale = divisions / voxel_size
    skipped = 0
    for i in range(len(points)):
        px, py, pz = points[i, 0], points[i, 1], points[i, 2]
        x = X[0, 0] * px + X[0, 1] * py + X[0, 2] * pz + X[0, 3]
        y = X[1, 0] * px + X[1, 1] * py + X[1, 2] * pz + X[1, 3]
        z = X[2, 0] * px + X[2, 1] * py + X[2, 2] * pz + X[2, 3]
        fx = np.floor(x / voxel_size)
        fy = np.floor(y / voxel_size)
        fz = np.floor(z / voxel_size)
        # A comparison with NaN is false.
        if not (abs(fx) < limit and abs(fy) < limit and abs(fz) < limit):
            skipped += 1
            continue
        ix, iy, iz = np.int32(fx), np.int32(fy), np.int32(fz)
        slot = _find(table, ix, iy, iz)
        if table[slot].count == 0:
            table[slot].ix = ix
            table[slot].iy = iy
            table[slot].iz = iz
            size += 1
        dx = x - fx * voxel_size
        dy = y - fy * voxel_size
        dz = z - fz * voxel_size
        table[slot].count += 1
        table[slot].sx += dx
        table[slot].sy += dy
        table[slot].sz += dz
        if divisions > 0:
            part = _part(dx * scale, divisions)
            part = part * divisions + _part(dy * scale, divisions)
            part = part * divisions + _part(dz * scale, divisions)
            bit = np.uint8(1 << (part & 7))
            if not sampled[slot, part >> 3] & bit:
                sampled[slot, part >> 3] |= bit
                samples[num_samples, 0] = x
                samples[num_samples, 1] = y
                samples[num_samples, 2] = z
                num_samples += 1
    return size, num_samples, skipped


@compiled
def _part(place: float, divisions: int) -> int:
    """Returns the part of a voxel's side at a place.

    Rounding may put a point on an end just outside: -0.1 becomes 0 as well.
    """
    return min(int(place), divisions - 1)
