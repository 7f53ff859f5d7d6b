"""Frames of MulRan: pose of its LiDAR on the vehicle, and its survey grid."""

import numpy as np
from scipy.spatial.transform import Rotation

from evaluation.base import poses

# Pose of the LiDAR on the vehicle, from the data set's calib_base2ouster. Read
# as its name says, it puts the LiDAR above the base. Other programs apply its
# inverse. Since it turns by almost 180 degrees, the inverse puts the LiDAR
# within a centimetre of the same horizontal position, but 1.8 m below the
# ground.
X_BS = poses.make_pose(
    Rotation.from_euler(
        "xyz", [0.0001, 0.0003, 179.6654], degrees=True
    ).as_matrix(),
    np.array([1.7042, -0.021, 1.8047]),
)

# Easting, northing and height of the origin of W [m]. It is in Daejeon. Its
# coordinates are multiples of the voxel size, so that voxels have the same
# borders as on the UTM grid.
ORIGIN = (350_000.0, 4_020_000.0, 0.0)
