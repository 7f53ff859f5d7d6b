"""What is recorded of a drive for its web page."""

from dataclasses import dataclass, field

import numpy as np
from pydrake.geometry import FrameId
from pydrake.math import RigidTransform


@dataclass(frozen=True)
class DriveRecord:
    """The record of a drive of F frames; most lists have one entry per frame.

    Attributes:
        period: time between frames [s].
        X_WBs: poses of the vehicle.
        X_WFs: id of a geometry frame that moves -> its poses.
        scans: the scans to show: index of the frame, and positions (N, 3) of
            the points in W [m].
        speeds: forward speed of the vehicle [m/s].
        specific_forces_I: specific force in the IMU's frame I [m/s^2].
        angular_velocities_I: angular velocity w_WI_I [rad/s].
        num_points: number of points in each scan as measured.
        limbs: the parts of each moving object other than the vehicle: id of the
            object's root frame -> {id of each of its geometry frames: constant
            pose in the root frame}. The root frame is the frame whose poses are
            recorded.
        names: id of an object's root frame -> name of the object in the page.
        images: name of a camera -> the images to show: index of the frame, and
            JPEG.
    """

    period: float
    X_WBs: list[RigidTransform] = field(default_factory=list)
    X_WFs: dict[FrameId, list[RigidTransform]] = field(default_factory=dict)
    scans: list[tuple[int, np.ndarray]] = field(default_factory=list)
    speeds: list[float] = field(default_factory=list)
    specific_forces_I: list[np.ndarray] = field(default_factory=list)
    angular_velocities_I: list[np.ndarray] = field(default_factory=list)
    num_points: list[int] = field(default_factory=list)
    limbs: dict[FrameId, dict[FrameId, RigidTransform]] = field(
        default_factory=dict
    )
    names: dict[FrameId, str] = field(default_factory=dict)
    images: dict[str, list[tuple[int, bytes]]] = field(default_factory=dict)
