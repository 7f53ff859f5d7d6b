"""A hash table of voxels, to which points are added by compiled loops."""

import numpy as np

from cns_drake.base import compiled

# One slot of the hash table of voxels: the number of a voxel, how many points
# it has (0: the slot is free), and their sum relative to its corner [m]. A slot
# is one record, because fetching slots from memory takes most of the time.
SLOT = np.dtype(
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
def copy_voxels(
    table: np.ndarray,
    sampled: np.ndarray,
    larger: np.ndarray,
    larger_sampled: np.ndarray,
) -> None:
    """Copies all voxels of a hash table to a larger, empty table.

    Args:
        table: (S,) slots of type `SLOT`.
        sampled: (S, B) uint8, for each slot one bit per cell: whether the cell
            has a sample, see `add_points`.
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
def add_points(
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
        table: (S,) slots of type `SLOT`; changed here. S is a power of two. The
            table needs room for all voxels.
        size: number of voxels that the table already contains.
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
    last = np.float64(divisions - 1)
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
            parts = min(np.trunc(sx * scale), last)
            parts = parts * divisions + min(np.trunc(sy * scale), last)
            parts = parts * divisions + min(np.trunc(sz * scale), last)
            part = np.uint64(parts)
            byte = part >> np.uint64(3)
            bit = np.uint8(np.uint64(1) << (part & np.uint64(7)))
            if not sampled[slot, byte] & bit:
                sampled[slot, byte] |= bit
                samples[num_samples, 0] = x
                samples[num_samples, 1] = y
                samples[num_samples, 2] = z
                num_samples += 1
    return size, num_samples, skipped
