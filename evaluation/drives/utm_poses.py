"""Poses in the UTM grid, as MulRan and HeLiPR publish them."""

from pathlib import Path

import numpy as np

from evaluation.base import InputError

# The zone of MulRan and HeLiPR.
DATUM = "utm-52n"
# Easting, northing and height of the origin of W [m]. It is in Daejeon. Its
# coordinates are multiples of the voxel size, so that voxels have the same
# borders as on the UTM grid.
ORIGIN = (350_000.0, 4_020_000.0, 0.0)
# Ranges of easting and northing on the northern half of the Earth.
_LIMITS = ((100_000.0, 900_000.0), (0.0, 10_000_000.0))


def is_local(X_WB: np.ndarray) -> bool:
    """Returns whether poses (N, 4, 4) are in local coordinates, not in UTM.

    Poses are taken as local if all x and y are within 100 km of zero.
    """
    return bool((np.abs(X_WB[:, :2, 3]) < _LIMITS[0][0]).all())


def to_world(X_UB: np.ndarray, path: Path) -> np.ndarray:
    """Returns poses X_WB (N, 4, 4) from poses in the UTM grid U, zone 52N.

    W has its axes east, north and up, and its origin at a fixed point of that
    grid near the drives of MulRan and HeLiPR. Coordinates in W are at most a
    few kilometres, which float32 resolves to under a millimetre. UTM
    coordinates can be thousands of kilometres, which float32 resolves only to
    0.25 m.

    Raises:
        InputError: if a position cannot be in UTM metres.
    """
    p_UB = X_UB[:, :3, 3]
    for axis, (name, limits) in enumerate(
        zip(("easting", "northing"), _LIMITS, strict=True)
    ):
        bad = (p_UB[:, axis] < limits[0]) | (p_UB[:, axis] > limits[1])
        if bad.any():
            first = int(np.flatnonzero(bad)[0])
            raise InputError(
                f"{path}: {name}: {p_UB[first, axis]:g} m of pose {first + 1}"
                " is no UTM coordinate"
            )
    X_WB = X_UB.copy()
    X_WB[:, :3, 3] -= ORIGIN
    return X_WB
