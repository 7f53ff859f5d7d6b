"""The hash table of voxels that a map is summed up in.

Points are first located, in a loop without branches, for which compilers use
the vectors of a processor. A second loop enters them into the table.
"""

from __future__ import annotations

import numpy as np

from cns_drake.base.compiled import compiled

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
# Voxels are numbered up to here, either way.
FARTHEST = 2.0**31


@compiled
def _find(
    table: np.ndarray, ix: np.int32, iy: np.int32, iz: np.int32
) -> np.uint64:
    """Returns the slot of a voxel, or its free slot.

    It has no sign: for a signed index, numba looks at each use whether it
    counts from the end.
    """
    mask = len(table) - 1
    # Large odd factors spread neighbouring voxels; products wrap around.
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
def move(
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
def locate(
    points: np.ndarray,
    number: int,
    X: np.ndarray,
    voxel_size: float,
    divisions: int,
    located: np.ndarray,
    parts: np.ndarray,
) -> None:
    """Locates points in voxels, and in parts of voxels.

    Args:
        points: (3, N) in the frame of a sensor [m].
        number: of the points to locate, the first ones.
        X: (4, 4) its pose in the world, which is lifted so that voxels begin at
            height 0.
        voxel_size: length of a voxel's side [m].
        divisions: of a side into parts; 0 for no parts.
        located: (3, 3, N) to fill, for each axis with the place in that world
            [m], the number of the voxel, and the distance from its corner [m].
        parts: (N,) float64 to fill with the number of the part.
    """
    scale = divisions / voxel_size
    last = np.float64(divisions - 1)
    for axis in range(3):
        a, b, c, d = X[axis, 0], X[axis, 1], X[axis, 2], X[axis, 3]
        for i in range(number):
            place = a * points[0, i] + b * points[1, i] + c * points[2, i] + d
            cell = np.floor(place / voxel_size)
            located[axis, 0, i] = place
            located[axis, 1, i] = cell
            located[axis, 2, i] = place - cell * voxel_size
    if divisions > 0:
        for i in range(number):
            # Rounding may put a point on an end just outside; -0.1 becomes 0.
            part = min(np.trunc(located[0, 2, i] * scale), last)
            for axis in range(1, 3):
                place = min(np.trunc(located[axis, 2, i] * scale), last)
                part = part * divisions + place
            parts[i] = part


@compiled
def enter(
    located: np.ndarray,
    parts: np.ndarray,
    number: int,
    divisions: int,
    table: np.ndarray,
    size: int,
    sampled: np.ndarray,
    samples: np.ndarray,
    num_samples: int,
) -> tuple[int, int, int]:
    """Enters points into a table.

    Args:
        located: (3, 3, N), see `locate`.
        parts: (N,), likewise.
        number: of the points to enter, the first ones.
        divisions: parts of a voxel's side; 0 for no samples.
        table: (S,) of `SLOT`, with room for all.
        size: number of its voxels up to now.
        sampled: (S, B) uint8, a bit for each part of a slot's voxel: whether it
            has a sample.
        samples: (K, 3) to add to, with room for all.
        num_samples: of them up to now.

    Returns:
        New size and number of samples, and how many points were skipped.
    """
    skipped = 0
    for i in range(number):
        fx, fy, fz = located[0, 1, i], located[1, 1, i], located[2, 1, i]
        # A comparison with NaN is false.
        if not (
            abs(fx) < FARTHEST and abs(fy) < FARTHEST and abs(fz) < FARTHEST
        ):
            skipped += 1
            continue
        ix, iy, iz = np.int32(fx), np.int32(fy), np.int32(fz)
        slot = _find(table, ix, iy, iz)
        voxel = table[slot]
        if voxel.count == 0:
            voxel.ix = ix
            voxel.iy = iy
            voxel.iz = iz
            size += 1
        voxel.count += 1
        voxel.sx += located[0, 2, i]
        voxel.sy += located[1, 2, i]
        voxel.sz += located[2, 2, i]
        if divisions > 0:
            part = np.uint64(parts[i])
            byte = part >> np.uint64(3)
            bit = np.uint8(np.uint64(1) << (part & np.uint64(7)))
            if not sampled[slot, byte] & bit:
                sampled[slot, byte] |= bit
                samples[num_samples, 0] = located[0, 0, i]
                samples[num_samples, 1] = located[1, 0, i]
                samples[num_samples, 2] = located[2, 0, i]
                num_samples += 1
    return size, num_samples, skipped
