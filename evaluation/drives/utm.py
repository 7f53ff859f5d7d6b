"""The world frame of data sets whose poses are in UTM metres.

MulRan and HeLiPR give positions as easting, northing and height in zone 52N.
Here W has its axes east, north and up, and its origin at a fixed point of
that grid near the drives. All drives have the same W, and coordinates are a
few kilometres instead of thousands. A float32 resolves them to under a
millimetre; easting and northing would have steps of 0.25 m.
"""

from pathlib import Path

import numpy as np

from cns_drake.base.errors import InputError

DATUM = "utm-52n"

# Easting, northing and height of the origin of W [m]. It is in Daejeon. Its
# coordinates are multiples of the voxel size, so that voxels have the same
# borders as on the UTM grid.
ORIGIN = (350_000.0, 4_020_000.0, 0.0)

# Ranges of easting and northing on the northern half of the Earth.
_LIMITS = ((100_000.0, 900_000.0), (0.0, 10_000_000.0))


def to_world(X_UB: np.ndarray, path: Path) -> np.ndarray:
    """Returns poses X_WB (N, 4, 4) from poses in the UTM grid U.

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
