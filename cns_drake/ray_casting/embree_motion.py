"""Groups that move during a cast, in Embree's terms."""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from cns_drake.ray_casting.ray_groups import RayGroup


def decompose_motion(group: RayGroup) -> np.ndarray:
    """Returns the poses of a moving group at even times of the turn.

    Embree turns from one orientation to the next at a constant rate about F's
    origin, which moves in a straight line. That is the motion of a frame with
    constant velocities.

    Returns:
        (T, 16) float32, an RTCQuaternionDecomposition each: 3 scales, 3
        skews, shift, quaternion (real part first), translation. A point is
        scaled, shifted, turned, and translated.
    """
    assert group.motion is not None
    num_steps = group.motion.num_steps
    R_OO, way_F = group.motion.at(np.linspace(0.0, 1.0, num_steps))
    # The columns of both maps are rotated and stretched axes of L.
    scale = np.linalg.norm(group.X_FL[:3, :3], axis=0)
    R_OL = group.X_OL[:, :3] / scale
    p_FL_L = (group.X_FL[:3, :3] / scale).T @ group.X_FL[:3, 3]
    quaternion = Rotation.from_matrix(R_OO @ R_OL).as_quat()
    steps = np.zeros((num_steps, 16))
    steps[:, 0:3] = scale
    steps[:, 6:9] = p_FL_L
    steps[:, 9:13] = quaternion[:, [3, 0, 1, 2]]
    steps[:, 13:16] = group.X_OL[:, 3] - R_OL @ p_FL_L + way_F
    return np.ascontiguousarray(steps, np.float32)
